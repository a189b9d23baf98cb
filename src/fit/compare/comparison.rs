//! Comparison of identifications of one problem by different strategies, solvers and models.

use nalgebra::{DVector, Vector3};

use crate::fit::compare::baseline::{Baseline, baselines};
use crate::fit::compare::procedure::Procedure;
use crate::fit::identification::identify_model;
use crate::fit::{
    Identification, IdentifyError, Options, Placement, ProgressSink, SolverChoice, Strategy,
};
use crate::least_squares::solver::BoundMethod;
use crate::measurement::Dataset;
use crate::model::{Ablation, Model};
use crate::paper::StiffnessStage;
use crate::paper::published::is_published_arm;
use crate::problem::Problem;

/// Results of all strategies, solvers and ablations for one problem.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Joint fit of the declared model by the solver that `auto` chooses.
    pub joint: Identification,
    /// Joint fit of the rigid arm, with elasticity ignored.
    pub rigid: Identification,
    /// One identification for each strategy and solver, except strategies without a parameter to
    /// vary.
    pub strategies: Vec<Identification>,
    /// Results of the paper's procedure in every form that the data allow, the rigid one first;
    /// empty if it was not requested, or if no row is held out.
    pub paper: Vec<Baseline>,
    /// Each ablation with the joint fit of the model without the elasticity that it removes.
    pub ablations: Vec<(Ablation, Identification)>,
    /// Results of the joint fit and of every elastic form of the paper's procedure, as in the
    /// paper's tables. Empty if some rows measure no position, or none is held out.
    pub procedures: Vec<Procedure>,
    /// Errors before identification as the paper defines them: those of the rigid nominal arm.
    pub before: ErrorsBefore,
    /// True if the problem declares the arm of the paper, so that the published figures apply.
    pub is_papers_arm: bool,
}

/// Errors of the rigid nominal arm, before identification.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorsBefore {
    /// Errors measured − predicted of the held-out poses, measuring frame \[m\].
    pub errors: Vec<Vector3<f64>>,
    /// True if base and tool were fitted first, because some of their parameters are free without
    /// prior and bounds.
    pub registered: bool,
}

/// Settings of a comparison of strategies and solvers on one problem.
#[derive(Clone, Default)]
pub struct CompareOptions {
    /// True to run the paper's procedure for any arm. It always runs for the paper's arm.
    pub paper: bool,
    /// Receiver of progress reports; `None` to report nothing.
    pub progress: Option<ProgressSink>,
}

/// Runs every strategy with every solver, and every ablation, on the identification rows.
///
/// Leaves out strategies without a parameter to vary and solvers that cannot keep the declared
/// bounds or constraints. Without free elastic parameters, [`Ablation::All`] alone runs.
///
/// # Errors
/// Returns an error if problem and data are not compatible.
pub fn compare(
    problem: &Problem,
    data: &Dataset,
    options: &CompareOptions,
) -> Result<Comparison, IdentifyError> {
    let placement = Placement::of(&data.measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let run = |model: &Model, strategy, solver| {
        let options =
            Options { strategy, solver, progress: options.progress.clone(), ..Options::default() };
        identify_model(model, problem, data, &options)
    };
    let elastic = problem.is_elastic();
    // Without bounds, all solvers that keep bounds take the same steps: one of them is enough.
    let is_distinct = |solver: &SolverChoice| {
        model.is_bounded() || matches!(solver.within(), None | Some(BoundMethod::ActiveSet))
    };
    let solvers = SolverChoice::SOLVERS
        .iter()
        .copied()
        .filter(|solver| solver.keeps(&model) && is_distinct(solver));
    let mut strategies = Vec::new();
    for strategy in
        Strategy::EACH.into_iter().filter(|&strategy| elastic || strategy != Strategy::Rigid)
    {
        let model = strategy.model(model.clone());
        for solver in solvers.clone() {
            match run(&model, strategy, solver) {
                Ok(identification) => strategies.push(identification),
                Err(IdentifyError::NothingToFit { .. }) => {}
                Err(error) => return Err(error),
            }
        }
    }
    let free = model.parameters.iter().any(|parameter| parameter.site.is_elastic());
    let mut ablations = Vec::new();
    for ablation in Ablation::EACH.into_iter().filter(|&ablation| free || ablation == Ablation::All)
    {
        let identification = run(&model.ablated(ablation), Strategy::Joint, SolverChoice::Auto)?;
        ablations.push((ablation, identification));
    }
    let joint = run(&model, Strategy::Joint, SolverChoice::Auto)?;
    let rigid_model = model.ablated(Ablation::Rigid);
    let rigid = run(&rigid_model, Strategy::Joint, SolverChoice::Auto)?;
    let is_papers_arm = is_published_arm(problem);
    // The paper's procedure and its tables concern positions.
    let of_positions = data.measurements.kinds().iter().all(|kind| kind.is_position());
    let is_held_out = !data.split.held_out.is_empty();
    let paper = if of_positions && is_held_out && (options.paper || is_papers_arm) {
        baselines(problem, data)
    } else {
        Vec::new()
    };
    let held_out = |model: &Model, x: &DVector<f64>| {
        placement.position_errors(model, x, &data.measurements, &data.split.held_out)
    };
    let ignoring = elastic.then(|| held_out(&rigid_model, &rigid.x));
    let of_joint_fit = Procedure::of_fit(problem, &joint, held_out(&model, &joint.x), ignoring);
    let papers = paper.iter().filter(|form| !elastic || form.stage != StiffnessStage::Rigid);
    let papers = papers.map(|form| form.procedure(paper.first().filter(|_| elastic)));
    let procedures = std::iter::once(of_joint_fit)
        .chain(papers)
        .filter(|_| of_positions && is_held_out)
        .collect();
    let unknown = |parameter: &crate::model::parameter::Parameter| {
        parameter.site.is_placement() && parameter.sigma.is_none() && !parameter.is_bounded()
    };
    let registered = model.parameters.iter().any(unknown);
    let x = if registered { rigid.registered_x.clone() } else { DVector::zeros(rigid.x.len()) };
    let before = ErrorsBefore { errors: held_out(&rigid_model, &x), registered };
    Ok(Comparison { joint, rigid, strategies, paper, ablations, procedures, before, is_papers_arm })
}

//! Every strategy with every solver, and every part of the elasticity left out in turn, on one
//! problem.

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

/// Strategies and solvers side by side.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The declared model, everything fitted at once by the solver that `auto` takes.
    pub joint: Identification,
    /// The same with elasticity ignored: geometry of a rigid arm.
    pub rigid: Identification,
    /// One identification per strategy and solver; `None` where the strategy has nothing to vary.
    pub strategies: Vec<Identification>,
    /// The paper's own procedure in every form that the data allow, the rigid one first; none where
    /// it was not asked for.
    pub paper: Vec<Baseline>,
    /// One identification per ablation, everything fitted at once.
    pub ablations: Vec<(Ablation, Identification)>,
    /// The joint fit and every form of the paper's procedure but the rigid one, in the terms of the
    /// paper; none where rows measure anything else than positions.
    pub procedures: Vec<Procedure>,
    /// What the paper calls before: the nominal arm with nothing that gives way, base and tool as
    /// declared.
    pub before: Before,
    /// Whether the problem declares the paper's arm, so that its figures may stand beside.
    pub is_papers_arm: bool,
}

/// Errors of the nominal arm with nothing that gives way.
#[derive(Debug, Clone, PartialEq)]
pub struct Before {
    /// Measured − predicted of the held-out poses, measuring frame \[m\].
    pub errors: Vec<Vector3<f64>>,
    /// Whether base or tool had to be fitted first, since nobody knows where they are: they are
    /// free and have no prior.
    pub registered: bool,
}

/// What takes part in a comparison.
#[derive(Clone, Default)]
pub struct CompareOptions {
    /// Whether the paper's own procedure does; it does anyway where the problem declares the
    /// paper's arm.
    pub paper: bool,
    /// Told of every step.
    pub progress: Option<ProgressSink>,
}

/// Runs every strategy with every solver, and every ablation, on the identification rows.
///
/// Left out are strategies that have nothing to vary, solvers that cannot keep bounds or
/// constraints where there are any, and ablations of an arm without elasticity.
///
/// # Errors
/// Problem and data do not fit each other.
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
    // Without bounds those that keep them all take the same steps; one of them is enough.
    let tells = |solver: &SolverChoice| {
        model.is_bounded() || matches!(solver.within(), None | Some(BoundMethod::ActiveSet))
    };
    let solvers =
        SolverChoice::EACH.into_iter().filter(|solver| solver.keeps(&model) && tells(solver));
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
    // The paper's procedure and its tables are of positions.
    let of_positions = data.measurements.kinds().iter().all(|kind| kind.is_position());
    let paper = if of_positions && (options.paper || is_papers_arm) {
        baselines(problem, data)
    } else {
        Vec::new()
    };
    let held_out = |model: &Model, x: &DVector<f64>| {
        placement.position_errors(model, x, &data.measurements, &data.split.held_out)
    };
    let ignoring = elastic.then(|| held_out(&rigid_model, &rigid.x));
    let own = Procedure::of_fit(problem, &joint, held_out(&model, &joint.x), ignoring);
    let papers = paper.iter().filter(|own| !elastic || own.stage != StiffnessStage::Rigid);
    let papers = papers.map(|own| own.procedure(paper.first().filter(|_| elastic)));
    let procedures = std::iter::once(own).chain(papers).filter(|_| of_positions).collect();
    let unknown = |parameter: &crate::model::parameter::Parameter| {
        parameter.site.is_placement() && parameter.sigma.is_none() && !parameter.is_bounded()
    };
    let registered = model.parameters.iter().any(unknown);
    let x = if registered { rigid.registered_x.clone() } else { DVector::zeros(rigid.x.len()) };
    let before = Before { errors: held_out(&rigid_model, &x), registered };
    Ok(Comparison { joint, rigid, strategies, paper, ablations, procedures, before, is_papers_arm })
}

//! Every strategy with every solver, and every part of the elasticity left out in turn, on one problem.

use super::baseline::{Baseline, baseline};
use super::identification::identify_model;
use super::{Identification, IdentifyError, Options, Placement, ProgressSink, SolverChoice, Strategy};
use crate::measurement::Dataset;
use crate::model::{Ablation, Model};
use crate::paper::Form;
use crate::problem::Problem;

/// Strategies and solvers side by side.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The declared model, everything fitted at once by the solver that `auto` takes.
    pub joint: Identification,
    /// The same without elasticity: geometry alone.
    pub rigid: Identification,
    /// One identification per strategy and solver; `None` where the strategy has nothing to vary.
    pub strategies: Vec<Identification>,
    /// The paper's own procedure, without its misprints and as printed, where it applies.
    pub paper: Vec<Baseline>,
    /// One identification per ablation, everything fitted at once.
    pub ablations: Vec<(Ablation, Identification)>,
}

/// Runs every strategy with every solver, and every ablation, on the identification rows.
///
/// Left out are strategies that have nothing to vary, solvers that cannot keep bounds or constraints where there are any, and ablations of
/// an arm without elasticity.
///
/// # Errors
/// Problem and data do not fit each other.
pub fn compare(
    problem: &Problem,
    data: &Dataset,
    progress: Option<&ProgressSink>,
) -> Result<Comparison, IdentifyError> {
    let placement = Placement::of(&data.measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let run = |model: &Model, strategy, solver| {
        let options = Options { strategy, solver, progress: progress.cloned(), ..Options::default() };
        identify_model(model, problem, data, &options)
    };
    let bounded = model.is_bounded();
    let solvers = SolverChoice::EACH.iter().filter(|&&solver| !bounded || solver == SolverChoice::Bounded);
    let mut strategies = Vec::new();
    for strategy in Strategy::EACH {
        for &solver in solvers.clone() {
            match run(&model, strategy, solver) {
                Ok(identification) => strategies.push(identification),
                Err(IdentifyError::NothingToFit { .. }) => {}
                Err(error) => return Err(error),
            }
        }
    }
    let elastic = model.parameters.iter().any(|parameter| parameter.slot.is_elastic());
    let mut ablations = Vec::new();
    for ablation in Ablation::EACH.into_iter().filter(|&ablation| elastic || ablation == Ablation::All) {
        let identification = run(&model.ablated(ablation), Strategy::Joint, SolverChoice::Auto)?;
        ablations.push((ablation, identification));
    }
    Ok(Comparison {
        joint: run(&model, Strategy::Joint, SolverChoice::Auto)?,
        rigid: run(&model.ablated(Ablation::Rigid), Strategy::Joint, SolverChoice::Auto)?,
        strategies,
        paper: [Form::Corrected, Form::Printed].into_iter().filter_map(|form| baseline(problem, data, form)).collect(),
        ablations,
    })
}

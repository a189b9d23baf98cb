//! Ranges of the quantities of a law over the identification poses.

use crate::problem::{Effect, PoseView};
use crate::residual_tests::Covariate;
use crate::select::data::Data;
use crate::select::evidence::Hypothesis;
use crate::select::fitted::Fitted;

/// Returns the recorded quantities on which an effect depends, with their ranges over the
/// identification poses (SI, temperatures in °C).
pub(super) fn ranges(
    fitted: &Fitted,
    data: &Data,
    effect: &Effect,
) -> Vec<(Covariate, (f64, f64))> {
    let poses = fitted.poses(data, data.rows());
    let has_approach = poses.iter().any(|pose| pose.setup.approach.is_some());
    let coverage = (has_approach, data.measurements.time_measured);
    let names = fitted.problem.covariate_names();
    let range = |covariate: Covariate| {
        let values = poses.iter().map(|pose| value(&covariate, &pose.setup, &names));
        let values = values.collect::<Option<Vec<f64>>>()?;
        let extreme = |of: fn(f64, f64) -> f64| values.iter().copied().reduce(of);
        Some((covariate, (extreme(f64::min)?, extreme(f64::max)?)))
    };
    let depends_on = Hypothesis::of_effect(effect, &fitted.problem, coverage).depends_on;
    depends_on.into_iter().filter_map(range).collect()
}

/// Returns the value of a covariate in a pose; `None` if the table does not record it. `names` are
/// those of the declared covariates.
fn value(covariate: &Covariate, setup: &PoseView, names: &[String]) -> Option<f64> {
    match covariate {
        Covariate::Command(joint) => setup.configuration.get(*joint).copied(),
        Covariate::Temperature => setup.temperature.copied(),
        Covariate::Payload => setup.payload.copied(),
        Covariate::Hoist => setup.hoist.copied(),
        Covariate::Time | Covariate::Row => Some(setup.elapsed),
        Covariate::Approach(joint) => setup.approach.map(|sides| sides[*joint]),
        Covariate::Load | Covariate::Position => None,
        Covariate::Declared(name) => {
            let index = names.iter().position(|other| other.as_str() == &**name)?;
            setup.covariates.get(index).copied()
        }
    }
}

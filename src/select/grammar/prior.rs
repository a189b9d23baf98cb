//! Prior probability of the laws of the grammar among all hypotheses.

use crate::problem::{Effect, Joint, JointKind, Problem};

/// Prior weight of all laws of the grammar at all joints, relative to one family of effects: they
/// are some twenty families of formulas, each rarer than what the catalogue holds.
const PRIOR_OF_GRAMMAR: f64 = 8.0;

/// Returns ln of the prior probability of a formula from the search, relative to a family of
/// effects; `None` for other effects.
pub fn ln_prior(effect: &Effect, problem: &Problem) -> Option<f64> {
    let Effect::Law(law) = effect else { return None };
    let takes = |joint: &&Joint| joint.command_kind() != JointKind::Fixed;
    let joints = problem.joints.iter().filter(takes).count().max(1);
    Some((PRIOR_OF_GRAMMAR / joints as f64).ln() + law.description()?)
}

//! Prior probability of the laws of the grammar among all hypotheses.

use crate::laws::{At, Law};
use crate::problem::{Effect, Joint, JointKind, Problem};

/// Prior weight of all laws of the grammar at the coordinates of all joints, relative to one family
/// of effects. There are about twenty families of formulas, each less common than a family of the
/// catalogue.
const PRIOR_OF_GRAMMAR: f64 = 8.0;
/// Prior weight of all laws of the grammar at each of the other sites: tool, measurement, base,
/// small motions of all joints, and links. Fewer formulas are searched there.
const PRIOR_ELSEWHERE: f64 = 2.0;
/// Number of sites of laws (axes or components) at each of tool, measurement, base and link.
const AXES: f64 = 3.0;
/// Number of small motions of a joint at which laws are searched: along x and z, and about x and y.
const MOTIONS: f64 = 4.0;

/// Returns ln of the prior probability of a formula from the search, relative to a family of
/// effects; `None` for other effects.
pub fn ln_prior(effect: &Effect, problem: &Problem) -> Option<f64> {
    let Effect::Law(law) = effect else { return None };
    Some(ln_weight(law, problem) + law.composed_ln_prior()?)
}

/// Returns ln of the prior weight of all laws at the site of a law, relative to a family of
/// effects.
fn ln_weight(law: &Law, problem: &Problem) -> f64 {
    let takes_command = |joint: &&Joint| joint.command_kind() != JointKind::Fixed;
    let joints = problem.joints.iter().filter(takes_command).count().max(1) as f64;
    match law.at() {
        At::Coordinate => (PRIOR_OF_GRAMMAR / joints).ln(),
        At::Before(_) | At::After(_) => (PRIOR_ELSEWHERE / MOTIONS / joints).ln(),
        At::Beam(_) => {
            let links = problem.joints.iter().filter(|joint| joint.beam.is_some()).count().max(1);
            (PRIOR_ELSEWHERE / AXES / links as f64).ln()
        }
        _ => (PRIOR_ELSEWHERE / AXES).ln(),
    }
}

//! Effects of the catalogue that the search may add.

use super::data::Data;
use crate::model::effect::{self, Candidate};
use crate::model::parameter::{are_all_fixed, makes_rule_invalid};
use crate::problem::{Effect, Problem};

/// Reason why an effect is not tried: the rules of the problem fix its parameters at zero.
pub const HELD_FIXED: &str = "[parameters] holds it fixed";

/// Reason why an effect is not tried: a rule of `[parameters]` that matches its parameters has
/// another unit than they.
pub const REFUSED: &str = "a rule of [parameters] speaks of it in another unit";

/// Reason why an effect is not tried: the derivative of the residuals with respect to it is not
/// finite in these poses.
pub const NOT_FINITE: &str = "its derivative is not a finite number in these poses";

/// Effects of the catalogue that the problem does not declare: those that the data can show, and
/// the others, each with the reason.
pub(super) struct Candidates {
    pub testable: Vec<Effect>,
    pub untestable: Vec<(Effect, &'static str)>,
}

impl Candidates {
    pub fn new(problem: &Problem, data: &Data) -> Self {
        let conditions = data.conditions(problem);
        let more = data.candidates.iter().map(|effect| Candidate {
            effect: effect.clone(),
            untestable: effect.untestable(problem, &conditions),
        });
        let candidates = effect::candidates(problem, &conditions).into_iter().chain(more);
        let mut found = Self { testable: Vec::new(), untestable: Vec::new() };
        for Candidate { effect, untestable } in candidates {
            let parameters = || effect.parameters(problem);
            match untestable {
                _ if problem.effects.iter().any(|declared| declared.effect.covers(&effect)) => {}
                Some(reason) => found.untestable.push((effect, reason)),
                None if are_all_fixed(problem, &parameters()) => {
                    found.untestable.push((effect, HELD_FIXED));
                }
                None if makes_rule_invalid(problem, &parameters()) => {
                    found.untestable.push((effect, REFUSED));
                }
                None => found.testable.push(effect),
            }
        }
        found
    }
}

/// Returns `effects` with the effect `new` appended. A harmonic of a joint that has one already is
/// merged into that one.
pub(super) fn joined(effects: &[Effect], new: &Effect) -> Vec<Effect> {
    let mut joined_effects = effects.to_vec();
    match joined_effects.iter_mut().find_map(|effect| Some((effect.joined(new)?, effect))) {
        Some((both, effect)) => *effect = both,
        None => joined_effects.push(new.clone()),
    }
    joined_effects
}

//! Which effects of the catalogue may be looked for.

use super::data::Data;
use crate::model::effect::{self, Candidate};
use crate::model::parameter::{holds_all, refuses};
use crate::problem::{Effect, Problem};

/// Why an effect that the rules of the problem hold at zero is not looked for.
pub const HELD_FIXED: &str = "[parameters] holds it fixed";

/// Why an effect is not looked for that the problem could not declare as its rules are.
pub const REFUSED: &str = "a rule of [parameters] speaks of it in another unit";

/// Why an effect is not judged whose derivative is not a number in these poses.
pub const NOT_FINITE: &str = "its derivative is not a finite number in these poses";

/// Candidates that are not declared, divided into those that the data can show and the others.
pub(super) struct Candidates {
    pub testable: Vec<Effect>,
    pub untestable: Vec<(Effect, &'static str)>,
}

impl Candidates {
    pub fn of(problem: &Problem, data: &Data) -> Self {
        let conditions = data.conditions(problem);
        let more = data.candidates.iter().map(|effect| Candidate {
            effect: effect.clone(),
            untestable: effect.untestable(problem, &conditions),
        });
        let all = effect::candidates(problem, &conditions).into_iter().chain(more);
        let mut found = Self { testable: Vec::new(), untestable: Vec::new() };
        for Candidate { effect, untestable } in all {
            let parameters = || effect.parameters(problem);
            match untestable {
                _ if problem.effects.iter().any(|declared| declared.effect.covers(&effect)) => {}
                Some(reason) => found.untestable.push((effect, reason)),
                None if holds_all(problem, &parameters()) => {
                    found.untestable.push((effect, HELD_FIXED));
                }
                None if refuses(problem, &parameters()) => found.untestable.push((effect, REFUSED)),
                None => found.testable.push(effect),
            }
        }
        found
    }
}

/// Effects with one more; harmonics of one joint become one effect.
pub(super) fn joined(effects: &[Effect], new: &Effect) -> Vec<Effect> {
    let mut all = effects.to_vec();
    match all.iter_mut().find_map(|known| Some((known.joined(new)?, known))) {
        Some((both, known)) => *known = both,
        None => all.push(new.clone()),
    }
    all
}

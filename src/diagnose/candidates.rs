//! Which effects of the catalogue may be looked for.

use super::data::Data;
use crate::model::effect::{self, Candidate, FAMILIES};
use crate::model::parameter::{holds_all, refuses};
use crate::problem::{Effect, Problem};

/// Why an effect that the rules of the problem hold at zero is not looked for.
pub const HELD_FIXED: &str = "[parameters] holds it fixed";

/// Why an effect is not looked for that the problem could not declare as its rules are.
pub const REFUSED: &str = "a rule of [parameters] speaks of it in another unit";

/// Candidates of the catalogue that are not declared, divided into those that the data can show and the others.
pub(super) struct Candidates {
    pub testable: Vec<Effect>,
    pub untestable: Vec<(Effect, &'static str)>,
}

impl Candidates {
    pub fn of(problem: &Problem, data: &Data) -> Self {
        let conditions = data.conditions(problem);
        let all = FAMILIES.iter().flat_map(|family| (family.candidates)(problem, &conditions));
        let mut found = Self { testable: Vec::new(), untestable: Vec::new() };
        for Candidate { effect, untestable } in all {
            let parameters = || effect::parameters_of(&effect, problem);
            match untestable {
                _ if problem.effects.iter().any(|declared| covers(&declared.effect, &effect)) => {}
                Some(reason) => found.untestable.push((effect, reason)),
                None if holds_all(problem, &parameters()) => found.untestable.push((effect, HELD_FIXED)),
                None if refuses(problem, &parameters()) => found.untestable.push((effect, REFUSED)),
                None => found.testable.push(effect),
            }
        }
        found
    }
}

/// Whether a declared effect holds a candidate.
pub(super) fn covers(declared: &Effect, candidate: &Effect) -> bool {
    match (declared, candidate) {
        (Effect::JointHarmonic { joint, orders }, Effect::JointHarmonic { joint: other, orders: wanted }) => {
            joint == other && wanted.iter().all(|order| orders.contains(order))
        }
        _ => declared == candidate,
    }
}

/// Effects with one more; harmonics of one joint become one effect.
pub(super) fn joined(effects: &[Effect], new: &Effect) -> Vec<Effect> {
    let mut all = effects.to_vec();
    if let Effect::JointHarmonic { joint, orders } = new {
        for effect in &mut all {
            if let Effect::JointHarmonic { joint: known, orders: present } = effect
                && known == joint
            {
                present.extend(orders.iter().filter(|order| !present.contains(order)).copied().collect::<Vec<_>>());
                present.sort_unstable();
                return all;
            }
        }
    }
    all.push(new.clone());
    all
}

/// An effect in parts that are tested one by one: a harmonic order by order.
pub(super) fn parts(effect: &Effect) -> Vec<Effect> {
    match effect {
        Effect::JointHarmonic { joint, orders } => {
            orders.iter().map(|&order| Effect::JointHarmonic { joint: *joint, orders: vec![order] }).collect()
        }
        other => vec![other.clone()],
    }
}

/// Whether two effects are of the same family.
pub(super) fn same_family(one: &Effect, other: &Effect) -> bool {
    effect::name(one) == effect::name(other)
}

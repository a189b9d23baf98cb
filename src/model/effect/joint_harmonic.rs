//! `joint-harmonic`: an error that repeats with the joint, Δθ = Σ_k a_k sin kθ + b_k cos kθ with θ = q as commanded.

use super::coverage::STANDS_STILL;
use super::place::coordinate;
use super::{Candidate, Family, Term};
use crate::model::parameter::Driver;
use crate::problem::{Effect, JointKind};

/// Highest order that is looked for.
const HIGHEST_ORDER: u32 = 60;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-harmonic",
    terms: |effect, problem| match effect {
        Effect::JointHarmonic { joint, orders } => {
            let slot = coordinate(problem, *joint);
            let pair = |&order: &u32| {
                [("sin", Driver::Sine(joint - 1, order)), ("cos", Driver::Cosine(joint - 1, order))]
                    .map(|(wave, driver)| Term::driven(&format!("{wave}{order}"), slot, driver, 1e-3))
            };
            orders.iter().flat_map(pair).collect()
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let revolute = problem.joints.iter().enumerate().filter(|(_, joint)| joint.kind == JointKind::Revolute);
        let effects = |(index, _)| {
            (1..=HIGHEST_ORDER).map(move |order| Effect::JointHarmonic { joint: index + 1, orders: vec![order] })
        };
        let moves = |effect: &Effect| matches!(effect, Effect::JointHarmonic { joint, .. } if data.moves(joint - 1));
        let candidate = |effect: Effect| {
            let moves = moves(&effect);
            Candidate::needing(effect, moves, STANDS_STILL)
        };
        revolute.flat_map(effects).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::JointHarmonic { joint, orders } => {
            format!("angle of joint {joint} errs {} × a turn", listed(orders))
        }
        _ => String::new(),
    },
};

/// Ascending orders in words; three and more in a row as "1 to 5".
fn listed(orders: &[u32]) -> String {
    let runs = orders.chunk_by(|a, b| a + 1 == *b).flat_map(|run| match run {
        [first, _, .., last] => vec![format!("{first} to {last}")],
        few => few.iter().map(u32::to_string).collect(),
    });
    runs.collect::<Vec<String>>().join(", ")
}

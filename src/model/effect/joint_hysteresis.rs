//! `joint-hysteresis`: friction pulls a joint back the way on which it came, Δθ = h z.
//! [Dahl 1968]

use super::coverage::{NO_TIMES, STANDS_STILL};
use super::family::{Candidate, Family, Term, USUAL, to_three_digits};
use super::place::commanded;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, JointKind};

/// Distances that are looked for, as parts of the range of the joint: over shorter ones it is play,
/// over longer ones a ratio.
const SHORTEST: f64 = 0.1;
const LONGEST: f64 = 1.6;
/// Each over the one before.
const STEP: f64 = 1.4;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-hysteresis",
    terms: |effect, problem| match effect {
        Effect::JointHysteresis { joint, distance } => {
            let regressor = Regressor::Dragged { joint: joint - 1, distance: *distance };
            vec![Term::driven(
                "amplitude",
                ParameterSite::coordinate(problem, *joint),
                regressor,
                1e-3,
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let of_joint = |joint: usize| {
            let range = data.ranges.get(joint - 1).map_or(0.0, |(low, high)| high - low);
            let parts = std::iter::successors(Some(SHORTEST), |part| Some(part * STEP))
                .take_while(|part| *part <= LONGEST);
            let candidate = |distance: f64| {
                let untestable = match (data.moves(joint - 1), data.clock) {
                    (false, _) => Some(STANDS_STILL),
                    (true, None) => Some(NO_TIMES),
                    _ => None,
                };
                Candidate { effect: Effect::JointHysteresis { joint, distance }, untestable }
            };
            parts
                .filter_map(|part| to_three_digits(part * range))
                .map(candidate)
                .collect::<Vec<_>>()
        };
        let turns = |joint: &usize| problem.joints[joint - 1].command_kind() == JointKind::Revolute;
        commanded(problem).filter(turns).flat_map(of_joint).collect()
    },
    describe: |effect| match effect {
        Effect::JointHysteresis { joint, .. } => {
            format!("friction pulls joint {joint} back the way on which it came")
        }
        _ => String::new(),
    },
    searched: Some("distance_rad"),
    scaled: |effect, factor| match effect {
        Effect::JointHysteresis { joint, distance } => {
            let distance = to_three_digits(factor * distance)?;
            Some(Effect::JointHysteresis { joint: *joint, distance })
        }
        _ => None,
    },
    ..USUAL
};

//! `tracker-settling`: what measures settles, positions move by d (1 − exp(−(t − t_first)/τ)).

use super::family::{Candidate, Family, Term, USUAL, to_three_digits};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// Time constants that are looked for, as parts of the time measured: shorter ones act on few
/// poses, longer ones are drifts.
const SHORTEST: f64 = 0.03;
const LONGEST: f64 = 0.6;
/// Each over the one before.
const STEP: f64 = 1.25;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "tracker-settling",
    terms: |effect, _| match effect {
        Effect::TrackerSettling { time_constant } => ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(|(axis, name)| {
                Term::driven(
                    name,
                    ParameterSite::Shift { axis },
                    Regressor::Settling(*time_constant),
                    5e-3,
                )
            })
            .collect(),
        _ => Vec::new(),
    },
    candidates: |_, data| {
        let (Some(first), Some(last)) = (data.times.first(), data.times.last()) else {
            return Vec::new();
        };
        let time = last - first;
        let constants = std::iter::successors(Some(SHORTEST), |part| Some(part * STEP))
            .take_while(|part| *part <= LONGEST);
        constants
            .filter_map(|part| to_three_digits(part * time))
            .map(|time_constant| Candidate::of(Effect::TrackerSettling { time_constant }))
            .collect()
    },
    describe: |effect| match effect {
        Effect::TrackerSettling { time_constant } => {
            format!("the measuring station settles with a time constant of {time_constant} s")
        }
        _ => String::new(),
    },
    describe_by_row: |effect| match effect {
        Effect::TrackerSettling { time_constant } => {
            Some(format!("the measuring station settles with a constant of {time_constant} rows"))
        }
        _ => None,
    },
    searched: Some("time_constant_s"),
    scaled: |effect, factor| match effect {
        Effect::TrackerSettling { time_constant } => Some(Effect::TrackerSettling {
            time_constant: to_three_digits(factor * time_constant)?,
        }),
        _ => None,
    },
    ..USUAL
};

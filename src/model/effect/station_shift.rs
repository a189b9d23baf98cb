//! `station-shift`: measured positions are moved by d from a time on.

use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "station-shift",
    terms: |effect, _| match effect {
        Effect::StationShift { at_time } => ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(|(axis, name)| {
                Term::driven(name, ParameterSite::Shift { axis }, Regressor::Since(*at_time), 5e-3)
            })
            .collect(),
        _ => Vec::new(),
    },
    candidates: |_, data| {
        data.times.iter().map(|&at_time| Candidate::of(Effect::StationShift { at_time })).collect()
    },
    describe: |effect| match effect {
        Effect::StationShift { at_time } => format!("the measuring station moved at {at_time} s"),
        _ => String::new(),
    },
    describe_by_row: |effect| match effect {
        Effect::StationShift { at_time } => {
            Some(format!("the measuring station moved after row {}", at_time.ceil()))
        }
        _ => None,
    },
    searched: Some("at_time_s"),
    ..USUAL
};

//! `tracker-drift`: measured positions move by v (t − t_first).

use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "tracker-drift",
    terms: |effect, _| match effect {
        Effect::TrackerDrift => ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(|(axis, name)| {
                Term::driven(name, ParameterSite::Shift { axis }, Regressor::Elapsed, 1e-5)
            })
            .collect(),
        _ => Vec::new(),
    },
    candidates: |_, data| {
        let there = !data.times.is_empty();
        vec![Candidate::needing(
            Effect::TrackerDrift,
            there,
            "too few poses before or after any time",
        )]
    },
    describe: |effect| match effect {
        Effect::TrackerDrift => "the measuring station drifts".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};

//! `tracker-scale`: measured positions are scaled by 1 + s.

use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::ParameterSite;
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "tracker-scale",
    terms: |effect, _| match effect {
        Effect::TrackerScale => vec![Term::constant("error", ParameterSite::Scale, 0.01)],
        _ => Vec::new(),
    },
    candidates: |_, _| vec![Candidate::of(Effect::TrackerScale)],
    describe: |effect| match effect {
        Effect::TrackerScale => "the scale of the measurement is off".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};

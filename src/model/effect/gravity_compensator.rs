//! `gravity-compensator`: a spring between what stands before a joint and the link behind it takes
//! off part of the moment about its axis.

use super::family::{Family, Term, USUAL};
use super::place::{LEAST_MOMENT, greatest_moment};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// The family. No data tell where a spring is fixed: none is a candidate, only what is declared is
/// fitted.
pub(super) const FAMILY: Family = Family {
    name: "gravity-compensator",
    terms: |effect, problem| {
        let Effect::GravityCompensator { joint, anchor, lever, .. } = effect else {
            return Vec::new();
        };
        // A compensator that takes off all of the greatest moment, by its rate or by its preload
        // alone: l h is at most |A| |B|, and the distance h of the line of pull from the axis at
        // most the shorter of the two.
        let moment = greatest_moment(problem, *joint).max(LEAST_MOMENT);
        let [anchor, lever] = [anchor, lever].map(|[x, y]| x.hypot(*y));
        let rate = Term::constant(
            "rate",
            ParameterSite::of_joint(*joint, JointField::SpringRate),
            moment / (anchor * lever),
        );
        let preload = ParameterSite::of_joint(*joint, JointField::SpringPreload);
        vec![rate.never_negative(), Term::constant("preload", preload, moment / anchor.min(lever))]
    },
    describe: |effect| match effect {
        Effect::GravityCompensator { joint, .. } => {
            format!("a gravity compensator takes load off joint {joint}")
        }
        _ => String::new(),
    },
    ..USUAL
};

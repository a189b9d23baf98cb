//! `frame-strain`: scales of the axes of the measuring frame and their squareness, positions are
//! measured as p + E p with E upper triangular, as usual for coordinate measuring machines: a
//! rotation more is the base's.

use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::ParameterSite;
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "frame-strain",
    terms: |effect, _| match effect {
        Effect::FrameStrain => ["xx", "yy", "zz", "xy", "xz", "yz"]
            .into_iter()
            .enumerate()
            .map(|(entry, name)| Term::constant(name, ParameterSite::Strain { entry }, 0.01))
            .collect(),
        _ => Vec::new(),
    },
    candidates: |_, _| vec![Candidate::of(Effect::FrameStrain)],
    describe: |effect| match effect {
        Effect::FrameStrain => {
            "axes of the measuring frame are off in scale or not square".to_owned()
        }
        _ => String::new(),
    },
    ..USUAL
};

//! `link-bending`: uniform flexibility 1/EI of a link declared rigid.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "link-bending",
    terms: |effect, _| match effect {
        Effect::LinkBending { joint } => {
            let site = ParameterSite::Beam { joint: joint - 1, field: BeamField::Flexibility };
            vec![Term::constant("flexibility", site, 1e-2).never_negative()]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let bends = |joint: &crate::problem::Joint| {
            joint.beam.as_ref().is_some_and(|beam| beam.ei_y.is_some() || beam.ei_z.is_some())
        };
        let rigid =
            problem.joints.iter().enumerate().filter(|(_, joint)| joint.a != 0.0 && !bends(joint));
        let effect = |(index, _)| Effect::LinkBending { joint: index + 1 };
        rigid.map(|link| Candidate::needing(effect(link), data.weighs(), NO_LOADS)).collect()
    },
    describe: |effect| match effect {
        Effect::LinkBending { joint } => format!("the link before joint {joint} bends"),
        _ => String::new(),
    },
    ..USUAL
};

//! `station-move`: what measures is set up anew at a time: measured positions are turned by ω about
//! the measuring frame's origin and moved by d from then on.

use super::family::{Family, Term, USUAL};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// Usual size of d \[m\] and of ω \[rad\]: an instrument that was knocked or set down again.
const SIZE: f64 = 1e-2;

/// The family. None is a candidate by itself, the evidence looks for times where something follows
/// time.
pub(super) const FAMILY: Family = Family {
    name: "station-move",
    terms: |effect, _| match effect {
        Effect::StationMove { at_time } => {
            let term = |name, site| Term::driven(name, site, Regressor::Since(*at_time), SIZE);
            let moved = ["x", "y", "z"].into_iter().enumerate();
            let turned = ["rx", "ry", "rz"].into_iter().enumerate();
            moved
                .map(|(axis, name)| term(name, ParameterSite::Shift { axis }))
                .chain(turned.map(|(axis, name)| term(name, ParameterSite::Turn { axis })))
                .collect()
        }
        _ => Vec::new(),
    },
    describe: |effect| match effect {
        Effect::StationMove { at_time } => {
            format!("the measuring station moved and turned at {at_time} s")
        }
        _ => String::new(),
    },
    describe_by_row: |effect| match effect {
        Effect::StationMove { at_time } => {
            Some(format!("the measuring station moved and turned after row {}", at_time.ceil()))
        }
        _ => None,
    },
    searched: Some("at_time_s"),
    ..USUAL
};

//! `joint-wave`: an error that repeats with a stage of the gear, Δθ = a sin kθ + b cos kθ with θ =
//! q as commanded and any k.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::family::{Family, Term, USUAL};
use super::place::slides;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, Joint, JointKind};

/// Chance of all orders between a whole number and the next, over that of a harmonic of that order:
/// gears have whole numbers of teeth, so that most errors repeat a whole number of times a
/// revolution; a stage of a gear need not.
const SHARE: f64 = 0.2;
/// ln of the longest over the shortest lead of a screw or pitch of a rack: each factor is as
/// probable as any other.
const LEADS: f64 = 7.0;

/// The family. Its orders have no end: none is a candidate by itself, the evidence looks for them
/// where a joint errs with its command.
pub(super) const FAMILY: Family = Family {
    name: "joint-wave",
    terms: |effect, problem| match effect {
        Effect::JointWave { joint, order } => {
            let site = ParameterSite::coordinate(problem, *joint);
            let wave = |phase| Regressor::Wave { joint: joint - 1, order: *order, phase };
            vec![
                Term::driven("sin", site, wave(0.0), 1e-3),
                Term::driven("cos", site, wave(FRAC_PI_2), 1e-3),
            ]
        }
        _ => Vec::new(),
    },
    describe: |effect| match effect {
        Effect::JointWave { joint, order } => {
            let (angle, way) = (360.0 / order, 1e3 * TAU / order);
            format!(
                "joint {joint} errs in waves of order {order} (every {angle:.2}°, or {way:.2} mm of a slide)"
            )
        }
        _ => String::new(),
    },
    tries: |effect, _, problem| match effect {
        // Of all orders in a unit together: those of a harmonic of that order of each joint that
        // turns, over the share.
        Effect::JointWave { joint, order } => {
            let of_kind = |kind| {
                problem
                    .joints
                    .iter()
                    .filter(|own: &&Joint| own.command_kind() == kind)
                    .count()
                    .max(1) as f64
            };
            // The chance of a lead in a factor e of leads, over the orders in it.
            if slides(problem, *joint) {
                return of_kind(JointKind::Prismatic) * LEADS * order.max(1.0);
            }
            of_kind(JointKind::Revolute) * PI.powi(2) / 6.0 * order.max(1.0).powi(2) / SHARE
        }
        _ => 1.0,
    },
    function_of: |effect| match effect {
        Effect::JointWave { joint, .. } => Some((*joint, *joint)),
        _ => None,
    },
    searched: Some("order"),
    ..USUAL
};

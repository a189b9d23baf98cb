//! `joint-wave`: an error that repeats with a stage of the gear, Δθ = a sin kθ + b cos kθ with θ = q as commanded and any k.

use std::f64::consts::{FRAC_PI_2, PI};

use super::family::{Family, Term, USUAL};
use crate::model::parameter::{Driver, Slot};
use crate::problem::{Effect, Joint, JointKind};

/// Chance of all orders between a whole number and the next, over that of a harmonic of that order: gears have whole numbers of teeth, so
/// that most errors repeat a whole number of times a revolution; a stage of a gear need not.
const SHARE: f64 = 0.2;

/// The family. Its orders have no end: none is a candidate by itself, the evidence looks for them where a joint errs with its command.
pub(super) const FAMILY: Family = Family {
    name: "joint-wave",
    terms: |effect, problem| match effect {
        Effect::JointWave { joint, order } => {
            let slot = Slot::coordinate(problem, *joint);
            let wave = |phase| Driver::Wave { joint: joint - 1, order: *order, phase };
            vec![Term::driven("sin", slot, wave(0.0), 1e-3), Term::driven("cos", slot, wave(FRAC_PI_2), 1e-3)]
        }
        _ => Vec::new(),
    },
    describe: |effect| match effect {
        Effect::JointWave { joint, order } => {
            format!("angle of joint {joint} errs with {order} cycles a revolution")
        }
        _ => String::new(),
    },
    tries: |effect, _, problem| match effect {
        // Of all orders in a unit together: those of a harmonic of that order of each joint that turns, over the share.
        Effect::JointWave { order, .. } => {
            let turns = |joint: &&Joint| joint.commanded() == JointKind::Revolute;
            let joints = problem.joints.iter().filter(turns).count().max(1);
            joints as f64 * PI.powi(2) / 6.0 * order.max(1.0).powi(2) / SHARE
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

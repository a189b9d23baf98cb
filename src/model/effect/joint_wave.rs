//! `joint-wave`: an error that repeats with a stage of the gear, Δθ = a sin kθ + b cos kθ with θ = q as commanded and any k.

use std::f64::consts::{FRAC_PI_2, PI};

use super::family::{Family, Term, USUAL};
use crate::model::parameter::{Driver, Slot};
use crate::problem::Effect;

/// Waves whose orders differ by less are hardly told apart, whatever the range of the joint.
const TOLD_APART: f64 = 0.2;

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
    tries: |effect, _| match effect {
        // Of the same chance as a harmonic of that order, which has one try in a unit of orders.
        Effect::JointWave { order, .. } => PI.powi(2) / 6.0 * order.max(1.0).powi(2) / TOLD_APART,
        _ => 1.0,
    },
    function_of: |effect| match effect {
        Effect::JointWave { joint, .. } => Some((*joint, *joint)),
        _ => None,
    },
    searched: Some("order"),
    ..USUAL
};

//! Shared arms and poses of the rig tests.

use crate::common::arms::{TABLE_2, golden_problem};
use flexcal::problem::{Effect, PoseConditions, Problem};
use flexcal::rig::{Cause, Rig, TrueEffect};
use nalgebra::Vector3;

pub const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Creates a true effect of the catalogue.
pub fn effect(arm: &Problem, effect: Effect, values: &[f64]) -> TrueEffect {
    TrueEffect::new(Cause::Catalogued(effect), values, &arm.joints).unwrap()
}

pub fn position(
    arm: &Problem,
    effects: Vec<TrueEffect>,
    conditions: &PoseConditions,
) -> Vector3<f64> {
    Rig::new(arm.clone(), effects).position(conditions).unwrap()
}

pub fn table_2() -> Problem {
    let mut arm = golden_problem();
    for (joint, [alpha, a, theta, d, beta]) in arm.joints.iter_mut().zip(TABLE_2) {
        (joint.alpha, joint.theta, joint.beta) =
            (alpha.to_radians(), theta.to_radians(), beta.to_radians());
        (joint.a, joint.d) = (a, d);
    }
    arm
}

/// Multiplies the stiffness of every joint and beam by a factor; 0 makes it rigid.
pub fn stiffer(mut arm: Problem, joints: f64, link_a: f64, link_b: f64) -> Problem {
    let by = |factor: f64, value: Option<f64>| {
        value.map(|value| value * factor).filter(|value| *value > 0.0)
    };
    for joint in &mut arm.joints {
        joint.stiffness = by(joints, joint.stiffness);
        if let Some(beam) = &mut joint.beam {
            let factor = if beam.name == "A" { link_a } else { link_b };
            for value in [&mut beam.ea, &mut beam.ei_y, &mut beam.ei_z, &mut beam.gj] {
                *value = by(factor, *value);
            }
        }
    }
    arm
}

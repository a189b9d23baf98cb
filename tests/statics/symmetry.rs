//! Invariance under rotation and reflection of the whole arm.

use flexcal::mechanics::{Angle, Arm, Beam, Joint};
use flexcal::problem::{Equilibrium, JointKind};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::bench::{TARGET, arms, joint, position};

#[test]
fn an_arm_turned_with_gravity_is_the_same_arm() {
    let (alpha, theta, beta) = (0.7, -1.9, 0.4);
    let about = |axis: Vector3<f64>, angle: f64| Rotation3::new(axis * angle);
    let turn = about(Vector3::x(), alpha) * about(Vector3::z(), theta) * about(Vector3::y(), beta);
    for (arm, configurations) in arms() {
        let stand = Joint { alpha: Angle::new(alpha), theta, beta: Angle::new(beta), ..joint(0.0) };
        let mut turned = arm.clone();
        turned.gravity = turn * arm.gravity;
        for joint in &mut turned.joints {
            if let Some(Beam { hoist: Some(hoist), .. }) = &mut joint.beam {
                hoist.direction = turn * hoist.direction;
            }
        }
        turned.joints.insert(0, stand);
        for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
            let (mut arm, mut turned) = (arm.clone(), turned.clone());
            (arm.equilibrium, turned.equilibrium) = (equilibrium, equilibrium);
            for q in &configurations {
                let same = turn * position(&arm, q, &TARGET);
                let longer: Vec<f64> = std::iter::once(0.0).chain(q.iter().copied()).collect();
                assert!((position(&turned, &longer, &TARGET) - same).norm() < 1e-12);
            }
        }
    }
}

#[test]
fn an_arm_in_a_mirror_is_its_mirror_image() {
    // Reflection in the plane x = 0: lengths along x and rotations about y and z change their sign.
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    for (arm, configurations) in arms() {
        let mut image = arm.clone();
        (image.gravity, image.payload_at) = (mirror * arm.gravity, mirror * arm.payload_at);
        for joint in &mut image.joints {
            (joint.a, joint.theta, joint.beta) =
                (-joint.a, -joint.theta, Angle::new(-joint.beta.value));
            joint.bodies.iter_mut().for_each(|body| body.at.x = -body.at.x);
            let Some(beam) = &mut joint.beam else { continue };
            beam.masses.iter_mut().for_each(|carried| carried.at.x = -carried.at.x);
            if let Some(hoist) = &mut beam.hoist {
                (hoist.at, hoist.direction) = (mirror * hoist.at, mirror * hoist.direction);
            }
        }
        for (equilibrium, elements) in [
            (Equilibrium::Deflected, 1),
            (Equilibrium::Deflected, 3),
            (Equilibrium::Undeflected, 1),
        ] {
            (image.equilibrium, image.beam_elements) = (equilibrium, elements);
            let arm = Arm { equilibrium, beam_elements: elements, ..arm.clone() };
            for q in &configurations {
                let joints = arm.joints.iter().zip(q);
                let mirrored: Vec<f64> = joints
                    .map(|(joint, q)| if joint.kind == JointKind::Revolute { -q } else { *q })
                    .collect();
                let seen = mirror * position(&arm, q, &TARGET);
                assert!((position(&image, &mirrored, &(mirror * TARGET)) - seen).norm() < 1e-12);
            }
        }
    }
}

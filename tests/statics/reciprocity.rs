//! Maxwell–Betti reciprocity of forces and displacements.

use flexcal::mechanics::{Hoist, Joint};
use flexcal::problem::JointKind;
use nalgebra::Vector3;

use super::bench::{TARGET, arms, frame, position, rigid, softer};

#[test]
fn points_of_the_last_link_obey_reciprocity() {
    // Maxwell–Betti: a force along u at A moves B along v as much as one along v at B moves A along
    // u.
    let (at_a, along_u) = (Vector3::new(0.3, 0.1, -0.2), Vector3::new(0.6, -0.3, 0.9));
    let (at_b, along_v) = (Vector3::new(-0.1, 0.25, 0.15), Vector3::new(-0.2, 1.0, 0.4));
    for (nominal, configurations) in arms() {
        let mut massless = softer(&nominal, 1e-6);
        for joint in &mut massless.joints {
            joint.bodies.clear();
            if let Some(beam) = &mut joint.beam {
                (beam.mass, beam.hoist) = (0.0, None);
                beam.masses.clear();
                let all = &mut beam.flexibility;
                all.coupling = Some([0.5 * all.twist, -0.4 * all.twist]);
            }
            joint.slide = (joint.kind == JointKind::Prismatic).then_some(1e-9);
        }
        let displacement =
            |q: &[f64], load: Vector3<f64>, force: Vector3<f64>, point: &Vector3<f64>| {
                let mut arm = massless.clone();
                (arm.gravity, arm.payload_at, arm.payload_mass) = (force, load, 50.0);
                position(&arm, q, point) - position(&rigid(&arm), q, point)
            };
        for q in &configurations {
            let forth = displacement(q, at_a, along_u, &at_b).dot(&along_v);
            let back = displacement(q, at_b, along_v, &at_a).dot(&along_u);
            let size = displacement(q, at_a, along_u, &at_a).dot(&along_u);
            assert!(size > 0.0, "a force does work");
            assert!((forth - back).abs() < 1e-5 * size, "{forth:e} and {back:e}, {size:e}");
        }
    }
}

#[test]
fn the_rope_and_the_payload_obey_reciprocity() {
    // A rope along v at the hook moves the payload position along u as much as a payload moves the
    // hook. The hook moves like the tip of the beam's inner part, which carries the rest of the arm
    // as a rigid load.
    let (mut whole, configurations) = arms()[0].clone();
    let (hook, along_v) = (0.95, Vector3::new(0.3, -0.5, 1.0));
    whole = softer(&whole, 1e-6);
    for joint in &mut whole.joints {
        joint.bodies.clear();
        if let Some(beam) = &mut joint.beam {
            (beam.mass, beam.hoist) = (0.0, None);
            beam.masses.clear();
        }
    }
    (whole.payload_mass, whole.payload_at) = (0.0, TARGET);
    let force = Vector3::new(0.2, 0.3, -1.0);
    for q in &configurations {
        let mut pulled = whole.clone();
        let rope = Hoist {
            at: Vector3::new(hook, 0.0, 0.0),
            force: 50.0 * along_v.norm(),
            direction: along_v.normalize(),
        };
        pulled.joints[3].beam.as_mut().unwrap().hoist = Some(rope);
        let forth =
            (position(&pulled, q, &TARGET) - position(&rigid(&pulled), q, &TARGET)).dot(&force);

        let mut inner = whole.clone();
        inner.joints[3] = Joint { a: hook, theta: -q[3], d: 0.0, ..inner.joints[3].clone() };
        inner.joints[3].flexibility = None;
        let at_hook = frame(&rigid(&inner), q).unwrap();
        let loaded = position(&rigid(&whole), q, &TARGET);
        inner.payload_at = at_hook.resolve(&(loaded - at_hook.origin));
        (inner.gravity, inner.payload_mass) = (force, 50.0);
        let back = (frame(&inner, q).unwrap().origin - at_hook.origin).dot(&along_v);
        assert!(
            (forth - back).abs() < 1e-5 * forth.abs().max(back.abs()),
            "{forth:e} and {back:e}"
        );
    }
}

//! Single beams and joints compared with textbook formulas.

use std::f64::consts::FRAC_PI_2;

use flexcal::mechanics::{Angle, Arm, Compensator, Flexibility, Hoist, Joint, PointMass};
use flexcal::problem::JointKind;
use nalgebra::Vector3;

use super::bench::{GRAVITY, LENGTH, STIFF, arm, beam, frame, joint, position};

fn near(value: f64, expected: f64, relative: f64, what: &str) {
    let error = (value / expected - 1.0).abs();
    assert!(error < relative, "{what}: {value:e} instead of {expected:e}");
}

#[test]
fn a_hanging_beam_stretches_under_its_own_weight() {
    // δ = q L² / (2 EA), downwards; an upright beam is compressed by the same amount.
    for (beta, sign) in [(FRAC_PI_2, -1.0), (-FRAC_PI_2, 1.0)] {
        for elements in [1, 5] {
            let turned = Joint { beta: Angle::new(beta), ..joint(0.0) };
            let mut arm = arm(vec![turned, beam(LENGTH, 12.0, STIFF)]);
            arm.beam_elements = elements;
            let moved = position(&arm, &[], &Vector3::zeros()).z - sign * LENGTH;
            let expected = 12.0 * GRAVITY / LENGTH * LENGTH.powi(2) * STIFF.axial / 2.0;
            near(moved, -expected, 1e-8, "change of length");
        }
    }
}

#[test]
fn a_horizontal_beam_sags_as_in_the_textbook() {
    // q L⁴/(8 EI) with the slope q L³/(6 EI); F L³/(3 EI) with F L²/(2 EI); F s² (3 L − s)/(6 EI)
    // with F s²/(2 EI).
    let (weight, s) = (12.0 * GRAVITY, 0.7);
    for (alpha, flexibility) in [(0.0, STIFF.about_y), (FRAC_PI_2, STIFF.about_z)] {
        for elements in [1, 4] {
            let made = |mass: f64| {
                let link = Joint { alpha: Angle::new(alpha), ..beam(LENGTH, mass, STIFF) };
                let mut arm = arm(vec![link]);
                arm.beam_elements = elements;
                arm
            };
            let check = |arm: &Arm<f64>, sag: f64, slope: f64, what: &str| {
                let tip = frame(arm, &[]).unwrap();
                near(-tip.origin.z, sag, 1e-6, what);
                near(-tip.axes[0].z, slope, 1e-6, what);
            };
            let (l, k) = (LENGTH, flexibility);
            check(
                &made(12.0),
                weight * l.powi(3) * k / 8.0,
                weight * l.powi(2) * k / 6.0,
                "own weight",
            );
            let mut loaded = made(0.0);
            loaded.payload_mass = 12.0;
            check(
                &loaded,
                weight * l.powi(3) * k / 3.0,
                weight * l.powi(2) * k / 2.0,
                "load at the tip",
            );
            let mut carrying = made(0.0);
            let carried = PointMass { mass: 12.0, at: Vector3::new(s, 0.0, 0.0) };
            carrying.joints[0].beam.as_mut().unwrap().masses.push(carried);
            let (sag, slope) = (weight * s * s * (3.0 * l - s) * k / 6.0, weight * s * s * k / 2.0);
            check(&carrying, sag, slope, "load on the beam");
            let mut hoisted = made(0.0);
            let hoist = Hoist {
                at: Vector3::new(s, 0.0, 0.0),
                force: weight,
                direction: Vector3::new(0.0, 0.0, -1.0),
            };
            hoisted.joints[0].beam.as_mut().unwrap().hoist = Some(hoist);
            check(&hoisted, sag, slope, "rope that pulls down");
        }
    }
}

#[test]
fn a_mass_beside_the_beam_twists_it() {
    // φ = m g e L / GJ: a point at the height h beside the axis moves sideways by φ h.
    let (mass, lever, height) = (3.0, 0.4, 0.25);
    let only_twist = Flexibility { axial: 0.0, about_y: 0.0, about_z: 0.0, ..STIFF };
    let mut arm = arm(vec![beam(LENGTH, 0.0, only_twist)]);
    (arm.payload_mass, arm.payload_at) = (mass, Vector3::new(0.0, lever, 0.0));
    let moved = position(&arm, &[], &Vector3::new(0.0, 0.0, height)).y;
    near(moved, mass * GRAVITY * lever * LENGTH * STIFF.twist * height, 1e-6, "twist");
}

#[test]
fn twist_and_bending_are_coupled_both_ways() {
    // A load W with the lever e at the tip: M_x = −W e along the beam, M_y = W (L − x). About y the
    // torsional moment adds −k_y W e to the curvature, about z −k_z W e; the bending moment rotates
    // the tip by k_y W L²/2 about x.
    let (weight, lever, l, [k_y, k_z]) = (3.0 * GRAVITY, 0.4, LENGTH, [2e-7, -3e-7]);
    for elements in [1, 4] {
        for along in [1.0, -1.0] {
            let coupled = Flexibility { axial: 0.0, coupling: Some([k_y, k_z]), ..STIFF };
            let mut arm = arm(vec![beam(along * l, 0.0, coupled)]);
            arm.beam_elements = elements;
            (arm.payload_mass, arm.payload_at) = (3.0, Vector3::new(0.0, lever, 0.0));
            let tip = frame(&arm, &[]).unwrap();
            let torsion = weight * lever * l * l / 2.0;
            near(
                -tip.origin.z,
                weight * l.powi(3) * STIFF.about_y / 3.0 - along * k_y * torsion,
                1e-4,
                "sag",
            );
            near(tip.origin.y, -along * k_z * torsion, 1e-4, "sideways");
            let twist = weight * (along * k_y * l * l / 2.0 - STIFF.twist * lever * l);
            near(tip.axes[1].z, twist, 1e-4, "twist");
        }
    }
}

#[test]
fn a_slide_sags_as_a_cantilever_as_long_as_it_is_out() {
    // F L³/(3 EI) + M L²/(2 EI) with the slope F L²/(2 EI) + M L/(EI), L = |d + q|, in either
    // direction.
    let (weight, lever, l, k) = (12.0 * GRAVITY, 0.3, LENGTH, 3e-7);
    for (d, q) in [(l, 0.0), (0.2, l - 0.2), (-l, 0.0), (0.4, -l - 0.4)] {
        let turned = Angle::new(FRAC_PI_2);
        let slide =
            Joint { kind: JointKind::Prismatic, alpha: turned, d, slide: Some(k), ..joint(0.0) };
        let mut arm = arm(vec![slide]);
        let along = (d + q).signum();
        (arm.payload_mass, arm.payload_at) = (12.0, Vector3::new(0.0, 0.0, lever * along));
        let tip = frame(&arm, &[q]).unwrap();
        near(-tip.origin.z, weight * k * l * l * (l / 3.0 + lever / 2.0), 1e-6, "sag");
        near(-tip.axes[2].z * along, weight * k * l * (l / 2.0 + lever), 1e-6, "slope");
    }
}

#[test]
fn a_spring_takes_off_part_of_the_moment() {
    // Horizontal axis, load at the lever L: M = −W L cos φ. A spring without free length from the
    // height h above the axis to the lever b along the link lifts it by k b h cos φ; with free
    // length and preload by (k (l − l₀) + F₀) b h cos φ / l.
    let (stiffness, mass, h, b, k) = (1e7, 4.0, 0.5, 0.4, 150.0);
    for (free_length, preload) in [(0.0, 0.0), (0.3, 20.0), (0.0, -15.0)] {
        for q in [-0.7_f64, 0.0, 0.4] {
            let (anchor, lever) = ([0.0, h], [b, 0.0]);
            let spring = Compensator { anchor, lever, free_length, rate: k, preload };
            let (alpha, flexibility) = (Angle::new(FRAC_PI_2), Some(1.0 / stiffness));
            let kind = JointKind::Revolute;
            let sprung =
                Joint { kind, alpha, flexibility, compensator: Some(spring), ..joint(0.0) };
            let mut arm = arm(vec![sprung, joint(LENGTH)]);
            arm.payload_mass = mass;
            let length = (b * b + h * h - 2.0 * b * h * q.sin()).sqrt();
            let pull = k * (length - free_length) + preload;
            let moment = (pull * b * h / length - mass * GRAVITY * LENGTH) * q.cos();
            let along = frame(&arm, &[q, 0.0]).unwrap().axes[0];
            near(along.z.atan2(along.x) - q, moment / stiffness, 1e-4, "turn");
        }
    }
}

#[test]
fn a_flexible_joint_turns_by_moment_over_stiffness() {
    // Horizontal axis, load at the lever L: the load sinks by F L²/k.
    let (stiffness, mass) = (1e7, 4.0);
    let axis =
        Joint { alpha: Angle::new(FRAC_PI_2), flexibility: Some(1.0 / stiffness), ..joint(0.0) };
    let mut arm = arm(vec![axis, joint(LENGTH)]);
    arm.payload_mass = mass;
    let sag = -position(&arm, &[], &Vector3::zeros()).z;
    near(sag, mass * GRAVITY * LENGTH.powi(2) / stiffness, 1e-5, "sag");
}

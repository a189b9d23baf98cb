//! What statics must obey whatever the formulas: beams of the textbook, reciprocity, symmetry, convergence, limits.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

use std::f64::consts::FRAC_PI_2;

use common::arms::{ODD, golden_problem, parse};
use common::made::{at_random, model_of};
use flexcal::arm::{
    Angle, Arm, Beam, Equilibrated, Flexibility, Hoist, Joint, PointMass, Setup, StaticsError, Workspace,
};
use flexcal::model::PoseResiduals;
use flexcal::problem::{Equilibrium, JointKind};
use flexcal::spatial::Frame;
use flexcal::study::Placement;
use nalgebra::{DVector, Matrix3, Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 1.6;
/// A beam so stiff that its deflection is linear to eight digits.
const STIFF: Flexibility<f64> = Flexibility { axial: 2e-9, about_y: 3e-7, about_z: 5e-7, twist: 7e-7 };

fn joint(a: f64) -> Joint<f64> {
    Joint {
        nonlinear: None,
        lateral: None,
        kind: JointKind::Fixed,
        alpha: Angle::new(0.0),
        a,
        theta: 0.0,
        d: 0.0,
        beta: Angle::new(0.0),
        flexibility: None,
        beam: None,
        bodies: Vec::new(),
    }
}

fn beam(a: f64, mass: f64, flexibility: Flexibility<f64>) -> Joint<f64> {
    let beam = Beam { mass, flexibility, masses: Vec::new(), hoist: None, thermal: None, added: None };
    Joint { beam: Some(beam), ..joint(a) }
}

/// An arm under gravity along −z, loads on the bent arm, one element a beam.
fn arm(joints: Vec<Joint<f64>>) -> Arm<f64> {
    Arm {
        payload_error: 0.0,
        rope: None,
        mounting: None,
        mixing: None,
        reference_temperature: 20.0,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        equilibrium: Equilibrium::Deflected,
        beam_elements: 1,
        joints,
        payload_at: Vector3::zeros(),
        payload_mass: 0.0,
    }
}

fn frame(arm: &Arm<f64>, q: &[f64]) -> Result<Frame<f64>, StaticsError> {
    let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
    let still = vec![0.0; arm.joints.len()];
    let configuration = if q.is_empty() { &still } else { q };
    arm.equilibrate(&Setup::of(configuration), &mut ws, &mut rest)?;
    Ok(rest.frame)
}

fn position(arm: &Arm<f64>, q: &[f64], target: &Vector3<f64>) -> Vector3<f64> {
    frame(arm, q).unwrap().point(target)
}

/// The same arm with nothing that bends.
fn rigid(arm: &Arm<f64>) -> Arm<f64> {
    let mut arm = arm.clone();
    for joint in &mut arm.joints {
        joint.flexibility = None;
        joint.beam = None;
    }
    arm
}

/// Flexibilities multiplied by `factor`.
fn softer(arm: &Arm<f64>, factor: f64) -> Arm<f64> {
    let mut arm = arm.clone();
    for joint in &mut arm.joints {
        joint.flexibility = joint.flexibility.map(|flexibility| flexibility * factor);
        if let Some(Beam { flexibility: all, .. }) = &mut joint.beam {
            for flexibility in [&mut all.axial, &mut all.about_y, &mut all.about_z, &mut all.twist] {
                *flexibility *= factor;
            }
        }
    }
    arm
}

fn near(value: f64, expected: f64, relative: f64, what: &str) {
    let error = (value / expected - 1.0).abs();
    assert!(error < relative, "{what}: {value:e} instead of {expected:e}");
}

/// Both arms of the tests in turn, each with some configurations.
fn arms() -> [(Arm<f64>, Vec<Vec<f64>>); 2] {
    [golden_problem(), parse(ODD)].map(|problem| {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let rows = at_random(&problem, 8, 2.5, &mut rng);
        let mut arm = Arm::nominal(&problem);
        arm.payload_mass = 1.5;
        (arm, (0..rows.len()).map(|row| rows.configuration(row).to_vec()).collect())
    })
}

const TARGET: Vector3<f64> = Vector3::new(0.22, 0.05, -0.09);

#[test]
fn a_hanging_beam_stretches_under_its_own_weight() {
    // δ = q L² / (2 EA), downwards; upright it is pressed together by as much.
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
    // q L⁴/(8 EI) with the slope q L³/(6 EI); F L³/(3 EI) with F L²/(2 EI); F s² (3 L − s)/(6 EI) with F s²/(2 EI).
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
            check(&made(12.0), weight * l.powi(3) * k / 8.0, weight * l.powi(2) * k / 6.0, "own weight");
            let mut loaded = made(0.0);
            loaded.payload_mass = 12.0;
            check(&loaded, weight * l.powi(3) * k / 3.0, weight * l.powi(2) * k / 2.0, "load at the tip");
            let mut carrying = made(0.0);
            let carried = PointMass { mass: 12.0, at: Vector3::new(s, 0.0, 0.0) };
            carrying.joints[0].beam.as_mut().unwrap().masses.push(carried);
            let (sag, slope) = (weight * s * s * (3.0 * l - s) * k / 6.0, weight * s * s * k / 2.0);
            check(&carrying, sag, slope, "load on the beam");
            let mut hoisted = made(0.0);
            let hoist = Hoist { at: Vector3::new(s, 0.0, 0.0), force: weight, direction: Vector3::new(0.0, 0.0, -1.0) };
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
fn a_flexible_joint_turns_by_moment_over_stiffness() {
    // A horizontal axis, a load at the lever L: the load sinks by F L²/k.
    let (stiffness, mass) = (1e7, 4.0);
    let axis = Joint { alpha: Angle::new(FRAC_PI_2), flexibility: Some(1.0 / stiffness), ..joint(0.0) };
    let mut arm = arm(vec![axis, joint(LENGTH)]);
    arm.payload_mass = mass;
    let sag = -position(&arm, &[], &Vector3::zeros()).z;
    near(sag, mass * GRAVITY * LENGTH.powi(2) / stiffness, 1e-5, "sag");
}

#[test]
fn points_of_the_last_link_obey_reciprocity() {
    // Maxwell–Betti: a force along u at A moves B along v as much as one along v at B moves A along u.
    let (at_a, along_u) = (Vector3::new(0.3, 0.1, -0.2), Vector3::new(0.6, -0.3, 0.9));
    let (at_b, along_v) = (Vector3::new(-0.1, 0.25, 0.15), Vector3::new(-0.2, 1.0, 0.4));
    for (nominal, configurations) in arms() {
        let mut massless = softer(&nominal, 1e-6);
        for joint in &mut massless.joints {
            joint.bodies.clear();
            if let Some(beam) = &mut joint.beam {
                (beam.mass, beam.hoist) = (0.0, None);
                beam.masses.clear();
            }
        }
        let displacement = |q: &[f64], load: Vector3<f64>, force: Vector3<f64>, point: &Vector3<f64>| {
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
    // A rope along v at the hook moves the payload's place along u as much as a payload moves the hook. The hook's
    // motion is that of the tip of the beam's inner part, which carries the rest of the arm as a rigid load.
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
        let rope =
            Hoist { at: Vector3::new(hook, 0.0, 0.0), force: 50.0 * along_v.norm(), direction: along_v.normalize() };
        pulled.joints[3].beam.as_mut().unwrap().hoist = Some(rope);
        let forth = (position(&pulled, q, &TARGET) - position(&rigid(&pulled), q, &TARGET)).dot(&force);

        let mut inner = whole.clone();
        inner.joints[3] = Joint { a: hook, theta: -q[3], d: 0.0, ..inner.joints[3].clone() };
        inner.joints[3].flexibility = None;
        let at_hook = frame(&rigid(&inner), q).unwrap();
        let loaded = position(&rigid(&whole), q, &TARGET);
        inner.payload_at = at_hook.resolve(&(loaded - at_hook.origin));
        (inner.gravity, inner.payload_mass) = (force, 50.0);
        let back = (frame(&inner, q).unwrap().origin - at_hook.origin).dot(&along_v);
        assert!((forth - back).abs() < 1e-5 * forth.abs().max(back.abs()), "{forth:e} and {back:e}");
    }
}

#[test]
fn twice_the_elements_come_four_times_closer() {
    for (arm, configurations) in arms() {
        let at = |elements: usize, q: &[f64]| {
            let mut arm = arm.clone();
            arm.beam_elements = elements;
            position(&arm, q, &TARGET)
        };
        let finest: Vec<Vector3<f64>> = configurations.iter().map(|q| at(64, q)).collect();
        let errors: Vec<f64> = [1, 2, 4, 8]
            .map(|elements| {
                let worst = configurations.iter().zip(&finest).map(|(q, fine)| (at(elements, q) - fine).norm());
                worst.fold(0.0, f64::max)
            })
            .to_vec();
        println!("1, 2, 4, 8 elements: {errors:?} m");
        assert!(errors.windows(2).all(|pair| pair[1] < 0.4 * pair[0]), "{errors:?}");
        assert!(errors[0] < 1e-4);
    }
}

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
    // In the plane x = 0: lengths along x and turns about y and z change their sign.
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    for (arm, configurations) in arms() {
        let mut image = arm.clone();
        (image.gravity, image.payload_at) = (mirror * arm.gravity, mirror * arm.payload_at);
        for joint in &mut image.joints {
            (joint.a, joint.theta, joint.beta) = (-joint.a, -joint.theta, Angle::new(-joint.beta.value));
            joint.bodies.iter_mut().for_each(|body| body.at.x = -body.at.x);
            let Some(beam) = &mut joint.beam else { continue };
            beam.masses.iter_mut().for_each(|carried| carried.at.x = -carried.at.x);
            if let Some(hoist) = &mut beam.hoist {
                (hoist.at, hoist.direction) = (mirror * hoist.at, mirror * hoist.direction);
            }
        }
        for (equilibrium, elements) in
            [(Equilibrium::Deflected, 1), (Equilibrium::Deflected, 3), (Equilibrium::Undeflected, 1)]
        {
            (image.equilibrium, image.beam_elements) = (equilibrium, elements);
            let arm = Arm { equilibrium, beam_elements: elements, ..arm.clone() };
            for q in &configurations {
                let joints = arm.joints.iter().zip(q);
                let mirrored: Vec<f64> =
                    joints.map(|(joint, q)| if joint.kind == JointKind::Revolute { -q } else { *q }).collect();
                let seen = mirror * position(&arm, q, &TARGET);
                assert!((position(&image, &mirrored, &(mirror * TARGET)) - seen).norm() < 1e-12);
            }
        }
    }
}

#[test]
fn without_gravity_and_rope_nothing_bends() {
    for (mut arm, configurations) in arms() {
        arm.gravity = Vector3::zeros();
        arm.joints.iter_mut().filter_map(|joint| joint.beam.as_mut()).for_each(|beam| beam.hoist = None);
        let straight = rigid(&arm);
        for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
            arm.equilibrium = equilibrium;
            for q in &configurations {
                let error = (position(&arm, q, &TARGET) - position(&straight, q, &TARGET)).norm();
                assert!(error < 1e-14, "{error:e}");
            }
        }
    }
}

#[test]
fn loads_on_the_bent_arm_are_a_matter_of_second_order() {
    for (nominal, configurations) in arms() {
        let difference = |factor: f64, q: &[f64]| {
            let bent = softer(&nominal, factor);
            let first = Arm { equilibrium: Equilibrium::Undeflected, ..bent.clone() };
            (position(&bent, q, &TARGET) - position(&first, q, &TARGET)).norm()
        };
        for q in &configurations {
            let (soft, stiff) = (difference(1.0, q), difference(0.1, q));
            assert!((stiff / soft * 100.0 - 1.0).abs() < 0.3, "{soft:e} {stiff:e}");
        }
    }
}

#[test]
fn an_arm_too_soft_for_its_loads_is_an_error() {
    for (nominal, configurations) in arms() {
        let mut fates = Vec::new();
        for exponent in 0..16 {
            let arm = softer(&nominal, 2.0_f64.powi(2 * exponent));
            let settled = configurations.iter().filter(|q| {
                let found = frame(&arm, q);
                found.is_ok_and(|frame| frame.origin.iter().all(|x| x.is_finite()))
            });
            fates.push(settled.count());
        }
        println!("settled of {}: {fates:?}", configurations.len());
        assert_eq!(fates[0], configurations.len());
        assert_eq!(fates[15], 0, "{fates:?}");
        assert_eq!(frame(&softer(&nominal, 1e9), &configurations[0]).unwrap_err(), StaticsError::NotSettled);
    }
}

#[test]
fn a_pose_without_equilibrium_has_no_residual() {
    let problem = golden_problem();
    let rows = at_random(&problem, 3, 1.0, &mut ChaCha8Rng::seed_from_u64(1));
    let model = model_of(&problem, &rows);
    // Stiffnesses 10⁻⁹ of nominal.
    let soft = model.parameters.iter().map(|parameter| if parameter.slot.is_elastic() { 1e-9_f64.ln() } else { 0.0 });
    let x = DVector::from_iterator(model.parameters.len(), soft);
    let poses = Placement::of(&rows).poses(&rows, &[0, 1, 2], 1e-3);
    let residuals = PoseResiduals::new(&model, poses, (0..x.len()).collect(), x.clone());
    assert!(residuals.position_errors(&x).iter().all(|error| error.iter().all(|e| e.is_nan())));
    let jacobian = flexcal::fit::jacobian(&residuals, &x);
    assert_eq!(jacobian.shape(), (9, x.len()));
}

#[test]
fn an_arm_that_its_hoist_balances_comes_to_rest() {
    let problem = parse(
        "name = 'balanced'\n[[joint]]\nd_mm = 300\n[[joint]]\nalpha_deg = 90\nstiffness_N_m_per_rad = 1000\n[[joint]]\n\
         a_m = 1\nstiffness_N_m_per_rad = 1000\n[joint.beam]\nname = 'A'\nmass_kg = 4\nEIy_N_m2 = 1000\nEIz_N_m2 = 1000\n\
         [joint.beam.hoist]\nat_mm = [500, 0, 0]\nforce_N = 39.2266\n[[joint]]\na_m = 0.5\n",
    );
    let arm = Arm::nominal(&problem);
    let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
    for step in -80..80 {
        for hoist in [39.2266, 39.227, 39.2] {
            let angle = f64::from(step) * 0.017;
            let configuration = [0.3, angle, -0.7 * angle, 0.2];
            let setup = Setup { hoist: Some(hoist), ..Setup::of(&configuration) };
            arm.equilibrate(&setup, &mut ws, &mut rest).unwrap();
        }
    }
}

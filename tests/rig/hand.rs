//! Hand calculations: a straight arm of one link, clamped or on one joint.

use flexcal::problem::{Effect, FreeLength, PoseConditions, Problem};
use nalgebra::Vector3;

use super::bench::{effect, position};
use super::common::arms::parse;

const G: f64 = 9.80665;
/// Length [m], EI and GJ [N·m²], EA [N] of the link.
const LENGTH: f64 = 2.0;
const EI: f64 = 4.0e4;
const GJ: f64 = 3.0e4;
const EA: f64 = 1.0e7;

/// Returns a horizontal cantilever along x whose end is measured; `beam` is added to its section.
fn cantilever(a: f64, beam: &str, tool: &str) -> Problem {
    parse(&format!(
        "name = 'cantilever'\n[[joint]]\na_m = {a}\n[joint.beam]\nname = 'A'\nEA_N = {EA}\nEIy_N_m2 = {EI}\n\
         EIz_N_m2 = {EI}\nGJ_N_m2 = {GJ}\n{beam}\n[tool]\n{tool}\n[data]\nreference_temperature_C = 20\n"
    ))
}

/// Returns a rigid horizontal link of 2 m behind one joint.
fn rigid() -> Problem {
    parse(
        "name = 'rigid'\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 2\nkind = 'fixed'\n\
         [data]\nreference_temperature_C = 20\n",
    )
}

fn at(payload: f64) -> PoseConditions {
    PoseConditions {
        configuration: vec![0.0; 2],
        payload: Some(payload),
        ..PoseConditions::default()
    }
}

fn near(is: f64, expected: f64, relative: f64) {
    assert!((is - expected).abs() <= relative * expected.abs(), "{is} instead of {expected}");
}

#[test]
fn a_payload_bends_a_cantilever_by_pl3_over_3ei() {
    for a in [LENGTH, -LENGTH] {
        let end = position(&cantilever(a, "", ""), Vec::new(), &at(0.5));
        near(end.z, -0.5 * G * LENGTH.powi(3) / (3.0 * EI), 1e-6);
        near(end.x, a, 1e-6);
    }
    let heavier = vec![effect(&cantilever(LENGTH, "", ""), Effect::PayloadMass, &[0.25])];
    let end = position(&cantilever(LENGTH, "", ""), heavier.clone(), &at(0.5));
    near(end.z, -0.75 * G * LENGTH.powi(3) / (3.0 * EI), 1e-6);
    assert!(position(&cantilever(LENGTH, "", ""), heavier, &at(0.0)).z.abs() < 1e-15);
}

#[test]
fn its_own_weight_bends_it_by_wl4_over_8ei() {
    let end = position(&cantilever(LENGTH, "mass_kg = 1", ""), Vec::new(), &at(0.0));
    near(end.z, -G * LENGTH.powi(3) / (8.0 * EI), 1e-6);
}

#[test]
fn a_mass_on_the_way_bends_it_by_p_s2_3l_minus_s_over_6ei() {
    let s = 0.7;
    let expected = -G * s * s * (3.0 * LENGTH - s) / (6.0 * EI);
    let carried = format!("[[joint.beam.mass]]\nmass_kg = 1\nat_m = [{s}, 0, 0]");
    near(position(&cantilever(LENGTH, &carried, ""), Vec::new(), &at(0.0)).z, expected, 1e-6);
    for a in [LENGTH, -LENGTH] {
        let arm = cantilever(a, "", "");
        let hidden = effect(&arm, Effect::UnmodelledMass { link: "A".to_owned() }, &[1.0, s]);
        near(position(&arm, vec![hidden], &at(0.0)).z, expected, 1e-6);
    }
}

#[test]
fn an_offset_payload_twists_it_by_ml_over_gj() {
    let arm = cantilever(LENGTH, "", "target_m = [0, 0.1, 0]\npayload_at_m = [0, 0.1, 0]");
    let end = position(&arm, Vec::new(), &at(0.1));
    let bending = 0.1 * G * LENGTH.powi(3) / (3.0 * EI);
    let twist = 0.1 * G * 0.1 * LENGTH / GJ;
    near(end.z, -bending - twist * 0.1, 1e-6);
}

#[test]
fn gravity_along_it_stretches_it_by_pl_over_ea() {
    let mut arm = cantilever(LENGTH, "", "");
    arm.gravity = Vector3::new(G, 0.0, 0.0);
    near(position(&arm, Vec::new(), &at(5.0)).x - LENGTH, 5.0 * G * LENGTH / EA, 1e-6);
}

#[test]
fn a_hanging_soft_joint_comes_to_rest_and_a_column_that_buckles_does_not() {
    let mut arm = parse(
        "name = 'pendulum'\n[[joint]]\nalpha_deg = 90\ntheta_deg = -80\nstiffness_N_m_per_rad = 20\n\
         [[joint]]\na_m = 2\nkind = 'fixed'\n",
    );
    // M = P L cos(−80° + φ) lets the joint sag by φ = −M/20, from an iteration that overshoots.
    let end = position(&arm, Vec::new(), &at(10.0));
    let angle = end.z.atan2(end.x);
    near(angle - (-80.0_f64).to_radians(), -10.0 * G * 2.0 * angle.cos() / 20.0, 1e-9);
    arm.joints[0].theta = 100.0_f64.to_radians();
    let standing = flexcal::rig::Rig::new(arm, Vec::new()).position(&at(10.0));
    if let Ok(end) = standing {
        // It may fall over and hang.
        assert!(end.z < 0.0);
    }
}

#[test]
fn warmth_lengthens_and_bows_a_link() {
    let warm = PoseConditions { temperature: Some(35.0), ..at(0.0) };
    for a in [LENGTH, -LENGTH] {
        let arm = cantilever(a, "", "");
        let link = || "A".to_owned();
        let longer = effect(&arm, Effect::LinkThermalExpansion { link: link() }, &[12e-6]);
        near(position(&arm, vec![longer.clone()], &warm).x, a * (1.0 + 12e-6 * 15.0), 1e-14);
        assert_eq!(position(&arm, vec![longer], &at(0.0)).x, a);
        // A bent link is an arc: κ = k (T − T₀), z = −(1 − cos κL)/κ, the same on either side of the
        // clamp.
        let bowed = effect(&arm, Effect::LinkThermalBending { link: link() }, &[1e-5, -2e-5]);
        let end = position(&arm, vec![bowed], &warm);
        let height = |curvature: f64| -(1.0 - (curvature * LENGTH).cos()) / curvature;
        near(end.z, height(15e-5), 1e-6);
        near(end.y, height(30e-5), 1e-6);
    }
}

#[test]
fn compliances_tilt_by_the_moment() {
    let arm = rigid();
    let (weight, arm_length) = (3.0 * G, 2.0);
    let moment = weight * arm_length;
    let drop =
        |cause, values: &[f64]| -position(&arm, vec![effect(&arm, cause, values)], &at(3.0)).z;
    // The moment of the payload is about +y of the base, which is −z of joint 1.
    near(drop(Effect::BaseCompliance, &[0.0, 1e-7]), 1e-7 * moment * arm_length, 1e-9);
    assert!(drop(Effect::BaseCompliance, &[1e-7, 0.0]).abs() < 1e-15);
    near(drop(Effect::JointCompliance { joint: 1 }, &[1e-7]), 1e-7 * moment * arm_length, 1e-9);
    near(
        drop(Effect::JointNonlinearStiffness { joint: 1 }, &[1e-11]),
        1e-11 * moment.powi(3) * arm_length,
        1e-9,
    );
    // The load has no moment about x and y of joint 1.
    assert!(drop(Effect::JointLateralCompliance { joint: 1 }, &[1e-7, 1e-7]).abs() < 1e-15);
    // In the frame of joint 2, whose z is also along −y, y is upward and x along the link.
    let mut upright = rigid();
    upright.joints[0].alpha = 0.0;
    let tilted = effect(&upright, Effect::JointLateralCompliance { joint: 1 }, &[0.0, 1e-7]);
    near(position(&upright, vec![tilted], &at(3.0)).z, -1e-7 * moment * arm_length, 1e-9);
}

#[test]
fn a_spring_lifts_what_a_joint_carries() {
    // A right triangle of 0.3, 0.4 and 0.5 m at the joint, whose y is upward: the spring is 0.3 m
    // longer than free, and its line is 0.24 m from the axis.
    let mut arm = rigid();
    arm.joints[0].stiffness = Some(1e7);
    let spring = |anchor| Effect::GravityCompensator {
        joint: 1,
        anchor,
        lever: [0.3, 0.0],
        free_length: FreeLength(0.2),
    };
    let turned = |cause, values: &[f64]| {
        let end = position(&arm, vec![effect(&arm, cause, values)], &at(3.0));
        end.z.atan2(end.x) * 1e7 + 3.0 * G * 2.0
    };
    near(turned(spring([0.0, 0.4]), &[500.0, 0.0]), 500.0 * 0.3 * 0.24, 1e-4);
    near(turned(spring([0.0, 0.4]), &[0.0, 70.0]), 70.0 * 0.24, 1e-4);
    near(turned(spring([0.0, -0.4]), &[500.0, 70.0]), -(500.0 * 0.3 + 70.0) * 0.24, 1e-4);
    // A spring on a rigid arm has no effect.
    let stiff = rigid();
    let still =
        position(&stiff, vec![effect(&stiff, spring([0.0, 0.4]), &[500.0, 70.0])], &at(3.0));
    assert!(still.z.abs() < 1e-15);
}

#[test]
fn the_tracker_scales_drifts_and_shifts() {
    let arm = rigid();
    let late = PoseConditions { time: 500.0, elapsed: 400.0, ..at(0.0) };
    let shift = |cause, values: &[f64], conditions| {
        position(&arm, vec![effect(&arm, cause, values)], conditions) - Vector3::new(2.0, 0.0, 0.0)
    };
    let is = |found: Vector3<f64>, expected: [f64; 3]| {
        assert!((found - Vector3::from(expected)).norm() < 1e-14);
    };
    is(shift(Effect::TrackerScale, &[1e-4], &late), [2e-4, 0.0, 0.0]);
    is(shift(Effect::TrackerDrift, &[1e-6, 0.0, 2e-6], &late), [4e-4, 0.0, 8e-4]);
    let step = [1e-4, 2e-4, 3e-4];
    is(shift(Effect::StationShift { at_time: 500.0 }, &step, &late), step);
    is(shift(Effect::StationShift { at_time: 501.0 }, &step, &late), [0.0; 3]);
    // A quarter turn about z moves (2, 0, 0) to (0, 2, 0), followed by the translation.
    let quarter = [1e-4, 2e-4, 3e-4, 0.0, 0.0, std::f64::consts::FRAC_PI_2];
    is(
        shift(Effect::StationMove { at_time: 500.0 }, &quarter, &late),
        [1e-4 - 2.0, 2.0 + 2e-4, 3e-4],
    );
    is(shift(Effect::StationMove { at_time: 501.0 }, &quarter, &late), [0.0; 3]);
}

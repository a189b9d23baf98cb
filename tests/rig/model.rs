//! Closed-form beams compared with the rig, on arms with every declarable feature.

use flexcal::mechanics::{Arm, StaticState, Workspace};
use flexcal::problem::Problem;
use flexcal::problem::{PoseConditions, PoseView};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::bench::position;
use super::common::arms::parse;

/// Different bending stiffnesses, links along −x, prismatic and fixed joints, an inclined rope,
/// oblique gravity.
const ARM: &str = "
name = 'odd'
gravity_m_s2 = [1.0, -2.0, -9.0]
[[joint]]
stiffness_N_m_per_rad = 3e4
beta_deg = 20
[[joint]]
alpha_deg = 80
a_m = -1.2
stiffness_N_m_per_rad = 2e4
[joint.beam]
name = 'A'
mass_kg = 5
EA_N = 1e7
EIy_N_m2 = 1e4
EIz_N_m2 = 3e4
GJ_N_m2 = 8e3
[[joint.beam.mass]]
mass_kg = 1.5
at_m = [-0.5, 0.1, -0.2]
[joint.beam.hoist]
at_m = [-0.8, 0.05, 0.1]
force_N = 50
direction = [0.2, -0.1, 1]
[[joint.body]]
mass_kg = 2
com_m = [0.1, 0.2, 0.3]
[[joint]]
kind = 'prismatic'
alpha_deg = 30
d_m = 0.2
stiffness_N_m_per_rad = 1e4
[[joint]]
kind = 'fixed'
alpha_deg = -50
theta_deg = 25
a_m = 0.9
[joint.beam]
name = 'B'
mass_kg = 2
EIz_N_m2 = 5e3
GJ_N_m2 = 4e3
[[joint]]
alpha_deg = 70
a_m = 0.4
d_m = 0.1
[tool]
target_m = [0.2, 0.1, -0.1]
payload_at_m = [0.1, 0.0, 0.3]
";

fn closed_form(problem: &Problem, set: &PoseConditions) -> Vector3<f64> {
    let mut arm = Arm::nominal(problem);
    arm.beam_elements = 12;
    let setup = PoseView {
        payload: set.payload.as_ref(),
        hoist: set.hoist.as_ref(),
        ..PoseView::from_configuration(&set.configuration)
    };
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    arm.equilibrate(&setup, &mut ws, &mut rest).unwrap();
    rest.frame.point(&problem.tool.target)
}

#[test]
fn closed_forms_and_segments_agree_on_every_kind_of_arm() {
    let arm = parse(ARM);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut worst, mut deflection) = (0.0_f64, 0.0_f64);
    for _ in 0..40 {
        let mut configuration: Vec<f64> = (0..5).map(|_| random.random_range(-1.5..1.5)).collect();
        (configuration[2], configuration[3]) = (0.2 * configuration[2], 0.0);
        let set = PoseConditions {
            configuration,
            payload: Some(random.random_range(0.0..3.0)),
            hoist: Some(random.random_range(30.0..60.0)),
            ..PoseConditions::default()
        };
        let seen = position(&arm, Vec::new(), &set);
        worst = worst.max((seen - closed_form(&arm, &set)).norm() * 1e3);
        let straight = super::bench::stiffer(arm.clone(), 0.0, 0.0, 0.0);
        deflection = deflection.max((seen - position(&straight, Vec::new(), &set)).norm() * 1e3);
    }
    println!(
        "closed forms and segments differ by {worst:.5} mm; the arm deflects by {deflection:.1} mm"
    );
    assert!(worst < 0.003, "{worst} mm");
}

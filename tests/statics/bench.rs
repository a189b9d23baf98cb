//! Shared fixtures of the statics tests.

use flexcal::mechanics::{
    Angle, Arm, Beam, Flexibility, Joint, StaticState, StaticsError, Workspace,
};
use flexcal::problem::PoseView;
use flexcal::problem::{Equilibrium, JointKind, Tree};
use flexcal::spatial::Frame;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::common::arms::{ODD, golden_problem, parse};
use super::common::made::at_random;

pub const GRAVITY: f64 = 9.81;
pub const LENGTH: f64 = 1.6;
/// Flexibility of a beam so stiff that its deflection is linear to eight digits.
pub const STIFF: Flexibility<f64> =
    Flexibility { axial: 2e-9, about_y: 3e-7, about_z: 5e-7, twist: 7e-7, coupling: None };

pub const TARGET: Vector3<f64> = Vector3::new(0.22, 0.05, -0.09);

pub fn joint(a: f64) -> Joint<f64> {
    Joint {
        motion: None,
        nonlinear: None,
        lateral: None,
        slide: None,
        compensator: None,
        kind: JointKind::Fixed,
        placement: None,
        alpha: Angle::new(0.0),
        a,
        theta: 0.0,
        d: 0.0,
        beta: Angle::new(0.0),
        flexibility: None,
        beam: None,
        bodies: Vec::new(),
        body_error: None,
    }
}

pub fn beam(a: f64, mass: f64, flexibility: Flexibility<f64>) -> Joint<f64> {
    let beam =
        Beam { mass, flexibility, masses: Vec::new(), hoist: None, strain: None, added: None };
    Joint { beam: Some(beam), ..joint(a) }
}

/// Returns an arm under gravity along −z, with loads on the deformed arm and one element per beam.
pub fn arm(joints: Vec<Joint<f64>>) -> Arm<f64> {
    Arm {
        payload_error: 0.0,
        rope: None,
        mounting: None,
        mixing: None,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        equilibrium: Equilibrium::Deflected,
        beam_elements: 1,
        joints,
        tree: Tree::default(),
        payload_on: None,
        payload_at: Vector3::zeros(),
        payload_mass: 0.0,
    }
}

pub fn frame(arm: &Arm<f64>, q: &[f64]) -> Result<Frame<f64>, StaticsError> {
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    let still = vec![0.0; arm.joints.len()];
    let configuration = if q.is_empty() { &still } else { q };
    arm.equilibrate(&PoseView::from_configuration(configuration), &mut ws, &mut rest)?;
    Ok(rest.frame)
}

pub fn position(arm: &Arm<f64>, q: &[f64], target: &Vector3<f64>) -> Vector3<f64> {
    frame(arm, q).unwrap().point(target)
}

/// Returns the same arm without elasticity.
pub fn rigid(arm: &Arm<f64>) -> Arm<f64> {
    let mut arm = arm.clone();
    for joint in &mut arm.joints {
        (joint.flexibility, joint.slide, joint.beam) = (None, None, None);
    }
    arm
}

/// Multiplies the flexibilities by `factor`.
pub fn softer(arm: &Arm<f64>, factor: f64) -> Arm<f64> {
    let mut arm = arm.clone();
    for joint in &mut arm.joints {
        joint.flexibility = joint.flexibility.map(|flexibility| flexibility * factor);
        if let Some(Beam { flexibility: all, .. }) = &mut joint.beam {
            for flexibility in [&mut all.axial, &mut all.about_y, &mut all.about_z, &mut all.twist]
            {
                *flexibility *= factor;
            }
        }
    }
    arm
}

/// Returns both arms of the tests, each with some configurations.
pub fn arms() -> [(Arm<f64>, Vec<Vec<f64>>); 2] {
    [golden_problem(), parse(ODD)].map(|problem| {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let rows = at_random(&problem, 8, 2.5, &mut rng);
        let mut arm = Arm::nominal(&problem);
        arm.payload_mass = 1.5;
        (arm, (0..rows.len()).map(|row| rows.configuration(row).to_vec()).collect())
    })
}

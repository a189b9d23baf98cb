//! Limits: many elements, no loads, small deflections, and loads without an equilibrium.

use flexcal::fit::Placement;
use flexcal::mechanics::{Arm, StaticState, StaticsError, Workspace};
use flexcal::model::PoseResiduals;
use flexcal::problem::Equilibrium;
use flexcal::problem::PoseView;
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::bench::{TARGET, arms, frame, position, rigid, softer};
use super::common::arms::{golden_problem, parse};
use super::common::made::{at_random, model_of};

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
                let worst = configurations
                    .iter()
                    .zip(&finest)
                    .map(|(q, fine)| (at(elements, q) - fine).norm());
                worst.fold(0.0, f64::max)
            })
            .to_vec();
        println!("1, 2, 4, 8 elements: {errors:?} m");
        assert!(errors.windows(2).all(|pair| pair[1] < 0.4 * pair[0]), "{errors:?}");
        assert!(errors[0] < 1e-4);
    }
}

#[test]
fn without_gravity_and_rope_nothing_bends() {
    for (mut arm, configurations) in arms() {
        arm.gravity = Vector3::zeros();
        arm.joints
            .iter_mut()
            .filter_map(|joint| joint.beam.as_mut())
            .for_each(|beam| beam.hoist = None);
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
        assert_eq!(
            frame(&softer(&nominal, 1e9), &configurations[0]).unwrap_err(),
            StaticsError::NotSettled
        );
    }
}

#[test]
fn a_pose_without_equilibrium_has_no_residual() {
    let problem = golden_problem();
    let rows = at_random(&problem, 3, 1.0, &mut ChaCha8Rng::seed_from_u64(1));
    let model = model_of(&problem, &rows);
    // Stiffnesses are 10⁻⁹ of nominal.
    let soft = model
        .parameters
        .iter()
        .map(|parameter| if parameter.site.is_elastic() { 1e-9_f64.ln() } else { 0.0 });
    let x = DVector::from_iterator(model.parameters.len(), soft);
    let poses = Placement::of(&rows).poses(&rows, &[0, 1, 2], 1e-3);
    let residuals = PoseResiduals::new(&model, poses, (0..x.len()).collect(), x.clone());
    assert!(residuals.position_errors(&x).iter().all(|error| error.iter().all(|e| e.is_nan())));
    let jacobian = flexcal::least_squares::jacobian(&residuals, &x);
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
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    for step in -80..80 {
        for hoist in [39.2266, 39.227, 39.2] {
            let angle = f64::from(step) * 0.017;
            let configuration = [0.3, angle, -0.7 * angle, 0.2];
            let setup =
                PoseView { hoist: Some(&hoist), ..PoseView::from_configuration(&configuration) };
            let found = arm.equilibrate(&setup, &mut ws, &mut rest);
            assert!(found.is_ok(), "{angle} rad, {hoist} N: {found:?}");
        }
    }
}

//! Recovery of declared effects from 28 noisy poses, within their errors.

use flexcal::fit::{Identification, Options, identify, identify_model};
use flexcal::measurement::Measurements;
use flexcal::model::Ablation;
use flexcal::problem::{Effect, Problem};
use flexcal::rig::Rig;
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::{conditions, declared, in_truth, lunar, odd, of_effects, poses, strengths};
use crate::common::arms::{ODD, parse, path};
use crate::common::made::{divided, draw, labels, measure, model_of, normal};

/// Standard deviation of a coordinate [m].
const NOISE: f64 = 2e-5;

/// Checks the estimates of effects: within 4 σ of the truth, and more accurate than the prior.
fn check(problem: &Problem, rows: &Measurements, truth: &DVector<f64>, found: &Identification) {
    let model = model_of(problem, rows);
    assert!(found.is_trusted(), "{:?}", found.findings);
    for k in of_effects(&model) {
        let (parameter, estimate) = (&model.parameters[k], &found.estimates[k]);
        let error = estimate.std_error.unwrap();
        let off = (estimate.estimate - parameter.value(truth[k])) / error;
        println!(
            "{:34} {:11.3e} ± {error:8.2e}, {off:5.2} σ off",
            estimate.name, estimate.estimate
        );
        assert!(off.abs() < 4.0, "{}: {off} σ off", estimate.name);
        assert!(error < 0.9 * parameter.sigma.unwrap(), "{}: nothing learned", estimate.name);
    }
}

#[test]
fn every_effect_is_found_beside_the_arm_s_own_errors() {
    let (arm, all) = lunar();
    // The lunar sampler has no prismatic joint.
    let (with_slide, more) = odd();
    let slides = more.iter().filter(|(effect, _)| matches!(effect, Effect::SlideBending { .. }));
    let cases =
        all.iter().map(|strong| (&arm, strong)).chain(slides.map(|strong| (&with_slide, strong)));
    for (number, (arm, (effect, values))) in cases.enumerate() {
        let mut arm = arm.clone();
        arm.data.position_sigma = Some(NOISE);
        let problem = declared(&arm, std::slice::from_ref(effect));
        let mut rng = ChaCha8Rng::seed_from_u64(100 + number as u64);
        let mut rows = poses(&problem, 36, true, &mut rng);
        let model = model_of(&problem, &rows);
        // Errors are as large as those of a real arm; the priors of the problem are wider.
        let mut truth = 0.3 * draw(&model, |_| 0.0, &mut rng);
        let strong = strengths(&model, values);
        for k in of_effects(&model) {
            truth[k] = strong[k];
        }
        measure(&problem, &mut rows, &truth, NOISE, &mut rng);
        let found = identify(&problem, &divided(28, &rows), &Options::default()).unwrap();
        check(&problem, &rows, &truth, &found);
    }
}

#[test]
fn several_effects_of_the_rig_are_found_at_once() {
    for (mut arm, all) in [lunar(), odd()] {
        arm.data.position_sigma = Some(NOISE);
        arm.statics.beam_elements = 4;
        let chosen = |effect: &Effect| {
            matches!(
                effect,
                Effect::GearRatio { .. }
                    | Effect::JointHarmonic { .. }
                    | Effect::LinkThermalBending { .. }
                    | Effect::PayloadMass
                    | Effect::TrackerDrift
            )
        };
        let some: Vec<_> = all.into_iter().filter(|(effect, _)| chosen(effect)).collect();
        let effects: Vec<Effect> = some.iter().map(|(effect, _)| effect.clone()).collect();
        let values: Vec<f64> = some.iter().flat_map(|(_, values)| values.clone()).collect();
        // Waves of a prismatic joint are long compared with its travel, so their prior must be
        // wide.
        if arm.name == "odd" {
            arm.parameters.extend(
                parse(&format!("{ODD}\n\"*-harmonic.*\" = {{ sigma_mm = 5.0 }}")).parameters.pop(),
            );
        }
        let problem = declared(&arm, &effects);
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut rows = poses(&problem, 36, true, &mut rng);
        let rig = Rig::new(arm.clone(), some.iter().map(|effect| in_truth(&arm, effect)).collect());
        for row in 0..rows.len() {
            let noise = Vector3::from_fn(|_, _| NOISE * normal(&mut rng));
            rows.positions[row] = rig.position(&conditions(&rows, row)).unwrap() + noise;
        }
        let found = identify(&problem, &divided(28, &rows), &Options::default()).unwrap();
        check(&problem, &rows, &strengths(&model_of(&problem, &rows), &values), &found);
    }
}

#[test]
fn sessions_are_registered_with_the_effects_at_work() {
    let mut arm = Problem::read(&path("problems/ur10-ipa")).unwrap();
    arm.data.position_sigma = Some(NOISE);
    let problem = declared(
        &arm,
        &[Effect::GearRatio { joint: 3 }, Effect::JointHarmonic { joint: 2, orders: vec![1] }],
    );
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let mut rows = poses(&problem, 50, false, &mut rng);
    rows.session = labels((0..50).map(|k| ["A", "B", "C"][(k / 20).min(2)]));
    let model = model_of(&problem, &rows);
    let mut truth = draw(&model, |_| 0.3, &mut rng);
    let strong = strengths(&model, &[4e-3, 1e-3, 2e-3]);
    for k in of_effects(&model) {
        truth[k] = strong[k];
    }
    measure(&problem, &mut rows, &truth, NOISE, &mut rng);
    let found = identify(&problem, &divided(40, &rows), &Options::default()).unwrap();
    check(&problem, &rows, &truth, &found);
    let held_out = found.fitted.held_out.rms.norm;
    assert!(held_out < 4.0 * NOISE, "{held_out} m");
}

#[test]
fn every_part_of_the_elasticity_can_be_left_out_with_effects_declared() {
    let (mut arm, all) = lunar();
    arm.data.position_sigma = Some(NOISE);
    let chosen = |effect: &Effect| {
        matches!(
            effect,
            Effect::GearRatio { .. }
                | Effect::Backlash { .. }
                | Effect::LinkThermalExpansion { .. }
                | Effect::BaseCompliance
        )
    };
    let some: Vec<_> = all.into_iter().filter(|(effect, _)| chosen(effect)).collect();
    let effects: Vec<Effect> = some.iter().map(|(effect, _)| effect.clone()).collect();
    let values: Vec<f64> = some.iter().flat_map(|(_, values)| values.clone()).collect();
    let problem = declared(&arm, &effects);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut rows = poses(&problem, 36, true, &mut rng);
    let truth = strengths(&model_of(&problem, &rows), &values);
    measure(&problem, &mut rows, &truth, NOISE, &mut rng);
    let model = model_of(&problem, &rows);
    let identify = |ablation: Ablation| {
        identify_model(&model.ablated(ablation), &problem, &divided(28, &rows), &Options::default())
            .unwrap()
    };
    let ablations = Ablation::EACH.map(|ablation| (ablation, identify(ablation)));
    for (ablation, found) in &ablations {
        let estimate = |name: &str| found.estimate(name);
        let of_geometry =
            ["gear-ratio[3].error", "backlash[3].width", "link-thermal-expansion[B].strain"];
        for name in of_geometry {
            let learned = estimate(name).unwrap().identified;
            assert!(learned > 0.5, "{}: {name} is not seen: {learned}", ablation.as_str());
        }
        let bases = ["joints-only", "all"].contains(&ablation.as_str());
        assert_eq!(estimate("base-compliance.about_x").is_some(), bases, "{}", ablation.as_str());
    }
    let rms = |k: usize| ablations[k].1.fitted.held_out.rms.norm;
    assert!(rms(4) < 0.1 * rms(0) && rms(4) < 5.0 * NOISE, "{} and {} m", rms(0), rms(4));
}

#[test]
fn effects_that_the_columns_cannot_show_are_refused() {
    let (arm, _) = odd();
    let cases = [
        (Effect::JointThermalDrift { joint: 1 }, "a column temperature_C"),
        (Effect::Backlash { joint: 4 }, "columns approach1"),
    ];
    for (effect, words) in cases {
        let problem = declared(&arm, &[effect]);
        let mut rows = poses(&problem, 20, false, &mut ChaCha8Rng::seed_from_u64(12));
        rows.temperature = None;
        let error =
            identify(&problem, &divided(10, &rows), &Options::default()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

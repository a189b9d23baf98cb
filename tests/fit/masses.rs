//! A mass in another unit is named where compliances and a payload nearly make up for it.

use flexcal::fit::{FindingCode, Identification};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use nalgebra::DVector;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::common::arms::parse;
use crate::common::made::{at_random, divided, fit, fit_as_command, measure, model_of};
use crate::trusted::simulated;

/// Noise of a coordinate [m].
const SIGMA: f64 = 4e-5;
/// Number of fitted rows; as many again are held out.
const ROWS: usize = 40;
/// True compliance of joints 2 and 3 [rad/(N·m)].
const COMPLIANCES: [f64; 2] = [1.6e-5, 3.6e-5];

/// Returns an arm of four joints, two of which give way, with a forearm of `mass` kilograms.
fn arm(mass: f64) -> Problem {
    parse(&text(mass))
}

/// Returns the same arm with stiffnesses of the joints in place of compliances as effects.
fn arm_with_stiffnesses() -> Problem {
    let text = text(5.2);
    let mut text = text
        .split("[[effect]]")
        .next()
        .unwrap()
        .replace("[parameters]", "[parameters]\n'joint*.stiffness' = { sigma_relative = 0.3 }");
    for (alpha, compliance) in ["a_m = 0.1\n", "a_m = 0.6\n"].into_iter().zip(COMPLIANCES) {
        let stiffness = 1.0 / compliance;
        text = text.replace(alpha, &format!("{alpha}stiffness_N_m_per_rad = {stiffness}\n"));
    }
    parse(&text)
}

/// Returns the text of [`arm`].
fn text(mass: f64) -> String {
    format!(
        "name = 'arm'\n[[joint]]\nd_m = 0.4\n[[joint]]\nalpha_deg = -90\na_m = 0.1\n[[joint.body]]\nname = 'upper'\n\
         mass_kg = 8\ncom_m = [0.3, 0, 0]\n[[joint]]\na_m = 0.6\n[[joint.body]]\nname = 'fore'\nmass_kg = {mass:?}\n\
         com_m = [0.25, 0, 0]\n[[joint]]\na_m = 0.5\nalpha_deg = 90\n[tool]\ntarget_m = [0.1, 0.05, 0.1]\npayload_at = 'target'\n\
         [parameters]\n'joint*.theta' = {{ sigma_deg = 0.3 }}\n'joint*.a' = {{ sigma_mm = 1 }}\n\
         'base.*' = {{ free = true }}\n[data]\nposition_sigma_mm = 0.04\n[[effect]]\njoint-compliance = {{ joint = 2 }}\n\
         [[effect]]\njoint-compliance = {{ joint = 3 }}\n"
    )
}

/// Returns measurements of an arm with a forearm of 5.2 kg.
fn measured() -> Dataset {
    measurements_of(&arm(5.2))
}

/// Returns measurements of a true arm, with its compliances as effects, if it has any.
fn measurements_of(truth: &Problem) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut rows = at_random(truth, 2 * ROWS, 1.2, &mut rng);
    rows.payload = Some((0..rows.len()).map(|row| [0.0, 4.0, 8.0][row % 3]).collect());
    let model = model_of(truth, &rows);
    let value = |name: &str| match name {
        "joint-compliance[2].compliance" => COMPLIANCES[0],
        "joint-compliance[3].compliance" => COMPLIANCES[1],
        _ => 0.0,
    };
    let x = DVector::from_iterator(
        model.parameters.len(),
        model.parameters.iter().map(|parameter| value(&parameter.name)),
    );
    measure(truth, &mut rows, &x, SIGMA, &mut rng);
    divided(ROWS, &rows)
}

/// Fits an arm with a forearm of 5.2 kg that is declared with another mass.
fn declared_with(mass: f64) -> Identification {
    fit_as_command(&arm(mass), &measured())
}

#[test]
fn a_mass_with_a_misplaced_decimal_point_is_named() {
    let found = declared_with(52.0);
    let finding = found.finding(FindingCode::Misread).unwrap();
    let words = finding.to_string();
    assert!(words.contains("the mass of fore at joint 3"), "{words}");
    assert!(words.contains("multiplied by 0.1"), "{words}");
}

#[test]
fn a_mass_in_pounds_is_named_near_the_noise() {
    let found = declared_with(5.2 / 0.453_592_37);
    let finding = found.finding(FindingCode::Misread);
    let words = finding.unwrap_or_else(|| panic!("{:?}", found.findings)).to_string();
    assert!(words.contains("the mass of fore at joint 3 that is in pounds"), "{words}");
}

#[test]
fn a_mass_that_is_right_or_a_little_wrong_is_no_mistake_of_its_unit() {
    for mass in [5.2, 6.0, 8.0] {
        let found = declared_with(mass);
        assert!(!found.has(FindingCode::Misread), "{mass} kg: {:?}", found.findings);
    }
}

/// Function that puts a mistake into a problem.
type Mistake = fn(&mut Problem);

#[test]
fn wrong_places_of_masses_are_named_near_the_noise() {
    let cases: [(Mistake, &str); 2] = [
        (|arm| arm.joints[2].bodies[0].position.x *= -1.0, "x of the centre of mass of fore"),
        (
            |arm| {
                arm.tool.payload_follows = false;
                arm.tool.payload_at = nalgebra::Vector3::new(0.0, 0.0, -0.9);
            },
            "the payload at the measured target",
        ),
    ];
    for (change, words) in cases {
        let mut declared = arm(5.2);
        change(&mut declared);
        let found = fit_as_command(&declared, &measured());
        let finding = found.finding(FindingCode::Misread);
        let finding = finding.unwrap_or_else(|| panic!("{words}: {:?}", found.findings));
        assert!(finding.to_string().contains(words), "{words}: {finding}");
    }
}

#[test]
fn payloads_of_the_next_row_are_named() {
    let mut data = measured();
    data.measurements.payload.as_mut().unwrap().rotate_right(1);
    let found = fit_as_command(&arm(5.2), &data);
    let finding = found.finding(FindingCode::Misread);
    let words = finding.unwrap_or_else(|| panic!("{:?}", found.findings)).to_string();
    assert!(words.contains("payloads that belong to the configuration 1 row before"), "{words}");
}

#[test]
fn gravity_of_the_wrong_sign_is_named_where_stiffnesses_are_declared() {
    let truth = arm_with_stiffnesses();
    let data = measurements_of(&truth);
    assert!(!fit_as_command(&truth, &data).has(FindingCode::Misread));
    for axis in [2, 0] {
        let mut wrong = truth.clone();
        wrong.gravity = nalgebra::Vector3::ith(axis, 9.80665);
        let found = fit_as_command(&wrong, &data);
        let finding = found.finding(FindingCode::Misread);
        let words = finding.unwrap_or_else(|| panic!("{:?}", found.findings)).to_string();
        assert!(words.contains("gravity that points along −z"), "{words}");
    }
}

#[test]
fn an_arm_that_bends_against_its_load_is_named() {
    let arm = "name = 'arm'\n[[joint]]\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 0.8\n\
               [tool]\ntarget_m = [0.5, 0.1, 0]\npayload_kg = 8\n\
               [data]\nposition_sigma_mm = 0.02\n\
               [parameters]\n'joint*.theta' = { sigma_deg = 0.3 }\n\
               [[effect]]\njoint-compliance = { joint = 2 }\n";
    let problem = parse(arm);
    let data = simulated(&problem, &[("joint-compliance[2].compliance", 4e-5)], [40, 15], 21);
    let upright = fit(&problem, &data);
    assert!(upright.is_trusted() && !upright.has(FindingCode::GivesWayUpwards));
    let mut inverted = problem.clone();
    inverted.gravity = -problem.gravity;
    let found = fit(&inverted, &data);
    let finding = found.finding(FindingCode::GivesWayUpwards).unwrap();
    assert_eq!(finding.word("parameter"), Some("joint-compliance[2].compliance"));
    assert!((finding.number("compliance").unwrap() + 4e-5).abs() < 2e-6, "{finding}");
    assert!(finding.remedy.contains("write gravity_m_s2 = [0, 0, -9.80665]"), "{finding}");
}

#[test]
fn payloads_in_pounds_in_some_rows_are_named() {
    let mut data = measured();
    let payloads = data.measurements.payload.as_mut().unwrap();
    payloads[..20].iter_mut().for_each(|payload| *payload /= 0.453_592_37);
    let found = fit_as_command(&arm(5.2), &data);
    let text = found.finding(FindingCode::Misread).map(ToString::to_string);
    let is_named = |text: &String| text.contains("payloads before") && text.contains("in pounds");
    assert!(text.as_ref().is_some_and(is_named), "{text:?}");
}

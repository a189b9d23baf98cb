//! Parameters of the geometry that the problem holds or confines by priors, although they deviate,
//! are named.

use flexcal::fit::FindingCode;

use nalgebra::{Rotation3, Vector3};

use crate::common::arms::parse;
use crate::common::made::{fit, fit_as_command};
use crate::judged::{PRIORS, measured, text};
use crate::trusted::simulated;

#[test]
fn a_held_parameter_that_causes_the_misfit_is_named() {
    let free = parse(&text(PRIORS));
    let data = measured(&free, 4);
    let found = fit_as_command(&free, &data);
    assert!(!found.has(FindingCode::HeldParameter), "{:?}", found.findings);

    let holding = |names: &[&str]| {
        let held: Vec<String> =
            names.iter().map(|name| format!("\n'{name}' = {{ fixed = true }}")).collect();
        fit_as_command(&parse(&text(&format!("{PRIORS}{}", held.concat()))), &data)
    };
    let held = holding(&["joint3.alpha"]);
    let finding = held.finding(FindingCode::HeldParameter);
    let words = finding.unwrap_or_else(|| panic!("{:?}", held.findings)).to_string();
    assert!(words.contains("joint3.alpha is held at its nominal value"), "{words}");
    assert!(words.contains("\"joint3.alpha\" = { sigma_deg = 1.0 }"), "{words}");
    let [before, after] = ["before", "after"].map(|name| finding.unwrap().number(name).unwrap());
    assert!(before > 3.0 * after && after < 2e-4, "{before} {after}");

    // Two that are held cause it together.
    let two = holding(&["joint3.alpha", "joint4.d"]).findings;
    let held = two.iter().find(|finding| finding.code == FindingCode::HeldParameter);
    let words = held.unwrap_or_else(|| panic!("{two:?}")).to_string();
    assert!(words.contains("are held at their nominal values"), "{words}");
    assert!(words.contains("free both in [parameters]: \"joint3.alpha\" = {"), "{words}");

    // Many that are held cause it together, so that none explains most of it alone.
    let many = holding(&["joint*.*"]);
    assert!(many.has(FindingCode::NoiseBeyondDeclared), "{:?}", many.findings);
    assert!(!many.has(FindingCode::HeldParameter), "{:?}", many.findings);
}

#[test]
fn a_held_base_that_moved_in_several_ways_is_named() {
    let problem = parse(&text("'joint3.a' = { sigma_mm = 1 }"));
    let mut moved = measured(&problem, 2);
    let turn = Rotation3::new(Vector3::new(6e-3, -4e-3, 5e-3));
    let shift = Vector3::new(5e-3, -6e-3, 4e-3);
    moved.measurements.positions.iter_mut().for_each(|at| *at = turn * *at + shift);
    let found = fit_as_command(&problem, &moved);
    let finding = found.finding(FindingCode::HeldParameter);
    let words = finding.unwrap_or_else(|| panic!("{:?}", found.findings)).to_string();
    assert!(words.contains("base.* is held") && words.contains("= { free = true }"), "{words}");
}

#[test]
fn a_held_base_is_offered_before_the_joint_that_acts_as_it_does() {
    let problem = parse(&text("'joint3.a' = { sigma_mm = 1 }"));
    let mut moved = measured(&problem, 2);
    moved.measurements.positions.iter_mut().for_each(|position| position.z += 8e-3);
    let found = fit_as_command(&problem, &moved);
    let finding = found.finding(FindingCode::HeldParameter);
    let words = finding.unwrap_or_else(|| panic!("{:?}", found.findings)).to_string();
    assert!(words.contains("joint1.d is held"), "{words}");
    assert!(words.contains("\"base.*\" = { free = true }"), "{words}");
}

#[test]
fn deviations_far_beyond_their_priors_state_the_rule_that_allows_them() {
    let priors = "'joint*.a' = { sigma_mm = 2 }\n'joint*.alpha' = { sigma_deg = 0.3 }\n\
                  'joint*.d' = { sigma_mm = 2 }\n'joint*.theta' = { sigma_deg = 0.3 }\n\
                  'tool.*' = { sigma_mm = 2 }";
    let problem = parse(&text(priors));
    let truth = [
        ("joint1.a", 24e-3),
        ("joint2.a", 18e-3),
        ("joint3.a", -26e-3),
        ("joint4.a", 20e-3),
        ("joint5.a", -19e-3),
    ];
    let data = simulated(&problem, &truth, [80, 30], 3);
    let found = fit(&problem, &data);
    let beyond = found.finding(FindingCode::BeyondPrior).unwrap().to_string();
    println!("{beyond}");
    let (_, rule) = beyond.split_once("so far from nominal, write in [parameters] ").unwrap();
    assert!(rule.starts_with("\"joint*.a\" = { sigma_mm = "), "{beyond}");
    let rule = rule.split(" and ").next().unwrap();
    let allowed = parse(&text(&priors.replace("'joint*.a' = { sigma_mm = 2 }", rule)));
    let found = fit(&allowed, &data);
    assert!(found.is_trusted(), "{:?}", found.findings);
}

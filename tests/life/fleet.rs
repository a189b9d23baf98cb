//! What the estimates of several arms of one type say of the next one.

use std::path::Path;

use flexcal::fit::{Options, SavedEstimate};
use flexcal::life::{FleetPrior, PriorError, PriorSource, fleet, update};
use flexcal::problem::Problem;
use flexcal::results::Document as _;

use crate::bench::{Bench, whole, with_zero};
use crate::common::program::{Folder, assert_contains};

/// Poses to which each arm of the fleet was calibrated.
const FULL: usize = 40;
/// Spread from arm to arm, as a part of the deviation that all arms share.
const SPREAD: f64 = 0.2;

/// Returns arm number `number` of fleet `fleet`: what all arms share, and a smaller part of its
/// own. Base and tool are those of the set-up, drawn anew.
pub fn sibling(bench: &Bench, fleet: u64, number: u64) -> Problem {
    let (shared, single) = (bench.arm(7000 + fleet), bench.arm(100 * fleet + number));
    let nominal = &bench.problem;
    let mut arm = single.clone();
    for (k, joint) in arm.joints.iter_mut().enumerate() {
        let (a, b, n) = (&shared.joints[k], &single.joints[k], &nominal.joints[k]);
        let mixed = |a: f64, b: f64, n: f64| n + (a - n) + SPREAD * (b - n);
        joint.alpha = mixed(a.alpha, b.alpha, n.alpha);
        joint.theta = mixed(a.theta, b.theta, n.theta);
        joint.a = mixed(a.a, b.a, n.a);
        joint.d = mixed(a.d, b.d, n.d);
        if let (Some(a), Some(b), Some(n)) = (a.stiffness, b.stiffness, n.stiffness) {
            joint.stiffness = Some(n * (a / n) * (b / n).powf(SPREAD));
        }
    }
    arm
}

pub fn estimate(bench: &Bench, arm: &Problem, seed: u64) -> SavedEstimate {
    let rows = bench.measure(arm, FULL, 40_000 + seed, 1.0);
    let found = bench.calibrate(&rows);
    let mut saved = bench.saved(&found, &rows);
    saved.file = format!("arm-{seed}.json").into();
    saved
}

/// Returns the errors of a new arm with 6 poses: with the prior of the fleet, and with that of the
/// data sheet [m].
pub fn errors(bench: &Bench, number: u64, arms: u64) -> (f64, f64) {
    let estimates: Vec<SavedEstimate> =
        (0..arms).map(|k| estimate(bench, &sibling(bench, number, k), 1000 * number + k)).collect();
    let file = std::env::temp_dir().join(format!("PRIOR-{}-{number}.toml", std::process::id()));
    std::fs::write(&file, fleet(&estimates).unwrap().to_toml()).unwrap();
    let prior = PriorSource::Fleet(FleetPrior::read(&file).unwrap());
    std::fs::remove_file(&file).unwrap();
    let arm = sibling(bench, number, 99);
    let rows = bench.measure(&arm, 6, 60_000 + number, 1.0);
    let options = Options::default();
    let found = update(&bench.problem, &whole(&rows), &options, &prior, 0.0).unwrap().found;
    (bench.error(&found, &arm), bench.error(&bench.calibrate(&rows), &arm))
}

#[test]
fn a_new_arm_learns_from_its_siblings() {
    let bench = Bench::new();
    let (with, without) = errors(&bench, 1, 8);
    println!("{with:.2e} {without:.2e}");
    assert!(with < 0.7 * without, "{with} {without}");
}

#[test]
fn an_arm_unlike_its_siblings_is_named() {
    let bench = Bench::new();
    let mut estimates: Vec<SavedEstimate> =
        (0..7).map(|k| estimate(&bench, &sibling(&bench, 2, k), k)).collect();
    assert!(fleet(&estimates).unwrap().arms.iter().all(|arm| !arm.is_unlike));
    let odd = with_zero(&sibling(&bench, 2, 8), 3, 1.0);
    estimates.push(estimate(&bench, &odd, 8));
    let found = fleet(&estimates).unwrap();
    let unlike: Vec<_> = found.arms.iter().filter(|arm| arm.is_unlike).collect();
    assert_eq!(unlike.len(), 1, "{:?}", found.arms);
    assert_eq!(
        (&*unlike[0].file, &*unlike[0].most.as_ref().unwrap().0),
        (Path::new("arm-8.json"), "joint3.theta")
    );
}

#[test]
fn an_arm_counts_once_and_the_order_of_files_does_not_matter() {
    let bench = Bench::new();
    let estimates: Vec<SavedEstimate> =
        (0..3).map(|k| estimate(&bench, &sibling(&bench, 3, k), 300 + k)).collect();
    let twice = [&estimates[..], &estimates[..1]].concat();
    assert!(matches!(fleet(&twice), Err(PriorError::SameRows { rows: FULL, .. })));
    let backwards: Vec<SavedEstimate> = estimates.iter().rev().cloned().collect();
    let (a, b) = (fleet(&estimates).unwrap(), fleet(&backwards).unwrap());
    for (a, b) in a.parameters.iter().zip(&b.parameters) {
        assert!(a.name == b.name && (a.spread / b.spread - 1.0).abs() < 1e-9, "{a:?} {b:?}");
    }
    // Without a variance in one arm, a parameter is left out, whichever arm it is.
    let found = bench.calibrate(&bench.measure(&sibling(&bench, 3, 4), FULL, 77, 1.0));
    let text = flexcal::results::IdentificationResult::new(&bench.problem, &found).to_json();
    let mut document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let names = document["parameters"].as_array().unwrap();
    let k = names.iter().position(|entry| entry["name"] == "joint3.a").unwrap();
    document["covariance"][k][k] = serde_json::Value::Null;
    // As a file of an older version, which has no digests.
    document.as_object_mut().unwrap().remove("digest");
    document["format"]["version"] = 1.into();
    let held = SavedEstimate::parse(&document.to_string(), Path::new("held.json")).unwrap();
    for place in [0, 3] {
        let mut arms = estimates.clone();
        arms.insert(place, held.clone());
        let found = fleet(&arms).unwrap();
        assert_eq!(found.left_out, ["joint3.a"]);
        assert!(found.parameters.iter().all(|parameter| parameter.name != "joint3.a"));
    }
}

#[test]
fn the_command_writes_a_prior_that_identify_takes() {
    let folder = Folder::with_lunar_sampler();
    for case in ["a-none", "h-none-large", "c-link-thermal-bending"] {
        folder.copy(&format!("tests/cases/{case}.csv"), format!("{case}.csv"));
        folder.flexcal(&format!("identify problem.toml --data {case}.csv --out {case}"));
    }
    let two = folder.flexcal("fleet a-none/estimate.json h-none-large/estimate.json").code(2);
    assert_contains(&two.stderr, &["at least 3 arms"]);
    let files =
        "a-none/estimate.json h-none-large/estimate.json c-link-thermal-bending/estimate.json";
    let shown = folder.flexcal(&format!("fleet {files} --out PRIOR.toml")).success();
    assert_contains(&shown.stdout, &["3 arms", "spread", "PRIOR.toml takes them as the prior"]);
    let run = "identify problem.toml --data a-none.csv --prior PRIOR.toml --out with -v";
    assert_contains(
        &folder.flexcal(run).success().stdout,
        &["Prior against the new rows", "PRIOR.toml"],
    );
    let again = files.replace("a-none", "with");
    let twice = folder.flexcal(&format!("fleet {again} --out TWICE.toml")).code(2);
    assert_contains(&twice.stderr, &["prior from siblings"]);
}

//! Identification with an earlier estimate as prior.

use std::path::Path;

use flexcal::fit::{FindingCode, Identification, Options, SavedEstimate};
use flexcal::life::{PriorError, PriorSource, update, watch};
use flexcal::measurement::{Dataset, Split};
use flexcal::report::estimate_text;
use flexcal::results::{Document as _, IdentificationResult};

use crate::bench::{Bench, whole, with_zero};
use crate::common::arms::parse;
use crate::common::program::{Folder, assert_contains, in_one_line};

/// Poses of a full calibration.
const FULL: usize = 40;

/// Returns the error of the full calibration, and the fit of new poses of a changed arm with it as
/// prior, with its error [m].
pub fn again(bench: &Bench, seed: u64, poses: usize, zero: f64) -> (f64, f64, Identification) {
    let arm = bench.arm(seed);
    let rows = bench.measure(&arm, FULL, 1000 + seed, 1.0);
    let full = bench.calibrate(&rows);
    let prior = PriorSource::Estimate(Box::new(bench.saved(&full, &rows)));
    let changed = with_zero(&arm, 2, zero);
    let rows = bench.measure(&changed, poses, 5000 + seed, 1.0);
    let options = Options::default();
    let found = update(&bench.problem, &whole(&rows), &options, &prior, 1.0).unwrap().found;
    (bench.error(&full, &arm), bench.error(&found, &changed), found)
}

#[test]
fn five_poses_with_the_earlier_estimate_do_as_well_as_forty() {
    let bench = Bench::new();
    let (mut full, mut prior, mut alone) = (0.0, 0.0, 0.0);
    for seed in 0..4 {
        let (of_full, of_prior, found) = again(&bench, seed, 5, 0.0);
        assert!(found.is_trusted(), "{:?}", found.findings);
        assert!(!found.has(FindingCode::EarlierEstimateContradicted));
        let arm = bench.arm(seed);
        let rows = bench.measure(&arm, 5, 5000 + seed, 1.0);
        let few = bench.calibrate(&rows);
        full += of_full;
        prior += of_prior;
        alone += bench.error(&few, &arm);
    }
    println!("full {full:.2e}, prior {prior:.2e}, alone {alone:.2e}");
    assert!(prior < 1.15 * full && alone > 2.0 * full, "{full} {prior} {alone}");
}

#[test]
fn a_moved_zero_is_named_and_fitted() {
    let bench = Bench::new();
    let (full, prior, found) = again(&bench, 3, 8, 0.05);
    let finding = found.finding(FindingCode::EarlierEstimateContradicted).unwrap();
    assert_eq!(finding.word("cause"), Some("zero of joint 2"), "{finding}");
    println!("full {full:.2e}, prior {prior:.2e}");
    assert!(prior < 1.6 * full, "{full} {prior}");
}

#[test]
fn two_moved_zeros_are_named_as_by_the_watch() {
    let bench = Bench::new();
    for (seed, zeros) in [(3, [2, 4]), (4, [2, 3]), (5, [3, 4])] {
        let arm = bench.arm(seed);
        let rows = bench.measure(&arm, FULL, 1000 + seed, 1.0);
        let full = bench.saved(&bench.calibrate(&rows), &rows);
        let changed = zeros.iter().fold(arm, |arm, &joint| with_zero(&arm, joint, 0.1));
        let rows = bench.measure(&changed, 6, 7000 + seed, 1.0);
        let watched = watch(&bench.problem, &full, &rows, (1.0, 0.01)).unwrap();
        let prior = PriorSource::Estimate(Box::new(full));
        let found =
            update(&bench.problem, &whole(&rows), &Options::default(), &prior, 1.0).unwrap().found;
        let finding = found.finding(FindingCode::EarlierEstimateContradicted).unwrap();
        let named = zeros.map(|joint| format!("zero of joint {joint}"));
        for cause in [finding.word("cause").unwrap(), &watched.causes[0].label] {
            assert!(named.iter().all(|zero| cause.contains(zero.as_str())), "{zeros:?}: {cause}");
        }
    }
}

#[test]
fn the_test_of_new_rows_says_that_it_leaves_bounds_out() {
    let mut bench = Bench::new();
    let (wide, narrow) = ("{ sigma_mm = 2.0 }", "{ free = true, min_mm = -0.001, max_mm = 0.001 }");
    let text = include_str!("arm.toml");
    for problem in [
        text,
        &text.replacen(&format!("\"base.x\" = {wide}"), &format!("\"base.x\" = {narrow}"), 1),
    ] {
        bench.problem = parse(problem);
        let (.., found) = again(&bench, 3, 8, 0.0);
        let is_bound = found.estimates.iter().any(|estimate| estimate.at_bound.is_some());
        assert_eq!(is_bound, problem != text);
        let words = in_one_line(&estimate_text(&bench.problem, &found, None));
        assert_eq!(words.contains("against it (without bounds and constraints)"), is_bound);
    }
}

#[test]
fn earlier_rows_are_not_counted_twice() {
    let bench = Bench::new();
    let arm = bench.arm(1);
    let rows = bench.measure(&arm, FULL + 5, 77, 1.0);
    let split = Split { identification: (0..FULL).collect(), held_out: Vec::new() };
    let data = Dataset::new(rows.clone(), split);
    let full = flexcal::fit::identify(&bench.problem, &data, &Options::default()).unwrap();
    let estimate = bench.saved(&full, &rows.select(&(0..FULL).collect::<Vec<_>>()));
    let prior = PriorSource::Estimate(Box::new(estimate));
    let run = |data: &Dataset| {
        update(&bench.problem, data, &Options::default(), &prior, 0.0).map(|update| update.found)
    };
    let new = rows.select(&(FULL..FULL + 5).collect::<Vec<_>>());
    let (all, only_new) = (run(&whole(&rows)).unwrap(), run(&whole(&new)).unwrap());
    for (a, b) in all.estimates.iter().zip(&only_new.estimates) {
        let error = b.std_error.unwrap();
        assert!((a.estimate - b.estimate).abs() < 1e-3 * error, "{}", a.name);
    }
    // All rows at once say the same as the earlier ones and the new ones in turn.
    let at_once = bench.calibrate(&rows);
    for (a, b) in at_once.estimates.iter().zip(&only_new.estimates) {
        let error = a.std_error.unwrap();
        assert!((a.estimate - b.estimate).abs() < 0.3 * error, "{}: {a:?} {b:?}", a.name);
        let ratio = b.std_error.unwrap() / error;
        assert!((0.8..1.25).contains(&ratio), "{}: {ratio}", a.name);
    }
    assert!(matches!(run(&data), Err(PriorError::NothingNew { rows: FULL, .. })));
    // Earlier rows are not held out either.
    let held_out = Split { identification: (FULL..FULL + 5).collect(), held_out: (0..9).collect() };
    let found = run(&Dataset::new(rows, held_out)).unwrap();
    assert_eq!(found.fitted.held_out.n, 0);
    let json: serde_json::Value =
        serde_json::from_str(&IdentificationResult::new(&bench.problem, &found).to_json()).unwrap();
    assert_eq!(json["prior"]["rows_left_out"], 9);
}

#[test]
fn the_noise_of_the_first_fit_is_kept() {
    let bench = Bench::new();
    let arm = bench.arm(2);
    let amplitude = 0.05_f64.to_radians();
    let measured = |poses, seed| {
        let configurations = bench.configurations(poses, seed);
        bench.measure_bent(&arm, &configurations, (amplitude, seed + 1))
    };
    let rows = measured(FULL, 500);
    let first = bench.calibrate(&rows);
    assert!(first.noise_factor > 1.5, "{}", first.noise_factor);
    let mut problem = bench.problem.clone();
    for declared in [problem.data.position_sigma, None] {
        problem.data.position_sigma = declared;
        let first = flexcal::fit::identify(&problem, &whole(&rows), &Options::default()).unwrap();
        let text = IdentificationResult::new(&problem, &first).to_json();
        let estimate = SavedEstimate::parse(&text, Path::new("first.json")).unwrap();
        let prior = PriorSource::Estimate(Box::new(estimate));
        let new = whole(&measured(6, 600));
        let found = update(&problem, &new, &Options::default(), &prior, 0.0).unwrap().found;
        let text = IdentificationResult::new(&problem, &found).to_json();
        let [first, second] = [first.sigma_taken, found.sigma_taken];
        assert!(second > 0.999 * first, "{first} {second}");
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        if let Some(sigma) = declared {
            let factor = json["noise_factor"].as_f64().unwrap();
            assert!((factor - (second / sigma).powi(2)).abs() < 1e-6 * factor, "{factor}");
            let words = in_one_line(&estimate_text(&problem, &found, None));
            assert!(words.contains("because the earlier estimate was fitted with it"), "{words}");
        } else {
            let sigma = json["estimated_sigma_mm"].as_f64().unwrap();
            assert!((sigma - 1e3 * second).abs() < 1e-6 * sigma, "{sigma}");
        }
    }
}

#[test]
fn the_command_names_what_differs_and_shows_prior_data_and_posterior() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify problem.toml --data a-none.csv --out first").success();
    let text = folder.read("a-none.csv");
    // A second table: the held-out rows of the first one, as rows to identify from.
    let header = text.lines().next().unwrap();
    let others = text.lines().filter(|line| line.contains("validation"));
    let marked = others.take(14).enumerate().map(|(k, line)| match k {
        0..10 => line.replace("validation", "identification"),
        _ => line.to_owned(),
    });
    let rows: Vec<String> = [header.to_owned()].into_iter().chain(marked).collect();
    folder.write("second.csv", rows.join("\n") + "\n");
    let run = "identify problem.toml --data second.csv --prior first/estimate.json --out second";
    let shown = folder.flexcal(&format!("{run} --drift 2 -v")).success();
    assert_contains(
        &shown.stdout,
        &["Prior against the new rows", "drift of 2 days", "No contradiction is shown"],
    );
    let json = folder.flexcal(&format!("{run} --json")).json();
    assert_eq!(json["prior"]["rows_left_out"], 0);
    assert!(json["prior"]["parameters"].as_array().unwrap().len() > 10);
    let again = "identify problem.toml --data a-none.csv --prior first/estimate.json --out third";
    assert_contains(&folder.flexcal(again).code(2).stderr, &["nothing is new"]);
    let problem = folder.read("problem.toml");
    folder.write("problem.toml", problem.replacen("mass_kg = ", "mass_kg = 1", 1));
    assert_contains(&folder.flexcal(run).code(2).stderr, &["joint ", "declared differently"]);
    folder.write("problem.toml", problem + "\n[[effect]]\ngear-ratio = { joint = 3 }\n");
    let said = folder.flexcal(run).code(2).stderr;
    assert_contains(&said, &["has no estimate of gear-ratio[3].error"]);
}

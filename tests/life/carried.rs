//! Remainder and error bounds of an earlier estimate, carried over to a new one.

use flexcal::fit::{self, FindingCode, Options, SavedEstimate};
use flexcal::life::{PriorSource, Update, update};
use flexcal::measurement::Measurements;
use flexcal::problem::{Observation, Problem};
use flexcal::remainder::{self, Bounds, Correction};
use flexcal::results::{Document as _, IdentificationResult};

use crate::bench::{Bench, whole, with_zero};
use crate::common::program::{Folder, assert_contains, in_one_line};

/// Amplitude of the error of joint 2 that no parameter describes [°].
const BENT_DEG: f64 = 0.03;
/// Poses of the first calibration.
const FULL: usize = 80;
/// Poses in which predictions are compared with measurements.
const HELD_OUT: usize = 200;

/// Measures an arm whose joint 2 errs by a function of its command.
fn bent(bench: &Bench, arm: &Problem, poses: usize, seed: u64) -> Measurements {
    let configurations = bench.configurations(poses, seed);
    bench.measure_bent(arm, &configurations, (BENT_DEG.to_radians(), seed + 1))
}

/// Calibrates an arm with a remainder and saves the estimate as `flexcal identify --remainder` does.
fn calibrated(bench: &Bench, arm: &Problem, folder: &Folder) -> (SavedEstimate, Errors) {
    let rows = whole(&bent(bench, arm, FULL, 300));
    let found = bench.calibrate(&rows.measurements);
    let fitted = remainder::fit(&found, &bench.problem, &rows).unwrap().unwrap();
    let kept = fitted.remainder.clone().unwrap();
    let result = IdentificationResult::new(&bench.problem, &found);
    folder.write("estimate.json", result.with_predictions(&found, &fitted).to_json());
    folder.write("remainder.json", kept.to_json());
    let estimate = SavedEstimate::read(&folder.path("estimate.json")).unwrap();
    let errors = Errors::of(
        bench,
        arm,
        |rows| remainder::predict_identified(&found, &bench.problem, &kept, rows).unwrap(),
        &kept,
    );
    (estimate, errors)
}

/// Errors of predictions in other poses.
struct Errors {
    /// Mean length of measured − predicted [m].
    mean: f64,
    /// Share of the errors within their 95 % bound.
    coverage: f64,
}

impl Errors {
    fn of(
        bench: &Bench,
        arm: &Problem,
        predict: impl Fn(&Measurements) -> (Vec<nalgebra::Vector3<f64>>, Vec<remainder::CorrectedPose>),
        correction: &Correction,
    ) -> Self {
        let rows = bent(bench, arm, HELD_OUT, 7_000);
        let (positions, poses) = predict(&rows);
        let lengths: Vec<f64> =
            positions.iter().zip(&rows.positions).map(|(a, b)| (a - b).norm()).collect();
        let bounds = Bounds::new(correction, poses, 0.95);
        Self {
            mean: lengths.iter().sum::<f64>() / lengths.len() as f64,
            coverage: bounds.coverage(lengths.iter().copied().enumerate()),
        }
    }
}

/// Identifies `poses` new poses of an arm with an estimate as prior.
fn updated(bench: &Bench, arm: &Problem, poses: usize, estimate: &SavedEstimate) -> Update {
    let rows = whole(&bent(bench, arm, poses, 900));
    let source = PriorSource::Estimate(Box::new(estimate.clone()));
    update(&bench.problem, &rows, &Options::default(), &source, 1.0).unwrap()
}

/// Returns the errors of an update with its remainder, and those without it.
fn errors(bench: &Bench, arm: &Problem, of: &Update) -> (Errors, f64) {
    let kept = of.predictions.as_ref().unwrap().remainder.as_ref().unwrap();
    let with = Errors::of(
        bench,
        arm,
        |rows| remainder::predict_identified(&of.found, &bench.problem, kept, rows).unwrap(),
        kept,
    );
    let rows = bent(bench, arm, HELD_OUT, 7_000);
    let plain = of.found.predict(&bench.problem, &rows).unwrap();
    let lengths = plain.iter().zip(&rows.positions).map(|(a, b)| (a - b).norm());
    (with, lengths.sum::<f64>() / HELD_OUT as f64)
}

#[test]
fn the_remainder_survives_five_new_poses() {
    let (bench, folder) = (Bench::new(), Folder::new());
    let arm = bench.arm(4);
    let (estimate, before) = calibrated(&bench, &arm, &folder);
    let next_day = updated(&bench, &arm, 5, &estimate);
    let (with, without) = errors(&bench, &arm, &next_day);
    assert!(with.mean < 1.15 * before.mean && without > 1.5 * before.mean);
    // The bounds hold as well as those of the full calibration.
    assert!(with.coverage > before.coverage - 0.03, "{} {}", with.coverage, before.coverage);
    let fitted = next_day.predictions.unwrap();
    assert!(fitted.carried.unwrap().widening < 1.0 + 1e-12 && !fitted.is_declared);
}

#[test]
fn a_moved_zero_is_learned_beside_the_remainder() {
    let (bench, folder) = (Bench::new(), Folder::new());
    let arm = bench.arm(4);
    let (estimate, before) = calibrated(&bench, &arm, &folder);
    let collided = with_zero(&arm, 2, 0.05);
    let next_day = updated(&bench, &collided, 8, &estimate);
    let finding = next_day.found.finding(FindingCode::EarlierEstimateContradicted).unwrap();
    assert_eq!(finding.word("cause"), Some("zero of joint 2"), "{finding}");
    let (with, without) = errors(&bench, &collided, &next_day);
    assert!(with.mean < 1.15 * before.mean && without > 1.5 * before.mean);
    // The bounds hold as well as those of the full calibration.
    assert!(with.coverage > before.coverage - 0.03, "{} {}", with.coverage, before.coverage);
}

#[test]
fn an_update_can_be_updated_and_is_read_back() {
    let (bench, folder) = (Bench::new(), Folder::new());
    let arm = bench.arm(4);
    let (estimate, before) = calibrated(&bench, &arm, &folder);
    let first = updated(&bench, &arm, 5, &estimate);
    let fitted = first.predictions.as_ref().unwrap();
    let result = IdentificationResult::new(&bench.problem, &first.found);
    folder.write("estimate.json", result.with_predictions(&first.found, fitted).to_json());
    folder.write("remainder.json", fitted.remainder.as_ref().unwrap().to_json());
    let again = SavedEstimate::read(&folder.path("estimate.json")).unwrap();
    let read = remainder::of_estimate(&bench.problem, &again).unwrap().unwrap();
    let rows = bent(&bench, &arm, 20, 55);
    let predict = |of: &Correction| {
        remainder::predict_identified(&first.found, &bench.problem, of, &rows).unwrap().0
    };
    let written = fitted.remainder.as_ref().unwrap();
    for (a, b) in predict(written).iter().zip(predict(&read)) {
        assert!((a - b).norm() < 1e-9, "{a} {b}");
    }
    let rows = whole(&bent(&bench, &arm, 4, 1_700));
    let source = PriorSource::Estimate(Box::new(again));
    let second = update(&bench.problem, &rows, &Options::default(), &source, 30.0).unwrap();
    let (with, _) = errors(&bench, &arm, &second);
    assert!(with.mean < 1.2 * before.mean, "{} {}", with.mean, before.mean);
}

#[test]
fn a_row_that_measures_no_position_leaves_the_update_by_the_others() {
    let (bench, folder) = (Bench::new(), Folder::new());
    let arm = bench.arm(4);
    let (estimate, before) = calibrated(&bench, &arm, &folder);
    let collided = with_zero(&arm, 2, 0.05);
    // The last row states a tilt as the first calibration predicts it, with a large σ.
    let mut rows = bent(&bench, &collided, 9, 900);
    rows.observations = vec![Observation::Position; 9];
    rows.observations[8] = Observation::Tilt(6);
    rows.sigma = Some([[5e-5; 8].as_slice(), &[0.1]].concat());
    rows.positions[8] =
        fit::predict(&bench.problem, Some(&estimate), &rows, None).unwrap().positions[8];
    let source = PriorSource::Estimate(Box::new(estimate));
    let next_day =
        update(&bench.problem, &whole(&rows), &Options::default(), &source, 1.0).unwrap();
    // The misfit counts as noise in rows that state their σ; the zero is named before it.
    let finding = next_day.found.finding(FindingCode::EarlierEstimateContradicted).unwrap();
    assert_eq!(finding.word("cause"), Some("zero of joint 2"), "{finding}");
    let (with, without) = errors(&bench, &collided, &next_day);
    assert!(with.mean < 1.15 * before.mean && without > 1.5 * before.mean);
    let carried = next_day.predictions.unwrap().carried.unwrap();
    assert_eq!((carried.positions, carried.conditioning), (8, 8));
}

/// Writes rows as a table of positions.
fn table(rows: &Measurements) -> String {
    let line = |row: usize| {
        let angles = rows.configuration(row).iter().map(|q| format!("{},", q.to_degrees()));
        let at = rows.positions[row] * 1e3;
        format!("{}{},{},{}", angles.collect::<String>(), at.x, at.y, at.z)
    };
    let lines: Vec<String> = (0..rows.len()).map(line).collect();
    format!("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n{}\n", lines.join("\n"))
}

#[test]
fn the_command_carries_the_remainder_over_or_says_why_not() {
    let bench = Bench::new();
    let arm = bench.arm(4);
    let problem = include_str!("arm.toml")
        .replace("held_out = { fraction = 0.3, seed = 1 }", "held_out = \"none\"");
    let folder = Folder::with([("problem.toml", &*problem)]);
    folder.write("measurements.csv", table(&bent(&bench, &arm, FULL, 300)));
    folder.write("new.csv", table(&bent(&bench, &arm, 5, 900)));
    folder.flexcal("identify problem.toml --remainder --out first").success();
    let run = "identify problem.toml --data new.csv --prior first/estimate.json --out second";
    let shown = in_one_line(&folder.flexcal(run).success().stdout);
    assert_contains(
        &shown,
        &["Error bound of a prediction with the remainder", "was updated with"],
    );
    let estimate = folder.json("second/estimate.json");
    assert_eq!(estimate["remainder"]["file"], "remainder.json");
    assert!(estimate["prediction"].is_object());
    let predict = "predict problem.toml --data measurements.csv --out predicted --estimate";
    let predicted = folder.flexcal(&format!("{predict} second/estimate.json")).success();
    assert_contains(&in_one_line(&predicted.stdout), &["of these rows lie within their bounds"]);
    // Problems that state another use of a remainder leave that of the estimate out.
    let declared = "\n[remainder]\nfile = \"first/remainder.json\"\nuse = false\n";
    folder.write("problem.toml", problem + declared);
    let said = in_one_line(&folder.flexcal(run).success().stderr);
    assert_contains(&said, &["is not carried over", "use = false"]);
    assert!(folder.json("second/estimate.json")["remainder"].is_null());
}

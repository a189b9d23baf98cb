//! A board that was put down again, and an arm that was not.

use std::path::Path;

use flexcal::fit::{Finding, FindingCode, Identification, Options, SavedEstimate, identify};
use flexcal::life::{CauseKind, PriorSource, update, watch};
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::Problem;
use flexcal::results::{Document as _, IdentificationResult};

use nalgebra::{Rotation3, Vector3};

use crate::cameras::measured_with;
use crate::common::made::model_of;

/// Returns the arm with a camera on its hand, its measured pixels, and their fit.
fn calibrated() -> (Problem, Measurements, Identification) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = Problem::read(&folder).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    (problem, data.measurements, found)
}

/// Returns pixels of six configurations after parameters have changed by amounts \[m\] and
/// \[rad\].
fn images_after(
    (problem, rows, found): &(Problem, Measurements, Identification),
    changes: &[(&str, f64)],
    seed: u64,
) -> Measurements {
    let model = model_of(problem, rows);
    let mut x = found.x.clone();
    for (name, change) in changes {
        let k = model.parameters.iter().position(|parameter| parameter.name == *name).unwrap();
        x[k] += change;
    }
    let every_third: Vec<usize> =
        (0..rows.len()).filter(|row| (row / 9).is_multiple_of(11)).collect();
    measured_with(&model, &rows.select(&every_third), &x, (1.0, seed))
}

/// Returns the rotation vector of the turn of the board by a change of the third component of its
/// rotation vector, world frame \[rad\].
fn turn_by(
    (problem, rows, found): &(Problem, Measurements, Identification),
    change: f64,
) -> Vector3<f64> {
    let model = model_of(problem, rows);
    let value = |axis: &str| {
        let name = format!("marker[board].{axis}");
        let k = model.parameters.iter().position(|parameter| parameter.name == name).unwrap();
        model.parameters[k].value(found.x[k])
    };
    let old = Vector3::new(value("rx"), value("ry"), value("rz"));
    let rotation = |third: f64| Rotation3::from_scaled_axis(old + Vector3::new(0.0, 0.0, third));
    (rotation(change) * rotation(0.0).inverse()).scaled_axis()
}

/// Returns the largest change of a parameter of the arm between two fits, in standard errors of the
/// first.
fn largest_change(before: &Identification, after: &Identification) -> f64 {
    let changes = before.estimates.iter().zip(&after.estimates).filter_map(|(before, after)| {
        assert_eq!(before.name, after.name);
        let sigma = before.std_error.filter(|_| before.name.starts_with("joint"))?;
        Some((after.estimate - before.estimate).abs() / sigma)
    });
    changes.fold(0.0, f64::max)
}

#[test]
fn a_board_that_was_put_down_again_is_named_and_leaves_the_arm() {
    let calibrated = calibrated();
    let (problem, _, found) = &calibrated;
    let json = IdentificationResult::new(problem, found).to_json();
    let estimate = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let pose = ["x", "y", "z"].map(|axis| format!("camera[hand].{axis}"));
    assert_eq!(estimate.undetermined(&pose), Vec::<&str>::new());
    let source = PriorSource::Estimate(Box::new(estimate.clone()));
    for (seed, (shift, turn)) in (40..).zip([(1e-3, 0.005), (3e-3, 0.02), (20e-3, 0.3)]) {
        let moved = [("marker[board].x", shift), ("marker[board].rz", turn)];
        let rows = images_after(&calibrated, &moved, seed);
        let watched = watch(problem, &estimate, &rows, (0.0, 0.01)).unwrap();
        assert!(watched.is_changed(), "{shift}");
        assert_eq!(watched.causes[0].label, "marker[board]", "{shift} {:?}", watched.causes);
        let changes = &watched.causes[0].changes;
        let turned: Vec<f64> = changes[3..].iter().map(|change| change.change).collect();
        let expected = turn_by(&calibrated, turn);
        let off = (Vector3::from_column_slice(&turned) - expected).norm();
        assert!(off < 0.1 * turn + 1e-3, "{expected} {changes:?}");
        let is_base = |kind: CauseKind| kind == CauseKind::Base;
        assert!(!watched.causes.iter().any(|cause| is_base(cause.kind)), "{shift}");
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let data = Dataset::new(rows, split);
        let updated = update(problem, &data, &Options::default(), &source, 0.0).unwrap().found;
        let is_contradiction =
            |finding: &&Finding| finding.code == FindingCode::EarlierEstimateContradicted;
        let causes: Vec<String> = updated
            .findings
            .iter()
            .filter(is_contradiction)
            .map(|finding| finding.word("cause").unwrap().to_owned())
            .collect();
        assert_eq!(causes, ["marker[board]"], "{shift}");
        assert!(
            largest_change(found, &updated) < 3.0,
            "{shift} {}",
            largest_change(found, &updated)
        );
        let place = |of: &Identification, name: &str| {
            of.estimates.iter().find(|estimate| estimate.name == name).unwrap().estimate
        };
        // The rotation vector of the board may be that of the whole turn less.
        let shifted = place(&updated, "marker[board].x") - place(found, "marker[board].x");
        assert!((shifted - shift).abs() < 0.1 * shift + 2e-4, "{shifted} {shift}");
    }
}

#[test]
fn a_moved_zero_is_not_taken_for_a_moved_board() {
    let calibrated = calibrated();
    let (problem, _, found) = &calibrated;
    let json = IdentificationResult::new(problem, found).to_json();
    let estimate = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let rows = images_after(&calibrated, &[("joint3.theta", 0.003)], 50);
    let watched = watch(problem, &estimate, &rows, (0.0, 0.01)).unwrap();
    assert_eq!(watched.named().map(|cause| &*cause.label), Some("zero of joint 3"));
    // Noise alone is no change.
    let same = images_after(&calibrated, &[], 51);
    assert!(!watch(problem, &estimate, &same, (0.0, 0.01)).unwrap().is_changed());
}

#[test]
fn a_board_that_moves_within_a_table_is_named_with_the_row() {
    let (problem, rows, found) = calibrated();
    let model = model_of(&problem, &rows);
    let mut x = found.x.clone();
    let name = "marker[board].x";
    x[model.parameters.iter().position(|parameter| parameter.name == name).unwrap()] += 0.003;
    let still = measured_with(&model, &rows, &found.x, (1.0, 5));
    let elsewhere = measured_with(&model, &rows, &x, (1.0, 5));
    assert_eq!(still.len(), elsewhere.len());
    // The first row of an image, nine rows each.
    let first = 20 * 9;
    let mut moved = still.clone();
    moved.positions[first..].copy_from_slice(&elsewhere.positions[first..]);
    let options = Options::default().with_influential_rows();
    let changed = |table: Measurements| {
        let split = Split::new(&problem, &table).unwrap();
        let data = Dataset { measurements: table, split };
        let found = identify(&problem, &data, &options).unwrap();
        found.finding(FindingCode::RowsChanged).map(ToString::to_string)
    };
    assert_eq!(changed(still), None);
    let said = changed(moved.clone()).unwrap();
    let row = moved.location(first).to_string();
    assert!(said.contains("marker board stands elsewhere, by 3.") && said.contains(&row), "{said}");
}

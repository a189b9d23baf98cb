//! Changes since an estimate.

use flexcal::fit::SavedEstimate;
use flexcal::life::{CauseKind, Watch, watch};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;
use nalgebra::{Rotation3, Vector3};

use crate::bench::{Bench, warmed, with_tool, with_zero};
use crate::common::arms::path;
use crate::common::program::{Folder, assert_contains};

/// Poses of the calibration.
const FULL: usize = 40;

/// Returns a true arm, and its estimate.
pub fn calibrated(bench: &Bench, seed: u64) -> (Problem, SavedEstimate) {
    let arm = bench.arm(seed);
    let rows = bench.measure(&arm, FULL, 1000 + seed, 1.0);
    let found = bench.calibrate(&rows);
    let estimate = bench.saved(&found, &rows);
    (arm, estimate)
}

pub fn judged(bench: &Bench, estimate: &SavedEstimate, rows: &Measurements) -> Watch {
    watch(&bench.problem, estimate, rows, (0.0, 0.01)).unwrap()
}

#[test]
fn an_unchanged_arm_is_unchanged() {
    let bench = Bench::new();
    for seed in 0..5 {
        let (arm, estimate) = calibrated(&bench, seed);
        let rows = bench.measure(&arm, 20, 3000 + seed, 1.0);
        let verdict = judged(&bench, &estimate, &rows);
        assert!(!verdict.is_changed() && verdict.chi2.2 > 1e-3, "{verdict:?}");
        assert_eq!((verdict.rows, verdict.looks.len()), (20, 20));
    }
}

#[test]
fn misfit_that_repeats_with_the_pose_is_no_change() {
    let bench = Bench::new();
    let amplitude = 0.02_f64.to_radians();
    for seed in 0..4 {
        let arm = bench.arm(seed);
        let poses = bench.configurations(FULL, 1000 + seed);
        let rows = bench.measure_bent(&arm, &poses, (amplitude, 2000 + seed));
        let estimate = bench.saved(&bench.calibrate(&rows), &rows);
        let pose = bench.configurations(1, 3000 + seed).remove(0);
        let visits = vec![pose; 40];
        let rows = bench.measure_bent(&arm, &visits, (amplitude, 4000 + seed));
        let verdict = judged(&bench, &estimate, &rows);
        assert!(!verdict.is_changed(), "{seed}: {verdict:?}");
        assert!(verdict.sigma > 0.05e-3, "{verdict:?}");
        // A change that other poses show is still seen.
        let moved = with_zero(&arm, 2, 0.1);
        let poses = bench.configurations(12, 5000 + seed);
        let rows = bench.measure_bent(&moved, &poses, (amplitude, 6000 + seed));
        assert!(judged(&bench, &estimate, &rows).is_changed(), "{seed}");
    }
}

/// Mistake in a table.
type Mistake = fn(&mut Measurements);

#[test]
fn a_misread_table_is_named_before_a_change() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let mistakes: [(Mistake, &str); 2] = [
        (|rows| rows.positions.iter_mut().for_each(|at| *at *= 1e-3), "positions that are metres"),
        (
            |rows| {
                let joints = rows.joints;
                rows.configurations.chunks_exact_mut(joints).for_each(|q| q[1] = -q[1]);
            },
            "joint 2 that counts the other way",
        ),
    ];
    for (mistake, expected) in mistakes {
        let mut rows = bench.measure(&arm, 6, 4002, 1.0);
        mistake(&mut rows);
        let verdict = judged(&bench, &estimate, &rows);
        let cause = &verdict.causes[0];
        assert!(verdict.is_changed() && cause.kind == CauseKind::Misread, "{verdict:?}");
        assert!(cause.label.contains(expected), "{verdict:?}");
    }
}

#[test]
fn a_moved_zero_and_a_moved_tool_are_named_with_their_size() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let rows = bench.measure(&with_zero(&arm, 2, 0.02), 8, 4002, 1.0);
    let verdict = judged(&bench, &estimate, &rows);
    let cause = &verdict.causes[0];
    assert_eq!((cause.kind, &*cause.label), (CauseKind::Zero, "zero of joint 2"), "{verdict:?}");
    let change = &cause.changes[0];
    let off = change.change - 0.02_f64.to_radians();
    assert!(off.abs() < 4.0 * change.std_error && change.std_error < 1e-4, "{change:?}");
    assert!(cause.left_out_error.unwrap() < 0.8 * verdict.error, "{verdict:?}");

    let moved = Vector3::new(0.2e-3, -0.1e-3, 0.2e-3);
    let rows = bench.measure(&with_tool(&arm, moved), 8, 4003, 1.0);
    let verdict = judged(&bench, &estimate, &rows);
    assert!(verdict.is_changed() && verdict.causes[0].kind == CauseKind::Tool, "{verdict:?}");
    for (change, truth) in verdict.causes[0].changes.iter().zip(&moved) {
        assert!((change.change - truth).abs() < 4.0 * change.std_error, "{change:?}");
    }
}

#[test]
fn two_changes_at_once_are_named_together() {
    let bench = Bench::new();
    for seed in [2, 3, 5] {
        let (arm, estimate) = calibrated(&bench, seed);
        let moved = Vector3::new(0.3e-3, -0.3e-3, 0.2e-3);
        let arm = with_tool(&with_zero(&arm, 4, 0.15), moved);
        let rows = bench.measure(&arm, 15, 4030 + seed, 1.0);
        let verdict = judged(&bench, &estimate, &rows);
        let named = verdict.named().unwrap();
        assert_eq!(named.kind, CauseKind::Two, "{verdict:?}");
        assert_contains(&named.label, &["tool", " and ", "zero of joint 4"]);
        assert_eq!(verdict.unexplained_error(), None, "{verdict:?}");
        // Drift may hide one of the two: the other one is then said not to be the whole change.
        let verdict = watch(&bench.problem, &estimate, &rows, (365.0, 0.01)).unwrap();
        if verdict.named().is_some_and(|cause| cause.kind == CauseKind::Zero) {
            assert!(verdict.unexplained_error().is_some(), "{verdict:?}");
        }
    }
}

#[test]
fn a_change_that_only_drift_explains_is_said_to_be_drift() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let within = |arm: &Problem, seed| {
        let rows = bench.measure(arm, 12, seed, 1.0);
        watch(&bench.problem, &estimate, &rows, (365.0, 0.01)).unwrap()
    };
    let verdict = within(&with_tool(&arm, Vector3::new(0.2e-3, 0.0, 0.1e-3)), 4003);
    assert!(!verdict.is_changed() && verdict.chi2.2 > 0.01 && verdict.has_drifted(), "{verdict:?}");
    let verdict = within(&arm, 4004);
    assert!(!verdict.is_changed() && !verdict.has_drifted(), "{verdict:?}");
}

#[test]
fn noise_a_gross_row_and_a_warm_arm_are_no_change_of_geometry() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 4);
    let first = |rows: &Measurements| judged(&bench, &estimate, rows);
    let noisy = first(&bench.measure(&arm, 20, 4005, 3.0));
    assert!(noisy.is_changed() && noisy.named().unwrap().kind == CauseKind::Noise, "{noisy:?}");
    let mut rows = bench.measure(&arm, 12, 4006, 1.0);
    rows.positions[7].y += 2e-3;
    let gross = first(&rows);
    let named = gross.named().map(|cause| (cause.row, &*cause.label));
    assert_eq!(named, Some((Some(7), "arrays:8 is off")), "{gross:?}");
    let warm = first(&bench.measure(&warmed(&arm, 3e-4), 12, 4007, 1.0));
    assert!(warm.is_changed() && warm.causes[0].kind == CauseKind::Temperature, "{warm:?}");
    // With a temperature in the table, a zero that moved with it is not called a moved zero.
    let rows = bench.measure_at(&with_zero(&arm, 2, 0.03), Some(32.0), (12, 4008, 1.0));
    let warm = first(&rows);
    assert!(warm.is_changed() && warm.causes[0].kind == CauseKind::Temperature, "{warm:?}");
}

#[test]
fn a_base_that_was_turned_far_is_named_with_its_move() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 6);
    let mut rows = bench.measure(&arm, 12, 4012, 1.0);
    let turn = Rotation3::from_scaled_axis(Vector3::new(0.0, 0.1, 1.2));
    for position in &mut rows.positions {
        *position = turn * *position + Vector3::new(0.5, -0.3, 0.1);
    }
    let verdict = judged(&bench, &estimate, &rows);
    let cause = verdict.named().unwrap();
    assert_eq!(cause.kind, CauseKind::Base, "{verdict:?}");
    // Moved by the estimate's base and then by this turn; the base is close to the origin.
    let near = |place: usize, value: f64, by: f64| {
        assert!((cause.changes[place].change - value).abs() < by, "{:?}", cause.changes);
    };
    near(0, 0.5, 1e-2);
    near(1, -0.3, 1e-2);
    near(5, 1.2, 1e-2);
    assert!(cause.left_out_error.unwrap() < 0.3e-3, "{cause:?}");
}

#[test]
fn a_base_that_was_turned_far_is_named_beside_other_changes() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let arm = with_tool(&with_zero(&arm, 3, 0.05), Vector3::new(0.3e-3, 0.0, 0.0));
    let mut rows = bench.measure(&arm, 15, 4105, 1.0);
    let turn = Rotation3::from_euler_angles(0.1, -0.2, 0.7);
    for position in &mut rows.positions {
        *position = turn * *position + Vector3::new(0.8, -0.4, 0.1);
    }
    let verdict = judged(&bench, &estimate, &rows);
    assert_eq!(verdict.named().map(|cause| cause.kind), Some(CauseKind::Base), "{verdict:?}");
}

#[test]
fn a_zero_of_joint_1_that_moved_far_is_not_named_a_moved_base() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 8);
    let rows = bench.measure(&with_zero(&arm, 1, 20.0), 12, 4014, 1.0);
    let verdict = judged(&bench, &estimate, &rows);
    assert!(verdict.is_changed() && verdict.named().is_none(), "{verdict:?}");
    let zero = verdict.causes.iter().find(|cause| cause.kind == CauseKind::Zero).unwrap();
    assert!((zero.changes[0].change - 20.0_f64.to_radians()).abs() < 1e-3, "{zero:?}");
}

/// Replaces the positions by others all over the workspace, which no reading explains.
fn scatter(rows: &mut Measurements) {
    for (row, position) in (1_u8..).map(f64::from).zip(&mut rows.positions) {
        *position = Vector3::new((2.3 * row).sin(), (3.7 * row).cos(), (5.1 * row).sin()) * 0.4;
    }
}

#[test]
fn too_few_rows_name_no_moved_base() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 9);
    let mut rows = bench.measure(&arm, 2, 4015, 1.0);
    scatter(&mut rows);
    let verdict = judged(&bench, &estimate, &rows);
    assert_eq!(verdict.causes[0].kind, CauseKind::Other, "{verdict:?}");
}

#[test]
fn rows_that_no_cause_explains_are_called_so() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 7);
    let mut rows = bench.measure(&arm, 12, 4013, 1.0);
    scatter(&mut rows);
    let verdict = judged(&bench, &estimate, &rows);
    assert_eq!(verdict.named().unwrap().kind, CauseKind::Other, "{verdict:?}");
}

#[test]
fn a_misread_table_is_not_judged_but_a_change_of_its_last_rows_is() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 7);
    let clean = bench.measure(&arm, 10, 4013, 1.0);
    let kind = |change: &dyn Fn(&mut [Vector3<f64>])| {
        let mut rows = clean.clone();
        change(&mut rows.positions);
        let verdict = judged(&bench, &estimate, &rows);
        verdict.causes.first().map(|cause| (cause.kind, cause.label.clone()))
    };
    let metres = kind(&|positions| positions.iter_mut().for_each(|at| *at *= 1e-3)).unwrap();
    assert_eq!(metres.0, CauseKind::Misread, "{metres:?}");
    let gross = kind(&|positions| positions[9].y += 0.05).unwrap();
    assert_eq!(gross.1, "arrays:10 is off");
    let last = kind(&|positions| positions[7..].iter_mut().for_each(|at| at.y += 0.05)).unwrap();
    assert!(last.0 != CauseKind::Misread, "{last:?}");
}

#[test]
fn a_zero_that_moves_the_points_as_the_base_would_names_both() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let named = |joint| {
        let rows = bench.measure(&with_zero(&arm, joint, 0.05), 12, 4002, 1.0);
        let cause = judged(&bench, &estimate, &rows).causes[0].clone();
        (cause.label, cause.alike)
    };
    let [first, third] = [1, 3].map(named);
    assert_eq!(first, ("zero of joint 1".to_owned(), Some("base or the instrument".to_owned())));
    assert_eq!(third, ("zero of joint 3".to_owned(), None));
}

#[test]
fn a_base_that_the_estimate_does_not_know_adds_nothing_to_the_expected_error() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 2);
    let rows = bench.measure(&arm, 20, 4020, 1.0);
    let known = judged(&bench, &estimate, &rows).expected_error;
    let mut moved = rows.clone();
    moved.session = std::iter::repeat_n("later", rows.len()).collect();
    let verdict = judged(&bench, &estimate, &moved);
    assert!(!verdict.is_changed(), "{verdict:?}");
    assert!((0.5..1.2).contains(&(verdict.expected_error / known)), "{known}: {verdict:?}");
}

/// Returns the rows of all tables, in their order.
fn joined(tables: &[Measurements]) -> Measurements {
    let rows = || tables.iter().flat_map(|table| (0..table.len()).map(move |row| (table, row)));
    let configurations = rows().map(|(table, row)| table.configuration(row).to_vec());
    let positions: Vec<Vector3<f64>> = rows().map(|(table, row)| table.positions[row]).collect();
    Dataset::builder(configurations, positions).measurements().unwrap()
}

#[test]
fn a_change_in_the_middle_of_a_table_is_named_with_its_first_row() {
    let bench = Bench::new();
    let (arm, estimate) = calibrated(&bench, 5);
    let before = bench.measure(&arm, 20, 4010, 1.0);
    let after = bench.measure(&with_zero(&arm, 2, 0.03), 20, 4011, 1.0);
    let verdict = judged(&bench, &estimate, &joined(&[before, after]));
    let cause = verdict.named().unwrap();
    let from_row = cause.from_row.unwrap();
    assert_eq!(cause.kind, CauseKind::Zero, "{verdict:?}");
    assert!(cause.label.starts_with("zero of joint 2, from ") && (18..=22).contains(&from_row));
    assert!(verdict.changed_at.unwrap() > 20, "{verdict:?}");
    let change = &cause.changes[0];
    let off = change.change - 0.03_f64.to_radians();
    assert!(off.abs() < 4.0 * change.std_error && change.std_error < 1e-4, "{change:?}");
}

#[test]
fn temperature_that_the_model_lacks_is_no_change() {
    let folder = Folder::with_lunar_sampler();
    let (rows, problem) = ["measurements.csv", "problem.toml"]
        .map(|file| {
            std::fs::read_to_string(path(&format!("problems/lunar-sampler/{file}"))).unwrap()
        })
        .into();
    folder.write("bowed/problem.toml", problem);
    folder.write("bowed/measurements.csv", rows);
    folder.flexcal("identify bowed --out first").success();
    let run =
        "watch bowed --estimate first/estimate.json --data bowed/measurements.csv --out watch";
    let same = folder.flexcal(run).success();
    assert_contains(&same.stdout, &["50 rows against the estimate", "No change shown"]);
}

#[test]
fn the_command_has_exit_status_3_for_a_changed_arm() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify problem.toml --data a-none.csv --out first").success();
    let run = "watch problem.toml --estimate first/estimate.json --out watch";
    let same = folder.flexcal(&format!("{run} --data a-none.csv")).success();
    assert_contains(
        &same.stdout,
        &["50 rows against the estimate", "No change shown", "28 rows left out"],
    );
    // Every position lies 5 mm higher.
    let text = folder.read("a-none.csv");
    let place = text.lines().next().unwrap().split(',').position(|name| name == "z_mm").unwrap();
    let moved = text.lines().map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(z) = cells[place].parse::<f64>() {
            cells[place] = (z + 5.0).to_string();
        }
        cells.join(",")
    });
    folder.write("moved.csv", moved.collect::<Vec<_>>().join("\n") + "\n");
    // Metres in columns of millimetres are another table, not another arm.
    let metres = text.lines().map(|line| {
        let cells = line.split(',').enumerate().map(|(k, cell)| match cell.parse::<f64>() {
            Ok(at) if (place - 2..=place).contains(&k) => (at / 1e3).to_string(),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",")
    });
    folder.write("metres.csv", metres.collect::<Vec<_>>().join("\n") + "\n");
    let misread = folder.flexcal(&format!("{run} --data metres.csv")).code(3);
    assert_contains(&misread.stdout, &["Not judged: ", "Next: correct the table"]);
    let changed = folder.flexcal(&format!("{run} --data moved.csv")).code(3);
    assert_contains(&changed.stdout, &["Changed, seen after", "Next: flexcal identify"]);
    // The suggested command leaves the estimate that is its prior where it is.
    let before = folder.read("first/estimate.json");
    let next = changed.stdout.split_once("Next: flexcal ").unwrap().1;
    let next = next.split_once(" takes").or(next.split_once(" says")).unwrap().0;
    let run = folder.flexcal(&next.replace('\n', " "));
    assert!(run.status < 2, "{next} {run:?}");
    assert_eq!(folder.read("first/estimate.json"), before);
    let json = folder.json("watch/watch.json");
    assert_eq!(json["changed"], true);
}

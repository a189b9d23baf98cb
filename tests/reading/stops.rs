//! Stops of a joint table that no row measures, by which the arm came to the measured poses.
#![expect(clippy::float_cmp, reason = "directions and rounded angles are exact")]

use std::fmt::Write as _;

use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

use crate::common::program::Folder;
use crate::common::reading::words;

/// Reads poses P0, P1, … of a tracker and a log of an arm with two joints; `by` is the rule that
/// joins them, and `more` further text of the problem.
fn read([by, more]: [&str; 2], log: &str, tracker: &str) -> (Measurements, String) {
    let text = format!(
        "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n[data]\nfiles = ['tracker.csv']\n\
         joints = {{ files = ['log.csv'], by = '{by}' }}\n{more}"
    );
    let folder =
        Folder::with([("problem.toml", &*text), ("tracker.csv", tracker), ("log.csv", log)]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let (rows, warnings) = Measurements::read(&problem.data.files, &problem).unwrap();
    (rows, words(&warnings))
}

/// Log of four measured poses with stops at which joint 2 turns before two of them.
const LOG: [(&str, f64, f64); 8] = [
    ("HOME", 0.0, 0.0),
    ("P0", 10.0, 5.0),
    ("P1", 20.0, 10.0),
    ("APPR", 30.0, 30.0),
    ("ON", 40.0, 20.0),
    ("P2", 50.0, 15.0),
    ("HOME", 0.0, 0.0),
    ("P3", 60.0, 15.002),
];

/// The log and a tracker's table of the poses whose names begin with P, both with times.
fn tables() -> [String; 2] {
    let mut log = "pose,time_s,q1_deg,q2_deg\n".to_owned();
    let mut tracker = "pose,time_s,x_mm,y_mm,z_mm\n".to_owned();
    for (place, (name, first, second)) in LOG.iter().enumerate() {
        let time = 10 * place;
        writeln!(log, "{name},{time},{first},{second}").unwrap();
        if name.starts_with('P') {
            writeln!(tracker, "{name},{time}.2,1,{place},3").unwrap();
        }
    }
    [log, tracker]
}

/// A table with a column more.
fn beside(table: &str, column: &[&str]) -> String {
    let rows = table.lines().zip(column).flat_map(|(row, cell)| [row, ",", cell, "\n"]);
    rows.collect()
}

#[test]
fn directions_of_approach_are_those_of_the_log() {
    let [log, tracker] = tables();
    for by in ["name", "time"] {
        let (rows, said) = read([by, ""], &log, &tracker);
        let sides = rows.approach.clone().unwrap();
        assert_eq!(sides, [1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0], "{by}");
        assert!(said.contains("log.csv: no column states from which side"), "{by}: {said}");
        // At HOME both joints turn, at APPR joint 2; at ON none does.
        assert!(said.contains("at 2 unmeasured stops between"), "{by}: {said}");
        // The past of a pose has the stops, also in a part of the table.
        let past = |rows: &Measurements, row: usize| {
            let degrees = |q: f64| (q.to_degrees() * 10.0).round() / 10.0;
            let past = rows.conditions(row).past;
            assert!(past.times.is_sorted() && past.approaches.len() == past.configurations.len());
            let second = past.configurations.chunks(2).map(|q| degrees(q[1]));
            second.collect::<Vec<f64>>()
        };
        assert_eq!(past(&rows, 2), [0.0, 5.0, 10.0, 30.0], "{by}");
        assert_eq!(past(&rows, 3), [0.0, 5.0, 10.0, 30.0, 15.0, 0.0], "{by}");
        assert_eq!(past(&rows.select(&[1, 3]), 1), [10.0, 0.0], "{by}");
    }
    // Each session begins anew.
    let with_sessions = beside(&tracker, &["session", "a", "a", "a", "b"]);
    let (rows, _) = read(["name", ""], &log, &with_sessions);
    assert_eq!(rows.approach.unwrap()[4..], [1.0, -1.0, 1.0, 1.0]);
}

#[test]
fn declared_directions_and_logs_of_measured_poses_stay_as_they_are() {
    let [log, tracker] = tables();
    let declared = beside(&tracker, &["approach2", "-1", "-1", "-1", "-1"]);
    let (rows, said) = read(["time", ""], &log, &declared);
    assert_eq!(rows.approach.clone().unwrap(), [0.0, -1.0].repeat(4));
    assert!(!said.contains("side"), "{said}");
    assert_eq!(rows.conditions(2).past.times.len(), 4);
    // A stop before the first pose alone does not show that the log has all.
    let first = |text: &str, lines: usize| {
        text.lines().take(lines).map(|row| row.to_owned() + "\n").collect::<String>()
    };
    let (rows, said) = read(["time", ""], &first(&log, 4), &first(&tracker, 3));
    assert!(rows.approach.is_none() && !said.contains("side"), "{said}");
    assert_eq!(rows.conditions(0).past.times.len(), 1);
}

#[test]
fn a_sampled_trace_keeps_the_poses_at_which_joints_turn() {
    // Two samples a second of a straight move with one turn of joint 2 before each measured pose.
    let mut log = "time_s,q1_deg,q2_deg\n".to_owned();
    let mut tracker = "time_s,x_mm,y_mm,z_mm\n".to_owned();
    let noise = |k: usize| 0.002 * (k * k % 5) as f64;
    let mut at = 0;
    for pose in 0..20 {
        for k in 0..40 {
            let turned = f64::from(if k < 10 { k } else { 20 - k.min(20) });
            let sign = if pose % 2 == 0 { 1.0 } else { -1.0 };
            let first = f64::from(pose * 20 + k.min(20));
            let (first, second) = (first + noise(at), sign * turned + noise(at + 2));
            writeln!(log, "{},{first:.4},{second:.4}", at as f64 / 2.0).unwrap();
            if k == 30 {
                writeln!(tracker, "{},1,{pose},3", at as f64 / 2.0).unwrap();
            }
            at += 1;
        }
    }
    let (rows, said) = read(["time", ""], &log, &tracker);
    let sides = rows.approach.clone().unwrap();
    let second: Vec<f64> = sides.chunks(2).map(|side| side[1]).collect();
    assert_eq!(second, [-1.0, 1.0].repeat(10), "{said}");
    assert!(sides.chunks(2).all(|side| side[0] == 1.0));
    let stops = rows.conditions(19).past.times.len();
    assert!((39..60).contains(&stops), "{stops}");
}

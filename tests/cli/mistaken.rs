//! Mistakes in the tables of `compensate` and `next`, and too few poses, are named.

use crate::common::program::{Folder, assert_contains};

/// Rigid arm with four joints.
const PROBLEM: &str = r#"
name = "elbow"
joint = [
  { d_m = 0.45, min_deg = -150, max_deg = 150 },
  { alpha_deg = 90, a_m = 0.05, min_deg = 0, max_deg = 120 },
  { a_m = 0.60, min_deg = -130, max_deg = -10 },
  { a_m = 0.50, min_deg = -100, max_deg = 100 },
]
tool.target_m = [0.15, 0.02, 0.0]
data = { files = ["measurements.csv"], position_sigma_mm = 0.03, held_out = { fraction = 0.3, seed = 1 } }

[parameters]
"joint*.theta" = { sigma_deg = 0.2 }
"base.*" = { free = true }
"#;

/// Truth of the arm, with ranges of its poses.
const TRUTH: &str = r#"
[random]
"joint*.theta" = { sigma_deg = 0.1 }

[noise]
position_sigma_mm = 0.03

[poses]
q1_deg = [-150, 150]
q2_deg = [0, 120]
q3_deg = [-130, -10]
q4_deg = [-100, 100]
"#;

/// Returns a folder with the arm, 40 measured poses and its estimate.
fn identified() -> Folder {
    let folder = Folder::with([("problem.toml", PROBLEM), ("TRUTH.toml", TRUTH)]);
    folder.simulate(".", "TRUTH.toml", 40, 3, "measurements.csv");
    folder.flexcal("identify . --out est --quiet").success();
    folder
}

/// Function that changes the numbers of a row.
type Change<'a> = &'a dyn Fn(&mut Vec<f64>);

#[test]
fn targets_that_contradict_their_joint_columns_are_asked_about() {
    let folder = identified();
    let table = folder.table("measurements.csv");
    let names = ["q1_deg", "q2_deg", "q3_deg", "q4_deg", "x_mm", "y_mm", "z_mm"];
    let columns = names.map(|name| table.numbers(name));
    let warned = |header: &str, change: &dyn Fn(&mut Vec<f64>)| {
        let rows = (0..5).map(|row| {
            let mut cells: Vec<f64> = columns.iter().map(|column| column[row]).collect();
            change(&mut cells);
            cells.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n"
        });
        folder.write("targets.csv", format!("{header}\n{}", rows.collect::<String>()));
        let command = "compensate . --estimate est/estimate.json --data targets.csv --out out";
        folder.flexcal(command).message()
    };
    let header = names.join(",");
    let cases: [(Change, &str); 4] = [
        (&|row| row.swap(1, 2), "the columns of joints 2 and 3 exchanged"),
        (&|row| row[..4].iter_mut().for_each(|q| *q = q.to_radians()), "start joints in radians"),
        (&|row| row.swap(4, 5), "the columns of x and y exchanged"),
        (&|row| row[6] += 80.0, "another point of the tool"),
    ];
    for (change, words) in cases {
        assert_contains(&warned(&header, change), &[words]);
    }
    let oriented = format!("{header},rx_deg,ry_deg,rz_deg");
    let message = warned(&oriented, &|row| row.extend([10.0, 20.0, 30.0]));
    assert_contains(&message, &["4 joints cannot hold both a position and an orientation"]);
    assert_eq!(warned(&header, &|_| {}), "");
    let far = warned(&header, &|row| row[4..7].iter_mut().for_each(|x| *x *= -0.3));
    assert_contains(&far, &["5 of 5 targets are 300 mm or more from where their joint columns"]);
}

#[test]
fn bounds_of_commands_are_those_of_the_targets_that_are_reached() {
    let folder = identified();
    let table = folder.table("measurements.csv");
    let names = ["q1_deg", "q2_deg", "q3_deg", "q4_deg", "x_mm", "y_mm", "z_mm"];
    let columns = names.map(|name| table.numbers(name));
    let targets = |rows: &[(usize, f64)]| {
        let rows = rows.iter().map(|&(row, factor)| {
            let factor_of = |k: usize| if k < 4 { 1.0 } else { factor };
            let cell = |(k, column): (usize, &Vec<f64>)| (column[row] * factor_of(k)).to_string();
            columns.iter().enumerate().map(cell).collect::<Vec<_>>().join(",") + "\n"
        });
        folder.write("targets.csv", format!("{}\n{}", names.join(","), rows.collect::<String>()));
        let command = "compensate . --estimate est/estimate.json --data targets.csv --out out";
        (folder.flexcal(&format!("{command} --json")), folder.flexcal(command))
    };
    let three = [(0, 1.0), (1, 1.0), (2, 1.0)];
    let (reached, _) = targets(&three);
    let (some, told) = targets(&[&three[..], &[(3, 9.0), (4, 9.0)]].concat());
    let (reached, some) = (reached.success().json(), some.code(1).json());
    assert_eq!(some["unreached"], serde_json::json!([4, 5]));
    for key in ["mean_bound_mm", "expected_error_mm"] {
        assert!(reached[key].is_number() && reached[key] == some[key], "{key}: {some}");
    }
    assert!(!told.stdout.contains("outside the range"), "{told:?}");
    assert!(!told.message().contains("another configuration"), "{told:?}");
}

#[test]
fn a_pool_of_measured_poses_and_a_tolerance_in_metres_are_asked_about() {
    let folder = identified();
    // With few fitted poses, the held-out ones in the pool are wanted.
    folder.write("few.toml", PROBLEM.replace("fraction = 0.3", "fraction = 0.85"));
    let next = "next few.toml --pool measurements.csv --poses 2 --out out";
    let message = folder.flexcal(next).message();
    assert_contains(&message, &["2 of the 2 chosen poses of the pool are measured already"]);
    let message = folder.flexcal("next . --tolerance-mm 0.0002 --poses 1 --out out").message();
    assert_contains(&message, &["write --tolerance-mm 0.2"]);
    let both = "--format mdh --best-rigid --fitted-alone --out arm.txt";
    let run = folder.flexcal(&format!("export . --estimate est/estimate.json {both}")).code(2);
    assert_contains(&run.message(), &["write different geometries"]);
}

#[test]
fn usual_mistakes_in_arguments_get_a_tip() {
    let folder = Folder::with([("problem.toml", PROBLEM)]);
    for (command, words) in [
        ("simulate . --poses 5 --noise 0.05", "the file of --truth says how large the noise"),
        ("identify . —data rows.csv", "write --data"),
        ("identify . .", "a command takes one problem, here ."),
    ] {
        assert_contains(&folder.flexcal(command).code(2).message(), &[words]);
    }
}

#[test]
fn a_loop_over_too_few_poses_asks_for_more() {
    let problem = PROBLEM.replace("\"joint*.theta\"", "\"joint*.a\" = { sigma_mm = 1 }\n\"joint*.d\" = { sigma_mm = 1 }\n\"joint*.alpha\" = { sigma_deg = 0.1 }\n\"joint*.theta\"");
    let folder = Folder::with([("problem.toml", problem.as_str()), ("TRUTH.toml", TRUTH)]);
    folder.simulate(".", "TRUTH.toml", 8, 3, "measurements.csv");
    let printed = folder.flexcal("loop . --out out").success().stdout;
    assert_contains(&printed, &["Next: flexcal plan ", "--poses N"]);
}

//! Gross errors and copied rows, and the one-line reason for exit status 1 of a quiet command.

use std::fs;

use assert_cmd::Command;
use serde_json::Value;

use super::{Bench, text};

/// Adds an error to x in one line of the data [mm].
fn spoil(bench: &Bench, spoiled: usize, by: f64) {
    let place = header(bench).iter().position(|name| name == "x_mm").unwrap();
    bench.map_data(|line, row| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        if line == spoiled {
            cells[place] = (cells[place].parse::<f64>().unwrap() + by).to_string();
        }
        Some(cells.join(","))
    });
}

fn header(bench: &Bench) -> Vec<String> {
    let table = fs::read_to_string(bench.path("a-none.csv")).unwrap();
    table.lines().next().unwrap().split(',').map(str::to_owned).collect()
}

fn run(bench: &Bench, arguments: &str) -> (i32, String, String) {
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let output = flexcal
        .current_dir(bench.folder.path())
        .args(arguments.split_whitespace())
        .output()
        .unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_row_that_carries_the_misfit_is_named_and_to_be_looked_at() {
    let bench = Bench::new();
    spoil(&bench, 16, 200.0);
    let (_, out, _) = run(&bench, "identify . --out out");
    let words = out.split_whitespace().collect::<Vec<_>>().join(" ");
    for expected in [
        "mostly because of 1 pose with gross errors",
        "1 pose causes most of the residual: ./a-none.csv:16 (",
        "Without it χ²/ν is ",
        "Next: check ./a-none.csv:16; a section [robust] in ./problem.toml",
    ] {
        assert!(words.contains(expected), "{expected} missing in:\n{out}");
    }
    assert!(!out.contains("lacks something"), "{out}");
    let json: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("out/estimate.json")).unwrap())
            .unwrap();
    let carried = &json["misfit_carried_by"];
    assert!(
        carried["rows"][0]["line"] == 16 && carried["rows"].as_array().unwrap().len() == 1,
        "{carried}"
    );
    let (with, without) = (&json["reduced_chi2"], &carried["reduced_chi2_without"]);
    assert!(with.as_f64().unwrap() > 1e3 && without.as_f64().unwrap() < 2.0, "{with} {without}");

    let (_, out, _) = run(&bench, "loop . --out out");
    for expected in
        ["Check the influential rows first", "Next: check ./a-none.csv:16; a section [robust]"]
    {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    // With the recommended robust loss there is no remark.
    bench.edit("problem.toml", "[parameters]", "[robust]\nloss = \"huber\"\n\n[parameters]");
    let (_, out, _) = run(&bench, "identify . --out out");
    assert!(!out.contains("causes most") && out.contains("the model explains the data"), "{out}");
}

#[test]
fn a_test_of_outliers_names_the_row_of_the_file() {
    let bench = Bench::new();
    let (_, out, _) = run(&bench, "trace . --out out");
    let (before, _) = out.split_once(" is farthest off, not significantly").unwrap();
    let line = before.rsplit_once("passed: ./a-none.csv:").unwrap().1.parse::<usize>().unwrap();
    let table = fs::read_to_string(bench.path("a-none.csv")).unwrap();
    assert!(table.lines().nth(line - 1).unwrap().contains(",identification,"), "{out}");
}

#[test]
fn copies_are_named_whatever_their_number_and_time_and_repeats_are_not() {
    let bench = Bench::new();
    let (names, table) = (header(&bench), fs::read_to_string(bench.path("a-none.csv")).unwrap());
    let line = |number: usize, changes: &[(&str, &str)]| {
        let row = table.lines().nth(number - 1).unwrap();
        let change = |(name, cell): (&String, &str)| {
            changes
                .iter()
                .find(|(other, _)| other == name)
                .map_or(cell.to_owned(), |(_, other)| (*other).to_owned())
        };
        names.iter().zip(row.split(',')).map(change).collect::<Vec<_>>().join(",")
    };
    let with = |rows: &[String]| {
        fs::write(bench.path("a-none.csv"), table.clone() + &rows.join("\n") + "\n").unwrap();
    };
    let last = table.lines().count();
    with(&[line(6, &[("time_s", "90000"), ("pose", "201")]), line(9, &[])]);
    let (_, _, err) = run(&bench, "identify . --out out");
    let expected = format!(
        "a-none.csv:{}: equal to ./a-none.csv:6 in all digits, and 1 further row repeats another (./a-none.csv:{})",
        last + 1,
        last + 2
    );
    assert!(err.contains(&expected), "{expected} missing in:\n{err}");
    // A repeated measurement of the same pose is no copy.
    with(&[line(6, &[("time_s", "90000"), ("x_mm", "1400.001")])]);
    assert!(!run(&bench, "identify . --out out").2.contains("last digit"));
    // Coarse digits repeat by chance.
    bench.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 0.000001");
    with(&[line(6, &[("time_s", "90000")])]);
    assert!(!run(&bench, "identify . --out out").2.contains("last digit"));
}

#[test]
fn quiet_says_in_one_line_why_the_status_is_1() {
    let bench = Bench::new();
    // Exchanging x and y makes a different arm.
    bench.edit("a-none.csv", "x_mm,y_mm", "y_mm,x_mm");
    for command in ["identify", "trace"] {
        let (status, out, err) = run(&bench, &format!("{command} . --quiet --out out"));
        assert!(status == 1 && out.is_empty(), "{status} {out}");
        assert!(
            err.lines().count() == 1 && err.contains("the fit is not to be trusted: "),
            "{command}: {err}"
        );
    }
}

#[test]
fn rows_that_an_effect_touches_alone_are_no_gross_ones() {
    let bench = Bench::new();
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    fs::copy(cases.join("e-payload-mass.csv"), bench.path("a-none.csv")).unwrap();
    let (_, out, _) = run(&bench, "identify . --out out");
    assert!(
        !out.contains("most of the residual")
            && out.contains("\nNext: flexcal loop . looks for what the model lacks"),
        "{out}"
    );
    let json: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("out/estimate.json")).unwrap())
            .unwrap();
    assert!(
        json["misfit_carried_by"].is_null() && !json["outliers"].as_array().unwrap().is_empty()
    );
}

#[test]
fn a_row_that_carries_little_of_the_misfit_is_not_said_to() {
    let bench = Bench::new();
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    fs::copy(cases.join("h-none-large.csv"), bench.path("a-none.csv")).unwrap();
    bench.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 0.046");
    for line in [16, 21, 60] {
        spoil(&bench, line, 0.35);
        let (_, out, _) = run(&bench, "identify . --out out");
        assert!(out.contains("× the declared σ") && !out.contains("because of"), "{line} {out}");
        spoil(&bench, line, -0.35);
    }
}

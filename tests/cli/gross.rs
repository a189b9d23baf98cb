//! Gross errors and copied rows, and the one-line reason for exit status 1 of a quiet command.

use serde_json::{Value, json};

use crate::common::program::{Folder, assert_contains, entry, items, number};

const DATA: &str = "a-none.csv";

/// Adds an error to x in one line of the data [mm].
fn spoil(folder: &Folder, spoiled: usize, by: f64) {
    spoil_column(folder, "x_mm", spoiled, by);
}

/// Adds an error to the cell of one line and column of the data.
fn spoil_column(folder: &Folder, column: &str, spoiled: usize, by: f64) {
    let place = folder.table(DATA).place(column);
    folder.map_rows(DATA, |line, row| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        if line == spoiled {
            cells[place] = (cells[place].parse::<f64>().unwrap() + by).to_string();
        }
        Some(cells.join(","))
    });
}

/// Identifies the arm and returns the printed text and the estimate.
fn identify(folder: &Folder) -> (String, Value) {
    let run = folder.flexcal("identify . --out out");
    (run.words(), folder.json("out/estimate.json"))
}

#[test]
fn a_row_that_carries_the_misfit_is_named_and_to_be_looked_at() {
    let folder = Folder::with_lunar_sampler();
    spoil(&folder, 16, 200.0);
    let (out, json) = identify(&folder);
    let carried = &json["misfit_carried_by"];
    let [row] = items(&carried["rows"]) else { panic!("{carried}") };
    assert_eq!((&row["file"], &row["line"]), (&json!("./a-none.csv"), &json!(16)));
    let (with, without) = (number(&json["reduced_chi2"]), number(&carried["reduced_chi2_without"]));
    assert!(with > 1e3 && without < 2.0, "{with} {without}");
    assert_contains(
        &out,
        &[
            "because of 1 pose with gross errors",
            "1 pose causes most of the residual: ./a-none.csv:16 (",
            "Without it χ²/ν is ",
            "Next: check ./a-none.csv:16; a section [robust] in ./problem.toml",
        ],
    );
    assert!(!out.contains("lacks something"), "{out}");

    let out = folder.flexcal("loop . --out out").words();
    assert_contains(
        &out,
        &["Check the influential rows first", "Next: check ./a-none.csv:16; a section [robust]"],
    );
    // With the recommended robust loss there is no remark.
    folder.edit("problem.toml", "[parameters]", "[robust]\nloss = \"huber\"\n\n[parameters]");
    let (out, json) = identify(&folder);
    assert!(json["misfit_carried_by"].is_null() && !out.contains("causes most"), "{out}");
    assert!(out.contains("the model explains the data"), "{out}");
}

#[test]
fn a_cause_is_not_stated_while_a_gross_error_counts_in_the_fit() {
    let folder = Folder::new();
    folder.copy("problems/lunar-sampler/problem.toml", "problem.toml");
    folder.copy("problems/lunar-sampler/measurements.csv", DATA);
    spoil_column(&folder, "z_mm", 19, 4.0);
    let run = folder.flexcal(&format!("loop . --data {DATA} --out out")).code(1);
    let json = folder.json("out/loop.json");
    assert_eq!((&json["verdict"], &json["trusted"]), (&json!("unexplained"), &json!(false)));
    assert!(items(&json["effects"]).iter().all(|effect| effect["status"] != "found"), "{json}");
    let finding = entry(&json["findings"], |of| of["code"] == "excluded-rows-fitted");
    assert_eq!(items(&finding["numbers"]["rows"])[0]["line"], 19);
    assert_contains(
        &run.words(),
        &["No cause is claimed", "Next: check a-none.csv:19; a section [robust] in ./problem.toml"],
    );
    assert_contains(&folder.read("out/report.html"), &["counts in full in the fit"]);
}

#[test]
fn a_test_of_outliers_names_the_row_of_the_file() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("trace . --out out");
    let trace = folder.json("out/trace.json");
    let test = entry(&trace["checks"], |check| check["check"] == "outliers");
    assert_eq!(test["failed"], false);
    let (place, _) =
        test["words"].as_str().unwrap().split_once(" has the largest residual").unwrap();
    let line = place.strip_prefix("./a-none.csv:").unwrap().parse::<usize>().unwrap();
    assert_eq!(folder.table(DATA).column("split")[line - 2], "identification", "{place}");
}

#[test]
fn copies_are_named_whatever_their_number_and_time_and_repeats_are_not() {
    let folder = Folder::with_lunar_sampler();
    let (text, table) = (folder.read(DATA), folder.table(DATA));
    let line = |number: usize, changes: &[(&str, &str)]| {
        let mut row = table.rows[number - 2].clone();
        for (column, cell) in changes {
            row[table.place(column)] = (*cell).to_owned();
        }
        row.join(",")
    };
    let message = |rows: &[String]| {
        folder.write(DATA, text.clone() + &rows.join("\n") + "\n");
        folder.flexcal("identify . --out out").message()
    };
    let last = text.lines().count();
    let said = message(&[line(6, &[("time_s", "90000"), ("pose", "201")]), line(9, &[])]);
    let expected = format!(
        "a-none.csv:{}: equal to ./a-none.csv:6 in all digits, and 1 further row repeats another (./a-none.csv:{})",
        last + 1,
        last + 2
    );
    assert_contains(&said, &[&expected]);
    // A repeated measurement of the same pose is no copy.
    let said = message(&[line(6, &[("time_s", "90000"), ("x_mm", "1400.001")])]);
    assert!(!said.contains("in all digits"), "{said}");
    // Coarse digits repeat by chance.
    folder.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 0.000001");
    let said = message(&[line(6, &[("time_s", "90000")])]);
    assert!(!said.contains("in all digits"), "{said}");
}

#[test]
fn quiet_says_in_one_line_why_the_status_is_1() {
    let folder = Folder::with_lunar_sampler();
    // Exchanging x and y makes a different arm.
    folder.edit(DATA, "x_mm,y_mm", "y_mm,x_mm");
    for command in ["identify", "trace"] {
        let run = folder.flexcal(&format!("{command} . --quiet --out out")).code(1);
        assert!(run.stdout.is_empty() && run.stderr.lines().count() == 1, "{run:?}");
        assert_contains(&run.stderr, &["the fit is not to be trusted: "]);
    }
    // Without a trusted fit there is no explanation, and without σ its size is not judged.
    folder.edit("problem.toml", "position_sigma_mm = 0.05\n", "");
    let said = folder.flexcal("trace . --out out").code(1).words();
    assert_contains(&said, &["Declare position_sigma_mm in [data]", "No cause is claimed"]);
    assert!(!said.contains("Most probable explanations"), "{said}");
}

#[test]
fn rows_that_an_effect_touches_alone_are_no_gross_ones() {
    let folder = Folder::with_lunar_sampler();
    folder.copy("tests/cases/e-payload-mass.csv", DATA);
    let (out, json) = identify(&folder);
    assert!(json["misfit_carried_by"].is_null() && !items(&json["outliers"]).is_empty());
    assert!(!out.contains("most of the residual"), "{out}");
    assert_contains(&out, &["Next: flexcal loop . looks for what the model lacks"]);
}

#[test]
fn a_row_that_carries_little_of_the_misfit_is_not_said_to() {
    let folder = Folder::with_lunar_sampler();
    folder.copy("tests/cases/h-none-large.csv", DATA);
    folder.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 0.046");
    for line in [16, 21, 60] {
        spoil(&folder, line, 0.35);
        let (out, json) = identify(&folder);
        assert!(json["misfit_carried_by"].is_null(), "{line}: {json}");
        assert!(out.contains("× the declared σ") && !out.contains("because of"), "{line} {out}");
        spoil(&folder, line, -0.35);
    }
}

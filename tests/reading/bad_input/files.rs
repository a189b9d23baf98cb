//! Errors of whole problems, and unreadable files.

use std::path::PathBuf;

use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

use super::reading::{ARM, check, problem};
use crate::common::arms::parse;
use crate::common::program::Folder;
use crate::common::reading::{problem_error, read_tables};

#[test]
fn whole_problems() {
    let mistakes: [(&str, &[&str]); 16] = [
        ("", &["problem.toml:1: name: missing"]),
        ("name = ''", &[":1: name: empty"]),
        ("name = 'a/b'", &[":1: name: ", "cannot name a folder"]),
        ("name = '..'", &[":1: name: "]),
        ("name = 3", &[":1: name: expected text", "found a number"]),
        ("name = 'arm'", &["joint: ", "at least one joint"]),
        ("name = 'arm'\njoint = []", &["joint: ", "at least one joint"]),
        ("name = 'arm'\n[joint]\na_m = 1", &[":2: joint: ", "double brackets"]),
        ("name = 'arm'\nname = 'leg'", &[":2: not valid TOML: duplicate key, near `name`"]),
        ("name = 'arm'\n\n[[joint]", &[":3: not valid TOML"]),
        ("name = 'arm", &[":1: not valid TOML"]),
        ("name = 'arm'\n[[joint]]\nd_m = 0,1273\n", &["write numbers with a decimal point"]),
        ("name = 'arm'\n[parameters]\nbase.* = 1\n", &["write a pattern in quotes"]),
        ("q1_deg,x_mm\n1,2\n", &["PROBLEM is a problem.toml or its folder"]),
        ("name = 'arm'\nmass_kg = 3\n[[joint]]", &[":2: mass_kg: unknown key", "gravity_m_s2"]),
        (
            "name = 'arm'\ngravity = [0, 0, 1]\n[[joint]]",
            &[":2: gravity: ", "needs a unit", "gravity_m_s2"],
        ),
    ];
    for (text, words) in mistakes {
        check(&problem_error(text), text, words);
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = Folder::new();
    let error = Problem::read(&folder.path("")).unwrap_err();
    check(&error, "no problem.toml", &["problem.toml: no such file"]);
    let file = folder.path("elsewhere.toml");
    check(&Problem::read(&file).unwrap_err(), "no file", &["elsewhere.toml: no such file"]);
    folder.write("elsewhere.toml", b"name = 'arm'\ntitle = '\xff'\n");
    check(&Problem::read(&file).unwrap_err(), "binary", &["elsewhere.toml:2: not UTF-8"]);

    let read = |text: &str| {
        let problem = problem(text).unwrap();
        Measurements::read(&problem.data.files, &problem).unwrap_err()
    };
    let named = format!("{ARM}[data]\nfiles = ['nowhere.csv']");
    check(
        &read(&named),
        "missing data file",
        &["problem.toml:4: data.files: no such file: nowhere.csv"],
    );
    check(&read(&format!("{ARM}[data]")), "no files", &["problem.toml:3: data: no measurements"]);
    check(&read(ARM), "no data", &["problem.toml: data: no measurements"]);

    let problem = problem(ARM).unwrap();
    let other = PathBuf::from("other.csv");
    let error = Measurements::read(std::slice::from_ref(&other), &problem).unwrap_err();
    check(&error, "missing file", &["other.csv: no such file"]);
    let error = Measurements::read(&[folder.path("")], &problem).unwrap_err();
    check(&error, "a folder", &["cannot be read"]);
}

#[test]
fn files_that_differ() {
    let problem = parse(ARM);
    let read = |first: &str, second: &str| {
        let cell = |column: &str| if column.is_empty() { "" } else { ",1" };
        let first = format!("q1_deg,x_m,y_m,z_m{first}\n0,0,0,0{}\n", cell(first));
        let second = format!("q1_rad,z_m,y_m,x_m{second}\n0,0,0,0{}\n", cell(second));
        read_tables(&problem, &[("1.csv", first), ("2.csv", second)])
    };
    check(
        &read("", ",session").unwrap_err(),
        "more",
        &["2.csv:1: column session: ", "1.csv does not have it"],
    );
    check(
        &read(",hoist_N", "").unwrap_err(),
        "fewer",
        &["2.csv:1: column hoist_N: ", "1.csv has this column, this file does not"],
    );
    assert!(read("", "").is_ok() && read(",pose", "").is_ok() && read(",note", "").is_ok());
    let text = format!("{ARM}\n[data]\nfiles = [\"1.csv\", \"./1.csv\"]\n");
    let table = "q1_deg,x_m,y_m,z_m\n0,0,0,0\n";
    let folder = Folder::with([("1.csv", table), ("problem.toml", &text)]);
    let twice = [folder.path("1.csv"), folder.path("1.csv")];
    check(
        &Measurements::read(&twice, &problem).unwrap_err(),
        "twice",
        &["1.csv: named twice on the command line"],
    );
    let named = Problem::read(&folder.path("problem.toml")).unwrap();
    check(
        &Measurements::read(&named.data.files, &named).unwrap_err(),
        "twice in the problem",
        &[&format!("problem.toml:{}: data.files: ", text.lines().count()), "1.csv is named twice"],
    );
}

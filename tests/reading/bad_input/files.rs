//! Errors of whole problems, and unreadable files.

use std::path::PathBuf;

use flexcal::fit::SavedEstimate;
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

use super::reading::{ARM, check, problem};
use crate::common::arms::parse;
use crate::common::program::Folder;
use crate::common::reading::{problem_error, read_tables};

#[test]
fn whole_problems() {
    let mistakes: [(&str, &[&str]); 32] = [
        ("", &["problem.toml:1: an empty file, not a problem.toml; flexcal init makes one"]),
        ("name = ''", &[":1: name: empty"]),
        ("name = 'a/b'", &[":1: name: ", "cannot name a folder"]),
        ("name = '..'", &[":1: name: "]),
        ("name = 3", &[":1: name: expected text", "found a number"]),
        ("name = 'arm'", &["joint: ", "at least one joint"]),
        ("name = 'arm'\njoint = []", &["joint: ", "at least one joint"]),
        ("name = 'arm'\n[joint]\na_m = 1", &[":2: joint: ", "double brackets"]),
        (
            "name = 'arm'\nname = 'leg'",
            &[":2: not valid TOML: duplicate key, given already on line 1, near `name`"],
        ),
        ("name = 'arm'\n\n[[joint]", &[":3: not valid TOML"]),
        ("name = 'arm", &[":1: not valid TOML"]),
        ("name = 'arm'\n[[joint]]\nd_m = 0,1273\n", &["write numbers with a decimal point"]),
        ("name = 'arm'\n[parameters]\nbase.* = 1\n", &["write a pattern in quotes"]),
        ("q1_deg,x_mm\n1,2\n", &["PROBLEM is a problem.toml or its folder"]),
        ("{\n\"problem\": 1}", &[":1: a JSON file, not TOML; PROBLEM is", "--estimate names"]),
        ("<?xml version='1.0'?>", &[":1: an XML file, not TOML; flexcal init FILE makes"]),
        ("<!DOCTYPE html>\n<html>", &[":1: an HTML page, not TOML"]),
        ("# arm\nname: arm\n", &[":2: a YAML file, not TOML"]),
        (
            "name = “arm”",
            &["a typographic quotation mark (U+201C), near `“arm”`; write the straight"],
        ),
        (
            "name = 'arm'\n[[joint]]\na_m = −0.3",
            &[
                ":3: not valid TOML: a typographic minus sign or dash (U+2212), near `−0.3`; write the -",
            ],
        ),
        (
            "name = 'arm'\n[[joint]]\na_m\u{a0}= 0.3",
            &["an invisible or no-break space (U+00A0); write"],
        ),
        (
            "name = 'arm'\n[[joint]]\nalpha_deg = -90°",
            &["a degree sign (U+00B0), near `-90°`; write"],
        ),
        ("name = 'arm'\n[[joint]]\nalpha_rad = -pi/2", &["a calculation, near `-pi/2`; write its"]),
        ("name = 'arm'\n[data]\nheld_out = { fraction = 1/3 }", &["a calculation, near `1/3`"]),
        ("name = 'arm'\n[parameters]\na = { free = wahr }", &["near `wahr`; write true or false"]),
        ("name = 'arm'\n[parameters]\na = { free = True }", &["near `True`; write true or false"]),
        (
            "name = 'arm'\n[data]\nfiles = [\"C:\\Users\\me.csv\"]",
            &[
                ":3: not valid TOML: a \\ in double quotes",
                "write / in its place, or put the path in",
            ],
        ),
        (
            "name = 'arm'\n[data]\nfiles = [\"C:\\data\\m.csv\"]",
            &[":3: not valid TOML: a \\ in double quotes"],
        ),
        (
            "name = 'arm'\n[data.columns]\nJoint 1 = \"q1_deg\"",
            &[":3: not valid TOML: a key with a space", "as in \"Joint 1\" = \"q1_deg\""],
        ),
        ("name = 'arm'\n[[effect]]\n1. found: a", &["the line is no `key = value`, no [section]"]),
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

    for (bytes, format) in [
        (&b"PK\x03\x04"[..], "a ZIP archive or a workbook"),
        (b"%PDF-1.7\xe2", "a PDF document"),
        (b"\x93NUMPY\x01", "a NumPy array"),
        (b"MATLAB 5.0 MAT-file\x01\xff", "a MATLAB file"),
        (b"#ROSBAG V2.0\n\xff", "a ROS bag"),
        (b"\x1f\x8b\x08", "a file compressed by gzip"),
    ] {
        folder.write("elsewhere.toml", bytes);
        let expected = format!("elsewhere.toml: {format}");
        check(&Problem::read(&file).unwrap_err(), format, &[&expected, "not a problem.toml"]);
        let error = read_tables(&parse(ARM), &[("rows.csv", bytes)]).unwrap_err();
        let expected = format!("rows.csv: {format}");
        check(&error, format, &[&expected, "not a table; save or export it as CSV"]);
        let error = SavedEstimate::read(&file).unwrap_err().to_string();
        let expected = "not an estimate.json; flexcal identify writes one";
        assert!(error.contains(format) && error.contains(expected), "{error}");
    }

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
    check(&error, "a folder", &["cannot be read: it is a folder; give a regular file"]);
}

#[test]
fn files_that_are_no_estimate() {
    for (text, words) in [
        (
            "q1_deg,x_mm\n1,2\n",
            "a table in text (CSV), not an estimate.json; flexcal identify writes one, and",
        ),
        ("name = 'arm'\n", "a TOML file, not an estimate.json; flexcal identify writes one"),
        ("<!DOCTYPE html>", "an HTML page, not an estimate.json"),
        (
            "{\"format\": {\"name\": \"flexcal-loop\", \"version\": 2}}",
            "format: a file of flexcal-loop, not an estimate.json; flexcal identify writes one",
        ),
        ("{\"a\": ", "not an estimate.json: EOF while parsing"),
    ] {
        let error = SavedEstimate::parse(text, &PathBuf::from("e.json")).unwrap_err();
        crate::common::program::assert_contains(&error.to_string(), &["e.json: ", words]);
    }
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

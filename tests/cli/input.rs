//! Arguments and input errors: exit status, messages, and no output after bad input.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

use super::{Bench, text};

#[test]
fn the_problem_may_stand_behind_the_data_or_in_the_current_folder() {
    let bench = Bench::new();
    let run = |arguments: &str| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command.current_dir(bench.folder.path()).args(arguments.split(' ')).assert()
    };
    run("identify --quiet --data a-none.csv problem.toml").success();
    run("identify --quiet").success();
    run("identify --quiet --data a-none.csv --out elsewhere").success();
    assert!(
        bench.path("out/lunar-sampler/estimate.json").exists()
            && bench.path("elsewhere/estimate.json").exists()
    );
    // A closed problem gets a separate folder.
    fs::copy(bench.path("problem.toml"), bench.path("problem.closed.toml")).unwrap();
    run("identify problem.closed.toml --quiet").success();
    assert!(bench.path("out/lunar-sampler-closed/estimate.json").exists());
    // A plan can be simulated.
    let truth = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/truth.toml");
    fs::copy(truth, bench.path("truth.toml")).unwrap();
    let room = "--workspace-mm=-4000,4000,0,4000,-4000,4000 --keep-out-mm 1,0,0,-500";
    run(&format!("plan --truth truth.toml --poses 12 --quiet --out plan {room}"));
    run("simulate --truth truth.toml --data plan/plan.csv --seed 3 --quiet --out rig").success();
    let rows = |name: &str| {
        let mut table = csv::Reader::from_path(bench.path(name)).unwrap();
        let header: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
        let rows: Vec<Vec<String>> =
            table.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
        move |column: &str| {
            let place = header.iter().position(|name| name == column).unwrap();
            rows.iter().map(|row| row[place].parse().unwrap()).collect::<Vec<f64>>()
        }
    };
    let (planned, measured) = (rows("plan/plan.csv"), rows("rig/measurements.csv"));
    assert_eq!(planned("q2_deg"), measured("q2_deg"));
    assert!(
        measured("y_mm").iter().all(|y| *y > -100.0)
            && measured("x_mm").iter().all(|x| *x > -600.0)
    );
    let assert = run("plan --truth truth.toml --poses 12 --workspace-mm 1,0,0,1,0,1").code(2);
    assert!(text(&assert.get_output().stderr).contains("the box is empty"));
}

#[test]
fn too_few_equations_are_not_trusted() {
    let bench = Bench::new();
    let problem = fs::read_to_string(bench.path("problem.toml")).unwrap();
    let (arm, _) = problem.split_once("[parameters]").unwrap();
    let free = "[parameters]\n\"*\" = { free = true }\n[data]\nfiles = [\"a-none.csv\"]\nposition_sigma_mm = 0.05\n\
                held_out = { column = \"split\" }\n";
    fs::write(bench.path("problem.toml"), format!("{arm}{free}")).unwrap();
    let mut kept = 0;
    let text_of = fs::read_to_string(bench.path("a-none.csv")).unwrap();
    let rows: Vec<&str> = text_of
        .lines()
        .filter(|line| {
            kept += usize::from(line.contains("identification"));
            !line.contains("identification") || kept <= 5
        })
        .collect();
    fs::write(bench.path("a-none.csv"), rows.join("\n")).unwrap();
    let assert = bench.identify(&[]).code(1);
    assert!(text(&assert.get_output().stderr).contains("15 measured coordinates for"));
    let json: Value = serde_json::from_str(
        &fs::read_to_string(bench.path("out/lunar-sampler/estimate.json")).unwrap(),
    )
    .unwrap();
    assert_eq!(json["trusted"], false);
}

/// File edit that makes an error, and the words that the message must contain.
type Mistake = (&'static str, fn(&Bench), &'static [&'static str]);

const DATA: &str = "a-none.csv";
const PROBLEM: &str = "problem.toml";

#[test]
fn where_nothing_is_free_every_command_that_fits_says_so() {
    let bench = Bench::new();
    let problem = fs::read_to_string(bench.path("problem.toml")).unwrap();
    let (arm, _) = problem.split_once("[parameters]").unwrap();
    let data = "[data]\nfiles = [\"a-none.csv\"]\nposition_sigma_mm = 0.05\nheld_out = { column = \"split\" }\n";
    fs::write(bench.path("problem.toml"), format!("{arm}{data}")).unwrap();
    for command in ["identify", "trace", "loop"] {
        let mut run = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        let assert = run.current_dir(bench.folder.path()).arg(command).assert();
        let said = text(&assert.get_output().stderr);
        assert!(
            said.contains("no parameter is free, so the nominal arm is judged"),
            "{command}: {said}"
        );
    }
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table of mistakes")]
fn bad_input_is_named_and_leaves_nothing_behind() {
    let mistakes: &[Mistake] = &[
        ("empty file", |b| fs::write(b.path(DATA), "").unwrap(), &[DATA, "empty"]),
        ("header only", |b| b.map_data(|_, _| None), &[DATA, "no rows"]),
        ("NaN", |b| b.edit(DATA, "1840.7678", "NaN"), &["a-none.csv:2", "x_mm", "finite"]),
        ("infinity", |b| b.edit(DATA, "1840.7678", "inf"), &["a-none.csv:2", "x_mm", "finite"]),
        (
            "text in a number",
            |b| b.edit(DATA, "1840.7678", "far"),
            &["a-none.csv:2", "x_mm", "far"],
        ),
        (
            "short row",
            |b| b.map_data(|n, l| Some(if n == 5 { "4,identification".into() } else { l.into() })),
            &["a-none.csv:5", "fields"],
        ),
        ("missing column", |b| b.edit(DATA, ",z_mm,", ",height_mm,"), &[DATA, "z_mm"]),
        ("doubled column", |b| b.edit(DATA, ",payload_kg,", ",x_m,"), &[DATA, "x_m"]),
        ("no unit in the data", |b| b.edit(DATA, "q2_deg", "q2"), &[DATA, "q2", "unit"]),
        (
            "no unit in the problem",
            |b| b.edit(PROBLEM, "alpha_deg = 90.0", "alpha = 90.0"),
            &["problem.toml:15", "alpha", "unit"],
        ),
        (
            "no held-out rows",
            |b| b.map_data(|_, l| Some(l.replace("validation", "identification"))),
            &["held out"],
        ),
        (
            "no identification rows",
            |b| b.map_data(|_, l| Some(l.replace("identification", "validation"))),
            &["no rows are left to fit"],
        ),
        (
            "unknown split word",
            |b| b.edit(DATA, ",validation,", ",test,"),
            &["a-none.csv:2", "split", "test"],
        ),
        (
            "binary junk",
            |b| fs::write(b.path(DATA), [0xff, 0xfe, 0x00, 0x80, b'\n']).unwrap(),
            &[DATA],
        ),
        ("binary problem", |b| fs::write(b.path(PROBLEM), [0xff, 0xfe, 0x00]).unwrap(), &[PROBLEM]),
        (
            "unknown key",
            |b| b.edit(PROBLEM, "beam_elements = 1", "beam_pieces = 1"),
            &["problem.toml:7", "beam_pieces"],
        ),
        (
            "negative mass",
            |b| b.edit(PROBLEM, "mass_kg = 4.2", "mass_kg = -4.2"),
            &["problem.toml:27", "mass_kg"],
        ),
        (
            "zero stiffness",
            |b| b.edit(PROBLEM, "5.2e4", "0.0"),
            &["problem.toml:17", "stiffness_N_m_per_rad"],
        ),
        (
            "no joints",
            |b| {
                fs::write(b.path(PROBLEM), "name = \"none\"\n[data]\nfiles = [\"a-none.csv\"]\n")
                    .unwrap();
            },
            &[PROBLEM, "joint"],
        ),
        ("broken TOML", |b| b.edit(PROBLEM, "[statics]", "[statics"), &["problem.toml:5"]),
        (
            "pattern that matches nothing",
            |b| b.edit(PROBLEM, "\"B.*\"", "\"C.*\""),
            &["problem.toml:77", "C.*", "matches no parameter of this arm; they are"],
        ),
        (
            "min above max",
            |b| {
                b.edit(
                    PROBLEM,
                    "\"tool.*\" = { sigma_mm = 5.0 }",
                    "\"tool.*\" = { min_mm = 2, max_mm = -2 }",
                );
            },
            &["problem.toml:78", "min"],
        ),
        (
            "σ of the wrong kind",
            |b| {
                b.edit(
                    PROBLEM,
                    "\"tool.*\" = { sigma_mm = 5.0 }",
                    "\"tool.*\" = { sigma_deg = 5.0 }",
                );
            },
            &["problem.toml:78", "tool.x", "_mm"],
        ),
        (
            "missing data file",
            |b| fs::remove_file(b.path(DATA)).unwrap(),
            &["problem.toml:81", DATA],
        ),
        (
            "no data file",
            |b| b.edit(PROBLEM, "files = [\"a-none.csv\"]\n", ""),
            &["problem.toml:80", "`files` or with --data"],
        ),
        ("missing problem", |b| fs::remove_file(b.path(PROBLEM)).unwrap(), &["no such file"]),
        (
            "zero sigma",
            |b| b.edit(PROBLEM, "position_sigma_mm = 0.05", "position_sigma_mm = 0.0"),
            &["problem.toml:82", "position_sigma_mm"],
        ),
        (
            "an arm too soft to stand",
            |b| b.edit(PROBLEM, "5.2e4", "1.0"),
            &["a-none.csv:2", "equilibrium"],
        ),
    ];
    for (what, spoil, expected) in mistakes {
        let bench = Bench::new();
        spoil(&bench);
        let assert = bench.identify(&[]).code(2);
        let output = assert.get_output();
        let message = text(&output.stderr);
        for word in *expected {
            assert!(message.contains(word), "{what}: {word:?} missing in: {message}");
        }
        assert!(
            message.starts_with("error: ") && !message.contains("panicked"),
            "{what}: {message}"
        );
        assert!(
            output.stdout.is_empty() && !bench.path("out").exists(),
            "{what} left something behind"
        );
    }
}

#[test]
fn wrong_arguments_end_with_status_two_and_help_with_zero() {
    let flexcal = || Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    flexcal().args(["identify"]).assert().code(2);
    flexcal().args(["identify", ".", "--strategy", "guess"]).assert().code(2);
    flexcal().args(["--help"]).assert().success();
    flexcal().args(["identify", "--help"]).assert().success();
}

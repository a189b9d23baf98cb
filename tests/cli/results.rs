//! Result files: reproducible, and without overwriting foreign files.

use std::fs;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

use crate::common::program::{Folder, Run, assert_contains};

#[test]
fn results_repeat_to_the_byte_but_for_the_time() {
    let folder = Folder::with_lunar_sampler();
    let run = || {
        let mut json = folder.flexcal("identify . --json").json();
        json["seconds"] = Value::Null;
        for key in ["seconds", "digest"] {
            json["digest"][key] = Value::Null;
        }
        json
    };
    assert_eq!(run(), run());
}

#[test]
fn a_result_that_cannot_be_written_is_an_error() {
    let folder = Folder::with_lunar_sampler();
    folder.write("taken", "a file where a folder is wanted");
    let run = folder.flexcal("identify . --out taken").code(2);
    assert_contains(&run.stderr, &["cannot write"]);
    // One file that cannot be written prevents all output.
    fs::create_dir_all(folder.path("page/report.html")).unwrap();
    folder.write("drawn/figures", "");
    for out in ["page", "drawn"] {
        folder.flexcal(&format!("identify . --out {out}")).code(2);
        assert_eq!(fs::read_dir(folder.path(out)).unwrap().count(), 1, "{out}");
    }
}

#[cfg(unix)]
#[test]
fn new_results_are_for_whom_files_are_and_older_ones_keep_their_permissions() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = Folder::with_lunar_sampler();
    let mode = |name: &str| fs::metadata(folder.path(name)).unwrap().permissions().mode() & 0o777;
    folder.write("made", "");
    folder.flexcal("identify . --quiet --out out").success();
    assert_eq!(mode("out/estimate.json"), mode("made"), "new");
    assert_eq!(mode("out/report.html"), mode("made"), "new");
    fs::set_permissions(folder.path("out/estimate.json"), fs::Permissions::from_mode(0o640))
        .unwrap();
    folder.flexcal("identify . --quiet --out out").success();
    assert_eq!(
        (mode("out/estimate.json"), mode("out/report.html")),
        (0o640, mode("made")),
        "older"
    );
}

#[test]
fn figures_of_an_older_page_go_and_other_files_stay() {
    let folder = Folder::with_cases(&["problem.toml", "f-two.csv"]);
    let flexcal =
        |command: &str| folder.flexcal(&format!("{command} . --data f-two.csv --out out"));
    let is_there = |name: &str| folder.has(format!("out/figures/{name}"));
    flexcal("loop").success();
    assert!(is_there("effect-1.svg"));
    let write = |name: &str| folder.write(format!("out/figures/{name}"), "mine");
    ["effect-mine.svg", "mine.svg", "ranking.txt"].into_iter().for_each(write);
    flexcal("identify").success();
    assert!(!is_there("effect-1.svg"));
    let kept = ["effect-mine.svg", "mine.svg", "ranking.txt", "residual-order.svg"];
    assert!(kept.into_iter().all(is_there));
    // A foreign file with the name of a figure prevents all output before any work.
    write("effect-1.svg");
    let run = flexcal("identify").code(2);
    assert_contains(&run.stderr, &["figures/effect-1.svg exists and was not written by flexcal"]);
}

#[test]
fn runs_into_one_folder_at_once_leave_one_whole_result() {
    let folder = Folder::with_lunar_sampler();
    for _ in 0..3 {
        let started: Vec<_> = (0..6)
            .map(|_| {
                std::process::Command::new(cargo_bin!("flexcal"))
                    .current_dir(folder.path(""))
                    .args(["identify", "problem.toml", "--data", "a-none.csv", "--out", "same"])
                    .arg("--quiet")
                    .spawn()
                    .unwrap()
            })
            .collect();
        for mut run in started {
            assert!(run.wait().unwrap().success());
        }
        folder.flexcal("identify . --quiet --out same").success();
    }
}

#[test]
fn a_result_whose_writer_was_killed_is_completed_by_the_next_command() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify . --quiet --out out").success();
    folder.flexcal("identify . --quiet --out new --data a-none.csv").success();
    // The writer was killed after its first file had taken its place.
    let moved = ["estimate.json", "residuals.csv", "report.md", "report.html", ".flexcal"];
    fs::create_dir(folder.path("out/.flexcal-new")).unwrap();
    fs::copy(folder.path("out/.flexcal"), folder.path("out/.flexcal-new/.flexcal-replaced"))
        .unwrap();
    for name in moved {
        let stage = if name == "estimate.json" { "out" } else { "out/.flexcal-new" };
        fs::copy(folder.path(format!("new/{name}")), folder.path(format!("{stage}/{name}")))
            .unwrap();
    }
    let figures = folder.path("out/.flexcal-new/figures");
    fs::rename(folder.path("new/figures"), figures).unwrap();
    let predict = "predict problem.toml --data a-none.csv --estimate out/estimate.json --out p";
    folder.flexcal(predict).success();
    assert!(!folder.has("out/.flexcal-new"));
    for name in moved {
        assert_eq!(
            folder.read(format!("out/{name}")),
            folder.read(format!("new/{name}")),
            "{name}"
        );
    }
    folder.flexcal("identify . --quiet --out out").success();
}

#[test]
fn files_of_a_result_that_were_changed_are_not_believed() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify . --quiet --out out").success();
    folder.edit("out/residuals.csv", "true", "false");
    let compare = "compare-results out/estimate.json out/estimate.json --out compared";
    let run = folder.flexcal(compare).code(2);
    assert_contains(&run.stderr, &["out/residuals.csv: changed since flexcal wrote it"]);
    let run = folder.flexcal(&format!("{compare} --trust")).success();
    assert_contains(&run.stderr, &["residuals.csv: changed", "used all the same"]);
    // Names of the folder's own records, and a test program that would not end.
    let export = "export . --estimate out/estimate.json --format";
    let run = folder.flexcal(&format!("{export} dh --out made/.flexcal")).code(2);
    assert_contains(&run.stderr, &["for flexcal's own records"]);
    folder.flexcal(&format!("{export} c --test-poses 10000000000 --out made")).code(2);
    assert!(!folder.has("made"));
}

#[test]
fn changed_poses_are_said_and_newer_or_endless_numbers_refused() {
    let folder = Folder::with_lunar_sampler();
    folder.copy("problems/lunar-sampler/TRUTH.toml", "TRUTH.toml");
    folder.flexcal("simulate . --truth . --poses 3 --seed 1 --quiet --out out").success();
    let again = "simulate . --truth . --data out/measurements.csv --seed 1 --out again";
    assert!(!folder.flexcal(again).success().stderr.contains("changed since"));
    folder.write("out/measurements.csv", folder.read("out/measurements.csv") + "\n");
    let run = folder.flexcal(again).success();
    assert_contains(&run.stderr, &["out/measurements.csv: changed since flexcal wrote it; used"]);
    let format = "\"format\": {\"name\": \"flexcal-loop\", \"version\": 99}";
    let newer = format!("{{{format}, \"causes\": []}}");
    folder.write("loop.json", newer);
    let run = folder.flexcal("next . --truth . --for causes --explanations loop.json").code(2);
    assert_contains(&run.stderr, &["loop.json: format: version 99"]);
    let head = "format = \"flexcal-prior\"\nversion = 1\nproblem = \"lunar-sampler\"\narms = 3\n";
    let parameter = "\"joint3.d\" = { mean = 9e18, mean_error = 1.0, spread = 1.0 }\n";
    folder.write("PRIOR.toml", format!("{head}[arm_parts]\n[parameters]\n{parameter}"));
    let run = folder.flexcal("identify . --prior PRIOR.toml").code(2);
    assert_contains(&run.stderr, &["joint3.d", "numbers below 1e9"]);
}

#[test]
fn a_prior_that_was_cut_or_holds_impossible_numbers_is_refused() {
    let folder = Folder::with_lunar_sampler();
    let names = ["a-none", "h-none-large", "c-link-thermal-bending"];
    for name in names {
        folder.copy(&format!("tests/cases/{name}.csv"), format!("{name}.csv"));
        folder.flexcal(&format!("identify . --data {name}.csv --quiet --out {name}"));
    }
    let estimates = names.map(|name| format!("{name}/estimate.json")).join(" ");
    folder.flexcal(&format!("fleet {estimates} --out PRIOR.toml")).success();
    let whole = folder.read("PRIOR.toml");
    let identify = |text: &str| {
        // In another folder, whose record does not know the file.
        std::fs::create_dir_all(folder.path("other")).unwrap();
        folder.write("other/PRIOR.toml", text);
        folder.flexcal("identify . --data a-none.csv --prior other/PRIOR.toml --out with")
    };
    assert_eq!(identify(&format!("# a comment\n{whole}")).success().status, 0);
    let lines: Vec<&str> = whole.lines().collect();
    let cut = lines[..lines.len() - 4].join("\n");
    assert_contains(&identify(&cut).code(2).stderr, &["PRIOR.toml: changed or cut since"]);
    let undigested: Vec<&str> =
        lines.iter().filter(|line| !line.starts_with("digest")).copied().collect();
    let undigested = undigested.join("\n");
    assert_eq!(identify(&undigested).success().status, 0);
    for arms in ["0", "-1"] {
        let changed = undigested.replace("\narms = 3\n", &format!("\narms = {arms}\n"));
        let words = format!("arms = {arms}, but a fleet has at least 3");
        assert_contains(&identify(&changed).code(2).stderr, &[&words]);
    }
    let (start, rest) = undigested.split_once("spread = ").unwrap();
    let (_, end) = rest.split_once(' ').unwrap();
    for spread in ["0.0", "-1e-3"] {
        let run = identify(&format!("{start}spread = {spread} {end}")).code(2);
        assert_contains(&run.stderr, &["joint1.", "spread is above 0"]);
    }
}

#[test]
fn an_estimate_with_parts_of_another_is_refused() {
    let folder = Folder::with_lunar_sampler();
    folder.copy("tests/cases/c-link-thermal-bending.csv", "other.csv");
    folder.flexcal("identify . --quiet --out out").success();
    folder.flexcal("identify . --quiet --data other.csv --out other").success();
    let (mut mixed, other) = (folder.json("out/estimate.json"), folder.json("other/estimate.json"));
    mixed["parameters"] = other["parameters"].clone();
    mixed["digest"]["parameters"] = other["digest"]["parameters"].clone();
    folder.write("mixed.json", mixed.to_string());
    let predict = "predict . --data a-none.csv --estimate mixed.json --out predicted";
    assert_contains(&folder.flexcal(predict).code(2).stderr, &["mixed.json: digest: changed"]);
    // An older file, which has no digest of all digests.
    mixed["digest"].as_object_mut().unwrap().remove("digest");
    folder.write("mixed.json", mixed.to_string());
    folder.flexcal(predict).success();
}

#[test]
fn an_estimate_that_was_changed_is_refused_or_said() {
    const ESTIMATE: &str = "out/estimate.json";
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify . --quiet --out out").success();
    let predict = |more: &str| {
        let data = "--data a-none.csv --estimate out/estimate.json --out predicted";
        folder.flexcal(&format!("predict problem.toml {data} {more}"))
    };
    predict("").success();
    // Grams under kilograms leave the arm without an equilibrium.
    let heavy = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        if cells[9].parse::<f64>().is_ok_and(|mass| mass > 0.0) {
            cells[9] = "1e6";
        }
        cells.join(",") + "\n"
    };
    folder.write("heavy.csv", folder.read("a-none.csv").lines().map(heavy).collect::<String>());
    let estimate = "problem.toml --data heavy.csv --estimate out/estimate.json --out heavy";
    let run = folder.flexcal(&format!("predict {estimate}")).code(1);
    assert_contains(&run.stdout, &["Next: correct the loads (payload_kg, hoist_N)"]);
    let run = folder.flexcal(&format!("watch {estimate}")).code(2);
    assert_contains(
        &run.stderr,
        &["heavy.csv:", "no equilibrium under the loads of this row and of"],
    );
    let whole = folder.read(ESTIMATE);
    let estimate = folder.json(ESTIMATE)["parameters"][0]["estimate"].to_string();
    folder.edit(ESTIMATE, &format!("\"estimate\": {estimate}"), "\"estimate\": 0.125");
    let changed = "out/estimate.json: parameters: changed";
    assert_contains(&predict("").code(2).stderr, &[&format!("{changed} since flexcal wrote it")]);
    assert_contains(&predict("--trust").success().stderr, &[changed, "all the same"]);
    for (from, to, words) in [
        (
            "\"version\": 2",
            "\"version\": 9",
            "format: version 9, and this program reads versions up to 2",
        ),
        ("flexcal-estimate", "flexcal-loop", "format: a file of flexcal-loop"),
    ] {
        folder.write(ESTIMATE, whole.replacen(from, to, 1));
        assert_contains(&predict("").code(2).stderr, &[words]);
    }
}

#[test]
fn an_impossible_number_of_threads_is_refused_at_once() {
    let folder = Folder::with_lunar_sampler();
    for threads in ["100000", "1000", "-1", "many"] {
        let mut command = folder.command("identify problem.toml");
        let run = Run::of(command.env("RAYON_NUM_THREADS", threads)).code(2);
        let words = format!("RAYON_NUM_THREADS={threads}: a whole number");
        assert_contains(&run.stderr, &[&words]);
    }
}

#[test]
fn suggested_commands_name_the_measurements_of_the_fit() {
    let folder = Folder::with_cases(&["problem.toml", "a-none.csv", "f-two.csv"]);
    let estimate = folder.flexcal("identify . --data f-two.csv --out two --json").json();
    assert_eq!(estimate["measurement_files"], serde_json::json!(["f-two.csv"]));
    let told = folder.flexcal("predict . --data f-two.csv --estimate two/estimate.json --out out");
    assert_contains(&told.stdout, &["Next: flexcal loop . --data f-two.csv looks for what"]);
    // The strategy, not a missing effect, causes the misfit of a rigid arm.
    let rigid = folder.flexcal("identify . --strategy rigid --out rigid").code(1);
    assert_contains(
        &rigid.stderr,
        &["strategy rigid ignores the elasticity that the problem declares"],
    );
    assert_contains(
        &rigid.stdout,
        &["Next: flexcal identify . fits all parameters at once, elasticity included"],
    );
}

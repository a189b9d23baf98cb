//! Result files: reproducible, and without overwriting foreign files.

use std::fs;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

use super::{Bench, text};

#[test]
fn results_repeat_to_the_byte_but_for_the_time() {
    let bench = Bench::new();
    let run = || {
        let mut json: Value =
            serde_json::from_slice(&bench.identify(&["--json"]).get_output().stdout).unwrap();
        json["seconds"] = Value::Null;
        json
    };
    assert_eq!(run(), run());
}

#[test]
fn a_result_that_cannot_be_written_is_an_error() {
    let bench = Bench::new();
    fs::write(bench.path("taken"), "a file where a folder is wanted").unwrap();
    let assert = bench.identify(&["--out", "taken"]).code(2);
    assert!(text(&assert.get_output().stderr).contains("cannot write"));
    // One file that cannot be written prevents all output.
    fs::create_dir_all(bench.path("page/report.html")).unwrap();
    bench.identify(&["--out", "page"]).code(2);
    assert_eq!(fs::read_dir(bench.path("page")).unwrap().count(), 1);
    fs::create_dir(bench.path("drawn")).unwrap();
    fs::write(bench.path("drawn/figures"), "").unwrap();
    bench.identify(&["--out", "drawn"]).code(2);
    assert_eq!(fs::read_dir(bench.path("drawn")).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn new_results_are_for_whom_files_are_and_older_ones_keep_their_permissions() {
    use std::os::unix::fs::PermissionsExt as _;
    let bench = Bench::new();
    let mode = |name: &str| fs::metadata(bench.path(name)).unwrap().permissions().mode() & 0o777;
    fs::write(bench.path("made"), "").unwrap();
    bench.identify(&["--quiet", "--out", "out"]).success();
    assert_eq!(mode("out/estimate.json"), mode("made"), "new");
    assert_eq!(mode("out/report.html"), mode("made"), "new");
    fs::set_permissions(bench.path("out/estimate.json"), fs::Permissions::from_mode(0o640))
        .unwrap();
    bench.identify(&["--quiet", "--out", "out"]).success();
    assert_eq!(
        (mode("out/estimate.json"), mode("out/report.html")),
        (0o640, mode("made")),
        "older"
    );
}

#[test]
fn figures_of_an_older_page_go_and_other_files_stay() {
    let bench = Bench::new();
    let flexcal = |command: &str| {
        let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        flexcal.current_dir(bench.folder.path()).args([command, ".", "--out", "out"]).assert()
    };
    let there = |name: &str| bench.path(&format!("out/figures/{name}")).exists();
    flexcal("compare").success();
    assert!(there("strategies.svg") && there("ablations.svg"));
    let write = |name: &str| fs::write(bench.path(&format!("out/figures/{name}")), "mine").unwrap();
    ["effect-mine.svg", "mine.svg", "ranking.txt"].into_iter().for_each(write);
    flexcal("identify").success();
    assert!(!there("strategies.svg") && !there("ablations.svg"));
    assert!(
        ["effect-mine.svg", "mine.svg", "ranking.txt", "residual-order.svg"].into_iter().all(there)
    );
    // A foreign file with the name of a figure prevents all output before any work.
    write("effect-1.svg");
    let error = text(&flexcal("identify").code(2).get_output().stderr);
    assert!(error.contains("figures/effect-1.svg is there and not as flexcal wrote it"), "{error}");
}

#[test]
fn runs_into_one_folder_at_once_leave_one_whole_result() {
    let bench = Bench::new();
    for _ in 0..3 {
        let started: Vec<_> = (0..6)
            .map(|_| {
                std::process::Command::new(cargo_bin!("flexcal"))
                    .current_dir(bench.path(""))
                    .args(["identify", "problem.toml", "--data", "a-none.csv", "--out", "same"])
                    .arg("--quiet")
                    .spawn()
                    .unwrap()
            })
            .collect();
        for mut run in started {
            assert!(run.wait().unwrap().success());
        }
        bench.identify(&["--quiet", "--out", "same"]).success();
    }
}

#[test]
fn an_estimate_that_was_changed_is_refused_or_said() {
    let bench = Bench::new();
    bench.identify(&["--quiet", "--out", "out"]).success();
    let predict = |more: &[&str]| {
        let mut flexcal = Command::new(cargo_bin!("flexcal"));
        flexcal.current_dir(bench.path("")).args([
            "predict",
            "problem.toml",
            "--data",
            "a-none.csv",
        ]);
        flexcal.args(["--estimate", "out/estimate.json", "--out", "predicted"]).args(more).assert()
    };
    predict(&[]).success();
    let text_of = |name: &str| fs::read_to_string(bench.path(name)).unwrap();
    let whole = text_of("out/estimate.json");
    let json: Value = serde_json::from_str(&whole).unwrap();
    let estimate = json["parameters"][0]["estimate"].to_string();
    let from = format!("\"estimate\": {estimate}");
    assert!(whole.contains(&from));
    fs::write(bench.path("out/estimate.json"), whole.replacen(&from, "\"estimate\": 0.125", 1))
        .unwrap();
    let assert = predict(&[]).code(2);
    let said = text(&assert.get_output().stderr);
    assert!(
        said.contains("out/estimate.json: parameters: changed since flexcal wrote it"),
        "{said}"
    );
    let said = text(&predict(&["--trust"]).success().get_output().stderr);
    assert!(
        said.contains("out/estimate.json: parameters: changed") && said.contains("all the same"),
        "{said}"
    );
    for (from, to, words) in [
        (
            "\"version\": 2",
            "\"version\": 9",
            "format: version 9, and this program reads versions up to 2",
        ),
        ("flexcal-estimate", "flexcal-loop", "format: a file of flexcal-loop"),
    ] {
        fs::write(bench.path("out/estimate.json"), whole.replacen(from, to, 1)).unwrap();
        let said = text(&predict(&[]).code(2).get_output().stderr);
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn an_impossible_number_of_threads_is_refused_at_once() {
    let bench = Bench::new();
    for threads in ["100000", "-1", "many"] {
        let mut flexcal = Command::new(cargo_bin!("flexcal"));
        flexcal.current_dir(bench.path("")).env("RAYON_NUM_THREADS", threads);
        let assert = flexcal.args(["identify", "problem.toml"]).assert().code(2);
        let said = text(&assert.get_output().stderr);
        assert!(said.contains(&format!("RAYON_NUM_THREADS={threads}: a whole number")), "{said}");
    }
}

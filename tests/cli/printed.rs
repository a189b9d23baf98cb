//! Content and length of printed output.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

use super::{Bench, text};

#[test]
fn identify_prints_a_table_and_writes_the_estimate() {
    let bench = Bench::new();
    let assert = bench.identify(&["-v"]).success();
    let out = text(&assert.get_output().stdout);
    for expected in [
        "joint2.stiffness",
        "held out",
        "mean norm",
        "Reduced χ²",
        "rank 31 of 32",
        "estimate.json",
    ] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    for name in ["report.md", "report.html"] {
        assert!(
            out.contains(name) && bench.path("out/lunar-sampler").join(name).exists(),
            "{name}"
        );
    }
    let json: Value = serde_json::from_str(
        &fs::read_to_string(bench.path("out/lunar-sampler/estimate.json")).unwrap(),
    )
    .unwrap();
    assert_eq!(json["held_out"]["n"], 50);
    assert_eq!(
        (&json["solver"], &json["solver_reason"]),
        (&"levenberg-marquardt".into(), &"no bounds".into())
    );
    assert!(!out.contains("no standard error"), "every value has one:\n{out}");
    assert!(json["held_out"]["rms_mm"]["norm"].as_f64().unwrap() < 0.14);
    for key in [
        "problem",
        "strategy",
        "solver",
        "termination",
        "iterations",
        "seconds",
        "reduced_chi2",
        "rank",
    ] {
        assert!(!json[key].is_null(), "{key}");
    }
    let stiffness = json["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["name"] == "joint2.stiffness")
        .unwrap();
    for key in ["unit", "nominal", "estimate", "std_error", "identified"] {
        assert!(!stiffness[key].is_null(), "{key}");
    }
    assert!(stiffness["at_bound"].is_null());
    let unidentifiable = &json["unidentified"][0];
    assert!(
        (unidentifiable["combination"]["joint1.beta"].as_f64().unwrap() - 0.5_f64.sqrt()).abs()
            < 1e-6
    );
    assert!(unidentifiable["singular_value"].as_f64().unwrap() < 1e-9);
}

/// Writes arms with measurements, given or simulated.
fn arms(folder: &Path) -> Vec<[String; 2]> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let named = |path: PathBuf| path.to_str().unwrap().to_owned();
    let cases = root.join("tests/cases");
    let mut arms: Vec<[String; 2]> = ["a-none", "f-two", "g-not-in-catalogue"]
        .map(|name| [named(cases.clone()), named(cases.join(format!("{name}.csv")))])
        .to_vec();
    for arm in ["lunar-sampler", "service-arm", "panda", "ur10-urdf", "scara", "gantry"] {
        let problem = root.join("problems").join(arm);
        let mut data = problem.join("measurements.csv");
        if !data.is_file() {
            let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
            let arguments = ["--poses", "80", "--seed", "1", "--quiet", "--out", arm];
            flexcal
                .current_dir(folder)
                .arg("simulate")
                .arg(&problem)
                .arg("--truth")
                .arg(&problem)
                .args(arguments);
            flexcal.assert().success();
            data = folder.join(arm).join("measurements.csv");
        }
        arms.push([named(problem), named(data)]);
    }
    arms
}

#[test]
fn what_is_printed_fits_on_a_screen_unless_more_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        let output = flexcal.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.code().unwrap() < 2, "{}", text(&output.stderr));
        text(&output.stdout)
    };
    for [problem, data] in arms(folder.path()) {
        for command in ["identify", "loop"] {
            let arguments = [command, &problem, "-o", "out", "--data", &data];
            let (brief, whole) = (run(&arguments), run(&[&arguments[..], &["-v"]].concat()));
            let lines = |text: &str| text.lines().count();
            assert!(
                lines(&brief) <= 25 && lines(&whole) > lines(&brief),
                "{command} {data}:\n{brief}"
            );
            // The next command may be longer because of its paths.
            let lines = brief.lines().filter(|line| !line.starts_with("Next: "));
            assert!(
                lines.map(|line| line.chars().count()).all(|width| width <= 110),
                "{command} {data}:\n{brief}"
            );
            for words in ["held out", "Written to out: ", "\nNext: flexcal "] {
                assert!(brief.contains(words), "{words:?} missing in:\n{brief}");
            }
        }
        assert_eq!(run(&["identify", &problem, "-q", "-o", "out", "--data", &data]), "");
    }
}

#[test]
fn commands_to_copy_keep_paths_whole_and_one_is_no_plural() {
    let bench = Bench::new();
    let out = text(&bench.identify(&["-o", "my results"]).success().get_output().stdout);
    assert!(out.contains(" 'my results/"), "{out}");
    // A single held-out row remains.
    let mut held_out = 0;
    let measured = fs::read_to_string(bench.path("a-none.csv")).unwrap();
    let kept = measured.lines().filter(|row| {
        held_out += usize::from(row.contains("validation"));
        held_out <= 1 || !row.contains("validation")
    });
    fs::create_dir(bench.path("my arm")).unwrap();
    fs::write(bench.path("my arm/a-none.csv"), kept.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    fs::copy(bench.path("problem.toml"), bench.path("my arm/problem.toml")).unwrap();
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let run =
        flexcal.current_dir(bench.folder.path()).args(["identify", "my arm"]).output().unwrap();
    let out = text(&run.stdout);
    assert!(out.contains("'my arm'") && out.contains(", 1 pose held out;"), "{out}");
}

#[test]
fn json_is_all_there_is_on_standard_output_and_quiet_is_quiet() {
    let bench = Bench::new();
    let assert = bench.identify(&["--json", "--out", "elsewhere"]).success();
    let json: Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
    assert_eq!(json["problem"], "lunar-sampler");
    assert!(bench.path("elsewhere/estimate.json").exists() && !bench.path("out").exists());
    let assert = bench.identify(&["--quiet", "--out", "out"]).success();
    assert!(assert.get_output().stdout.is_empty() && assert.get_output().stderr.is_empty());
}

#[test]
fn the_readme_shows_what_is_printed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::cell::RefCell::new(fs::read_to_string(root.join("README.md")).unwrap());
    let refills = std::env::var_os("FLEXCAL_REFILL").is_some();
    // The third line of a fit ends with its duration.
    let timeless = |text: &str| -> Vec<String> {
        text.trim_end()
            .lines()
            .map(|line| line.split(" steps, ").next().unwrap().to_owned())
            .collect()
    };
    let compare = |mark: &str, printed: &str| {
        let fence = format!("<!-- {mark} -->\n```text\n");
        let text = readme.borrow().clone();
        let (before, after) = text.split_once(&fence).unwrap();
        let (shown, rest) = after.split_once("\n```").unwrap();
        if refills {
            *readme.borrow_mut() = format!("{before}{fence}{}\n```{rest}", printed.trim_end());
        } else {
            assert_eq!(timeless(shown), timeless(printed), "FLEXCAL_REFILL=1 prints it anew");
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let printed = |command: &str, problem: &Path, more: &[&str]| {
        let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        text(
            &flexcal
                .current_dir(folder.path())
                .arg(command)
                .arg(problem)
                .args(more)
                .output()
                .unwrap()
                .stdout,
        )
    };
    compare("loop", &printed("loop", &root.join("problems/lunar-sampler"), &[]));
    let drawn =
        fs::read_to_string(folder.path().join("out/lunar-sampler/figures/effect-1.svg")).unwrap();
    if refills {
        fs::write(root.join("docs/effect.svg"), &drawn).unwrap();
    }
    // Coordinates may round differently on another machine.
    let shapes = |svg: &str| svg.replace(|c: char| c.is_ascii_digit() || c == '.', "");
    let kept = fs::read_to_string(root.join("docs/effect.svg")).unwrap();
    assert_eq!(shapes(&kept), shapes(&drawn), "FLEXCAL_REFILL=1 draws it anew");
    compare(
        "lunar",
        &printed(
            "identify",
            Path::new("out/lunar-sampler/problem.closed.toml"),
            &["--out", "out/closed"],
        ),
    );
    if refills {
        fs::write(root.join("README.md"), &*readme.borrow()).unwrap();
    }
    assert!(readme.borrow().lines().count() < 130, "one page");
}

/// Returns the output of a command in the package folder, with line breaks as spaces.
fn screen(arguments: &[&str]) -> String {
    let out = tempfile::tempdir().unwrap();
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    flexcal.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).arg("--out").arg(out.path());
    let printed = text(&flexcal.output().unwrap().stdout);
    printed.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_screen_of_a_loop_says_what_an_effect_is_not_told_from() {
    let data = ["--data", "tests/cases/c-link-thermal-bending.csv"];
    let printed = screen(&[&["loop", "tests/cases"], &data[..]].concat());
    let expected = "link-thermal-bending = { link = \"B\" }; not told from: zero of joint 3 drifts with temperature";
    assert!(printed.contains(expected), "{printed}");
}

#[test]
fn limits_that_hold_the_declared_fit_are_said_beside_what_was_found() {
    let printed = screen(&["loop", "tests/cases/bounded/stiffness.toml"]);
    let expected = "Limits are active in the declared fit (joint3.stiffness, A.GJ). If one is wrong, an effect";
    assert!(printed.contains(expected) && printed.contains("What was found"), "{printed}");
    // Without effects no effect replaces a limit; a wrong limit is reported.
    let printed = screen(&["loop", "problems/service-arm"]);
    let expected = "Move the limit of joint4.a out, or remove it: with probability";
    assert!(printed.contains(expected) && !printed.contains("Limits are active"), "{printed}");
    let printed = screen(&["loop", "tests/cases", "--data", "tests/cases/a-none.csv"]);
    assert!(!printed.contains("Limits are active"), "{printed}");
}

#[test]
fn a_fit_that_tells_little_is_followed_by_a_check() {
    let bench = Bench::new();
    let mut rows = 0;
    let mut kept = |row: &str| {
        rows += usize::from(row.contains(",identification,"));
        rows <= 1 || !row.contains(",identification,")
    };
    let table = fs::read_to_string(bench.path("a-none.csv")).unwrap();
    let kept: Vec<&str> = table.lines().filter(|row| kept(row)).collect();
    fs::write(bench.path("a-none.csv"), kept.join("\n") + "\n").unwrap();
    let out = text(&bench.identify(&["-o", "out"]).success().get_output().stdout);
    assert!(out.contains("\n0 of 32 parameters identified well"), "{out}");
    assert!(out.contains("\nNext: flexcal check . says what the poses can tell\n"), "{out}");
}

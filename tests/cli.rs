//! The command line as users meet it: exit status, messages, and that bad input leaves nothing behind.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

/// A folder with a copy of the lunar sampler's problem and data, to spoil.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
        for name in ["problem.toml", "a-none.csv"] {
            fs::copy(cases.join(name), folder.path().join(name)).unwrap();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Replaces the first `from` in a file.
    fn edit(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(text.contains(from), "{name} has no {from:?}");
        fs::write(self.path(name), text.replacen(from, to, 1)).unwrap();
    }

    /// Keeps the header, then maps every other line of the data, counted from 2.
    fn map_data(&self, map: impl Fn(usize, &str) -> Option<String>) {
        let text = fs::read_to_string(self.path("a-none.csv")).unwrap();
        let lines: Vec<String> = text
            .lines()
            .enumerate()
            .filter_map(|(k, line)| if k == 0 { Some(line.to_owned()) } else { map(k + 1, line) })
            .collect();
        fs::write(self.path("a-none.csv"), lines.join("\n") + "\n").unwrap();
    }

    fn identify(&self, more: &[&str]) -> assert_cmd::assert::Assert {
        Command::new(assert_cmd::cargo::cargo_bin!("flexcal"))
            .current_dir(self.folder.path())
            .args(["identify", "."])
            .args(more)
            .assert()
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn identify_prints_a_table_and_writes_the_estimate() {
    let bench = Bench::new();
    let assert = bench.identify(&["-v"]).success();
    let out = text(&assert.get_output().stdout);
    for expected in ["joint2.stiffness", "held out", "mean norm", "Reduced χ²", "rank 31 of 32", "estimate.json"] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    for name in ["report.md", "report.html"] {
        assert!(out.contains(name) && bench.path("out/lunar-sampler").join(name).exists(), "{name}");
    }
    let json: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("out/lunar-sampler/estimate.json")).unwrap()).unwrap();
    assert_eq!(json["held_out"]["n"], 50);
    assert_eq!((&json["solver"], &json["solver_reason"]), (&"levenberg-marquardt".into(), &"no bounds".into()));
    assert!(!out.contains("no standard error"), "every value has one:\n{out}");
    assert!(json["held_out"]["rms_mm"]["norm"].as_f64().unwrap() < 0.14);
    for key in ["problem", "strategy", "solver", "termination", "iterations", "seconds", "reduced_chi2", "rank"] {
        assert!(!json[key].is_null(), "{key}");
    }
    let stiffness = json["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "joint2.stiffness").unwrap();
    for key in ["unit", "nominal", "estimate", "std_error", "identified"] {
        assert!(!stiffness[key].is_null(), "{key}");
    }
    assert!(stiffness["at_bound"].is_null());
    let blind = &json["unidentified"][0];
    assert!((blind["combination"]["joint1.beta"].as_f64().unwrap() - 0.5_f64.sqrt()).abs() < 1e-6);
    assert!(blind["singular_value"].as_f64().unwrap() < 1e-9);
}

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
    assert!(bench.path("out/lunar-sampler/estimate.json").exists() && bench.path("elsewhere/estimate.json").exists());
    // A closed problem has a folder of its own.
    fs::copy(bench.path("problem.toml"), bench.path("problem.closed.toml")).unwrap();
    run("identify problem.closed.toml --quiet").success();
    assert!(bench.path("out/lunar-sampler-closed/estimate.json").exists());
    // What is planned can be rehearsed.
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
    assert!(measured("y_mm").iter().all(|y| *y > -100.0) && measured("x_mm").iter().all(|x| *x > -600.0));
    let assert = run("plan --truth truth.toml --poses 12 --workspace-mm 1,0,0,1,0,1").code(2);
    assert!(text(&assert.get_output().stderr).contains("the box is empty"));
}

#[test]
fn what_is_printed_fits_on_a_screen_unless_more_is_asked_for() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        text(&flexcal.current_dir(folder.path()).args(arguments).assert().success().get_output().stdout)
    };
    let cases: Vec<String> =
        ["a-none", "f-two", "g-not-in-catalogue"].map(|name| format!("tests/cases/{name}.csv")).to_vec();
    let problem = root.join("tests/cases");
    for case in cases.iter().map(|name| root.join(name)) {
        for command in ["identify", "loop"] {
            let arguments =
                [command, problem.to_str().unwrap(), "-o", "out", "--data", case.to_str().unwrap()].map(str::to_owned);
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            let (brief, whole) = (run(&arguments), run(&[&arguments[..], &["-v"]].concat()));
            let lines = |text: &str| text.lines().count();
            assert!(lines(&brief) <= 25 && lines(&whole) > lines(&brief), "{command} {}:\n{brief}", case.display());
            // But for the next command, whose paths are as long as they are.
            let own = brief.lines().filter(|line| !line.starts_with("Next: "));
            assert!(own.map(|line| line.chars().count()).all(|width| width <= 120), "{brief}");
            for words in ["held out", "Written to out: ", "\nNext: flexcal "] {
                assert!(brief.contains(words), "{words:?} missing in:\n{brief}");
            }
            assert_eq!(run(&[&arguments[..], &["-q"]].concat()), "");
        }
    }
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
fn results_repeat_to_the_byte_but_for_the_time() {
    let bench = Bench::new();
    let run = || {
        let mut json: Value = serde_json::from_slice(&bench.identify(&["--json"]).get_output().stdout).unwrap();
        json["seconds"] = Value::Null;
        json
    };
    assert_eq!(run(), run());
}

#[test]
fn strategies_and_solvers_are_what_they_say() {
    let bench = Bench::new();
    let rms = |arguments: &[&str]| {
        let json: Value =
            serde_json::from_slice(&bench.identify(&[&["--json"], arguments].concat()).get_output().stdout).unwrap();
        (json["held_out"]["rms_mm"]["norm"].as_f64().unwrap(), json)
    };
    let (joint, _) = rms(&[]);
    let (geometry, json) = rms(&["--strategy", "geometry-only"]);
    assert_eq!(json["strategy"], "geometry-only");
    assert!(geometry > 2.0 * joint, "{geometry} against {joint}");
    let (bounded, json) = rms(&["--solver", "bounded"]);
    assert_eq!(json["solver"], "bounded");
    assert!((bounded - joint).abs() < 1e-6);
    bench.edit(
        "problem.toml",
        "\"A.*\" = { sigma_relative = 0.5 }",
        "\"A.*\" = { min_relative = 0.9, max_relative = 1.1 }",
    );
    let (_, json) = rms(&[]);
    assert_eq!((&json["solver"], &json["solver_reason"]), (&"bounded".into(), &"bounds to keep".into()));
    let told = text(&bench.identify(&["-v"]).get_output().stdout);
    assert!(told.contains("\n  –: no standard error: "), "{told}");
    let parameters = json["parameters"].as_array().unwrap();
    let stiff = parameters.iter().find(|p| p["name"] == "A.EI").unwrap();
    assert_eq!(stiff["at_bound"], "upper");
    assert!((stiff["estimate"].as_f64().unwrap() - 1.1 * 2.6e4).abs() < 1e-6);
    assert!(stiff["std_error"].is_null());
    let assert = bench.identify(&["--solver", "levenberg-marquardt"]).code(2);
    assert!(text(&assert.get_output().stderr).contains("does not keep the bounds"));
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
    let json: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("out/lunar-sampler/estimate.json")).unwrap()).unwrap();
    assert_eq!(json["trusted"], false);
}

/// What is spoiled, how, and what the message must name.
type Mistake = (&'static str, fn(&Bench), &'static [&'static str]);

const DATA: &str = "a-none.csv";
const PROBLEM: &str = "problem.toml";

#[test]
fn bad_input_is_named_and_leaves_nothing_behind() {
    let mistakes: &[Mistake] = &[
        ("empty file", |b| fs::write(b.path(DATA), "").unwrap(), &[DATA, "empty"]),
        ("header only", |b| b.map_data(|_, _| None), &[DATA, "no rows"]),
        ("NaN", |b| b.edit(DATA, "1840.7678", "NaN"), &["a-none.csv:2", "x_mm", "finite"]),
        ("infinity", |b| b.edit(DATA, "1840.7678", "inf"), &["a-none.csv:2", "x_mm", "finite"]),
        ("text in a number", |b| b.edit(DATA, "1840.7678", "far"), &["a-none.csv:2", "x_mm", "far"]),
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
        ("no held-out rows", |b| b.map_data(|_, l| Some(l.replace("validation", "identification"))), &["held out"]),
        (
            "no identification rows",
            |b| b.map_data(|_, l| Some(l.replace("identification", "validation"))),
            &["no rows are left to fit"],
        ),
        ("unknown split word", |b| b.edit(DATA, ",validation,", ",test,"), &["a-none.csv:2", "split", "test"]),
        ("binary junk", |b| fs::write(b.path(DATA), [0xff, 0xfe, 0x00, 0x80, b'\n']).unwrap(), &[DATA]),
        ("binary problem", |b| fs::write(b.path(PROBLEM), [0xff, 0xfe, 0x00]).unwrap(), &[PROBLEM]),
        (
            "unknown key",
            |b| b.edit(PROBLEM, "beam_elements = 1", "beam_pieces = 1"),
            &["problem.toml:7", "beam_pieces"],
        ),
        ("negative mass", |b| b.edit(PROBLEM, "mass_kg = 4.2", "mass_kg = -4.2"), &["problem.toml:27", "mass_kg"]),
        ("zero stiffness", |b| b.edit(PROBLEM, "5.2e4", "0.0"), &["problem.toml:17", "stiffness_N_m_per_rad"]),
        (
            "no joints",
            |b| fs::write(b.path(PROBLEM), "name = \"none\"\n[data]\nfiles = [\"a-none.csv\"]\n").unwrap(),
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
            |b| b.edit(PROBLEM, "\"tool.*\" = { sigma_mm = 5.0 }", "\"tool.*\" = { min_mm = 2, max_mm = -2 }"),
            &["problem.toml:78", "min"],
        ),
        (
            "σ of the wrong kind",
            |b| b.edit(PROBLEM, "\"tool.*\" = { sigma_mm = 5.0 }", "\"tool.*\" = { sigma_deg = 5.0 }"),
            &["problem.toml:78", "tool.x", "_mm"],
        ),
        ("missing data file", |b| fs::remove_file(b.path(DATA)).unwrap(), &["problem.toml:81", DATA]),
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
        ("an arm too soft to stand", |b| b.edit(PROBLEM, "5.2e4", "1.0"), &["a-none.csv:2", "equilibrium"]),
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
        assert!(message.starts_with("error: ") && !message.contains("panicked"), "{what}: {message}");
        assert!(output.stdout.is_empty() && !bench.path("out").exists(), "{what} left something behind");
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

#[test]
fn a_result_that_cannot_be_written_is_an_error() {
    let bench = Bench::new();
    fs::write(bench.path("taken"), "a file where a folder is wanted").unwrap();
    let assert = bench.identify(&["--out", "taken"]).code(2);
    assert!(text(&assert.get_output().stderr).contains("cannot write"));
    // What is in the way of one file keeps all away.
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
    fs::set_permissions(bench.path("out/estimate.json"), fs::Permissions::from_mode(0o640)).unwrap();
    bench.identify(&["--quiet", "--out", "out"]).success();
    assert_eq!((mode("out/estimate.json"), mode("out/report.html")), (0o640, mode("made")), "older");
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
    assert!(["effect-mine.svg", "mine.svg", "ranking.txt", "residual-order.svg"].into_iter().all(there));
    // One that some page may have and that is not flexcal's keeps all of them away, before any work is done.
    write("effect-1.svg");
    let error = text(&flexcal("identify").code(2).get_output().stderr);
    assert!(error.contains("figures/effect-1.svg is there and not as flexcal wrote it"), "{error}");
}

#[test]
fn the_readme_shows_what_is_printed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::cell::RefCell::new(fs::read_to_string(root.join("README.md")).unwrap());
    let refills = std::env::var_os("FLEXCAL_REFILL").is_some();
    // The third line of a fit ends in the time it took.
    let timeless = |text: &str| -> Vec<String> {
        text.trim_end().lines().map(|line| line.split(" steps, ").next().unwrap().to_owned()).collect()
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
        text(&flexcal.current_dir(folder.path()).arg(command).arg(problem).args(more).output().unwrap().stdout)
    };
    compare("loop", &printed("loop", &root.join("problems/lunar-sampler"), &[]));
    let drawn = fs::read_to_string(folder.path().join("out/lunar-sampler/figures/effect-1.svg")).unwrap();
    if refills {
        fs::write(root.join("docs/effect.svg"), &drawn).unwrap();
    }
    // Another machine may round a coordinate elsewhere.
    let shapes = |svg: &str| svg.replace(|c: char| c.is_ascii_digit() || c == '.', "");
    let kept = fs::read_to_string(root.join("docs/effect.svg")).unwrap();
    assert_eq!(shapes(&kept), shapes(&drawn), "FLEXCAL_REFILL=1 draws it anew");
    compare(
        "lunar",
        &printed("identify", Path::new("out/lunar-sampler/problem.closed.toml"), &["--out", "out/closed"]),
    );
    if refills {
        fs::write(root.join("README.md"), &*readme.borrow()).unwrap();
    }
    assert!(readme.borrow().lines().count() < 120, "one page");
}

/// A bench whose problem declares effects, with few other parameters.
fn bench_with_effects() -> Bench {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.path("problem.toml")).unwrap();
    let (arm, rest) = text.split_once("[parameters]\n").unwrap();
    let (_, data) = rest.split_once("[data]\n").unwrap();
    let effects =
        "[[effect]]\ngear-ratio = { joint = 3 }\n\n[[effect]]\njoint-harmonic = { joint = 2, orders = [1] }\n";
    let rules = "[parameters]\n\"joint*.theta\" = { sigma_deg = 1 }\n\"joint*.stiffness\" = { sigma_relative = 0.5 }\n\
                 \"joint-harmonic.*\" = { sigma_deg = 0.3 }\n";
    fs::write(bench.path("problem.toml"), format!("{arm}{effects}\n{rules}\n[data]\n{data}")).unwrap();
    bench
}

#[test]
fn declared_effects_are_in_the_results() {
    let bench = bench_with_effects();
    let told = text(&bench.identify(&["-v"]).success().get_output().stdout);
    let line = |name: &str| told.lines().find(|line| line.contains(name)).unwrap().to_owned();
    assert!(line("gear-ratio[3].error").contains('‰') && line("joint-harmonic[2].cos1").contains('°'), "{told}");
    let json = text(&bench.identify(&["--json"]).success().get_output().stdout);
    let result: Value = serde_json::from_str(&json).unwrap();
    let entries = result["parameters"].as_array().unwrap();
    let unit = |name: &str| entries.iter().find(|entry| entry["name"] == name).unwrap()["unit"].clone();
    assert_eq!((unit("gear-ratio[3].error"), unit("joint-harmonic[2].sin1")), ("1".into(), "rad".into()));
    let out = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        let done = command.current_dir(bench.folder.path()).args(arguments).assert().success();
        text(&done.get_output().stdout)
    };
    let compared = out(&["compare", "."]);
    assert!(compared.contains("paper: its own closed forms, without the declared effects"), "{compared}");
    let file = format!("out/{}/estimate.json", result["problem"].as_str().unwrap());
    out(&["compensate", ".", "--estimate", &file, "--data", "a-none.csv"]);
}

#[test]
fn effects_that_cannot_act_are_bad_input() {
    let bench = bench_with_effects();
    bench.edit("problem.toml", "gear-ratio = { joint = 3 }", "deflected-equilibrium = true");
    let error = text(&bench.identify(&[]).code(2).get_output().stderr);
    assert!(error.contains("effect[1].deflected-equilibrium") && error.contains("[statics]"), "{error}");
}

/// The JSON of a command that succeeds.
fn json(bench: &Bench, arguments: &[&str]) -> Value {
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let done = flexcal.current_dir(bench.folder.path()).args(arguments).arg("--json").assert().success();
    serde_json::from_slice(&done.get_output().stdout).unwrap()
}

/// Names of the procedures in a comparison.
fn procedures(comparison: &Value) -> Vec<&str> {
    comparison["procedures"].as_array().unwrap().iter().map(|own| own["procedure"].as_str().unwrap()).collect()
}

#[test]
fn compare_has_the_papers_tables_from_each_procedure_of_its_arm() {
    let bench = Bench::new();
    let compared = json(&bench, &["compare", ".", "--out", "out"]);
    let papers = ["nominal-stiffness", "from-positions"].map(|stage| format!("paper-{stage}"));
    let expected = [&["joint".to_owned()], &papers[..], &papers.clone().map(|name| name + "-as-printed")].concat();
    assert_eq!(procedures(&compared), expected);
    let rows: Vec<&str> =
        compared["rows"].as_array().unwrap().iter().map(|row| row["strategy"].as_str().unwrap()).collect();
    assert!(rows.contains(&"paper-rigid") && rows.contains(&"rigid") && rows.contains(&"geometry-only"), "{rows:?}");
    for own in compared["procedures"].as_array().unwrap() {
        let (table_2, table_3, figure) = (&own["table_2"], &own["table_3"], &own["figure_13"]);
        assert_eq!((table_2.as_array().unwrap().len(), &table_3["before_registered"]), (4, &false.into()));
        let (beta, theta) = (&table_2[0]["beta_deg"], &table_2[1]["theta_deg"]);
        assert!(beta["seen"].as_f64().unwrap() < 0.6 && theta["seen"].as_f64().unwrap() < 0.6, "{own}");
        for (key, kind) in
            [("before", "before_mm"), ("after", "after_mm"), ("ignoring_elasticity", "ignoring_elasticity_mm")]
        {
            let poses = figure[kind].as_array().unwrap();
            let norm = |pose: &Value| (0..3).map(|k| pose[k].as_f64().unwrap().powi(2)).sum::<f64>().sqrt();
            let mean = poses.iter().map(norm).sum::<f64>() / 50.0;
            assert_eq!(poses.len(), 50);
            assert!((table_3[key]["mean_mm"]["norm"].as_f64().unwrap() - mean).abs() < 1e-9, "{key}");
        }
        let name = own["procedure"].as_str().unwrap();
        let figure = if name == "joint" { String::new() } else { format!("-{name}") };
        assert!(bench.path(&format!("out/figures/held-out-errors{figure}.svg")).exists(), "{name}");
    }
    let page = fs::read_to_string(bench.path("out/report.md")).unwrap();
    for words in ["paper: before", "48.9644", "85.44", "(0.", "before: nominal arm without elasticity"] {
        assert!(page.contains(words), "{words} missing in:\n{page}");
    }
}

#[test]
fn compare_on_an_arm_of_ones_own_leaves_the_paper_out_unless_asked() {
    let bench = Bench::new();
    let problem = "name = \"own\"\ntitle = \"Two joints\"\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\na_m = 0.1\n\
                   [tool]\ntarget_m = [0.5, 0.05, 0.0]\n[parameters]\n\"joint*.theta\" = { sigma_deg = 0.5 }\n\
                   [data]\nfiles = [\"made/measurements.csv\"]\nposition_sigma_mm = 0.1\nheld_out = { column = \"split\" }\n";
    let truth = "[random]\n\"*\" = { sigma_deg = 0.1, sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.1\n\
                 [poses]\nq1_deg = [-120, 120]\nq2_deg = [-40, 80]\nidentification = 12\n";
    fs::write(bench.path("problem.toml"), problem).unwrap();
    fs::write(bench.path("TRUTH.toml"), truth).unwrap();
    json(&bench, &["simulate", ".", "--truth", "TRUTH.toml", "--poses", "20", "--seed", "1", "--out", "made"]);
    let own = json(&bench, &["compare", ".", "--out", "out"]);
    assert_eq!(procedures(&own), ["joint"]);
    assert!(own["rows"].as_array().unwrap().iter().all(|row| row["strategy"] != "rigid"), "nothing to ignore");
    let page = fs::read_to_string(bench.path("out/report.md")).unwrap();
    assert!(!page.contains("with elasticity") && !page.contains("paper:") && page.contains("identified"), "{page}");
    let asked = json(&bench, &["compare", ".", "--paper", "--out", "asked"]);
    assert_eq!(procedures(&asked), ["joint", "paper-rigid"]);
    // A base that nobody knows has to be found first.
    bench.edit("problem.toml", "[parameters]\n", "[parameters]\n\"base.*\" = { free = true }\n");
    let placed = json(&bench, &["compare", ".", "--out", "out"]);
    assert_eq!(placed["procedures"][0]["table_3"]["before_registered"], true);
    assert!(placed["procedures"][0]["table_2"][0]["a_mm"]["seen"].is_null(), "fixed");
}

#[test]
fn an_arm_identified_as_rigid_is_used_as_rigid() {
    let bench = Bench::new();
    let found = json(&bench, &["identify", ".", "--strategy", "rigid", "--out", "out"]);
    let named = |own: &Value| own["name"].as_str().unwrap().to_owned();
    let names: Vec<String> = found["parameters"].as_array().unwrap().iter().map(named).collect();
    assert!(names.iter().all(|name| !name.ends_with("stiffness") && !name.ends_with("EI")), "{names:?}");
    let geometry = json(&bench, &["identify", ".", "--strategy", "geometry-only", "--out", "geometry"]);
    let rms = |found: &Value| found["held_out"]["rms_mm"]["norm"].as_f64().unwrap();
    assert!(rms(&found) > 3.0 * rms(&geometry), "{} {}", rms(&found), rms(&geometry));
    // Where the rigid arm is predicted to be is where its commands bring it.
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let arguments =
        ["compensate", ".", "--estimate", "out/estimate.json", "--data", "a-none.csv", "--out", "out", "--json"];
    let output = flexcal.current_dir(bench.folder.path()).args(arguments).output().unwrap();
    let commands: Value = serde_json::from_slice(&output.stdout).unwrap();
    let before = commands["mean_miss_before_mm"].as_f64().unwrap();
    assert!((0.5..20.0).contains(&before), "{before} mm, what the rigid fit leaves");
}

//! Commands `plan` and `check`: results, exit status, messages, help, colours.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use flexcal::problem::{DeclaredCovariate, JointKind};
use flexcal::results::poses_csv;
use serde_json::Value;

/// Temporary folder for results, with flexcal run in the package folder.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> String {
        fs::write(self.path(name), text).unwrap();
        self.path(name).display().to_string()
    }

    fn flexcal(&self, arguments: &str, more: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(arguments.split_whitespace())
            .args(more);
        command.arg("--out").arg(self.folder.path());
        command
    }

    /// Runs a command that ends with `status`; returns standard output and standard error.
    fn run(&self, status: i32, arguments: &str, more: &[&str]) -> (String, String) {
        let assert = self.flexcal(arguments, more).assert().code(status);
        let output = assert.get_output();
        (text(&output.stdout), text(&output.stderr))
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn flexcal(arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    command.args(arguments);
    command
}

#[test]
fn a_plan_can_be_checked_and_measured() {
    let bench = Bench::new();
    let table = bench.write("some.csv", &drawn(60));
    let (out, _) = bench.run(0, "plan tests/cases --poses 20 --candidates", &[&table]);
    for expected in [
        "20 poses, from 60 candidates",
        "joint2.stiffness",
        "times smaller",
        "rank 31 of 32",
        "plan.csv",
    ] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    let csv = fs::read_to_string(bench.path("plan.csv")).unwrap();
    assert!(
        csv.starts_with(
            "pose,split,q1_deg,q2_deg,q3_deg,q4_deg,payload_kg,hoist_N\n1,identification,"
        ),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 21);
    // Every pose is one of the candidates.
    for line in csv.lines().skip(1) {
        let pose = line.splitn(3, ',').nth(2).unwrap();
        assert!(
            fs::read_to_string(&table).unwrap().lines().any(|candidate| candidate == pose),
            "{pose}"
        );
    }
    let plan: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("plan.json")).unwrap()).unwrap();
    assert!(
        plan["gain"].as_f64().unwrap() > 1.0
            && plan["sufficient"] == true
            && plan["criterion"] == "S"
    );
    let path = bench.path("plan.csv").display().to_string();
    let (out, _) = bench.run(0, "check tests/cases --json --candidates", &[&path]);
    let check: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((check["poses"].as_u64(), check["rank"].as_u64()), (Some(20), Some(31)));
    let found = |json: &Value, name: &str| {
        let all = json["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).unwrap()["std_error"].as_f64().unwrap()
    };
    // The plan refers to the nominal arm, the check to arms of the prior.
    let ratio = found(&check, "joint2.alpha") / found(&plan, "joint2.alpha");
    assert!((0.8..1.5).contains(&ratio), "{ratio}");
}

/// Returns a table of candidates within the ranges of the test rig.
fn drawn(count: usize) -> String {
    let (problem, truth) = super::bench::lunar();
    let poses =
        super::bench::ranges(&truth).draw(&problem, count, flexcal::design::Extremes::Often, 2, 0);
    let mut plain = problem.clone();
    plain.data.held_out = None;
    let text = poses_csv(&plain, &poses);
    text.lines().map(|line| line.split_once(',').unwrap().1.to_owned() + "\n").collect()
}

#[test]
fn a_check_takes_measured_poses_or_draws_them() {
    let bench = Bench::new();
    let (out, _) = bench.run(0, "check tests/cases", &[]);
    for expected in [
        "32 parameters, 28 poses",
        "in the held-out poses",
        "these",
        "joint1.beta + 0.71 joint2.theta",
    ] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    let (out, _) =
        bench.run(0, "check tests/cases --truth tests/cases/truth.toml --poses 12 --json", &[]);
    let check: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(check["poses"], 12);
    let steps = check["growth"].as_array().unwrap();
    let rms: Vec<f64> = steps.iter().map(|step| step["rms_mm"].as_f64().unwrap()).collect();
    assert!(rms.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9)), "{rms:?}");
    let enough = check["enough"].as_u64().unwrap();
    assert!((10..60).contains(&enough), "{enough}");
}

#[test]
fn a_check_names_what_would_be_found() {
    let bench = Bench::new();
    let (out, _) = bench.run(0, "check tests/cases", &[]);
    for expected in [
        "Size from which on an effect is found",
        "gear-ratio = { joint = 4 }",
        "Not visible with these poses",
        "tracker-scale",
    ] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    let check: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("check.json")).unwrap()).unwrap();
    let detectable = &check["detectable"];
    assert_eq!(
        (detectable["power"].as_f64(), detectable["level"].as_f64()),
        (Some(0.8), Some(0.01))
    );
    let effects = detectable["effects"].as_array().unwrap();
    let gear =
        effects.iter().find(|row| row["effect"] == "gear-ratio" && row["joint"] == 2).unwrap();
    let size = &gear["sizes"][0];
    assert_eq!(
        (size["parameters"][0].as_str(), size["unit"].as_str()),
        (Some("gear-ratio[2].error"), Some("1"))
    );
    assert!(size["found_from"].as_f64().unwrap() < size["prior_sigma"].as_f64().unwrap());
    // Every order of every joint is listed.
    assert_eq!(effects.iter().filter(|row| row["effect"] == "joint-harmonic").count(), 240);
}

#[test]
fn without_times_nothing_that_remembers_is_promised() {
    let bench = Bench::new();
    let measured = fs::read_to_string("tests/cases/a-none.csv").unwrap();
    let untimed = bench.write("untimed.csv", &measured.replacen("time_s", "note", 1));
    let (out, _) = bench.run(0, "check tests/cases --data", &[&untimed]);
    assert!(out.contains("no time_s that tells which pose was before which"), "{out}");
    let check: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("check.json")).unwrap()).unwrap();
    let names = |key: &str| {
        let all = check["detectable"][key].as_array().unwrap();
        all.iter().filter(|row| row["effect"] == "joint-hysteresis").count()
    };
    assert_eq!((names("effects"), names("untestable") > 0), (0, true), "{check}");
    assert_eq!(check["detectable"]["times_assumed"], false);
    // Poses that are still to be measured may get measured times.
    let (out, _) = bench.run(0, "check tests/cases --truth tests/cases/truth.toml --poses 60", &[]);
    let (table, rest) = out.split_once("Only if time_s is measured too").unwrap();
    assert!(rest.contains("joint-hysteresis") && !table.contains("joint-hysteresis"), "{out}");
}

#[test]
fn a_plan_that_would_tell_nothing_is_refused() {
    let bench = Bench::new();
    let text = "name = 'arm'\n[[joint]]\nd_m = 0.3\nmin_deg = -90\nmax_deg = 90\n[tool]\ntarget_m = [0, 0, 0.2]\n\
                [parameters]\n'joint1.theta' = { sigma_deg = 1 }\n[data]\nposition_sigma_mm = 0.1\n";
    fs::create_dir(bench.path("arm")).unwrap();
    let problem = bench.write("arm/problem.toml", text);
    let (_, error) = bench.run(2, "plan --poses 4", &[&problem]);
    assert!(error.contains("no free parameter moves the target in any pose"), "{error}");
    assert!(!bench.path("plan.csv").exists());
}

#[test]
fn a_plan_tells_two_effects_apart() {
    let bench = Bench::new();
    let table = bench.write("some.csv", &drawn(60));
    let pair = ["--separate", "gear-ratio = { joint = 3 }", "hoist-force", "--candidates", &table];
    let (out, _) = bench.run(0, "plan tests/cases --poses 20", &pair);
    for expected in [
        "told apart",
        "angle between them",
        "hoist-force = true",
        "gear-ratio[3].error",
        "p beside the other",
    ] {
        assert!(out.contains(expected), "{expected} missing in:\n{out}");
    }
    let plan: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("plan.json")).unwrap()).unwrap();
    let sides = plan["separation"]["effects"].as_array().unwrap();
    assert_eq!(
        (sides[0]["effect"].as_str(), sides[1]["effect"].as_str()),
        (Some("gear-ratio"), Some("hoist-force"))
    );
    for side in sides {
        assert!(side["told_from"].as_f64() <= side["random_told_from"].as_f64(), "{side}");
        assert!(side["p_value"].as_f64() <= side["random_p_value"].as_f64(), "{side}");
    }
    for (pair, expected) in [
        (["gear-rato = { joint = 3 }", "hoist-force"], "--separate:1: gear-rato: unknown effect"),
        (
            ["gear-ratio", "backlash"],
            "--separate: gear-ratio: needs arguments; write 'gear-ratio = { joint = 1 }'",
        ),
        (["gear-ratio = { joint = 9 }", "hoist-force"], "no joint 9"),
        (["tracker-drift", "hoist-force"], "depends on the time of measurement"),
    ] {
        let more = ["--separate", pair[0], pair[1], "--candidates", &table];
        let (_, err) = bench.run(2, "plan tests/cases --poses 20", &more);
        assert!(err.contains(expected), "{expected} missing in:\n{err}");
        assert_eq!(
            err.contains(" | "),
            pair[0].contains('='),
            "only what somebody wrote is shown:\n{err}"
        );
    }
}

#[test]
fn examples_of_arguments_are_effects_of_the_arm() {
    let (mut problem, _) = super::bench::lunar();
    let (name, meaning) = ("oil_bar".to_owned(), String::new());
    problem.data.covariates.push(DeclaredCovariate {
        name,
        meaning,
        location: problem.data.location.clone(),
    });
    problem.joints[3].kind = JointKind::Prismatic;
    let read = |text: &str| problem.effect(text, Path::new("--separate"));
    let mut written = 0;
    for family in flexcal::laws::FAMILIES {
        let Err(error) = read(family.name) else { continue };
        let error = error.to_string();
        let Some((_, example)) = error.split_once("write '") else { continue };
        let read = read(example.trim_end_matches('\'')).unwrap();
        assert_eq!(read.effect.name(), family.name);
        written += 1;
    }
    assert_eq!(written, 25);
}

#[test]
fn too_few_poses_are_not_to_be_trusted() {
    let bench = Bench::new();
    let problem = fs::read_to_string("problems/ur10-ipa/problem.toml").unwrap();
    let limited = problem.replace("[[joint]]\n", "[[joint]]\nmin_deg = -120\nmax_deg = 120\n");
    let limited = bench.write("problem.toml", &limited);
    let (_, err) = bench.run(1, "check --poses 1", &[&limited]);
    assert!(err.contains("more poses are needed"), "{err}");
    bench.run(0, "check --poses 30 --quiet", &[&limited]);
}

#[test]
fn bad_input_names_file_and_key_or_the_option() {
    let bench = Bench::new();
    let bad = bench.write("bad.csv", "q1_deg,q2_deg,q3_deg,q4_deg\n1,2,3,4\n1,2,x,4\n");
    let short = bench.write("short.csv", "q1_deg,q2_deg,q3_deg\n1,2,3\n");
    let three =
        bench.write("three.csv", "q1_deg,q2_deg,q3_deg,q4_deg\n1,2,3,4\n5,6,7,8\n9,10,11,12\n");
    let lunar = fs::read_to_string("tests/cases/problem.toml").unwrap();
    let sigma = bench.write("no-sigma.toml", &lunar.replace("position_sigma_mm = 0.05\n", ""));
    let fixed = lunar.split("[parameters]").next().unwrap().to_owned()
        + "[data]\nposition_sigma_mm = 0.05\n";
    let fixed = bench.write("fixed.toml", &fixed);
    let half = "name = 'x'\ntitle = 'x'\n[parameters]\n'joint1.a' = { sigma_mm = 1 }\n[[joint]]\na_m = 1\nmin_deg = -9\n[tool]\n\
                target_m = [1, 0, 0]\n[data]\nposition_sigma_mm = 1\n";
    let half = bench.write("half.toml", half);
    let cases: [(&str, &[&str], &[&str]); 10] = [
        (
            "plan tests/cases --poses 28",
            &[],
            &["joint[1].min_deg: missing", "--truth", "--candidates"],
        ),
        ("check --poses 28", &[&half], &["half.toml:5: joint[1].max_deg: missing"]),
        (
            "plan tests/cases --poses 28 --candidates",
            &[&bad],
            &["bad.csv:3: column q3_deg", "\"x\""],
        ),
        (
            "plan tests/cases --poses 28 --candidates",
            &[&short],
            &["short.csv:1: column q4", "missing"],
        ),
        (
            "plan tests/cases --poses 28 --candidates",
            &[&three],
            &["--poses 28", "only 3 candidates"],
        ),
        ("check tests/cases --poses 28 --candidates", &[&three], &["--poses 28", "only 3 rows"]),
        ("plan tests/cases --poses 0", &[], &["--poses"]),
        ("plan tests/cases --poses 9 --criterion Q", &[], &["--criterion", "'Q'"]),
        (
            "plan --poses 2 --candidates",
            &[&three, "--", &sigma],
            &["no-sigma.toml:80: data.position_sigma_mm"],
        ),
        (
            "plan --poses 2 --candidates",
            &[&three, "--", &fixed],
            &["fixed.toml: parameters: no parameter is free"],
        ),
    ];
    for (arguments, more, expected) in cases {
        let mut command = flexcal(&[]);
        command
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .arg(arguments.split_whitespace().next().unwrap());
        command.arg("--out").arg(bench.path("out"));
        let assert = command.args(arguments.split_whitespace().skip(1)).args(more).assert().code(2);
        let err = text(&assert.get_output().stderr);
        assert!(
            expected.iter().all(|part| err.contains(part)),
            "{arguments} {more:?}: {expected:?} not in\n{err}"
        );
        assert!(assert.get_output().stdout.is_empty() && !bench.path("out").exists());
    }
}

#[test]
fn quiet_is_quiet_and_progress_keeps_to_standard_error() {
    let bench = Bench::new();
    let table = bench.write("some.csv", &drawn(30));
    let (out, err) = bench.run(0, "plan tests/cases --poses 20 --quiet --candidates", &[&table]);
    assert!(out.is_empty() && err.is_empty(), "{out}{err}");
    let (out, err) =
        bench.run(0, "plan tests/cases --poses 20 --json --criterion d --candidates", &[&table]);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert!(json["criterion"] == "D" && err.is_empty(), "{err}");
}

#[test]
fn every_command_has_examples() {
    let help = text(&flexcal(&["--help"]).assert().success().get_output().stdout);
    assert!(help.contains("Examples:"), "{help}");
    for command in [
        "identify",
        "trace",
        "loop",
        "compare",
        "predict",
        "compensate",
        "simulate",
        "plan",
        "check",
        "completions",
        "man",
    ] {
        assert!(help.contains(command), "{command} missing in:\n{help}");
        let help = text(&flexcal(&[command, "--help"]).assert().success().get_output().stdout);
        assert!(
            help.contains("Examples:\n") && help.contains(&format!("\n  flexcal {command}")),
            "{help}"
        );
    }
}

#[test]
fn shells_are_completed_and_manuals_written() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&flexcal(&["completions", shell]).assert().success().get_output().stdout);
        assert!(script.contains("criterion") && script.contains("compensate"), "{shell}");
    }
    flexcal(&["completions", "tcsh"]).assert().code(2);
    let page = text(&flexcal(&["man"]).assert().success().get_output().stdout);
    assert!(page.contains(".TH flexcal 1") && page.contains("Exit status"), "{page}");
    let folder = tempfile::tempdir().unwrap();
    flexcal(&["man", "--out"]).arg(folder.path()).assert().success().stdout("");
    for name in ["flexcal.1", "flexcal-identify.1", "flexcal-plan.1"] {
        let page = fs::read_to_string(Path::new(folder.path()).join(name)).unwrap();
        assert!(page.contains(".TH") && page.contains("NAME"), "{name}");
    }
    let page = fs::read_to_string(folder.path().join("flexcal-plan.1")).unwrap();
    assert!(page.contains("flexcal\\-plan") && page.contains("criterion"), "{page}");
}

#[test]
fn colours_are_for_terminals_and_no_color_forbids_them() {
    let coloured = |variables: &[(&str, &str)]| {
        let mut command = flexcal(&["identify", "no-such-folder"]);
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").env("TERM", "xterm-256color");
        command.envs(variables.iter().copied());
        text(&command.assert().code(2).get_output().stderr).contains('\u{1b}')
    };
    assert!(!coloured(&[]), "a pipe is no terminal");
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}

#[test]
fn a_plan_of_too_few_poses_says_how_many_it_takes() {
    let bench = Bench::new();
    let plan = |poses: &str| {
        let (out, _) =
            bench.run(0, "plan problems/panda --truth problems/panda/TRUTH.toml --poses", &[poses]);
        let json: Value =
            serde_json::from_str(&fs::read_to_string(bench.path("plan.json")).unwrap()).unwrap();
        (out.split_whitespace().collect::<Vec<_>>().join(" "), json)
    };
    let (few, json) = plan("5");
    let (rank, attainable) =
        (json["rank"].as_u64().unwrap(), json["attainable_rank"].as_u64().unwrap());
    assert!(
        rank == 15 && attainable > 25 && json["least_poses"] == attainable.div_ceil(3),
        "{json}"
    );
    let words = format!(
        "Too few poses: they determine 15 of the {attainable} combinations of the 31 parameters"
    );
    assert!(
        few.contains(&words)
            && few.contains(&format!("it takes {} poses at least", attainable.div_ceil(3))),
        "{few}"
    );
    let (enough, json) = plan("20");
    assert!(json["rank"] == attainable && !enough.contains("Too few poses"), "{enough}");
}

#[test]
fn what_the_nominal_arm_does_not_tell_is_not_said_to_be_identified() {
    let bench = Bench::new();
    let (out, _) = bench.run(0, "check problems/ur10-urdf --poses 40", &[]);
    // joint5.theta and joint6.a are confounded if the target is at the origin of the last frame.
    assert!(out.contains("+ 0.71 joint5.theta + 0.71 joint6.a"), "{out}");
    let line = |name: &str| {
        out.lines().find(|line| line.trim_start().starts_with(name)).unwrap().to_owned()
    };
    for name in ["joint5.theta", "joint6.a "] {
        assert!(line(name).contains(" to 100 %"), "{}", line(name));
    }
    assert!(
        line("joint2.a ").ends_with(" 100 %") && !line("joint2.a ").contains("to"),
        "{}",
        line("joint2.a ")
    );
    let json: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("check.json")).unwrap()).unwrap();
    let parameter = json["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|parameter| parameter["name"] == "joint5.theta")
        .unwrap();
    assert!(parameter["identified"].as_f64().unwrap() > 0.99, "{parameter}");
    assert!(parameter["identified_at_nominal"].as_f64().unwrap() < 0.5, "{parameter}");
}

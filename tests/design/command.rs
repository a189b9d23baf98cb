//! Commands `plan` and `check`: results, exit status, messages, help, colours.

use std::path::Path;

use flexcal::problem::{DeclaredCovariate, JointKind};
use flexcal::results::poses_csv;
use serde_json::{Value, json};

use crate::common::arms::path;
use crate::common::program::{
    Folder, Run, assert_contains, entry, items, named, number, run, texts,
};

/// Runs a command in the folder of the package, with results in `folder`.
fn flexcal(folder: &Folder, arguments: &str) -> Run {
    run(path(""), &format!("{arguments} --out {}", folder.path("").display()))
}

/// Returns a folder with a table, and the path of the table.
fn with_table(name: &str, text: &str) -> (Folder, String) {
    let folder = Folder::with([(name, text)]);
    let table = folder.path(name).display().to_string();
    (folder, table)
}

#[test]
fn a_plan_can_be_checked_and_measured() {
    let candidates = drawn(60);
    let (folder, table) = with_table("some.csv", &candidates);
    let run =
        flexcal(&folder, &format!("plan tests/cases --poses 20 --candidates {table}")).success();
    let plan = folder.json("plan.json");
    assert_eq!(
        [
            &plan["poses"],
            &plan["candidates"],
            &plan["rank"],
            &plan["sufficient"],
            &plan["criterion"]
        ],
        [&json!(20), &json!(60), &json!(31), &json!(true), &json!("S")]
    );
    assert!(number(&plan["gain"]) > 1.0 && items(&plan["parameters"]).len() == 32);
    assert_contains(
        &run.stdout,
        &[
            "20 poses, from 60 candidates",
            "joint2.stiffness",
            "times smaller",
            "these determine 31 of 32",
            "plan.csv",
        ],
    );
    let csv = folder.read("plan.csv");
    assert!(
        csv.starts_with(
            "pose,split,q1_deg,q2_deg,q3_deg,q4_deg,payload_kg,hoist_N\n1,identification,"
        ),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 21);
    // The page lists the loads of each pose, too.
    assert_contains(&folder.read("plan.html"), &["payload_kg<", "hoist_N<"]);
    // Every pose is one of the candidates.
    for line in csv.lines().skip(1) {
        let pose = line.splitn(3, ',').nth(2).unwrap();
        assert!(candidates.lines().any(|candidate| candidate == pose), "{pose}");
    }
    let planned = folder.path("plan.csv").display().to_string();
    let check = flexcal(&folder, &format!("check tests/cases --json --candidates {planned}"))
        .success()
        .json();
    assert_eq!((&check["poses"], &check["rank"]), (&json!(20), &json!(31)));
    // The plan refers to the nominal arm, the check to arms of the prior.
    let error = |result: &Value| number(&named(&result["parameters"], "joint2.alpha")["std_error"]);
    let ratio = error(&check) / error(&plan);
    assert!((0.8..1.5).contains(&ratio), "{ratio}");
}

#[test]
fn measured_poses_that_are_held_out_do_not_count() {
    let (folder, table) = with_table("some.csv", &drawn(40));
    let plan = format!("plan tests/cases --poses 3 --criterion d --candidates {table}");
    let with = format!("{plan} --data tests/cases/a-none.csv --json");
    let result = flexcal(&folder, &with).success().json();
    assert_eq!((&result["poses"], &result["given"]), (&json!(3), &json!(28)));
    // The forecast is that of the fitted rows alone.
    let rows = std::fs::read_to_string(path("tests/cases/a-none.csv")).unwrap();
    let is_fitted = |line: &&str| !line.contains("validation");
    let fitted = rows.lines().filter(is_fitted).collect::<Vec<_>>().join("\n") + "\n";
    folder.write("fitted.csv", fitted);
    let file = folder.path("fitted.csv");
    let alone = flexcal(&folder, &format!("{plan} --data {} --json", file.display())).json();
    assert_eq!(result["parameters"], alone["parameters"]);
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
fn the_command_after_a_plan_runs_once_the_plan_is_measured() {
    // The declared table has the held-out rows; every planned row is for identification.
    let folder = Folder::with_lunar_sampler();
    folder.copy("tests/cases/truth.toml", "truth.toml");
    let plan = folder.flexcal("plan . --truth truth.toml --poses 20 --out plan").success();
    let simulate = "simulate . --truth truth.toml --data plan/plan.csv --seed 3 --quiet --out rig";
    folder.flexcal(simulate).success();
    folder.write("plan/plan.csv", folder.read("rig/measurements.csv"));
    let (_, command) = plan.stdout.split_once(", then flexcal ").unwrap();
    assert_eq!(command.trim(), "identify . --data ./a-none.csv plan/plan.csv");
    // The two tables are of different arms, so that the fit may not be trusted.
    let run = folder.flexcal(command.trim());
    assert!(run.status < 2, "{run:?}");
    // Without the declared table, some of the planned rows have to be held out.
    let moved = folder.read("a-none.csv");
    std::fs::remove_file(folder.path("a-none.csv")).unwrap();
    folder.write("elsewhere.csv", moved);
    let plan = folder.flexcal("plan . --truth truth.toml --poses 20 --out plan --force").success();
    let next = "write validation in the column split for some of them, then flexcal identify . --data plan/plan.csv";
    assert_contains(&plan.words(), &[next]);
}

#[test]
fn a_check_takes_measured_poses_or_draws_them() {
    let folder = Folder::new();
    let run = flexcal(&folder, "check tests/cases").success();
    let check = folder.json("check.json");
    assert_eq!((&check["poses"], items(&check["parameters"]).len()), (&json!(28), 32));
    assert_eq!(check["prediction"]["judged_in"], "held-out");
    let combination = &check["unidentified"][0]["combination"];
    for name in ["joint1.beta", "joint2.theta"] {
        assert!((number(&combination[name]) - 0.5_f64.sqrt()).abs() < 1e-6, "{combination}");
    }
    assert_contains(
        &run.stdout,
        &[
            "32 parameters, 28 poses",
            "in the held-out poses",
            "joint1.beta + 0.71 joint2.theta",
            "parameters to 90 % or more",
            "Effects that these poses would show: ",
            "-v and check.html state",
        ],
    );
    assert!(run.stdout.split_whitespace().count() < 600, "{}", run.stdout);
    let drawn = "check tests/cases --truth tests/cases/truth.toml --poses 12 --json";
    let check = flexcal(&folder, drawn).success().json();
    assert_eq!(check["poses"], 12);
    let rms: Vec<f64> =
        items(&check["growth"]).iter().map(|step| number(&step["rms_mm"])).collect();
    assert!(rms.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9)), "{rms:?}");
    let enough = check["enough"].as_u64().unwrap();
    assert!((10..60).contains(&enough), "{enough}");
}

#[test]
fn a_check_names_what_would_be_found() {
    let folder = Folder::new();
    let run = flexcal(&folder, "check tests/cases -v").success();
    let detectable = &folder.json("check.json")["detectable"];
    assert_eq!((&detectable["power"], &detectable["level"]), (&json!(0.8), &json!(0.01)));
    let gear = |joint| {
        let is_gear = |row: &Value| row["effect"] == "gear-ratio" && row["joint"] == joint;
        &entry(&detectable["effects"], is_gear)["sizes"][0]
    };
    let size = gear(2);
    assert_eq!(
        (&size["parameters"][0], &size["unit"]),
        (&json!("gear-ratio[2].error"), &json!("1"))
    );
    assert!(number(&size["found_from"]) < number(&size["prior_sigma"]));
    // Every order of every joint is listed.
    let names = texts(&detectable["effects"], "effect");
    assert_eq!(names.iter().filter(|name| **name == "joint-harmonic").count(), 240);
    // The tool takes up what the scale changes.
    let scale = &entry(&detectable["effects"], |row| row["effect"] == "tracker-scale")["sizes"][0];
    assert!(number(&scale["found_from"]) > number(&scale["prior_sigma"]), "{scale}");
    assert!(gear(4)["found_from"].is_number());
    assert_contains(
        &run.stdout,
        &[
            "Size from which on an effect is found",
            "gear-ratio = { joint = 4 }",
            "Not visible with these poses",
            "tracker-scale",
        ],
    );
}

#[test]
fn without_times_nothing_that_remembers_is_promised() {
    let measured = std::fs::read_to_string(path("tests/cases/a-none.csv")).unwrap();
    let (folder, table) = with_table("untimed.csv", &measured.replacen("time_s", "note", 1));
    let run = flexcal(&folder, &format!("check tests/cases -v --data {table}")).success();
    assert_contains(&run.stdout, &["no column time_s, so the order of the poses is not known"]);
    let detectable = &folder.json("check.json")["detectable"];
    let has = |key: &str| texts(&detectable[key], "effect").contains(&"joint-hysteresis");
    assert!(!has("effects") && has("untestable"), "{detectable}");
    // Row numbers stand for times, so that a drift is per row.
    let drift = &entry(&detectable["effects"], |row| row["effect"] == "tracker-drift")["sizes"][0];
    assert_eq!(drift["unit"], "m/row");
    assert_contains(&run.stdout, &["mm/row", "Drifts are per row"]);
    assert!(!run.stdout.contains("mm/h") && !run.stdout.contains("at_time_s"), "{run:?}");
    assert_eq!(detectable["times_assumed"], false);
    // Poses that are still to be measured may get measured times.
    let later = "check tests/cases -v --truth tests/cases/truth.toml --poses 60";
    let out = flexcal(&folder, later).success().stdout;
    let (table, rest) = out.split_once("These effects can be seen only").unwrap();
    assert!(rest.contains("joint-hysteresis") && !table.contains("joint-hysteresis"), "{out}");
}

#[test]
fn a_plan_that_would_tell_nothing_is_refused() {
    let text = "name = 'arm'\n[[joint]]\nd_m = 0.3\nmin_deg = -90\nmax_deg = 90\n[tool]\ntarget_m = [0, 0, 0.2]\n\
                [parameters]\n'joint1.theta' = { sigma_deg = 1 }\n[data]\nposition_sigma_mm = 0.1\n";
    let (folder, problem) = with_table("arm/problem.toml", text);
    let run = flexcal(&folder, &format!("plan --poses 4 {problem}")).code(2);
    assert_contains(&run.stderr, &["no free parameter moves the target in any pose"]);
    assert!(!folder.has("plan.csv"));
}

#[test]
fn a_plan_tells_two_effects_apart() {
    let (folder, table) = with_table("some.csv", &drawn(60));
    let plan = |effects: &str| {
        let arguments = format!("--separate {effects} --candidates {table}");
        flexcal(&folder, &format!("plan tests/cases --poses 20 {arguments}"))
    };
    let run = plan("'gear-ratio = { joint = 3 }' hoist-force").success();
    let sides = &folder.json("plan.json")["separation"]["effects"];
    assert_eq!(texts(sides, "effect"), ["gear-ratio", "hoist-force"]);
    assert_eq!(sides[0]["parameters"], json!(["gear-ratio[3].error"]));
    for side in items(sides) {
        for statistic in ["told_from", "p_value"] {
            let [with, random] =
                [String::new(), "random_".to_owned()].map(|of| number(&side[of + statistic]));
            assert!(with <= random, "{statistic} of {side}");
        }
    }
    assert_contains(
        &run.stdout,
        &["told apart", "angle between them", "hoist-force = true", "p beside the other"],
    );
    let drift = "depends on the time of measurement";
    let arguments = "--separate: gear-ratio: needs arguments; write 'gear-ratio = { joint = 1 }'";
    for (effects, is_shown, expected) in [
        (
            "'gear-rato = { joint = 3 }' hoist-force",
            true,
            "--separate:1: gear-rato: unknown effect",
        ),
        ("gear-ratio backlash", false, arguments),
        ("'gear-ratio = { joint = 9 }' hoist-force", true, "no joint 9"),
        ("tracker-drift hoist-force", false, drift),
    ] {
        let run = plan(effects).code(2);
        assert_contains(&run.stderr, &[expected]);
        assert_eq!(run.stderr.contains(" | "), is_shown, "only what somebody wrote: {run:?}");
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
    assert_eq!(written, 29);
}

#[test]
fn too_few_poses_are_not_to_be_trusted() {
    let problem = std::fs::read_to_string(path("problems/ur10-ipa/problem.toml")).unwrap();
    let limited = problem.replace("[[joint]]\n", "[[joint]]\nmin_deg = -120\nmax_deg = 120\n");
    let (folder, limited) = with_table("problem.toml", &limited);
    let run = flexcal(&folder, &format!("check --poses 1 {limited}")).code(1);
    assert_contains(&run.stderr, &["more poses are needed"]);
    assert_eq!(folder.json("check.json")["sufficient"], false);
    flexcal(&folder, &format!("check --poses 30 --quiet {limited}")).success();
}

#[test]
fn bad_input_names_file_and_key_or_the_option() {
    let lunar = std::fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
    let without_sigma = lunar.replace("position_sigma_mm = 0.05\n", "");
    let (arm, _) = lunar.split_once("[parameters]").unwrap();
    let fixed = format!("{arm}[data]\nposition_sigma_mm = 0.05\n");
    let half = "name = 'x'\ntitle = 'x'\n[parameters]\n'joint1.a' = { sigma_mm = 1 }\n[[joint]]\na_m = 1\nmin_deg = -9\n[tool]\n\
                target_m = [1, 0, 0]\n[data]\nposition_sigma_mm = 1\n";
    let folder = Folder::with([
        ("bad.csv", "q1_deg,q2_deg,q3_deg,q4_deg\n1,2,3,4\n1,2,x,4\n"),
        ("short.csv", "q1_deg,q2_deg,q3_deg\n1,2,3\n"),
        ("three.csv", "q1_deg,q2_deg,q3_deg,q4_deg\n1,2,3,4\n5,6,7,8\n9,10,11,12\n"),
        ("no-sigma.toml", &without_sigma),
        ("fixed.toml", &fixed),
        ("half.toml", half),
        ("arm/problem.toml", &lunar),
    ]);
    folder.copy("tests/cases/a-none.csv", "arm/a-none.csv");
    let cases: [(&str, &[&str]); 10] = [
        ("plan arm --poses 28", &["joint[1].min_deg: missing", "--truth", "--candidates"]),
        ("check --poses 28 half.toml", &["half.toml:5: joint[1].max_deg: missing"]),
        ("plan arm --poses 28 --candidates bad.csv", &["bad.csv:3: column q3_deg", "\"x\""]),
        ("plan arm --poses 28 --candidates short.csv", &["short.csv:1: column q4", "missing"]),
        ("plan arm --poses 28 --candidates three.csv", &["--poses 28", "only 3 candidates"]),
        ("check arm --poses 28 --candidates three.csv", &["--poses 28", "only 3 rows"]),
        ("plan arm --poses 0", &["--poses"]),
        ("plan arm --poses 9 --criterion Q", &["--criterion", "'Q'"]),
        (
            "plan --poses 2 --candidates three.csv -- no-sigma.toml",
            &["no-sigma.toml:80: data.position_sigma_mm"],
        ),
        (
            "plan --poses 2 --candidates three.csv -- fixed.toml",
            &["fixed.toml: parameters: no parameter is free"],
        ),
    ];
    for (arguments, expected) in cases {
        let (command, rest) = arguments.split_once(' ').unwrap();
        let run = folder.flexcal(&format!("{command} --out out {rest}")).code(2);
        assert_contains(&run.stderr, expected);
        assert!(run.stdout.is_empty() && !folder.has("out"), "{run:?}");
    }
}

#[test]
fn quiet_is_quiet_and_progress_keeps_to_standard_error() {
    let (folder, table) = with_table("some.csv", &drawn(30));
    let plan = |more: &str| {
        flexcal(&folder, &format!("plan tests/cases --poses 20 {more} --candidates {table}"))
            .success()
    };
    assert!(plan("--quiet").is_silent());
    let run = plan("--json --criterion d");
    assert!(run.json()["criterion"] == "D" && run.stderr.is_empty(), "{run:?}");
}

#[test]
fn every_command_has_examples() {
    let folder = Folder::new();
    let help = folder.flexcal("--help").success().stdout;
    assert_contains(&help, &["Examples:"]);
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
        assert_contains(&help, &[command]);
        let help = folder.flexcal(&format!("{command} --help")).success().stdout;
        assert_contains(&help, &["Examples:\n", &format!("\n  flexcal {command}")]);
    }
}

#[test]
fn shells_are_completed_and_manuals_written() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let run = folder.flexcal(&format!("completions {shell}")).success();
        assert_contains(&run.stdout, &["criterion", "compensate"]);
    }
    folder.flexcal("completions tcsh").code(2);
    let page = folder.flexcal("man").success().stdout;
    assert_contains(&page, &[".TH flexcal 1", "Exit status"]);
    assert!(folder.flexcal("man --out .").success().stdout.is_empty());
    for name in ["flexcal.1", "flexcal-identify.1", "flexcal-plan.1"] {
        assert_contains(&folder.read(name), &[".TH", "NAME"]);
    }
    assert_contains(&folder.read("flexcal-plan.1"), &["flexcal\\-plan", "criterion"]);
}

#[test]
fn colours_are_for_terminals_and_no_color_forbids_them() {
    let folder = Folder::new();
    let coloured = |variables: &[(&str, &str)]| {
        let mut command = folder.command("identify no-such-folder");
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").env("TERM", "xterm-256color");
        Run::of(command.envs(variables.iter().copied())).code(2).stderr.contains('\u{1b}')
    };
    assert!(!coloured(&[]), "a pipe is no terminal");
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}

#[test]
fn a_plan_of_too_few_poses_says_how_many_it_takes() {
    let folder = Folder::new();
    let plan = |poses: u64| {
        let arm = "problems/panda --truth problems/panda/TRUTH.toml";
        let run = flexcal(&folder, &format!("plan {arm} --poses {poses}")).success();
        (run.words(), folder.json("plan.json"))
    };
    let (few, json) = plan(5);
    let attainable = json["attainable_rank"].as_u64().unwrap();
    let least = attainable.div_ceil(3);
    assert!(json["rank"] == 15 && attainable > 25 && json["least_poses"] == least, "{json}");
    assert_contains(
        &few,
        &[
            &format!(
                "Too few poses: they determine 15 of the {attainable} combinations of the 31 parameters"
            ),
            &format!("it takes {least} poses at least"),
        ],
    );
    let (enough, json) = plan(20);
    assert!(json["rank"] == attainable && !enough.contains("Too few poses"), "{enough}");
}

#[test]
fn what_the_nominal_arm_does_not_tell_is_not_said_to_be_identified() {
    let folder = Folder::new();
    let out = flexcal(&folder, "check problems/ur10-urdf --poses 40 -v").success().stdout;
    // joint5.theta and joint6.a are confounded if the target is at the origin of the last frame.
    assert_contains(&out, &["+ 0.71 joint5.theta + 0.71 joint6.a"]);
    let line = |name: &str| {
        out.lines().find(|line| line.trim_start().starts_with(name)).unwrap().to_owned()
    };
    let parameters = &folder.json("check.json")["parameters"];
    for (name, most_at_nominal) in [("joint5.theta", 0.5), ("joint6.a ", 0.9)] {
        assert!(line(name).contains(" to 100 %"), "{}", line(name));
        let parameter = named(parameters, name.trim());
        assert!(number(&parameter["identified"]) > 0.99, "{parameter}");
        assert!(number(&parameter["identified_at_nominal"]) < most_at_nominal, "{parameter}");
    }
    let whole = line("joint2.a ");
    assert!(whole.ends_with(" 100 %") && !whole.contains("to"), "{whole}");
}

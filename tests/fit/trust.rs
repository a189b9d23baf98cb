//! Fits without information are not trusted by any command.

use flexcal::fit::{FindingCode, Options, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;
use serde_json::Value;

use crate::common::program::{Folder, Run, assert_contains, entry, findings, items, named, number};

/// Problem of a SCARA: two revolute joints, a prismatic one, a wrist.
const ARM: &str = "name = 'scara'
title = 'SCARA'
[[joint]]
d_m = 0.35
min_deg = -130
max_deg = 130
[[joint]]
a_m = 0.325
min_deg = -145
max_deg = 145
[[joint]]
kind = 'prismatic'
alpha_deg = 180
a_m = 0.275
min_mm = 0
max_mm = 200
[[joint]]
min_deg = -180
max_deg = 180
[tool]
target_m = [0.06, 0, 0.05]
[base]
translation_m = [1.5, -0.3, 0.2]
rotation_deg = [0, 0, 20]
";
const DATA: &str = "[data]\nposition_sigma_mm = 0.02\nfiles = ['m.csv']\n";
const PRIORS: &str =
    "[parameters]\n'joint*.*' = { sigma_deg = 0.3, sigma_mm = 1 }\n'tool.*' = { sigma_mm = 2 }\n";
const BASE: &str = "[parameters]\n'base.*' = { free = true }\n";
const TRUTH: &str = "[random]\n'*' = { sigma_deg = 0.05, sigma_mm = 0.3 }
[[effect]]\njoint-coupling = { joint = 3, from = 4 }\nfactor_relative = 0.0005
[noise]\nposition_sigma_mm = 0.02
[poses]\nq1_deg = [-130, 130]\nq2_deg = [-145, 145]\nq3_mm = [0, 200]\nq4_deg = [-180, 180]\npayload_kg = [0, 2]
approach = false\nidentification = 40\n";

/// Simulates sixty poses on the rig; `edit` changes the table before the fit.
fn bench(parameters: &str, edit: impl Fn(Vec<&str>) -> Vec<String>) -> Folder {
    let problem = format!("{ARM}{parameters}{DATA}");
    let folder = Folder::with([("problem.toml", &problem), ("TRUTH.toml", TRUTH)]);
    // The folder may be given in place of the file.
    folder.simulate(".", ".", 60, 3, "rig.csv");
    folder.write("m.csv", edit(folder.read("rig.csv").lines().collect()).join("\n"));
    folder
}

/// Identifies the arm.
fn identify_arm(folder: &Folder) -> Run {
    folder.flexcal("identify . --out out")
}

/// Returns the first finding of a result with the given code.
#[track_caller]
fn finding(result: &Value, code: &str) -> Value {
    entry(&result["findings"], |finding| finding["code"] == code)["numbers"].clone()
}

/// Returns the header, `count` identification rows that repeat the first `poses` ones, and the
/// held-out rows.
fn repeated(lines: &[&str], poses: usize, count: usize) -> Vec<String> {
    let of = |word: &str| {
        lines.iter().filter(|line| line.contains(word)).map(|line| (*line).to_owned()).collect()
    };
    let (fitted, held_out): (Vec<String>, Vec<String>) = (of("identification"), of("validation"));
    let again = (0..count).map(|row| fitted[row % poses].clone());
    std::iter::once(lines[0].to_owned()).chain(again).chain(held_out).collect()
}

#[test]
fn poses_measured_again_decide_nothing() {
    let two = bench(PRIORS, |lines| repeated(&lines, 2, 30));
    for (command, file) in
        [("identify", "estimate"), ("trace", "trace"), ("loop", "loop"), ("compare", "")]
    {
        let run = two.flexcal(&format!("{command} . --out out")).success();
        if !file.is_empty() {
            let numbers = finding(&two.json(format!("out/{file}.json")), "priors-decide");
            assert_eq!([&numbers["poses"], &numbers["coordinates"]], [2, 6], "{command}");
        }
        assert_contains(
            &run.stderr,
            &["warning: 2 different poses measure 6 coordinates, fewer than the"],
        );
        assert!(!run.stdout.contains("explains the data"), "{command}: {run:?}");
        let is_unjudged = run.stdout.contains("Not judged, because priors decide most of it");
        assert_eq!(is_unjudged, command == "identify", "{command}: {run:?}");
    }
    let three = bench(PRIORS, |lines| repeated(&lines, 3, 3));
    identify_arm(&three);
    let numbers = finding(&three.json("out/estimate.json"), "priors-decide");
    assert_eq!([&numbers["poses"], &numbers["coordinates"]], [3, 9]);
    let one = bench(BASE, |lines| repeated(&lines, 1, 30));
    identify_arm(&one).code(1);
    let numbers = finding(&one.json("out/estimate.json"), "too-few-equations");
    assert_eq!([&numbers["coordinates"], &numbers["parameters"]], [3, 6]);
    // Enough different poses need no remark, and neither do repeated ones among them.
    for enough in [
        bench(PRIORS, |lines| repeated(&lines, 8, 30)),
        bench(BASE, |lines| repeated(&lines, 3, 3)),
    ] {
        let run = identify_arm(&enough).success();
        let json = enough.json("out/estimate.json");
        assert!(!findings(&json).contains(&"priors-decide"), "{json}");
        assert!(!run.stderr.contains("coordinates"), "{run:?}");
    }
}

#[test]
fn a_check_does_not_trust_what_a_fit_would_not() {
    let again = |lines: &[&str]| {
        repeated(lines, 1, 30).into_iter().filter(|line| !line.contains("validation")).collect()
    };
    let one = bench(BASE, |lines| again(&lines));
    let check = |folder: &Folder| folder.flexcal("check . --candidates m.csv --out out");
    let run = check(&one).code(1);
    assert_contains(
        &run.stderr,
        &["do not determine 3 combinations of parameters without a prior"],
    );
    let json = one.json("out/check.json");
    assert_eq!((&json["sufficient"], items(&json["unidentified"]).len()), (&false.into(), 3));
    let without_limits = |text: String| -> String {
        text.lines()
            .filter(|line| !line.starts_with("min_") && !line.starts_with("max_"))
            .fold(String::new(), |all, line| all + line + "\n")
    };
    one.write("problem.toml", without_limits(format!("{ARM}{BASE}{DATA}")));
    let run = check(&one).code(1);
    assert_contains(
        &run.stderr,
        &["the 30 poses (1 different pose) measure 3 different coordinates"],
    );
    // The second joint never moves, but poses within its limits would determine its parameter.
    let free = "[parameters]\n'joint1.theta' = { free = true }\n'joint2.theta' = { free = true }\n'joint3.a' = { free = true }\n";
    let still = |lines: Vec<&str>| {
        let hold = |(k, line): (usize, &&str)| {
            let mut cells: Vec<&str> = line.split(',').collect();
            if k > 0 {
                cells[3..6].copy_from_slice(&["30", "0.1", "20"]);
            }
            cells.join(",")
        };
        lines.iter().enumerate().map(hold).collect()
    };
    let still = bench(free, still);
    let run = check(&still).code(1);
    assert_contains(&run.stderr, &["do not determine 1 combination of parameters"]);
    assert_eq!(items(&still.json("out/check.json")["unidentified"]).len(), 1);
    still.write("m.csv", still.read("rig.csv"));
    check(&still).success();
}

#[test]
fn poses_are_different_where_it_matters() {
    let folder = bench(PRIORS, |lines| repeated(&lines, 2, 4));
    let count = |problem: &str, edit: &dyn Fn(usize, &mut Vec<String>)| {
        folder.write("problem.toml", problem);
        let text = folder.read("m.csv");
        let edited = text.lines().filter(|line| !line.contains("validation")).enumerate().map(
            |(row, line)| {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                edit(row, &mut cells);
                cells.join(",")
            },
        );
        folder.write("edited.csv", edited.collect::<Vec<_>>().join("\n"));
        let problem = Problem::read(&folder.path("problem.toml")).unwrap();
        let (rows, _) = Measurements::read(&[folder.path("edited.csv")], &problem).unwrap();
        rows.pose_numbers(&problem)
    };
    let rigid = format!("{ARM}{PRIORS}{DATA}");
    let soft = rigid.replacen("d_m = 0.35", "d_m = 0.35\nstiffness_N_m_per_rad = 4e4", 1);
    let same = |_: usize, _: &mut Vec<String>| {};
    assert_eq!(count(&rigid, &same), [0, 1, 0, 1]);
    // Encoder readings scatter.
    let noisy = |row: usize, cells: &mut Vec<String>| {
        if row > 0 {
            cells[2] = (cells[2].parse::<f64>().unwrap() + 0.002 * row as f64).to_string();
        }
    };
    assert_eq!(count(&rigid, &noisy), [0, 1, 0, 1]);
    let loaded = |row: usize, cells: &mut Vec<String>| {
        let last = cells.iter().position(|name| name == "payload_kg").unwrap_or(9);
        if row > 0 {
            cells[last] = if row > 3 { "5".to_owned() } else { "0".to_owned() };
        }
    };
    assert_eq!(count(&rigid, &loaded), [0, 1, 0, 1]);
    assert_eq!(count(&soft, &loaded), [0, 1, 0, 2]);
    let in_sessions = |row: usize, cells: &mut Vec<String>| {
        cells.push(if row == 0 { "session" } else { ["A", "B"][row / 3] }.to_owned());
    };
    assert_eq!(count(&rigid, &in_sessions), [0, 1, 2, 3]);
}

#[test]
fn wrong_units_are_told_before_anything_else() {
    let metres = bench(&format!("{PRIORS}'base.*' = {{ free = true }}\n"), |lines| {
        let header = ["x", "y", "z"].iter().fold(lines[0].to_owned(), |all, axis| {
            all.replace(&format!("{axis}_mm"), &format!("{axis}_m"))
        });
        std::iter::once(header).chain(lines[1..].iter().map(|line| (*line).to_owned())).collect()
    });
    let run = identify_arm(&metres).code(1);
    assert_contains(&run.stderr, &["misses the measurements by", "correct units"]);
    // The message also appears if the fit did not converge.
    let problem = Problem::read(&metres.path("problem.toml")).unwrap();
    let fit = |table: &str, max_steps| {
        let (data, _) = Dataset::read_files(&[metres.path(table)], &problem).unwrap();
        identify(&problem, &data, &Options::default().with_max_steps(max_steps)).unwrap()
    };
    let stopped = fit("m.csv", Some(2));
    assert!(stopped.has(FindingCode::MissesMeasurements), "{:?}", stopped.findings);
    assert!(
        !stopped.termination.converged(),
        "otherwise this shows nothing: {}",
        stopped.termination
    );
    // A fit that was stopped close to the arm does not suspect its units.
    let near = fit("rig.csv", Some(1));
    assert!(near.has(FindingCode::NotConverged), "{:?}", near.findings);
    let radians = bench(PRIORS, |lines| {
        let header = lines[0].replace("q1_deg", "q1_rad");
        std::iter::once(header).chain(lines[1..].iter().map(|line| (*line).to_owned())).collect()
    });
    let run = identify_arm(&radians);
    let commands = radians.table("m.csv").numbers("q1_rad");
    let beyond = commands.iter().filter(|q| q.abs() > 130_f64.to_radians()).count();
    let (line, worst) = (2..).zip(commands).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
    let expected = format!(
        "m.csv:{line}: joint 1: commanded beyond its limits (min_rad = -2.268928, max_rad = 2.268928) in {beyond} rows, furthest \
         here: q1_rad = {worst};"
    );
    assert_contains(&run.stderr, &[&expected]);
}

#[test]
fn a_factor_between_a_turn_and_a_slide_has_their_units() {
    let coupled = format!(
        "{PRIORS}[[effect]]\njoint-coupling = {{ joint = 3, from = 4 }}\n[[effect]]\njoint-coupling = {{ joint = 2, from = 3 }}\n[[effect]]\njoint-coupling = {{ joint = 2, from = 1 }}\n"
    );
    let folder = bench(&coupled, |lines| lines.into_iter().map(str::to_owned).collect());
    let out = folder.flexcal("identify . -v --out out").success().stdout;
    let parameters = &folder.json("out/estimate.json")["parameters"];
    let of = |name: &str| named(parameters, name);
    for (name, unit, shown) in
        [("[3,4]", "m/rad", "mm/rad"), ("[2,3]", "rad/m", "°/m"), ("[2,1]", "1", "‰")]
    {
        let name = format!("joint-coupling{name}.factor");
        assert_eq!(of(&name)["unit"], unit);
        let line = out.lines().find(|line| line.contains(&name)).unwrap();
        assert!(line.split_whitespace().any(|word| word == shown), "{line}");
    }
    let found = number(&of("joint-coupling[3,4].factor")["estimate"]);
    assert!((found - 0.0005).abs() < 2e-5, "{found}");
}

#[test]
fn a_mistyped_column_is_an_error_and_other_warnings_are_in_the_report() {
    let with = |name: &str| {
        bench(PRIORS, |lines| {
            let cell = |row: usize| if row == 0 { name.to_owned() } else { "21".to_owned() };
            lines.iter().enumerate().map(|(row, line)| format!("{line},{}", cell(row))).collect()
        })
    };
    for (name, meant) in
        [("temprature_C", "temperature_C"), ("Session_", "session"), ("sgima_mm", "sigma_mm")]
    {
        let run = identify_arm(&with(name)).code(2);
        let expected =
            format!("m.csv:1: column {name}: unknown column, one letter away from {meant}");
        assert_contains(&run.stderr, &[&expected]);
    }
    // A column with another name, or without influence, only gives a warning.
    for name in ["room", "post"] {
        let folder = with(name);
        let run = identify_arm(&folder).success();
        assert_contains(&run.stderr, &[&format!("m.csv:1: column {name}: unknown column")]);
        for file in ["out/report.md", "out/report.html"] {
            assert_contains(&folder.read(file), &[&format!("column {name}: unknown column")]);
        }
    }
}

#[test]
fn nothing_that_is_printed_is_infinite() {
    let folder = bench(PRIORS, |lines| lines.into_iter().map(str::to_owned).collect());
    identify_arm(&folder).success();
    let numbers = |text: &str| {
        let words = text
            .split(|c: char| !(c.is_alphanumeric() || "+-.".contains(c)))
            .map(str::to_lowercase);
        words
            .filter(|word| ["nan", "inf", "-inf", "+inf", "infinity"].contains(&word.as_str()))
            .count()
    };
    for (name, x) in [("targets.csv", "1900"), ("far.csv", "1e153")] {
        let header = "q1_deg,q2_deg,q3_mm,q4_deg,x_mm,y_mm,z_mm";
        folder.write(name, format!("{header}\n0,10,50,0,{x},100,400\n"));
    }
    let value = folder.json("out/estimate.json");
    for (huge, targets) in [("1e300", "targets.csv"), ("-1e200", "targets.csv"), ("1.0", "far.csv")]
    {
        let mut edited = value.clone();
        for parameter in edited["parameters"].as_array_mut().unwrap() {
            parameter["estimate"] = huge.parse::<f64>().unwrap().into();
        }
        folder.write("huge.json", edited.to_string());
        let compensate = "compensate . --out out --estimate huge.json";
        let run = folder.flexcal(&format!("{compensate} --data {targets}"));
        let Run { status, stdout: out, stderr: err, .. } = run;
        assert!(status != 0 && numbers(&out) + numbers(&err) == 0, "{huge}: {out} {err}");
        if status == 1 {
            let csv = folder.read("out/commands.csv");
            assert_eq!(numbers(&csv), 0, "{huge}: {csv}");
        }
    }
    // Extremely narrow or wide priors.
    for sigma in ["1e-300", "1e300", "1e-12"] {
        let rules = format!(
            "[parameters]\n'joint*.*' = {{ sigma_deg = {sigma}, sigma_mm = {sigma} }}\n'tool.*' = {{ sigma_mm = {sigma} }}\n"
        );
        folder.write("problem.toml", format!("{ARM}{rules}{DATA}"));
        let Run { status, stdout: out, stderr: err, .. } = identify_arm(&folder);
        assert!(numbers(&out) + numbers(&err) == 0, "{sigma}: {status} {out} {err}");
        if status < 2 {
            for file in ["out/estimate.json", "out/report.md", "out/report.html"] {
                assert_eq!(numbers(&folder.read(file)), 0, "{sigma}: {file}");
            }
        }
    }
}

//! Fits without information are not trusted by any command.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use assert_cmd::Command;
use flexcal::fit::{FindingCode, Options, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;
use serde_json::Value;

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

/// Temporary folder with an arm and its measurements.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    /// Simulates sixty poses on the rig; `edit` changes the table before the fit.
    fn new(parameters: &str, edit: impl Fn(Vec<&str>) -> Vec<String>) -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        fs::write(bench.path("problem.toml"), format!("{ARM}{parameters}{DATA}")).unwrap();
        fs::write(bench.path("TRUTH.toml"), TRUTH).unwrap();
        // The folder may be given in place of the file.
        let out = bench.run(&[
            "simulate", ".", "--truth", ".", "--poses", "60", "--seed", "3", "--out", "rig",
        ]);
        assert_eq!(out.status.code(), Some(0), "{out:?}");
        let text = fs::read_to_string(bench.path("rig/measurements.csv")).unwrap();
        fs::write(bench.path("m.csv"), edit(text.lines().collect()).join("\n")).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command.current_dir(self.folder.path()).args(arguments).output().unwrap()
    }

    /// Returns status, standard output and standard error of a command on the arm.
    fn command(&self, command: &str, more: &[&str]) -> (i32, String, String) {
        let out = self.run(&[&[command, ".", "--out", "out"], more].concat());
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (out.status.code().unwrap(), text(&out.stdout), text(&out.stderr))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&fs::read_to_string(self.path("out").join(name)).unwrap()).unwrap()
    }
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
    let two = Bench::new(PRIORS, |lines| repeated(&lines, 2, 30));
    for command in ["identify", "trace", "loop", "compare"] {
        let (status, out, err) = two.command(command, &[]);
        assert_eq!(status, 0, "{command}: {err}");
        let expected = "warning: 2 different poses measure 6 coordinates, fewer than the";
        assert!(err.contains(expected), "{command}: {err}");
        assert!(!out.contains("explains the data"), "{command}: {out}");
    }
    let three = Bench::new(PRIORS, |lines| repeated(&lines, 3, 3));
    assert!(three.command("identify", &[]).2.contains("3 different poses measure 9 coordinates"));
    let one = Bench::new(BASE, |lines| repeated(&lines, 1, 30));
    let (status, _, err) = one.command("identify", &[]);
    assert!(
        status == 1 && err.contains("3 measured coordinates for 6 parameters without a prior"),
        "{err}"
    );
    // Enough different poses need no remark, and neither do repeated ones among them.
    for all in [
        Bench::new(PRIORS, |lines| repeated(&lines, 8, 30)),
        Bench::new(BASE, |lines| repeated(&lines, 3, 3)),
    ] {
        let (status, _, err) = all.command("identify", &[]);
        assert!(status == 0 && !err.contains("coordinates"), "{err}");
    }
}

#[test]
fn a_check_does_not_trust_what_a_fit_would_not() {
    let again = |lines: &[&str]| {
        repeated(lines, 1, 30).into_iter().filter(|line| !line.contains("validation")).collect()
    };
    let one = Bench::new(BASE, |lines| again(&lines));
    let check = |bench: &Bench| bench.command("check", &["--candidates", "m.csv"]);
    let (status, _, err) = check(&one);
    assert!(
        status == 1
            && err.contains("do not determine 3 combinations of parameters without a prior"),
        "{err}"
    );
    assert_eq!(one.json("check.json")["sufficient"], false);
    let without_limits = |text: String| -> String {
        text.lines()
            .filter(|line| !line.starts_with("min_") && !line.starts_with("max_"))
            .fold(String::new(), |all, line| all + line + "\n")
    };
    fs::write(one.path("problem.toml"), without_limits(format!("{ARM}{BASE}{DATA}"))).unwrap();
    let (status, _, err) = check(&one);
    assert!(
        status == 1 && err.contains("1 of the 30 poses differ and measure 3 coordinates"),
        "{err}"
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
    let still = Bench::new(free, still);
    let (status, _, err) = check(&still);
    assert!(status == 1 && err.contains("do not determine 1 combination of parameters"), "{err}");
    fs::copy(still.path("rig/measurements.csv"), still.path("m.csv")).unwrap();
    assert_eq!(check(&still).0, 0);
}

#[test]
fn poses_are_different_where_it_matters() {
    let bench = Bench::new(PRIORS, |lines| repeated(&lines, 2, 4));
    let count = |problem: &str, edit: &dyn Fn(usize, &mut Vec<String>)| {
        let path = bench.path("problem.toml");
        fs::write(&path, problem).unwrap();
        let text = fs::read_to_string(bench.path("m.csv")).unwrap();
        let edited = text.lines().filter(|line| !line.contains("validation")).enumerate().map(
            |(row, line)| {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                edit(row, &mut cells);
                cells.join(",")
            },
        );
        fs::write(bench.path("edited.csv"), edited.collect::<Vec<_>>().join("\n")).unwrap();
        let problem = Problem::read(&path).unwrap();
        let (rows, _) = Measurements::read(&[bench.path("edited.csv")], &problem).unwrap();
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
    let metres = Bench::new(&format!("{PRIORS}'base.*' = {{ free = true }}\n"), |lines| {
        let header = ["x", "y", "z"].iter().fold(lines[0].to_owned(), |all, axis| {
            all.replace(&format!("{axis}_mm"), &format!("{axis}_m"))
        });
        std::iter::once(header).chain(lines[1..].iter().map(|line| (*line).to_owned())).collect()
    });
    let (status, _, err) = metres.command("identify", &[]);
    assert!(
        status == 1 && err.contains("misses the measurements by") && err.contains("check units"),
        "{err}"
    );
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
    let near = fit("rig/measurements.csv", Some(1));
    assert!(near.has(FindingCode::NotConverged), "{:?}", near.findings);
    let radians = Bench::new(PRIORS, |lines| {
        let header = lines[0].replace("q1_deg", "q1_rad");
        std::iter::once(header).chain(lines[1..].iter().map(|line| (*line).to_owned())).collect()
    });
    let (_, _, err) = radians.command("identify", &[]);
    let text = fs::read_to_string(radians.path("m.csv")).unwrap();
    let commands =
        text.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse::<f64>().unwrap());
    let beyond = commands.clone().filter(|q| q.abs() > 130_f64.to_radians()).count();
    let (line, worst) = (2..).zip(commands).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
    let expected = format!(
        "m.csv:{line}: joint 1: commanded beyond its limits (min_rad = -2.268928, max_rad = 2.268928) in {beyond} rows, furthest \
         here: q1_rad = {worst};"
    );
    assert!(err.contains(&expected), "{expected} missing in\n{err}");
}

#[test]
fn a_factor_between_a_turn_and_a_slide_has_their_units() {
    let coupled = format!(
        "{PRIORS}[[effect]]\njoint-coupling = {{ joint = 3, from = 4 }}\n[[effect]]\njoint-coupling = {{ joint = 2, from = 3 }}\n[[effect]]\njoint-coupling = {{ joint = 2, from = 1 }}\n"
    );
    let bench = Bench::new(&coupled, |lines| lines.into_iter().map(str::to_owned).collect());
    let (status, out, err) = bench.command("identify", &["-v"]);
    assert_eq!(status, 0, "{err}");
    let json = bench.json("estimate.json");
    let parameters = json["parameters"].as_array().unwrap();
    let of = |name: &str| parameters.iter().find(|parameter| parameter["name"] == name).unwrap();
    for (name, unit, shown) in
        [("[3,4]", "m/rad", "mm/rad"), ("[2,3]", "rad/m", "°/m"), ("[2,1]", "1", "‰")]
    {
        let name = format!("joint-coupling{name}.factor");
        assert_eq!(of(&name)["unit"], unit);
        let line = out.lines().find(|line| line.contains(&name)).unwrap();
        assert!(line.split_whitespace().any(|word| word == shown), "{line}");
    }
    let found = of("joint-coupling[3,4].factor")["estimate"].as_f64().unwrap();
    assert!((found - 0.0005).abs() < 2e-5, "{found}");
}

#[test]
fn a_mistyped_column_is_an_error_and_other_warnings_are_in_the_report() {
    let with = |name: &str| {
        Bench::new(PRIORS, |lines| {
            let cell = |row: usize| if row == 0 { name.to_owned() } else { "21".to_owned() };
            lines.iter().enumerate().map(|(row, line)| format!("{line},{}", cell(row))).collect()
        })
    };
    for (name, meant) in
        [("temprature_C", "temperature_C"), ("Session_", "session"), ("sgima_mm", "sigma_mm")]
    {
        let (status, _, err) = with(name).command("identify", &[]);
        let expected =
            format!("m.csv:1: column {name}: unknown column, one letter away from {meant}");
        assert!(status == 2 && err.contains(&expected), "{name}: {err}");
    }
    // A column with another name, or without influence, only gives a warning.
    for name in ["room", "post"] {
        let bench = with(name);
        let (status, _, err) = bench.command("identify", &[]);
        let expected = format!("m.csv:1: column {name}: unknown column");
        assert!(status == 0 && err.contains(&expected), "{name}: {err}");
        for file in ["report.md", "report.html"] {
            let report = fs::read_to_string(bench.path("out").join(file)).unwrap();
            assert!(report.contains(&format!("column {name}: unknown column")), "{file}: {report}");
        }
    }
}

#[test]
fn nothing_that_is_printed_is_infinite() {
    let bench = Bench::new(PRIORS, |lines| lines.into_iter().map(str::to_owned).collect());
    assert_eq!(bench.command("identify", &[]).0, 0);
    let numbers = |text: &str| {
        let words = text
            .split(|c: char| !(c.is_alphanumeric() || "+-.".contains(c)))
            .map(str::to_lowercase);
        words
            .filter(|word| ["nan", "inf", "-inf", "+inf", "infinity"].contains(&word.as_str()))
            .count()
    };
    let estimate = fs::read_to_string(bench.path("out/estimate.json")).unwrap();
    fs::write(
        bench.path("targets.csv"),
        "q1_deg,q2_deg,q3_mm,q4_deg,x_mm,y_mm,z_mm\n0,10,50,0,1900,100,400\n",
    )
    .unwrap();
    fs::write(
        bench.path("far.csv"),
        "q1_deg,q2_deg,q3_mm,q4_deg,x_mm,y_mm,z_mm\n0,10,50,0,1e153,100,400\n",
    )
    .unwrap();
    let value: Value = serde_json::from_str(&estimate).unwrap();
    for (huge, targets) in [("1e300", "targets.csv"), ("-1e200", "targets.csv"), ("1.0", "far.csv")]
    {
        let mut edited = value.clone();
        for parameter in edited["parameters"].as_array_mut().unwrap() {
            parameter["estimate"] = huge.parse::<f64>().unwrap().into();
        }
        fs::write(bench.path("huge.json"), edited.to_string()).unwrap();
        let (status, out, err) =
            bench.command("compensate", &["--estimate", "huge.json", "--data", targets]);
        assert!(status != 0 && numbers(&out) + numbers(&err) == 0, "{huge}: {out} {err}");
        if status == 1 {
            let csv = fs::read_to_string(bench.path("out/commands.csv")).unwrap();
            assert_eq!(numbers(&csv), 0, "{huge}: {csv}");
        }
    }
    // Extremely narrow or wide priors.
    for sigma in ["1e-300", "1e300", "1e-12"] {
        let rules = format!(
            "[parameters]\n'joint*.*' = {{ sigma_deg = {sigma}, sigma_mm = {sigma} }}\n'tool.*' = {{ sigma_mm = {sigma} }}\n"
        );
        fs::write(bench.path("problem.toml"), format!("{ARM}{rules}{DATA}")).unwrap();
        let (status, out, err) = bench.command("identify", &[]);
        assert!(numbers(&out) + numbers(&err) == 0, "{sigma}: {status} {out} {err}");
        if status < 2 {
            for file in ["estimate.json", "report.md", "report.html"] {
                let text = fs::read_to_string(bench.path("out").join(file)).unwrap();
                assert_eq!(numbers(&text), 0, "{sigma}: {file}");
            }
        }
    }
}

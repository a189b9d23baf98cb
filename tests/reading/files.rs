//! File handling of commands: what they replace, keep and read.

#![cfg(unix)]
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::common::program::{Folder, Run, assert_contains, number};

/// Problem of two rigid joints, whose fit is fast.
const ARM: &str = "name = 'arm'\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\na_m = 0.1\n[tool]\ntarget_m = [0.5, 0, 0]\n\
                   [parameters]\n'joint*.theta' = { sigma_deg = 1 }\n'tool.x' = { sigma_mm = 3 }\n[data]\n\
                   files = ['measurements.csv']\nposition_sigma_mm = 0.1\nreference_temperature_C = 20\n";
const TRUTH: &str = "[random]\n'*' = { sigma_deg = 0.1, sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.1\n\
                     [poses]\nq1_deg = [-90, 90]\nq2_deg = [-60, 60]\n";

/// Returns a folder with a problem and its data in `arm`.
fn bench() -> Folder {
    let folder = Folder::with([("arm/problem.toml", ARM), ("arm/TRUTH.toml", TRUTH)]);
    folder.simulate("arm", "arm/TRUTH.toml", 40, 1, "arm/measurements.csv");
    folder
}

/// Asserts that a command ends with status 2, a message that contains `words`, and the files of a
/// folder unchanged.
#[track_caller]
fn assert_refused(bench: &Folder, arguments: &str, folder: &str, words: &[&str]) {
    let before = listing(&bench.path(folder));
    let run = bench.flexcal(arguments).code(2);
    assert_eq!(listing(&bench.path(folder)), before, "{arguments}");
    assert_contains(&run.stderr, words);
}

/// Returns every file below a folder with its content.
fn listing(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() && !path.is_symlink() {
                folders.push(path);
            } else {
                let content = fs::read(&path).unwrap_or_default();
                found.push((path, content));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn what_is_read_is_not_replaced() {
    let bench = bench();
    let simulate = "simulate arm --truth arm/TRUTH.toml --poses 9 --seed 2 --out arm";
    let is_input = "arm/measurements.csv is an input of this command or belongs to its problem";
    assert_refused(&bench, simulate, "arm", &[is_input, "--force"]);
    // Inputs are recognised under other names: a link to the folder, and one to the file.
    symlink(bench.path("arm"), bench.path("other")).unwrap();
    fs::create_dir(bench.path("linked")).unwrap();
    symlink("../arm/measurements.csv", bench.path("linked/measurements.csv")).unwrap();
    for out in ["--out other", "--out linked"] {
        assert_refused(&bench, &simulate.replace("--out arm", out), "arm", &["an input"]);
    }
    // The problem that the loop wrote is the one that it reads next.
    bench.flexcal("loop arm --out closed");
    let again = "loop closed/problem.closed.toml --out closed";
    assert_refused(&bench, again, "closed", &["problem.closed.toml is an input"]);
    // --force permits it.
    bench.flexcal(&format!("{simulate} --force")).success();
    assert_eq!(bench.read("arm/measurements.csv").lines().count(), 10);
}

#[test]
fn what_flexcal_did_not_write_is_not_replaced() {
    let bench = bench();
    fs::create_dir(bench.path("out")).unwrap();
    for name in ["estimate.json", "report.md", "report.html"] {
        bench.write(format!("out/{name}"), "mine");
        let words = format!("out/{name} exists and was not written by flexcal");
        assert_refused(&bench, "identify arm --out out", "out", &[&words]);
        fs::remove_file(bench.path("out").join(name)).unwrap();
    }
    // Files of flexcal are replaced; those of another command with a message.
    for (command, said) in
        [("identify", None), ("identify", None), ("compare", Some("the report of identify"))]
    {
        let error = bench.flexcal(&format!("{command} arm --out out")).success().stderr;
        assert!(said.is_none_or(|said| error.contains(said)), "{error}");
        assert_eq!(error.contains("is replaced"), said.is_some(), "{error}");
    }
    // A changed file is not replaced.
    bench.map("out/report.md", |text| format!("{text}and a remark"));
    for command in ["identify", "compare", "loop"] {
        let arguments = format!("{command} arm --out out");
        assert_refused(&bench, &arguments, "out", &["out/report.md exists"]);
    }
    bench.flexcal("identify arm --out out --force").success();
    assert!(!bench.read("out/report.md").contains("remark"));
    bench.flexcal("man --out pages").success();
    bench.write("pages/flexcal.1", "mine");
    assert_refused(&bench, "man --out pages", "pages", &[]);
}

#[test]
fn results_of_an_earlier_table_do_not_stay_beside_those_of_another() {
    let bench = bench();
    bench.write("poses.csv", "q1_deg,q2_deg\n10,20\n");
    let there = || {
        let names = fs::read_dir(bench.path("out"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
        names.sort();
        names
    };
    let poses = "predict arm --data poses.csv --out out";
    bench.flexcal("predict arm --out out").success();
    assert_eq!(there(), ["errors.json", "predictions.csv", "predictions.html", "residuals.csv"]);
    bench.flexcal(poses).success();
    assert_eq!(there(), ["predictions.csv", "predictions.html"]);
    // Files of another command stay, and so do changed ones.
    bench.flexcal("predict arm --out out").success();
    bench.flexcal("identify arm --out out").success();
    bench.write("out/errors.json", "mine");
    bench.flexcal(&format!("{poses} --force")).success();
    assert!(there().contains(&"residuals.csv".to_owned()), "{:?}", there());
    assert_eq!(bench.read("out/errors.json"), "mine");
}

#[test]
fn links_are_not_followed() {
    let bench = bench();
    for folder in ["out", "elsewhere"] {
        fs::create_dir(bench.path(folder)).unwrap();
    }
    symlink("../elsewhere", bench.path("out/figures")).unwrap();
    assert_refused(&bench, "identify arm --out out", ".", &["symbolic link"]);
    fs::remove_file(bench.path("out/figures")).unwrap();
    // A result that is a link was not written by flexcal; --force replaces the link and leaves its
    // target.
    bench.write("elsewhere/mine", "mine");
    symlink("../elsewhere/mine", bench.path("out/report.md")).unwrap();
    assert_refused(&bench, "identify arm --out out", ".", &["out/report.md exists"]);
    bench.flexcal("identify arm --out out --force").success();
    assert_eq!(bench.read("elsewhere/mine"), "mine");
    assert!(
        !bench.path("out/report.md").is_symlink() && bench.read("out/report.md").starts_with("# ")
    );
}

#[test]
fn a_command_that_is_killed_leaves_no_litter() {
    let bench = bench();
    let whole = |folder: &str| -> Vec<String> {
        let names =
            |path: &Path| path.strip_prefix(bench.path(folder)).unwrap().display().to_string();
        listing(&bench.path(folder)).iter().map(|(path, _)| names(path)).collect()
    };
    bench.flexcal("identify arm --out whole").success();
    let expected = whole("whole");
    for delay in 0..12 {
        let mut process = Process::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        process.current_dir(bench.path("")).args(["identify", "arm", "--out", "killed", "--quiet"]);
        let mut process = process.stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(4 * delay));
        process.kill().unwrap();
        process.wait().unwrap();
        let left = whole("killed");
        // The files of a result lie in one hidden folder until they take their places.
        let stage = |name: &String| {
            let first = name.split('/').next().unwrap_or_default();
            first.starts_with(".flexcal-new").then(|| first.to_owned())
        };
        let stages: BTreeSet<String> = left.iter().filter_map(stage).collect();
        let is_passing = |name: &String| stage(name).is_some();
        assert!(stages.len() <= 1, "after {} ms: {left:?}", 4 * delay);
        let known = |name: &String| expected.contains(name) || is_passing(name);
        assert!(left.iter().all(known), "after {} ms: {left:?}", 4 * delay);
    }
    // The next command removes the folder of a killed one.
    bench.flexcal("identify arm --out killed").success();
    assert_eq!(whole("killed"), expected);
    bench.write("killed/.flexcal-new-Ab12/estimate.json", "");
    bench.flexcal("identify arm --out killed").success();
    assert_eq!(whole("killed"), expected);
}

#[test]
fn pipes_are_read_or_refused_at_once() {
    let bench = bench();
    let table = bench.read("arm/measurements.csv");
    let piped = |arguments: &str, input: &str| {
        Run::of(bench.command(arguments).write_stdin(input.to_owned()))
    };
    let parameters = |run: Run| run.success().json()["parameters"].clone();
    let expected = parameters(bench.flexcal("identify arm --json --out a"));
    for name in ["/dev/stdin", "/proc/self/fd/0"] {
        let run = piped(&format!("identify arm --json --out b --data {name}"), &table);
        assert_eq!(parameters(run), expected, "{name}");
    }
    let run = piped("identify /dev/stdin --json --out c --data arm/measurements.csv", ARM);
    assert_eq!(parameters(run), expected);
    let run = piped("loop arm --out d --data /dev/stdin", &table).code(2);
    assert_contains(&run.stderr, &["/dev/stdin: loop names its data in problem.closed.toml"]);
    assert!(!bench.has("d"));
    // A problem from a pipe can be closed, too.
    assert!(piped("loop /dev/stdin --out e --data arm/measurements.csv", ARM).status < 2);
    bench.flexcal("identify e/problem.closed.toml --out f").success();
}

#[test]
fn names_need_not_be_utf8() {
    let bench = bench();
    let (data, out) = (OsStr::from_bytes(b"d\xff.csv"), OsStr::from_bytes(b"out\xfe"));
    fs::copy(bench.path("arm/measurements.csv"), bench.path(data)).unwrap();
    let run = |command: &str| {
        let mut command = bench.command(command);
        Run::of(command.arg("arm").arg("--data").arg(data).arg("--out").arg(out))
    };
    run("identify").success();
    assert!(bench.path(out).join("estimate.json").is_file());
    run("identify").success();
    // A name that cannot be written to a file is refused before any work.
    assert_contains(&run("loop").code(2).stderr, &["the name of this file is not UTF-8"]);
    assert!(!bench.path(out).join("loop.json").exists());
}

#[test]
fn the_same_rows_under_two_names_are_said() {
    let bench = bench();
    let table = bench.read("arm/measurements.csv");
    bench.write("copy.csv", &table);
    symlink("arm/measurements.csv", bench.path("link.csv")).unwrap();
    fs::hard_link(bench.path("arm/measurements.csv"), bench.path("hard.csv")).unwrap();
    for name in ["link.csv", "hard.csv", "./arm/../arm/measurements.csv"] {
        let arguments = format!("identify arm --data arm/measurements.csv {name}");
        let words = format!("error: {name}: named twice on the command line");
        assert_contains(&bench.flexcal(&arguments).code(2).stderr, &[&words]);
    }
    // The problem names the file too, but is not to blame.
    let twice = "identify arm --data arm/measurements.csv arm/measurements.csv";
    let error = bench.flexcal(twice).code(2).stderr;
    assert_contains(&error, &["arm/measurements.csv: named twice on the command line"]);
    assert!(!error.contains(".toml"), "{error}");
    let said = |data: &str| bench.flexcal(&format!("identify arm --data {data}")).stderr;
    assert_contains(
        &said("arm/measurements.csv copy.csv"),
        &["copy.csv:2: equal to arm/measurements.csv:2 in all digits, and 39 further rows"],
    );
    let rows: Vec<&str> = table.lines().collect();
    bench.write("doubled.csv", [rows.as_slice(), &rows[7..8]].concat().join("\n"));
    let words = "doubled.csv:42: equal to doubled.csv:8 in all digits;";
    assert_contains(&said("doubled.csv"), &[words]);
    assert!(!said("arm/measurements.csv").contains("in all digits"));
}

#[test]
fn a_fraction_holds_out_the_same_rows_in_any_order() {
    let bench = bench();
    bench.write("arm/problem.toml", format!("{ARM}held_out = {{ fraction = 0.3, seed = 1 }}\n"));
    let table = bench.read("arm/measurements.csv");
    let (header, rows) = table.split_once('\n').unwrap();
    let reversed: Vec<&str> = std::iter::once(header).chain(rows.lines().rev()).collect();
    bench.write("reversed.csv", reversed.join("\n"));
    let held_out = |data: &str| {
        let arguments = format!("identify arm --json --out {data}.out --data {data}");
        let json = bench.flexcal(&arguments).success().json();
        ["mean_mm", "rms_mm", "max_mm"].map(|key| number(&json["held_out"][key]["norm"]))
    };
    let (one, other) = (held_out("arm/measurements.csv"), held_out("reversed.csv"));
    assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-6), "{one:?} {other:?}");
}

#[test]
fn an_estimate_with_a_name_twice_is_refused() {
    let bench = bench();
    let mut json = bench.flexcal("identify arm --json --out out").success().json();
    let parameters = json["parameters"].as_array_mut().unwrap();
    parameters.push(parameters[0].clone());
    bench.write("twice.json", json.to_string());
    let arguments = "compensate arm --estimate twice.json --data arm/measurements.csv";
    assert_refused(&bench, arguments, ".", &["twice.json: joint1.theta stands there twice"]);
}

#[test]
fn an_acceptance_lists_the_joint_table_too() {
    let bench = bench();
    let problem = crate::common::arms::path("problems/bench-arm/two-tables");
    bench.flexcal(&format!("accept {} --out joined", problem.display())).success();
    let inputs = bench.json("joined/acceptance.json")["inputs"].as_array().unwrap().clone();
    let file = |input: &Value| PathBuf::from(input["file"].as_str().unwrap());
    let names: Vec<String> =
        inputs.iter().map(|i| file(i).file_name().unwrap().display().to_string()).collect();
    assert_eq!(names, ["problem.toml", "tracker.csv", "controller.csv"]);
}

#[test]
fn a_true_value_is_no_deviation_unless_both_are_small() {
    let simulate = "simulate arm --truth arm/TRUTH.toml --poses 9 --seed 2 --out new";
    for (nominal, deviation, is_refused) in [("0.4", 400, true), ("0.005", 5, false)] {
        let bench = bench();
        bench.map("arm/problem.toml", |text| {
            text.replace("[0.5, 0, 0]", &format!("[{nominal}, 0, 0]"))
        });
        bench.map("arm/TRUTH.toml", |text| {
            format!("[parameters]\n'tool.x' = {{ mm = {deviation} }}\n{text}")
        });
        if is_refused {
            assert_refused(&bench, simulate, ".", &["write the deviation from nominal"]);
        } else {
            bench.flexcal(simulate).success();
        }
    }
}

#[test]
fn check_and_next_know_the_joint_table() {
    let bench = bench();
    let problem = crate::common::arms::path("problems/bench-arm/two-tables");
    bench.flexcal(&format!("check {} --out checked", problem.display())).success();
    assert!(bench.json("checked/check.json")["poses"].as_u64() > Some(20));
    let run = bench.flexcal(&format!("next {} --poses 2 --out next", problem.display())).success();
    let step =
        "append them to the measurements and, unless these hold the joints, to the joint table";
    assert_contains(&run.stdout, &[step]);
}

#[test]
fn results_of_one_table_are_paired_whatever_the_path() {
    let bench = bench();
    bench.flexcal("identify arm --out here").success();
    // The same table, named by another path.
    bench.map("arm/problem.toml", |text| {
        text.replace("'measurements.csv'", "'../arm/measurements.csv'")
    });
    bench.flexcal("identify arm --out there").success();
    let compared = |bench: &Folder| {
        bench.flexcal("compare-results here/estimate.json there/estimate.json --force").success()
    };
    let words = "rows that both predict and neither fitted: neither predicts them better";
    assert_contains(&compared(&bench).stdout, &[words]);
    // Other measurements of the same poses are not the same rows.
    let table = bench.table("arm/measurements.csv");
    let x = table.place("x_mm");
    bench.map("arm/measurements.csv", |text| {
        let mut lines = text.lines();
        let header = lines.next().unwrap().to_owned();
        let moved = lines.map(|line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells[x] = format!("{:.4}", cells[x].parse::<f64>().unwrap() + 0.01);
            cells.join(",")
        });
        std::iter::once(header).chain(moved).collect::<Vec<_>>().join("\n") + "\n"
    });
    bench.flexcal("identify arm --out there").success();
    assert!(!compared(&bench).stdout.contains("both predict and neither fitted"));
}

#[test]
fn an_acceptance_is_of_the_files_that_were_read() {
    let bench = bench();
    // Three of the held-out rows in one configuration, 0.3 mm apart along x.
    let table = bench.table("arm/measurements.csv");
    let x = table.place("x_mm");
    let mut row =
        table.rows.iter().rfind(|row| row.contains(&"validation".to_owned())).unwrap().clone();
    for _ in 0..2 {
        row[x] = format!("{:.4}", row[x].parse::<f64>().unwrap() + 0.3);
        bench.map("arm/measurements.csv", |text| text.to_owned() + &row.join(",") + "\n");
    }
    let run = bench.flexcal("accept arm --instrument tracker --out signed").success();
    assert_contains(&run.stdout, &["pose accuracy AP, mm", "acceptance.html"]);
    let record = bench.json("signed/acceptance.json");
    for (k, name) in ["arm/problem.toml", "arm/measurements.csv"].into_iter().enumerate() {
        let input = &record["inputs"][k];
        assert!(input["file"].as_str().unwrap().ends_with(name), "{input}");
        assert_eq!(input["sha256"], flexcal::files::digest(&fs::read(bench.path(name)).unwrap()));
    }
    assert_eq!((&record["instrument"], &record["commit"]), (&"tracker".into(), &Value::Null));
    // Distances of 0.3, 0 and 0.3 mm from the centre: mean 0.2, standard deviation √0.03.
    assert_eq!(record["repeated_poses"], 1);
    let expected = 0.2 + 3.0 * 0.03_f64.sqrt();
    assert!((number(&record["repeatability_max_mm"]) - expected).abs() < 1e-4);
    let of = |state: &str, key: &str| number(&record[state][key]);
    let [low, high] = [0, 1].map(|end| number(&record["after"]["interval_95_mm"][end]));
    let (mean, rms, max) = (of("after", "mean_mm"), of("after", "rms_mm"), of("after", "max_mm"));
    assert!(low < mean && mean < high && high < of("before", "mean_mm"));
    assert!(mean <= rms && rms <= max);
    assert_eq!(record["held_out_rows"].as_u64().unwrap(), record["poses"].as_u64().unwrap() + 2);
    let digest = record["inputs"][0]["sha256"].as_str().unwrap();
    assert_contains(
        &bench.read("signed/acceptance.html"),
        &["measured by", "signed by", "Instrument: tracker", "SHA-256", digest],
    );
    // A repository that tracks the problem is identified by its commit, and another one is not.
    bench.write(".git/HEAD", "ref: refs/heads/main\n");
    bench.write(".git/refs/heads/main", "0123abcd\n");
    let json = bench.flexcal("accept arm --json --out signed").success().json();
    assert_eq!(json["commit"], Value::Null);
    let mut index = b"DIRC\0\0\0\x02\0\0\0\x01".to_vec();
    index.extend([0; 60]);
    index.extend(b"\0\x10arm/problem.toml\0\0");
    bench.write(".git/index", index);
    let json = bench.flexcal("accept arm --json --out signed").success().json();
    assert_eq!(json["commit"], "0123abcd");
}

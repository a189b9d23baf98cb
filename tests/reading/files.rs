//! File handling of commands: what they replace, keep and read.

#![cfg(unix)]
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use assert_cmd::Command;
use assert_cmd::assert::Assert;

/// Problem of two rigid joints, whose fit is fast.
const ARM: &str = "name = 'arm'\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\na_m = 0.1\n[tool]\ntarget_m = [0.5, 0, 0]\n\
                   [parameters]\n'joint*.theta' = { sigma_deg = 1 }\n'tool.x' = { sigma_mm = 3 }\n[data]\n\
                   files = ['measurements.csv']\nposition_sigma_mm = 0.1\nreference_temperature_C = 20\n";
const TRUTH: &str = "[random]\n'*' = { sigma_deg = 0.1, sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.1\n\
                     [poses]\nq1_deg = [-90, 90]\nq2_deg = [-60, 60]\n";

/// Temporary folder with a problem and its data in `arm`.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(tempfile::tempdir().unwrap());
        fs::create_dir(bench.path("arm")).unwrap();
        fs::write(bench.path("arm/problem.toml"), ARM).unwrap();
        fs::write(bench.path("arm/TRUTH.toml"), TRUTH).unwrap();
        bench.flexcal(SIMULATE).success();
        fs::rename(bench.path("made/measurements.csv"), bench.path("arm/measurements.csv"))
            .unwrap();
        bench
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command.current_dir(self.0.path()).args(arguments.split(' '));
        command
    }

    fn flexcal(&self, arguments: &str) -> Assert {
        self.command(arguments).assert()
    }

    /// Returns the message of a command that ends with status 2 and leaves the files of a folder
    /// unchanged.
    fn refused(&self, arguments: &str, folder: &str) -> String {
        let before = self.listing(folder);
        let error = text(&self.flexcal(arguments).code(2).get_output().stderr);
        assert_eq!(self.listing(folder), before, "{arguments}");
        error
    }

    /// Returns every file below a folder with its content.
    fn listing(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let mut all = Vec::new();
        let mut folders = vec![self.path(folder)];
        while let Some(folder) = folders.pop() {
            let Ok(entries) = fs::read_dir(&folder) else { continue };
            for path in entries.map(|entry| entry.unwrap().path()) {
                if path.is_dir() && !path.is_symlink() {
                    folders.push(path);
                } else {
                    let content = fs::read(&path).unwrap_or_default();
                    all.push((path, content));
                }
            }
        }
        all.sort();
        all
    }
}

const SIMULATE: &str = "simulate arm --truth arm/TRUTH.toml --poses 40 --seed 1 --out made";

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn what_is_read_is_not_replaced() {
    let bench = Bench::new();
    let simulate = "simulate arm --truth arm/TRUTH.toml --poses 9 --seed 2 --out arm";
    let error = bench.refused(simulate, "arm");
    assert!(
        error
            .contains("arm/measurements.csv is an input of this command or belongs to its problem")
            && error.contains("--force"),
        "{error}"
    );
    // Inputs are recognised under other names: a link to the folder, and one to the file.
    symlink(bench.path("arm"), bench.path("other")).unwrap();
    assert!(
        bench.refused(&simulate.replace("--out arm", "--out other"), "arm").contains("an input")
    );
    fs::create_dir(bench.path("linked")).unwrap();
    symlink("../arm/measurements.csv", bench.path("linked/measurements.csv")).unwrap();
    assert!(
        bench.refused(&simulate.replace("--out arm", "--out linked"), "arm").contains("an input")
    );
    // The problem that the loop wrote is the one that it reads next.
    bench.flexcal("loop arm --out closed");
    let error = bench.refused("loop closed/problem.closed.toml --out closed", "closed");
    assert!(error.contains("problem.closed.toml is an input"), "{error}");
    // --force permits it.
    bench.flexcal(&format!("{simulate} --force")).success();
    assert_eq!(bench.read("arm/measurements.csv").lines().count(), 10);
}

#[test]
fn what_flexcal_did_not_write_is_not_replaced() {
    let bench = Bench::new();
    fs::create_dir(bench.path("out")).unwrap();
    for name in ["estimate.json", "report.md", "report.html"] {
        fs::write(bench.path("out").join(name), "mine").unwrap();
        let error = bench.refused("identify arm --out out", "out");
        assert!(
            error.contains(&format!("out/{name} is there and not as flexcal wrote it")),
            "{error}"
        );
        fs::remove_file(bench.path("out").join(name)).unwrap();
    }
    // Files of flexcal are replaced; those of another command with a message.
    for (command, said) in
        [("identify", None), ("identify", None), ("compare", Some("the report of identify"))]
    {
        let done = bench.flexcal(&format!("{command} arm --out out")).success();
        let error = text(&done.get_output().stderr);
        assert_eq!(said.map(|said| error.contains(said)), said.map(|_| true), "{error}");
        assert_eq!(error.contains("is replaced"), said.is_some(), "{error}");
    }
    // A changed file is not replaced.
    fs::write(bench.path("out/report.md"), bench.read("out/report.md") + "and a remark").unwrap();
    for command in ["identify", "compare", "loop"] {
        assert!(
            bench
                .refused(&format!("{command} arm --out out"), "out")
                .contains("out/report.md is there")
        );
    }
    bench.flexcal("identify arm --out out --force").success();
    assert!(!bench.read("out/report.md").contains("remark"));
    bench.flexcal("man --out pages").success();
    fs::write(bench.path("pages/flexcal.1"), "mine").unwrap();
    bench.refused("man --out pages", "pages");
}

#[test]
fn results_of_an_earlier_table_do_not_stay_beside_those_of_another() {
    let bench = Bench::new();
    fs::write(bench.path("poses.csv"), "q1_deg,q2_deg\n10,20\n").unwrap();
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
    assert_eq!(there(), ["errors.json", "predictions.csv", "residuals.csv"]);
    bench.flexcal(poses).success();
    assert_eq!(there(), ["predictions.csv"]);
    // Files of another command stay, and so do changed ones.
    bench.flexcal("predict arm --out out").success();
    bench.flexcal("identify arm --out out").success();
    fs::write(bench.path("out/errors.json"), "mine").unwrap();
    bench.flexcal(&format!("{poses} --force")).success();
    assert!(there().contains(&"residuals.csv".to_owned()), "{:?}", there());
    assert_eq!(bench.read("out/errors.json"), "mine");
}

#[test]
fn links_are_not_followed() {
    let bench = Bench::new();
    for folder in ["out", "elsewhere"] {
        fs::create_dir(bench.path(folder)).unwrap();
    }
    symlink("../elsewhere", bench.path("out/figures")).unwrap();
    let error = bench.refused("identify arm --out out", ".");
    assert!(error.contains("symbolic link"), "{error}");
    fs::remove_file(bench.path("out/figures")).unwrap();
    // A result that is a link was not written by flexcal; --force replaces the link and leaves its
    // target.
    fs::write(bench.path("elsewhere/mine"), "mine").unwrap();
    symlink("../elsewhere/mine", bench.path("out/report.md")).unwrap();
    assert!(bench.refused("identify arm --out out", ".").contains("out/report.md is there"));
    bench.flexcal("identify arm --out out --force").success();
    assert_eq!(bench.read("elsewhere/mine"), "mine");
    assert!(
        !bench.path("out/report.md").is_symlink() && bench.read("out/report.md").starts_with("# ")
    );
}

#[test]
fn a_command_that_is_killed_leaves_no_litter() {
    let bench = Bench::new();
    let whole = |folder: &str| -> Vec<String> {
        let names =
            |path: &Path| path.strip_prefix(bench.path(folder)).unwrap().display().to_string();
        bench.listing(folder).iter().map(|(path, _)| names(path)).collect()
    };
    bench.flexcal("identify arm --out whole").success();
    let expected = whole("whole");
    for delay in 0..12 {
        let mut process = Process::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        process.current_dir(bench.0.path()).args(["identify", "arm", "--out", "killed", "--quiet"]);
        let mut process = process.stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(4 * delay));
        process.kill().unwrap();
        process.wait().unwrap();
        let left = whole("killed");
        // During replacement a file has another name.
        let is_passing = |name: &String| {
            name.rsplit('/').next().is_some_and(|last| last.starts_with(".flexcal-"))
        };
        assert!(
            left.iter().filter(|name| is_passing(name)).count() <= 1,
            "after {} ms: {left:?}",
            4 * delay
        );
        let known = |name: &String| expected.contains(name) || is_passing(name);
        assert!(left.iter().all(known), "after {} ms: {left:?}", 4 * delay);
    }
    // Process ids do not exceed 4 194 304.
    bench.flexcal("identify arm --out killed").success();
    fs::write(bench.path("killed/figures/.flexcal-5000000-x"), "").unwrap();
    // Files older than a minute are removed, including those of a killed command.
    for (path, _) in bench.listing("killed") {
        let left = fs::File::options().append(true).open(path).unwrap();
        left.set_modified(std::time::SystemTime::now() - Duration::from_secs(3600)).unwrap();
    }
    bench.flexcal("identify arm --out killed").success();
    assert_eq!(whole("killed"), expected);
}

#[test]
fn pipes_are_read_or_refused_at_once() {
    let bench = Bench::new();
    let table = fs::read(bench.path("arm/measurements.csv")).unwrap();
    let json = |assert: Assert| -> serde_json::Value {
        serde_json::from_slice(&assert.code(0).get_output().stdout).unwrap()
    };
    let from_file = json(bench.flexcal("identify arm --json --out a"));
    for name in ["/dev/stdin", "/proc/self/fd/0"] {
        let mut command = bench.command(&format!("identify arm --json --out b --data {name}"));
        let from_pipe = json(command.write_stdin(table.clone()).assert());
        assert_eq!(from_pipe["parameters"], from_file["parameters"], "{name}");
    }
    let problem = bench
        .command("identify /dev/stdin --json --out c --data arm/measurements.csv")
        .write_stdin(ARM)
        .assert();
    assert_eq!(json(problem)["parameters"], from_file["parameters"]);
    let mut looped = bench.command("loop arm --out d --data /dev/stdin");
    let error = text(&looped.write_stdin(table).assert().code(2).get_output().stderr);
    assert!(error.contains("/dev/stdin: loop names its data in problem.closed.toml"), "{error}");
    assert!(!bench.path("d").exists());
    // A problem from a pipe can be closed, too.
    let closed = bench
        .command("loop /dev/stdin --out e --data arm/measurements.csv")
        .write_stdin(ARM)
        .assert();
    assert!(closed.get_output().status.code().unwrap() < 2);
    bench.flexcal("identify e/problem.closed.toml --out f").success();
}

#[test]
fn names_need_not_be_utf8() {
    let bench = Bench::new();
    let (data, out) = (OsStr::from_bytes(b"d\xff.csv"), OsStr::from_bytes(b"out\xfe"));
    fs::copy(bench.path("arm/measurements.csv"), bench.path(data)).unwrap();
    let run = |command: &str| {
        bench.command(command).arg("arm").arg("--data").arg(data).arg("--out").arg(out).assert()
    };
    run("identify").success();
    assert!(bench.path(out).join("estimate.json").is_file());
    run("identify").success();
    // A name that cannot be written to a file is refused before any work.
    let error = text(&run("loop").code(2).get_output().stderr);
    assert!(error.contains("the name of this file is not UTF-8"), "{error}");
    assert!(!bench.path(out).join("loop.json").exists());
}

#[test]
fn the_same_rows_under_two_names_are_said() {
    let bench = Bench::new();
    let table = bench.read("arm/measurements.csv");
    fs::write(bench.path("copy.csv"), &table).unwrap();
    symlink("arm/measurements.csv", bench.path("link.csv")).unwrap();
    fs::hard_link(bench.path("arm/measurements.csv"), bench.path("hard.csv")).unwrap();
    for name in ["link.csv", "hard.csv", "./arm/../arm/measurements.csv"] {
        let error = text(
            &bench
                .flexcal(&format!("identify arm --data arm/measurements.csv {name}"))
                .code(2)
                .get_output()
                .stderr,
        );
        assert!(
            error.contains(&format!("error: {name}: named twice on the command line")),
            "{error}"
        );
    }
    // The problem names the file too, but is not to blame.
    let twice = "identify arm --data arm/measurements.csv arm/measurements.csv";
    let error = text(&bench.flexcal(twice).code(2).get_output().stderr);
    assert!(
        error.contains("arm/measurements.csv: named twice on the command line")
            && !error.contains(".toml"),
        "{error}"
    );
    let said = |data: &str| {
        text(&bench.flexcal(&format!("identify arm --data {data}")).get_output().stderr)
    };
    let error = said("arm/measurements.csv copy.csv");
    assert!(
        error.contains(
            "copy.csv:2: equal to arm/measurements.csv:2 in all digits, and 39 further rows"
        ),
        "{error}"
    );
    let rows: Vec<&str> = table.lines().collect();
    fs::write(bench.path("doubled.csv"), [rows.as_slice(), &rows[7..8]].concat().join("\n"))
        .unwrap();
    let error = said("doubled.csv");
    assert!(error.contains("doubled.csv:42: equal to doubled.csv:8 in all digits;"), "{error}");
    assert!(!said("arm/measurements.csv").contains("in all digits"));
}

#[test]
fn a_fraction_holds_out_the_same_rows_in_any_order() {
    let bench = Bench::new();
    fs::write(
        bench.path("arm/problem.toml"),
        format!("{ARM}held_out = {{ fraction = 0.3, seed = 1 }}\n"),
    )
    .unwrap();
    let table = bench.read("arm/measurements.csv");
    let (header, rows) = table.split_once('\n').unwrap();
    let reversed: Vec<&str> = std::iter::once(header).chain(rows.lines().rev()).collect();
    fs::write(bench.path("reversed.csv"), reversed.join("\n")).unwrap();
    let held_out = |data: &str| {
        let run =
            bench.flexcal(&format!("identify arm --json --out {data}.out --data {data}")).success();
        let json: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
        ["mean_mm", "rms_mm", "max_mm"].map(|key| json["held_out"][key]["norm"].as_f64().unwrap())
    };
    let (one, other) = (held_out("arm/measurements.csv"), held_out("reversed.csv"));
    assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-6), "{one:?} {other:?}");
}

#[test]
fn an_estimate_with_a_name_twice_is_refused() {
    let bench = Bench::new();
    bench.flexcal("identify arm --out out").success();
    let mut json: serde_json::Value =
        serde_json::from_str(&bench.read("out/estimate.json")).unwrap();
    let parameters = json["parameters"].as_array_mut().unwrap();
    let again = parameters[0].clone();
    parameters.push(again);
    fs::write(bench.path("twice.json"), json.to_string()).unwrap();
    let error =
        bench.refused("compensate arm --estimate twice.json --data arm/measurements.csv", ".");
    assert!(error.contains("twice.json: joint1.theta stands there twice"), "{error}");
}

#[test]
fn an_acceptance_is_of_the_files_that_were_read() {
    let bench = Bench::new();
    // Three of the held-out rows in one configuration, 0.3 mm apart along x.
    let table = bench.read("arm/measurements.csv");
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let x = header.iter().position(|name| *name == "x_mm").unwrap();
    let last = lines.iter().rposition(|line| line.contains("validation")).unwrap();
    for _ in 0..2 {
        let mut cells: Vec<String> = lines.last().unwrap().split(',').map(str::to_owned).collect();
        if lines.len() == table.lines().count() {
            cells = lines[last].split(',').map(str::to_owned).collect();
        }
        cells[x] = format!("{:.4}", cells[x].parse::<f64>().unwrap() + 0.3);
        lines.push(cells.join(","));
    }
    fs::write(bench.path("arm/measurements.csv"), lines.join("\n") + "\n").unwrap();
    let told = text(
        &bench
            .flexcal("accept arm --instrument tracker --out signed")
            .success()
            .get_output()
            .stdout,
    );
    assert!(told.contains("pose accuracy AP, mm") && told.contains("acceptance.html"), "{told}");
    let record: serde_json::Value =
        serde_json::from_str(&bench.read("signed/acceptance.json")).unwrap();
    for (k, name) in ["arm/problem.toml", "arm/measurements.csv"].into_iter().enumerate() {
        let input = &record["inputs"][k];
        assert!(input["file"].as_str().unwrap().ends_with(name), "{input}");
        assert_eq!(input["sha256"], flexcal::files::digest(&fs::read(bench.path(name)).unwrap()));
    }
    assert_eq!(
        (&record["instrument"], &record["commit"]),
        (&"tracker".into(), &serde_json::Value::Null)
    );
    // Distances of 0.3, 0 and 0.3 mm from the centre: mean 0.2, standard deviation √0.03.
    assert_eq!(record["repeated_poses"], 1);
    assert!(
        (record["repeatability_max_mm"].as_f64().unwrap() - (0.2 + 3.0 * 0.03_f64.sqrt())).abs()
            < 1e-4
    );
    let of = |state: &str, key: &str| record[state][key].as_f64().unwrap();
    let [low, high] = [0, 1].map(|end| record["after"]["interval_95_mm"][end].as_f64().unwrap());
    assert!(
        low < of("after", "mean_mm")
            && of("after", "mean_mm") < high
            && high < of("before", "mean_mm")
    );
    assert!(
        of("after", "mean_mm") <= of("after", "rms_mm")
            && of("after", "rms_mm") <= of("after", "max_mm")
    );
    assert_eq!(record["held_out_rows"].as_u64().unwrap(), record["poses"].as_u64().unwrap() + 2);
    let page = bench.read("signed/acceptance.html");
    for words in [
        "measured by",
        "accepted by",
        "Instrument: tracker",
        "SHA-256",
        record["inputs"][0]["sha256"].as_str().unwrap(),
    ] {
        assert!(page.contains(words), "{words}");
    }
    // A repository around the problem is identified by its commit.
    fs::create_dir_all(bench.path(".git/refs/heads")).unwrap();
    fs::write(bench.path(".git/HEAD"), "ref: refs/heads/main\n").unwrap();
    fs::write(bench.path(".git/refs/heads/main"), "0123abcd\n").unwrap();
    let json = text(&bench.flexcal("accept arm --json --out signed").success().get_output().stdout);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&json).unwrap()["commit"], "0123abcd");
}

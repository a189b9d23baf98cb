//! Interrupts (SIGINT) sent at a chosen point of the progress line on a terminal.

use std::io::Read as _;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use assert_cmd::cargo::cargo_bin;

use crate::common::program::{Folder, assert_contains, items, texts};

/// Number of poses for which a round of the loop takes long enough to interrupt it.
const POSES: usize = 200;

/// Returns a folder with measurements of an arm with an effect, most of them for identification.
fn measured() -> Folder {
    let folder = Folder::new();
    folder.copy("problems/lunar-sampler/problem.toml", "problem.toml");
    folder.copy("problems/lunar-sampler/TRUTH.toml", "TRUTH.toml");
    folder.simulate(".", "TRUTH.toml", POSES + 20, 1, "data.csv");
    folder.map_rows("data.csv", |line, row| {
        Some(if line <= POSES + 1 {
            row.replace("validation", "identification")
        } else {
            row.to_owned()
        })
    });
    folder
}

/// Run of flexcal on a pseudo-terminal.
struct Terminal {
    script: Child,
    output: ChildStdout,
    /// Output shown so far.
    shown: String,
}

impl Terminal {
    /// Starts the command through `script`, which provides the terminal; the first output is its
    /// process id.
    fn run(folder: &Path, arguments: &str) -> Self {
        let command =
            format!("echo pid=$$.; exec '{}' {arguments}", cargo_bin!("flexcal").display());
        // Background test runs ignore interrupts, and child processes would inherit that.
        let mut script = Command::new("env")
            .args(["--default-signal=INT", "script", "-qefc", &command, "/dev/null"])
            .current_dir(folder)
            .env("TERM", "xterm")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let output = script.stdout.take().unwrap();
        Self { script, output, shown: String::new() }
    }

    /// Waits until the output contains `words`.
    fn wait_for(&mut self, words: &str) {
        let mut piece = [0; 4096];
        while !self.shown.contains(words) {
            let read = self.output.read(&mut piece).unwrap();
            assert!(read > 0, "it ended before {words:?}: {}", self.shown);
            self.shown.push_str(&String::from_utf8_lossy(&piece[..read]));
        }
    }

    fn interrupt(&self) {
        self.signal("INT");
    }

    /// Returns the process id of the command, once it has been shown.
    fn pid(&self) -> &str {
        self.shown.split_once("pid=").unwrap().1.split('.').next().unwrap()
    }

    /// Waits until the command handles interrupts.
    #[cfg(target_os = "linux")]
    fn wait_for_handler(&mut self) {
        self.wait_for(".");
        let is_handled = || {
            let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid())).unwrap();
            let value = |key| status.split_once(key).unwrap().1.lines().next().unwrap().trim();
            let caught = u64::from_str_radix(value("SigCgt:"), 16).unwrap();
            value("Name:") == "flexcal" && caught & 2 != 0
        };
        while !is_handled() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }

    fn signal(&self, signal: &str) {
        let pid = self.pid();
        assert!(
            Command::new("sh")
                .args(["-c", &format!("kill -{signal} {pid}")])
                .status()
                .unwrap()
                .success()
        );
    }

    /// Returns the exit status and the complete output.
    fn end(mut self) -> (Option<i32>, String) {
        let mut rest = Vec::new();
        self.output.read_to_end(&mut rest).unwrap();
        (self.script.wait().unwrap().code(), self.shown + &String::from_utf8_lossy(&rest))
    }
}

#[test]
fn an_interrupted_loop_tells_what_it_has_found() {
    let folder = measured();
    let run = |arguments: &str| Terminal::run(&folder.path(""), arguments);

    let mut once = run("loop . --data data.csv --out once");
    once.wait_for("round 2, 1 effect (last link-thermal-bending)");
    once.interrupt();
    let (status, shown) = once.end();
    assert_eq!(status, Some(1), "{shown}");
    assert_contains(&shown, &["interrupted after 1 round: there may be more to find"]);
    let found = folder.json("once/loop.json");
    assert_eq!((&found["interrupted"], &found["trusted"]), (&true.into(), &true.into()));
    assert_eq!(texts(&found["effects"], "effect"), ["link-thermal-bending"]);
    assert_eq!(items(&found["steps"]).len(), 1);
    for name in ["problem.closed.toml", "residuals.csv", "report.html"] {
        assert!(folder.path("once").join(name).is_file(), "{name}");
    }
    assert_contains(&folder.read("once/report.md"), &["Search interrupted after 1 round"]);

    // A second interrupt before the report is written leaves no output.
    let mut twice = run("loop . --data data.csv --out twice");
    twice.wait_for("round 2");
    twice.interrupt();
    twice.wait_for("Ctrl-C again ends at once");
    twice.interrupt();
    let (status, shown) = twice.end();
    assert_eq!(status, Some(130), "{shown}");
    assert!(!folder.has("twice"));

    // An interrupt before the first result leaves no output.
    let mut early = run("identify . --data data.csv --strategy sequential --out early");
    early.wait_for("step ");
    early.interrupt();
    let (status, shown) = early.end();
    assert_eq!(status, Some(130), "{shown}");
    assert_contains(&shown, &["interrupted before there was a result"]);
    assert!(!folder.has("early"));
}

#[test]
fn an_interrupted_loop_replaces_no_finished_one() {
    let folder = measured();
    // A finished loop of few poses.
    let table = folder.read("data.csv");
    let few: Vec<&str> = table.lines().take(1).chain(table.lines().skip(POSES - 29)).collect();
    folder.write("few.csv", few.join("\n") + "\n");
    folder.flexcal("loop . --data few.csv --out out --quiet").success();
    let finished = folder.read("out/loop.json");
    for signal in ["INT", "TERM"] {
        let mut run = Terminal::run(&folder.path(""), "loop . --data data.csv --out out");
        run.wait_for("round 2, 1 effect (last link-thermal-bending)");
        run.signal(signal);
        let (status, shown) = run.end();
        assert_eq!(status, Some(1), "{signal}: {shown}");
        assert_eq!(folder.read("out/loop.json"), finished);
        let found = folder.read("out/interrupted/problem.closed.toml");
        assert!(found.contains("link-thermal-bending"), "{found}");
        assert!(shown.contains("holds a finished loop, which stays"), "{shown}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn every_command_says_that_it_was_interrupted() {
    let folder = measured();
    for command in ["plan . --poses 200", "simulate . --poses 1000000 --seed 1"] {
        let arguments = format!("{command} --truth TRUTH.toml --out early");
        let mut run = Terminal::run(&folder.path(""), &arguments);
        run.wait_for_handler();
        run.interrupt();
        let (status, shown) = run.end();
        assert_eq!(status, Some(130), "{command}: {shown}");
        assert_contains(&shown, &["error", "interrupted before the end"]);
        assert!(!folder.has("early"));
    }
    let mut run = Terminal::run(&folder.path(""), "next . --data data.csv --out early");
    run.wait_for_handler();
    run.signal("TERM");
    let (status, shown) = run.end();
    assert_eq!(status, Some(143), "{shown}");
    assert!(!folder.has("early"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_command_starts_where_no_thread_can_be_started() {
    // No processor has the addresses for a stack of this size.
    let stack = (1_u64 << 48).to_string();
    let run = |command: &str| {
        let mut program = Command::new(cargo_bin!("flexcal"));
        let output = program.arg(command).env("RUST_MIN_STACK", &stack).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (status, said) = run("man");
    assert_eq!(status, Some(0), "{said}");
    let (status, said) = run("identify");
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("no threads for the computation") && !said.contains("panic"), "{said}");
}

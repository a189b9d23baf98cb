//! Studies: the same bytes however they are interrupted, shared out and threaded; statistics that mean what they say; and
//! bad input.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Stdio};
use std::time::Duration;

use assert_cmd::Command;
use flexcal::campaign::{Campaign, Results, Shard, Store, collect, pending, run};
use flexcal::report;
use serde_json::Value;

/// Three rigid joints, few parameters: a fit takes a moment.
const ARM: &str = r#"
name = "small"
[[joint]]
d_m = 0.3
[[joint]]
alpha_deg = 90.0
[[joint]]
a_m = 0.6
[tool]
target_m = [0.5, 0.05, 0.0]
[parameters]
"joint*.theta" = { sigma_deg = 0.5 }
"joint3.a" = { sigma_mm = 3.0 }
"tool.x" = { sigma_mm = 3.0 }
[data]
position_sigma_mm = 0.1
"#;

const STUDY: &str = r#"
name = "small-study"
problem = "problem.toml"
seed = 7
repetitions = 120
position_sigma_mm = [0.05, 0.2]
identification_poses = [8]
held_out_poses = 10
strategies = ["joint"]
solvers = ["auto", "gauss-newton"]
[poses]
q1_deg = [-120, 120]
q2_deg = [-40, 80]
q3_deg = [-120, -10]
"#;

/// The results that have to repeat.
const RESULTS: [&str; 3] = ["study.csv", "study.json", "parameters.csv"];

/// A folder with a study.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self::of(STUDY)
    }

    fn of(study: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("problem.toml"), ARM).unwrap();
        fs::write(folder.path().join("STUDY.toml"), study).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The texts of the results in a folder.
    fn results(&self, out: &str) -> Vec<String> {
        RESULTS.iter().map(|name| self.read(&format!("{out}/{name}"))).collect()
    }

    fn flexcal(&self, arguments: &[&str]) -> assert_cmd::assert::Assert {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command.current_dir(self.folder.path()).args(arguments).assert()
    }

    fn start(&self, arguments: &[&str]) -> Child {
        let mut command = Process::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        command.current_dir(self.folder.path()).args(arguments).stdout(Stdio::null()).spawn().unwrap()
    }

    /// Finished parts in a folder of results.
    fn parts(&self, out: &str) -> usize {
        let finished = |entry: fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "json");
        fs::read_dir(self.path(out).join("cells")).map_or(0, |files| files.filter(|f| finished_file(f, finished)).count())
    }

    fn campaign(&self) -> Campaign {
        Campaign::read(&self.path("STUDY.toml")).unwrap()
    }
}

fn finished_file(entry: &std::io::Result<fs::DirEntry>, finished: impl Fn(fs::DirEntry) -> bool) -> bool {
    entry.as_ref().is_ok_and(|entry| {
        let name = entry.file_name();
        !name.to_string_lossy().starts_with('.') && Path::new(&name).extension().is_some_and(|e| e == "json")
    }) && entry.is_ok()
        && finished as usize != 0
}

fn texts(campaign: &Campaign, results: &Results) -> [String; 3] {
    [
        report::study_csv(campaign, results),
        report::study_json(campaign, results),
        report::study_parameters_csv(campaign, results),
    ]
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

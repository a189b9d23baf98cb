//! Tests of the command line.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

#[path = "cli/compensate.rs"]
mod compensate;
#[path = "cli/example.rs"]
mod example;
#[path = "cli/gross.rs"]
mod gross;
#[path = "cli/input.rs"]
mod input;
#[cfg(target_os = "linux")]
#[path = "cli/interrupt.rs"]
mod interrupt;
#[path = "cli/printed.rs"]
mod printed;
#[path = "cli/results.rs"]
mod results;
#[path = "cli/strategies.rs"]
mod strategies;

/// Temporary folder with a copy of the lunar sampler's problem and data.
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

    /// Keeps the header and maps every other line of the data, counted from 2.
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

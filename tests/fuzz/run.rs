//! One run of the program with limits on time and memory.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Largest processor time of a run [s].
pub const LONGEST: u64 = 20;
/// Time after which a run counts as hanging.
const PATIENCE: Duration = Duration::from_secs(600);
/// Largest address space of a run [KiB].
const MEMORY: u64 = 2 << 20;

/// Outcome of a run.
pub struct Ran {
    /// Exit status; `None` if the run was killed.
    pub status: Option<i32>,
    /// Elapsed time of the run.
    pub time: Duration,
    pub out: String,
    pub err: String,
}

/// Runs the program in a folder; its output is redirected to files.
pub fn flexcal(folder: &Path, arguments: &[&str], threads: usize) -> Ran {
    let printed = [folder.with_extension("out"), folder.with_extension("err")];
    let limited = format!("ulimit -v {MEMORY}; ulimit -t {LONGEST}; exec \"$0\" \"$@\"");
    let clock = Instant::now();
    let mut child = Command::new("sh")
        .args(["-c", &limited])
        .arg(assert_cmd::cargo::cargo_bin!("flexcal"))
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .stdin(Stdio::null())
        .stdout(File::create(&printed[0]).unwrap())
        .stderr(File::create(&printed[1]).unwrap())
        .spawn()
        .unwrap();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status.code(),
            None if clock.elapsed() > PATIENCE => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    let time = clock.elapsed();
    let [out, err] =
        printed.map(|path| String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned());
    Ran { status, time, out, err }
}

/// Returns every file below a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() { folders.push(path) } else { all.push(path) }
        }
    }
    all.sort();
    all
}

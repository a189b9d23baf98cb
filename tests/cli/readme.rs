//! Commands of the README for an arm of the reader's own, run as they are printed.

use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
#[cfg(unix)]
fn the_first_hour_of_the_readme_runs_as_printed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let section = readme.split("## Your own arm").nth(1).unwrap().split("\n## ").next().unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(root.join("problems"), folder.path().join("problems")).unwrap();
    let commands: Vec<&str> =
        section.lines().filter_map(|line| line.strip_prefix("    ")).collect();
    assert!(commands.len() >= 6, "{section}");
    let two_tables = "flexcal identify problems/bench-arm/two-tables --out out/two-tables";
    for line in commands.into_iter().chain([two_tables]) {
        let mut words = line.split('#').next().unwrap().split_whitespace();
        let program = match words.next().unwrap() {
            "flexcal" => assert_cmd::cargo::cargo_bin!("flexcal").to_path_buf(),
            other => other.into(),
        };
        let run = Command::new(program).args(words).current_dir(folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{line}: {said}");
    }
    let closed =
        fs::read_to_string(folder.path().join("out/bench-loop/problem.closed.toml")).unwrap();
    assert!(closed.contains("joint-compliance = { joint = 2 }"), "{closed}");
    assert!(folder.path().join("out/calibrated.urdf").is_file());
}

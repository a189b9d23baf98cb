//! Example of custom parts: its length, and that it finds the simulated deviations.

use std::process::Command;

/// Number of lines of code in which the public interface must do.
const MAX_LINES: usize = 40;

#[test]
fn forty_lines_fit_within_bounds_with_a_law_and_a_solver_of_the_caller() {
    let text = include_str!("../../examples/custom.rs");
    let is_code = |line: &&str| {
        !line.trim().is_empty() && !["//", "#!["].iter().any(|mark| line.trim().starts_with(mark))
    };
    let lines = text.lines().filter(is_code).count();
    assert!(lines <= MAX_LINES, "{lines} lines of code");

    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["run", "--quiet", "--example", "custom"];
    let output =
        Command::new(cargo).current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).output();
    let printed = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let printed = printed.unwrap_or_default();
    let cam = printed.strip_prefix("cam: ").and_then(|text| text.split_once(" mrad; tip at ["));
    let cam: f64 = cam.and_then(|(cam, _)| cam.parse().ok()).unwrap_or(f64::NAN);
    assert!((cam - 3.0).abs() < 0.3, "{printed}");
}

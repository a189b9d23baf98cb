//! The example of thirty lines: it has no more, and it finds what it put in.

use std::path::Path;
use std::process::Command;

const LINES: usize = 30;

#[test]
fn thirty_lines_fit_predict_and_trace_an_effect_of_their_own() {
    let text = include_str!("../examples/thirty_lines.rs");
    let is_code =
        |line: &&str| !line.trim().is_empty() && !["//", "#!["].iter().any(|mark| line.trim().starts_with(mark));
    let lines = text.lines().filter(is_code).count();
    assert!(lines <= LINES, "{lines} lines of code");

    // Cargo builds the examples along with the tests.
    let built = Path::new(env!("CARGO_BIN_EXE_flexcal")).with_file_name("examples").join("thirty_lines");
    let output = Command::new(built).output();
    let printed = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let printed = printed.unwrap_or_default();
    assert!(printed.starts_with("joint 1 pulls at joint 2: 3.00 mrad; the tip is at "), "{printed}");
}

//! Example of thirty lines: its length, and that it finds the simulated effect.

use std::process::Command;

const LINES: usize = 30;

#[test]
fn thirty_lines_fit_predict_and_trace_an_effect_of_their_own() {
    let text = include_str!("../../examples/thirty_lines.rs");
    let is_code = |line: &&str| {
        !line.trim().is_empty() && !["//", "#!["].iter().any(|mark| line.trim().starts_with(mark))
    };
    let lines = text.lines().filter(is_code).count();
    assert!(lines <= LINES, "{lines} lines of code");

    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["run", "--quiet", "--example", "thirty_lines"];
    let output =
        Command::new(cargo).current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).output();
    let printed = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let printed = printed.unwrap_or_default();
    assert!(printed.starts_with("cam at joint2: sin(q1): 3.00 mrad; the tip is at "), "{printed}");
}

//! Agreement of `docs/findings.md` with the codes of findings.

use std::fmt::Write as _;

use flexcal::fit::{FindingCode, FindingEntry};

#[test]
fn the_documented_codes_are_those_of_the_checks() {
    let mut table = String::new();
    for code in FindingCode::EACH {
        let FindingEntry { code, severity, numbers, meaning, remedy } = code.entry();
        let numbers: Vec<String> = numbers.iter().map(|name| format!("`{name}`")).collect();
        let (severity, numbers) = (severity.as_str(), numbers.join(", "));
        writeln!(table, "| `{code}` | {severity} | {meaning} | {numbers} | {remedy} |").unwrap();
    }
    let page = include_str!("../../docs/findings.md");
    assert!(page.ends_with(&table), "docs/findings.md should end with:\n{table}");
}

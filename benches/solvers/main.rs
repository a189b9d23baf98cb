//! Comparison of all solvers on all classes of problems: which reach the optimum, and at what cost.
//!
//!     cargo bench --bench solvers               all problems; writes benches/RESULTS.md and
//! docs/solvers.svg
//!     cargo bench --bench solvers -- WORD ...   prints problems whose class or name contains a
//! WORD
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    missing_docs,
    reason = "a program that prints, and may panic"
)]

mod arms;
#[path = "../../tests/common/bounded.rs"]
#[expect(dead_code, reason = "only some of it is needed here")]
mod bounded;
mod case;
#[path = "../../tests/collections/mod.rs"]
mod collections;
#[path = "../common/mod.rs"]
mod common;
#[path = "../../tests/common/made.rs"]
#[expect(dead_code, reason = "only some of it is needed here")]
mod made;
mod method;
mod profile;
mod row;
mod smooth;
mod table;
mod watched;

use arms::Arms;
use row::Row;

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let is_selected = |class: &str, name: &str| {
        words.is_empty()
            || words
                .iter()
                .any(|word| format!("{class}/{name}").to_lowercase().contains(&word.to_lowercase()))
    };
    // Panics of solvers are caught and reported in their rows, so their messages are not printed.
    std::panic::set_hook(Box::new(|_| ()));
    let arms = Arms::new();
    let mut rows: Vec<Row> = Vec::new();
    common::pool(1).install(|| {
        let cases = arms.cases().into_iter().chain(case::collections());
        for case in cases.filter(|case| is_selected(case.class.name(), &case.name)) {
            rows.extend(report_progress(row::measure(&case)));
        }
        for arm in
            arms.lunar.iter().filter(|arm| is_selected(case::Class::Sequential.name(), &arm.name()))
        {
            rows.extend(report_progress(row::sequential(arm)));
        }
    });
    rows.sort_by_key(|row| row.class);
    if words.is_empty() {
        std::fs::write(common::file("benches/RESULTS.md"), table::page(&rows)).unwrap();
        std::fs::write(common::file("docs/solvers.svg"), profile::picture(&rows)).unwrap();
    } else {
        println!("{}", table::tables(&rows));
    }
}

/// Prints how many solvers solved a problem, as progress, and returns the rows.
fn report_progress(rows: Vec<Row>) -> Vec<Row> {
    if let Some(row) = rows.first() {
        let reached = rows.iter().filter(|row| row.reached.is_ok()).count();
        eprintln!(
            "{} / {}: {reached} of {} solvers reach the optimum",
            row.class.name(),
            row.problem,
            rows.len()
        );
    }
    rows
}

//! Every solver on every class of problem, side by side: which reach the optimum, at what price.
//!
//!     cargo bench --bench solvers               all of it, written to benches/RESULTS.md and docs/solvers.svg
//!     cargo bench --bench solvers -- WORD ...   classes and problems whose names hold one of the words; only printed
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
    let asked = |class: &str, name: &str| {
        words.is_empty()
            || words
                .iter()
                .any(|word| format!("{class}/{name}").to_lowercase().contains(&word.to_lowercase()))
    };
    // Solvers that fail by a panic are reported in their rows.
    std::panic::set_hook(Box::new(|_| ()));
    let arms = Arms::new();
    let mut rows: Vec<Row> = Vec::new();
    common::pool(1).install(|| {
        let cases = arms.cases().into_iter().chain(case::collections());
        for case in cases.filter(|case| asked(case.class.name(), &case.name)) {
            rows.extend(tell(row::measure(&case)));
        }
        for arm in
            arms.lunar.iter().filter(|arm| asked(case::Class::Sequential.name(), &arm.name()))
        {
            rows.extend(tell(row::sequential(arm)));
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

/// Says which problem is done.
fn tell(rows: Vec<Row>) -> Vec<Row> {
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

//! Times of whole identifications of the lunar sampler without limits, with bounds and with
//! constraints.
//!
//! The limits are near the free optimum: far from it the residual is large, and Gauss–Newton steps
//! take hundreds of iterations with bounds and constraints alike.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use divan::Bencher;
use flexcal::fit::{Options, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;

/// Priors of the problem file and what replaces them: the same priors with bounds.
const BOUNDS: [(&str, &str); 2] = [
    (
        "\"A.*\" = { sigma_relative = 0.5 }",
        "\"A.*\" = { sigma_relative = 0.5, max_relative = 1.02, min_relative = 0.98 }",
    ),
    (
        "\"joint*.d\" = { sigma_mm = 30.0 }",
        "\"joint*.d\" = { sigma_mm = 30.0, min_mm = -1, max_mm = 1 }",
    ),
];

/// Constraints appended to the problem file.
const CONSTRAINTS: &str = "
[[constraint]]
terms = { \"A.EI\" = 1.0, \"B.EI\" = -1.0 }
at_least = 1.0
[[constraint]]
terms = { \"joint3.a\" = 1, \"joint4.a\" = 1 }
at_most_m = 3.7395
";

/// Measurements of 28 and of 200 poses, in `tests/cases`.
const DATA: [&str; 2] = ["a-none.csv", "h-none-large.csv"];

fn main() {
    divan::main();
}

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases")
}

fn problem() -> String {
    fs::read_to_string(cases().join("problem.toml")).unwrap()
}

fn bench_identify(bencher: Bencher, text: &str, data: &str) {
    let problem = Problem::parse(text, &cases().join("problem.toml")).unwrap();
    let (measurements, _) = Measurements::read(&[cases().join(data)], &problem).unwrap();
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    bencher
        .bench_local(|| identify(divan::black_box(&problem), &data, &Options::default()).unwrap());
}

#[divan::bench(args = DATA)]
fn free(bencher: Bencher, data: &str) {
    bench_identify(bencher, &problem(), data);
}

#[divan::bench(args = DATA)]
fn bounds(bencher: Bencher, data: &str) {
    let text = BOUNDS.iter().fold(problem(), |text, (from, to)| {
        assert!(text.contains(from), "the problem has no {from:?}");
        text.replace(from, to)
    });
    bench_identify(bencher, &text, data);
}

#[divan::bench(args = DATA)]
fn constraints(bencher: Bencher, data: &str) {
    bench_identify(bencher, &format!("{}{CONSTRAINTS}", problem()), data);
}

//! The same fits for other programs: writes their data, times flexcal's own.
//!
//!     peers write <poses> <unknowns> <csv>       data of `benches/fit.rs`; unknowns: 25 identifiable, or all 33
//!     peers fit <poses> <unknowns> <repeats>     median time [ms] on one thread, final cost, steps tried
#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    missing_docs,
    reason = "a program for run.sh"
)]

#[path = "../common/mod.rs"]
mod common;

use std::fmt::Write as _;
use std::time::Instant;

use common::ur10::{NOISE, Ur10};
use flexcal::least_squares::Fit;
use flexcal::least_squares::solver::{Settings, minimise};
use nalgebra::DVector;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).filter(|word| *word != "--bench").collect();
    match arguments[..] {
        ["write", poses, unknowns, file] => {
            let ur10 = Ur10::new(poses.parse().unwrap());
            std::fs::write(file, csv(&ur10, chosen(&ur10, unknowns))).unwrap();
        }
        ["fit", poses, unknowns, repeats] => {
            let ur10 = Ur10::new(poses.parse().unwrap());
            time(&ur10, chosen(&ur10, unknowns), repeats.parse().unwrap());
        }
        _ => eprintln!("for run.sh: peers write <poses> <unknowns> <csv> | peers fit <poses> <unknowns> <repeats>"),
    }
}

fn chosen<'a>(ur10: &'a Ur10, unknowns: &str) -> &'a [usize] {
    let sets = [&ur10.identifiable, &ur10.geometric];
    sets.into_iter().find(|set| set.len().to_string() == unknowns).expect("25 or 33 unknowns")
}

/// σ; the nominal α, a, θ, d, β of each joint and the target; which of these are unknown; a pose a line.
fn csv(ur10: &Ur10, unknowns: &[usize]) -> String {
    let mut out = format!("{NOISE}\n");
    let nominal: Vec<String> = ur10.geometric.iter().map(|&k| ur10.model.parameters[k].nominal.to_string()).collect();
    let place = |k: &usize| ur10.geometric.iter().position(|g| g == k).unwrap().to_string();
    let unknown: Vec<String> = unknowns.iter().map(place).collect();
    writeln!(out, "{}\n{}", nominal.join(","), unknown.join(",")).unwrap();
    for (q, p) in ur10.configurations.iter().zip(&ur10.measured) {
        let row: Vec<String> = q.iter().chain(p.iter()).map(f64::to_string).collect();
        writeln!(out, "{}", row.join(",")).unwrap();
    }
    out
}

fn time(ur10: &Ur10, unknowns: &[usize], repeats: usize) {
    let residuals = ur10.residuals(unknowns);
    let objective = Fit::new(&residuals);
    let solve = || minimise(&objective, DVector::zeros(unknowns.len()), &Settings::default());
    let (mut times, solution) = common::pool(1).install(|| {
        let timed = |_| {
            let begin = Instant::now();
            std::hint::black_box(solve());
            begin.elapsed().as_secs_f64() * 1e3
        };
        ((0..repeats).map(timed).collect::<Vec<f64>>(), solve())
    });
    times.sort_by(f64::total_cmp);
    println!("{:.4} {:.9e} {}", times[times.len() / 2], solution.cost, solution.iterations);
}

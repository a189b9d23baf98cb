//! The same fits for other programs: writes their data, times flexcal's own.
//!
//!     peers write <poses> <unknowns> <csv>       data of `benches/fit.rs`; unknowns: 25 identifiable, or all 33
//!     peers fit <poses> <unknowns> <repeats>     median time [ms] on one thread, final cost, steps tried
//!     peers serve <name>                         a problem of `tests/cases/bounded`: limits and flexcal's optimum, then for each line x
//!                                                a line of residuals and derivatives
#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    missing_docs,
    reason = "a program for run.sh"
)]

#[path = "../../tests/common/bounded.rs"]
mod bounded;
#[path = "../common/mod.rs"]
mod common;

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

use bounded::Bounded;
use common::ur10::{NOISE, Ur10};
use flexcal::least_squares::solver::{Settings, minimise, minimise_constrained};
use flexcal::least_squares::{Fit, jacobian, residual_vector};
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
        ["serve", name] => serve(&Bounded::read(name)),
        _ => eprintln!(
            "peers write <poses> <unknowns> <csv> | peers fit <poses> <unknowns> <repeats> | peers serve <name>"
        ),
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

fn words<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    values.into_iter().map(f64::to_string).collect::<Vec<String>>().join(" ")
}

/// Lower and upper bounds; the number of constraints and for each its limits and coefficients; flexcal's steps, cost and optimum.
/// Then, for each line x, the whitened residuals with those of the priors, and the Jacobian row after row.
fn serve(own: &Bounded) {
    let residuals = own.residuals();
    let fit = own.fit(&residuals);
    let found = minimise_constrained(&fit, own.nominal(), &own.bounds, &own.rows, &Settings::default());
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n{}\n{}", words(own.bounds.lower()), words(own.bounds.upper()), own.rows.len()).unwrap();
    for i in 0..own.rows.len() {
        let (lower, upper) = (own.rows.lower()[i], own.rows.upper()[i]);
        writeln!(out, "{lower} {upper} {}", words(&own.rows.matrix().row(i).clone_owned())).unwrap();
    }
    writeln!(out, "{} {} {}", found.iterations, found.cost, words(&found.x)).unwrap();
    let priors = own.priors();
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let x = DVector::from_iterator(found.x.len(), line.split_whitespace().map(|word| word.parse().unwrap()));
        let (data, own) = (residual_vector(&residuals, &x), &priors.matrix * &x);
        // Column after column of the transpose: row after row.
        let slopes = (jacobian(&residuals, &x).transpose(), priors.matrix.transpose());
        let rows = data.iter().chain(own.iter()).chain(slopes.0.iter()).chain(slopes.1.iter());
        writeln!(out, "{}", words(rows)).unwrap();
    }
}

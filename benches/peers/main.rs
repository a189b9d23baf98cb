//! The fits of `benches/fit.rs` for other programs: writes their data, and times flexcal's fits.
//!
//!     peers write <poses> <unknowns> <kind> <csv>     writes data, for 25 or all 33 unknowns
//!     peers fit <poses> <unknowns> <kind> <repeats>   prints time [ms], cost and steps of a fit
//!     peers serve <name>                              evaluates a problem of `tests/cases/bounded`
//!
//! `kind` is `plain`, `box` (with bounds that exclude a few true values), `huber` or `l1` (with
//! gross errors and flexcal's losses). A time is the median on one thread. `serve` prints limits,
//! optimum and times, then for each line x of the standard input a line of residuals and
//! derivatives.
#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    missing_docs,
    reason = "a program for run.sh"
)]

#[path = "../../tests/common/bounded.rs"]
#[expect(dead_code, reason = "only some of it is needed here")]
mod bounded;
#[path = "../common/mod.rs"]
mod common;

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

use bounded::Bounded;
use common::ur10::{NOISE, Ur10};
use flexcal::least_squares::solver::{Settings, minimise, minimise_bounded, minimise_constrained};
use flexcal::least_squares::{Fit, Loss, Objective as _, jacobian, residual_vector};
use nalgebra::DVector;

/// Number of fits of which the median time is taken.
const REPEATS: usize = 15;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> =
        arguments.iter().map(String::as_str).filter(|word| *word != "--bench").collect();
    match arguments[..] {
        ["write", poses, unknowns, kind, file] => {
            let ur10 = arm(poses, kind);
            std::fs::write(file, csv(&ur10, chosen(&ur10, unknowns), kind)).unwrap();
        }
        ["fit", poses, unknowns, kind, repeats] => {
            let ur10 = arm(poses, kind);
            time(&ur10, chosen(&ur10, unknowns), kind, repeats.parse().unwrap());
        }
        ["serve", name] => serve(&Bounded::read(name)),
        _ => eprintln!(
            "peers write <poses> <unknowns> <kind> <csv> | peers fit <poses> <unknowns> <kind> <repeats> | peers serve <name>"
        ),
    }
}

fn arm(poses: &str, kind: &str) -> Ur10 {
    let ur10 = Ur10::new(poses.parse().unwrap());
    if loss(kind) == Loss::Squares { ur10 } else { ur10.with_gross_errors() }
}

fn loss(kind: &str) -> Loss {
    match kind {
        "huber" => Loss::Huber { threshold: Loss::HUBER_POSITION },
        "l1" => Loss::L1 { slope: Loss::L1_POSITION, smoothing: Loss::L1_SMOOTHING },
        _ => Loss::Squares,
    }
}

/// Returns the set of parameters with the number `unknowns`.
fn chosen<'a>(ur10: &'a Ur10, unknowns: &str) -> &'a [usize] {
    let sets = [&ur10.identifiable, &ur10.geometric];
    sets.into_iter().find(|set| set.len().to_string() == unknowns).expect("25 or 33 unknowns")
}

/// Returns the data as lines: σ; the nominal α, a, θ, d, β of each joint and the target; the
/// indices of the unknowns; their lower and upper bounds or an empty line; the loss; then a pose
/// per line.
fn csv(ur10: &Ur10, unknowns: &[usize], kind: &str) -> String {
    let mut out = format!("{NOISE}\n");
    let nominal: Vec<String> =
        ur10.geometric.iter().map(|&k| ur10.model.parameters[k].nominal.to_string()).collect();
    let index = |k: &usize| ur10.geometric.iter().position(|g| g == k).unwrap().to_string();
    let unknown: Vec<String> = unknowns.iter().map(index).collect();
    let bounds = ur10.bounds(unknowns);
    let bounds: Vec<String> =
        bounds.lower().iter().chain(bounds.upper()).map(f64::to_string).collect();
    let bounds = if kind == "box" { bounds.join(",") } else { String::new() };
    writeln!(out, "{}\n{}\n{bounds}", nominal.join(","), unknown.join(",")).unwrap();
    match loss(kind) {
        Loss::Huber { threshold } => writeln!(out, "huber,{threshold}").unwrap(),
        Loss::L1 { slope, smoothing } => writeln!(out, "l1,{slope},{smoothing}").unwrap(),
        _ => writeln!(out, "squares").unwrap(),
    }
    for (q, p) in ur10.configurations.iter().zip(&ur10.measured) {
        let row: Vec<String> = q.iter().chain(p.iter()).map(f64::to_string).collect();
        writeln!(out, "{}", row.join(",")).unwrap();
    }
    out
}

/// Prints the median time of a fit [ms], the final cost and the number of steps.
fn time(ur10: &Ur10, unknowns: &[usize], kind: &str, repeats: usize) {
    let residuals = ur10.residuals(unknowns);
    let objective = Fit::new(&residuals).with_loss(loss(kind));
    let (start, settings, bounds) =
        (DVector::zeros(unknowns.len()), Settings::default(), ur10.bounds(unknowns));
    let solve = || match kind {
        "box" => minimise_bounded(&objective, start.clone(), &bounds, &settings),
        _ => minimise(&objective, start.clone(), &settings),
    };
    let (seconds, solution) = common::pool(1).install(|| (median(repeats, solve), solve()));
    println!("{:.4} {:.9e} {}", seconds * 1e3, solution.cost, solution.iterations);
}

/// Returns the median time of a call [s].
fn median<T>(repeats: usize, call: impl Fn() -> T) -> f64 {
    let timed = |_| {
        let begin = Instant::now();
        std::hint::black_box(call());
        begin.elapsed().as_secs_f64()
    };
    let mut times: Vec<f64> = (0..repeats.max(1)).map(timed).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Joins numbers by spaces.
fn spaced<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    values.into_iter().map(f64::to_string).collect::<Vec<String>>().join(" ")
}

/// Prints the lower and upper bounds; the number of constraints and, for each, its limits and
/// coefficients; flexcal's steps, cost, time, time of one evaluation of residuals and Jacobian,
/// both on one thread [s], and optimum. Then prints, for each line x of the standard input, the
/// whitened residuals with those of the priors and the Jacobian by rows.
fn serve(bounded: &Bounded) {
    let residuals = bounded.residuals();
    let fit = bounded.fit(&residuals);
    let solve = || {
        minimise_constrained(
            &fit,
            bounded.nominal(),
            &bounded.bounds,
            &bounded.rows,
            &Settings::default(),
        )
    };
    let (solution, pool) = (solve(), common::pool(1));
    let (fitted, linearised) = pool
        .install(|| (median(REPEATS, solve), median(10 * REPEATS, || fit.linearise(&solution.x))));
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{}\n{}\n{}",
        spaced(bounded.bounds.lower()),
        spaced(bounded.bounds.upper()),
        bounded.rows.len()
    )
    .unwrap();
    for i in 0..bounded.rows.len() {
        let (lower, upper) = (bounded.rows.lower()[i], bounded.rows.upper()[i]);
        writeln!(out, "{lower} {upper} {}", spaced(&bounded.rows.matrix().row(i).clone_owned()))
            .unwrap();
    }
    let (steps, cost) = (solution.iterations, solution.cost);
    writeln!(out, "{steps} {cost} {fitted} {linearised} {}", spaced(&solution.x)).unwrap();
    let priors = bounded.priors();
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let x = DVector::from_iterator(
            solution.x.len(),
            line.split_whitespace().map(|word| word.parse().unwrap()),
        );
        let (data, slopes) =
            pool.install(|| (residual_vector(&residuals, &x), jacobian(&residuals, &x)));
        let prior_residuals = &priors.matrix * &x;
        // The columns of the transpose are the rows of the Jacobian.
        let slopes = (slopes.transpose(), priors.matrix.transpose());
        let rows =
            data.iter().chain(prior_residuals.iter()).chain(slopes.0.iter()).chain(slopes.1.iter());
        writeln!(out, "{}", spaced(rows)).unwrap();
    }
}

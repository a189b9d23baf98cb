//! Times of whole fits, from nominal parameters to the minimum.
#![allow(clippy::unwrap_used, clippy::wildcard_imports, missing_docs, reason = "a bench may panic")]

mod common;

use common::analytic::Analytic;
use common::lunar::Lunar;
use common::minpack::Minpack;
use common::ur10::Ur10;
use divan::Bencher;
use flexcal::least_squares::solver::{Settings, Solution, minimise};
use flexcal::least_squares::{Fit, LeastSquares, Objective};
use nalgebra::DVector;

fn main() {
    divan::main();
}

/// Minimises `objective` from the nominal parameters.
fn fit(objective: &impl Objective) -> Solution {
    let solution =
        minimise(objective, DVector::zeros(objective.parameters()), &Settings::default());
    assert!(solution.termination.converged(), "{}", solution.termination);
    solution
}

fn bench_fit<P: LeastSquares>(bencher: Bencher, threads: usize, problem: &P) {
    let pool = common::pool(threads);
    bencher.bench_local(|| pool.install(|| fit(&Fit::new(divan::black_box(problem)))));
}

/// UR10, rigid, with the 25 parameters that positions identify; the argument is the number of
/// poses.
#[divan::bench_group(name = "rigid", max_time = 4)]
mod rigid {
    use super::*;

    #[divan::bench(args = [28, 100, 1000, 10_000, 100_000, 1_000_000])]
    fn one_thread(bencher: Bencher, poses: usize) {
        let ur10 = Ur10::new(poses);
        bench_fit(bencher, 1, &ur10.residuals(&ur10.identifiable));
    }

    #[divan::bench(args = [28, 100, 1000, 10_000, 100_000, 1_000_000])]
    fn two_threads(bencher: Bencher, poses: usize) {
        let ur10 = Ur10::new(poses);
        bench_fit(bencher, 2, &ur10.residuals(&ur10.identifiable));
    }

    #[divan::bench(args = [100, 1000])]
    fn analytic_jacobian(bencher: Bencher, poses: usize) {
        let ur10 = Ur10::new(poses);
        let residuals = ur10.residuals(&ur10.identifiable);
        bench_fit(bencher, 1, &Analytic::new(&ur10.model, &residuals));
    }

    #[divan::bench(args = [28, 100, 1000])]
    fn minpack(bencher: Bencher, poses: usize) {
        let ur10 = Ur10::new(poses);
        let residuals = ur10.residuals(&ur10.identifiable);
        bencher.bench_local(|| Minpack::minimise(divan::black_box(&residuals)));
    }
}

/// Lunar sampler: elastic, with loads on the deflected arm, 32 parameters with priors, and 28
/// poses.
#[divan::bench]
fn elastic(bencher: Bencher) {
    let lunar = Lunar::new();
    let residuals = lunar.residuals();
    let objective = lunar.fit(&residuals);
    bencher.bench_local(|| fit(divan::black_box(&objective)));
}

//! Times of residuals and derivatives of a block of poses; an `item` is a pose.
#![allow(clippy::unwrap_used, clippy::wildcard_imports, missing_docs, reason = "a bench may panic")]

mod common;

use common::analytic::Analytic;
use common::lunar::Lunar;
use common::ur10::Ur10;
use divan::Bencher;
use divan::counter::ItemsCount;
use flexcal::least_squares::{Block, LeastSquares, check_jacobian};
use nalgebra::{DMatrix, DVector};

/// Number of poses of the rigid arm; a fit evaluates them in blocks of this size.
const POSES: usize = 256;

fn main() {
    let ur10 = Ur10::new(8);
    let residuals = ur10.residuals(&ur10.geometric);
    let x = Ur10::some_point(&residuals);
    let difference = common::difference(&Analytic::new(&ur10.model, &residuals), &residuals, &x);
    assert!(difference < 1e-9, "the hand-written Jacobian differs by {difference}");
    let all_residuals = ur10.residuals(&(0..ur10.model.parameters.len()).collect::<Vec<usize>>());
    check(&all_residuals, &Ur10::some_point(&all_residuals));
    let lunar = Lunar::new();
    check(&lunar.residuals(), &DVector::from_element(lunar.parameters(), 1e-3));
    divan::main();
}

/// Checks the derivatives of `problem` at `x` before they are timed.
fn check(problem: &impl LeastSquares, x: &DVector<f64>) {
    let check = check_jacobian(problem, x, &DVector::from_element(x.len(), 1e-2));
    let (column, worst) = check.worst().unwrap();
    assert!(
        worst.relative_error < 1e-7_f64.max(2.0 * worst.accuracy),
        "unknown {column}: {worst:?}"
    );
}

/// Times residuals and Jacobian of all poses of `problem`.
fn linearise(bencher: Bencher, problem: &impl LeastSquares, x: &DVector<f64>) {
    let poses = problem.items();
    let mut block = Block::zeros(problem.rows_per_item() * poses, problem.parameters());
    bencher.counter(ItemsCount::new(poses)).bench_local(|| {
        block.clear();
        problem.linearise(divan::black_box(x), 0..poses, &mut block);
    });
}

/// Times the residuals of all poses of `problem` without derivatives.
fn evaluate(bencher: Bencher, problem: &impl LeastSquares, x: &DVector<f64>) {
    let poses = problem.items();
    let mut out = vec![0.0; problem.rows_per_item() * poses];
    bencher.counter(ItemsCount::new(poses)).bench_local(|| {
        problem.residuals(divan::black_box(x), 0..poses, divan::black_box(&mut out));
    });
}

/// UR10, rigid, with 33 geometric parameters.
#[divan::bench_group(name = "rigid")]
mod rigid {
    use super::*;

    #[divan::bench]
    fn flexcal(bencher: Bencher) {
        let ur10 = Ur10::new(POSES);
        let residuals = ur10.residuals(&ur10.geometric);
        linearise(bencher, &residuals, &Ur10::some_point(&residuals));
    }

    #[divan::bench]
    fn analytic(bencher: Bencher) {
        let ur10 = Ur10::new(POSES);
        let residuals = ur10.residuals(&ur10.geometric);
        linearise(bencher, &Analytic::new(&ur10.model, &residuals), &Ur10::some_point(&residuals));
    }

    #[divan::bench]
    fn differences(bencher: Bencher) {
        let ur10 = Ur10::new(POSES);
        let residuals = ur10.residuals(&ur10.geometric);
        let x = Ur10::some_point(&residuals);
        let mut out = DMatrix::zeros(3 * POSES, x.len());
        bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
            common::central_differences(&residuals, divan::black_box(&x), &mut out);
        });
    }

    #[divan::bench]
    fn residual_only(bencher: Bencher) {
        let ur10 = Ur10::new(POSES);
        let residuals = ur10.residuals(&ur10.geometric);
        evaluate(bencher, &residuals, &Ur10::some_point(&residuals));
    }
}

/// Lunar sampler: elastic, with loads on the deflected arm and 32 parameters.
#[divan::bench_group(name = "elastic")]
mod elastic {
    use super::*;

    #[divan::bench]
    fn flexcal(bencher: Bencher) {
        let lunar = Lunar::new();
        linearise(bencher, &lunar.residuals(), &DVector::zeros(lunar.parameters()));
    }

    #[divan::bench]
    fn differences(bencher: Bencher) {
        let lunar = Lunar::new();
        let x = DVector::zeros(lunar.parameters());
        let mut out = DMatrix::zeros(3 * lunar.poses(), x.len());
        bencher.counter(ItemsCount::new(lunar.poses())).bench_local(|| {
            common::central_differences(&lunar.residuals(), divan::black_box(&x), &mut out);
        });
    }

    #[divan::bench]
    fn residual_only(bencher: Bencher) {
        let lunar = Lunar::new();
        evaluate(bencher, &lunar.residuals(), &DVector::zeros(lunar.parameters()));
    }
}

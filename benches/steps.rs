//! Times of the solver's frequent operations; the argument is the number of unknowns.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench may panic")]

use divan::{Bencher, black_box};
use flexcal::least_squares::solver::{Factor, Settings, minimise};
use flexcal::least_squares::{Block, Linearisation, Objective, Triangle};
use nalgebra::{DMatrix, DVector};

const UNKNOWNS: [usize; 3] = [6, 25, 57];

fn main() {
    divan::main();
}

/// Returns a number between −1 and 1 that varies irregularly with `i`, to fill matrices.
fn wave(i: usize) -> f64 {
    (1.7 * i as f64 + 0.3 * (i * i % 101) as f64).sin()
}

/// Returns a block of 768 rows, those of 256 positions, with `n` columns.
fn block(n: usize) -> Block {
    let mut block = Block::zeros(3 * 256, n);
    block.values_mut().iter_mut().enumerate().for_each(|(i, v)| *v = wave(i));
    block
}

fn triangle(n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(4 * n, n, |i, j| wave(i * n + j)).qr().r()
}

fn constant(n: usize) -> DVector<f64> {
    DVector::from_fn(n, |i, _| wave(i))
}

/// Absorption of a block by the running QR decomposition.
#[divan::bench(args = UNKNOWNS)]
fn absorb(bencher: Bencher, n: usize) {
    let (source, mut triangle) = (block(n), Triangle::new(n));
    bencher.with_inputs(|| source.clone()).bench_local_refs(|block| triangle.absorb(block));
}

/// Merging of two triangular factors.
#[divan::bench(args = UNKNOWNS)]
fn merge(bencher: Bencher, n: usize) {
    let mut triangle = Triangle::new(n);
    triangle.absorb(&mut block(n));
    let other = triangle.clone();
    bencher.bench_local(|| triangle.merge(black_box(&other)));
}

#[divan::bench(args = UNKNOWNS)]
fn gauss_newton_step(bencher: Bencher, n: usize) {
    let (matrix, constant) = (triangle(n), constant(n));
    bencher.bench_local(|| Factor::new(matrix.clone(), constant.clone(), 1e-12).gauss_newton());
}

/// Step limited to three tenths of the length of the Gauss–Newton step.
#[divan::bench(args = UNKNOWNS)]
fn limited_step(bencher: Bencher, n: usize) {
    let (matrix, constant) = (triangle(n), constant(n));
    let length = Factor::new(matrix.clone(), constant.clone(), 1e-12).gauss_newton().norm();
    bencher
        .bench_local(|| Factor::new(matrix.clone(), constant.clone(), 1e-12).limited(0.3 * length));
}

/// Objective ½‖R x + c‖² whose reported derivatives are 1.5 times the true ones, so that each step
/// covers the same part of the distance and many equal iterations are needed.
struct Steep {
    triangle: DMatrix<f64>,
    constant: DVector<f64>,
}

impl Steep {
    fn new(n: usize) -> Self {
        Self { triangle: triangle(n), constant: constant(n) }
    }
}

impl Objective for Steep {
    fn parameters(&self) -> usize {
        self.constant.len()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        0.5 * (&self.triangle * x + &self.constant).norm_squared()
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let projected = &self.triangle * x + &self.constant;
        Linearisation {
            cost: 0.5 * projected.norm_squared(),
            triangle: 1.5 * &self.triangle,
            projected,
        }
    }
}

/// All iterations to the minimum; an `item` is an iteration.
#[divan::bench(args = UNKNOWNS)]
fn iterations(bencher: Bencher, n: usize) {
    let (objective, start) = (Steep::new(n), DVector::from_element(n, 1.0));
    let iterations = minimise(&objective, start.clone(), &Settings::default()).iterations;
    let counter = divan::counter::ItemsCount::new(iterations);
    bencher
        .counter(counter)
        .bench_local(|| minimise(black_box(&objective), start.clone(), &Settings::default()));
}

/// Evaluations of one iteration: the cost and the linearisation.
#[divan::bench(args = UNKNOWNS)]
fn evaluations(bencher: Bencher, n: usize) {
    let (objective, x) = (Steep::new(n), DVector::from_element(n, 1.0));
    bencher.bench_local(|| (objective.cost(black_box(&x)), objective.linearise(&x)));
}

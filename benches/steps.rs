//! Rates of the solver's hot paths; the argument is the number of unknowns.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench may panic")]

use divan::{Bencher, black_box};
use flexcal::least_squares::solver::{Factor, Settings, minimise};
use flexcal::least_squares::{Block, Linearisation, Objective, Triangle};
use nalgebra::{DMatrix, DVector};

const UNKNOWNS: [usize; 3] = [6, 25, 57];

fn main() {
    divan::main();
}

fn wave(i: usize) -> f64 {
    (1.7 * i as f64 + 0.3 * (i * i % 101) as f64).sin()
}

/// A block of 768 rows: 256 positions.
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

/// A block is absorbed by the running QR decomposition.
#[divan::bench(args = UNKNOWNS)]
fn absorb(bencher: Bencher, n: usize) {
    let (source, mut triangle) = (block(n), Triangle::new(n));
    bencher.with_inputs(|| source.clone()).bench_local_refs(|block| triangle.absorb(block));
}

/// Two factors become one.
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

/// A step of three tenths of the Gauss–Newton step's length.
#[divan::bench(args = UNKNOWNS)]
fn limited_step(bencher: Bencher, n: usize) {
    let (matrix, constant) = (triangle(n), constant(n));
    let length = Factor::new(matrix.clone(), constant.clone(), 1e-12).gauss_newton().norm();
    bencher
        .bench_local(|| Factor::new(matrix.clone(), constant.clone(), 1e-12).limited(0.3 * length));
}

/// ½‖R x + c‖² with a slope that is a half too steep, so that many equal iterations are needed.
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

/// All iterations to the minimum.
#[divan::bench(args = UNKNOWNS)]
fn iterations(bencher: Bencher, n: usize) {
    let (objective, start) = (Steep::new(n), DVector::from_element(n, 1.0));
    let iterations = minimise(&objective, start.clone(), &Settings::default()).iterations;
    let counter = divan::counter::ItemsCount::new(iterations);
    bencher
        .counter(counter)
        .bench_local(|| minimise(black_box(&objective), start.clone(), &Settings::default()));
}

/// What an iteration takes for its evaluations.
#[divan::bench(args = UNKNOWNS)]
fn evaluations(bencher: Bencher, n: usize) {
    let (objective, x) = (Steep::new(n), DVector::from_element(n, 1.0));
    bencher.bench_local(|| (objective.cost(black_box(&x)), objective.linearise(&x)));
}

//! Rates of the hot paths; run with `cargo test --release --test solver speed -- --ignored --nocapture`.

use std::hint::black_box;
use std::time::{Duration, Instant};

use flexcal::least_squares::solver::{Factor, Settings, minimise};
use flexcal::least_squares::{Block, Linearisation, Objective, Triangle};
use nalgebra::{DMatrix, DVector};

fn wave(i: usize) -> f64 {
    (1.7 * i as f64 + 0.3 * (i * i % 101) as f64).sin()
}

/// The shortest of several runs.
fn best(mut run: impl FnMut() -> Duration) -> f64 {
    (0..15).map(|_| run().as_secs_f64()).fold(f64::INFINITY, f64::min)
}

fn timed<T>(work: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    black_box(work());
    start.elapsed()
}

#[test]
#[ignore = "a measurement"]
fn speed_of_the_running_decomposition() {
    for n in [6, 25, 57] {
        let rows = 3 * 256;
        let mut source = Block::zeros(rows, n);
        source.values_mut().iter_mut().enumerate().for_each(|(i, v)| *v = wave(i));
        let mut triangle = Triangle::new(n);
        let mut blocks: Vec<Block> = Vec::new();
        let absorb = best(|| {
            blocks.clear();
            blocks.resize(20, source.clone());
            timed(|| blocks.iter_mut().for_each(|block| triangle.absorb(block)))
        }) / 20.0;
        let other = triangle.clone();
        let merge = best(|| timed(|| triangle.merge(&other)));
        let work = rows as f64 * (n * n) as f64;
        println!(
            "n = {n}: block of {rows} rows {:.1} µs = {:.3} ns per row·n² = {:.2} Gflop/s; merge {:.1} µs",
            1e6 * absorb,
            1e9 * absorb / work,
            2.0 * work / absorb / 1e9,
            1e6 * merge
        );
    }
}

#[test]
#[ignore = "a measurement"]
fn speed_of_one_step() {
    for n in [6, 25, 57] {
        let matrix = DMatrix::from_fn(4 * n, n, |i, j| wave(i * n + j)).qr().r();
        let constant = DVector::from_fn(n, |i, _| wave(i));
        let new = || Factor::new(matrix.clone(), constant.clone(), 1e-12);
        let direct = best(|| timed(|| new().gauss_newton()));
        let length = new().gauss_newton().norm();
        let limited = best(|| timed(|| new().limited(0.3 * length)));
        println!("n = {n}: Gauss–Newton step {:.1} µs, limited step {:.1} µs", 1e6 * direct, 1e6 * limited);
    }
}

/// ½‖R x + c‖² with a slope that is a third too steep, so that many equal iterations are needed.
struct Steep {
    triangle: DMatrix<f64>,
    constant: DVector<f64>,
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
        Linearisation { cost: 0.5 * projected.norm_squared(), triangle: 1.5 * &self.triangle, projected }
    }
}

#[test]
#[ignore = "a measurement"]
fn speed_of_one_iteration() {
    for n in [6, 25, 57] {
        let triangle = DMatrix::from_fn(4 * n, n, |i, j| wave(i * n + j)).qr().r();
        let objective = Steep { triangle, constant: DVector::from_fn(n, |i, _| wave(i)) };
        let start = DVector::from_element(n, 1.0);
        let settings = Settings::default();
        let iterations = minimise(&objective, start.clone(), &settings).iterations as f64;
        let all = best(|| timed(|| minimise(&objective, start.clone(), &settings)));
        let evaluations = best(|| timed(|| (objective.cost(black_box(&start)), objective.linearise(&start))));
        let own = all / iterations - evaluations;
        println!("n = {n}: {iterations} iterations, {:.1} µs each beyond the evaluations", 1e6 * own);
    }
}

//! Problems shared by the benches.
#![allow(dead_code, clippy::unwrap_used, reason = "each bench uses its part; a bench may panic")]

pub mod analytic;
pub mod lunar;
pub mod minpack;
pub mod ur10;

use std::path::{Path, PathBuf};

use flexcal::least_squares::{LeastSquares, jacobian, residual_vector};
use nalgebra::{DMatrix, DVector};

/// Returns the path of a file of the repository.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Returns a thread pool of `threads` threads.
pub fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// Writes the m × n Jacobian ∂r/∂x by central differences into `out`.
pub fn central_differences(problem: &impl LeastSquares, x: &DVector<f64>, out: &mut DMatrix<f64>) {
    /// Step of each unknown, near the cube root of the machine precision [unit of the unknown].
    const STEP: f64 = 1e-6;
    for j in 0..x.len() {
        let at = |value: f64| {
            let mut moved = x.clone();
            moved[j] = value;
            residual_vector(problem, &moved)
        };
        out.set_column(j, &((at(x[j] + STEP) - at(x[j] - STEP)) / (2.0 * STEP)));
    }
}

/// Returns the largest difference between the Jacobians of two problems, relative to the largest
/// entry.
pub fn difference(one: &impl LeastSquares, other: &impl LeastSquares, x: &DVector<f64>) -> f64 {
    let (one, other) = (jacobian(one, x), jacobian(other, x));
    (&one - &other).amax() / other.amax()
}

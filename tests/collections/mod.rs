//! Collections of least-squares problems with known minima, shared by tests and benchmarks:
//! residual functions generic over the scalar, as problems with exact derivatives.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test takes what it needs; stored data can be read"
)]

pub mod functions;
pub mod more_garbow_hillstrom;
pub mod nist;

use std::ops::Range;

use flexcal::least_squares::{Block, LeastSquares};
use nalgebra::DVector;
use num_dual::Dual64;

/// Residual function of a few unknowns, evaluated as one item.
pub struct Analytic {
    pub unknowns: usize,
    pub rows: usize,
    pub value: fn(&[f64]) -> Vec<f64>,
    pub dual: fn(&[Dual64]) -> Vec<Dual64>,
}

impl LeastSquares for Analytic {
    fn parameters(&self) -> usize {
        self.unknowns
    }

    fn items(&self) -> usize {
        1
    }

    fn rows_per_item(&self) -> usize {
        self.rows
    }

    fn residuals(&self, x: &DVector<f64>, _items: Range<usize>, out: &mut [f64]) {
        out.copy_from_slice(&(self.value)(x.as_slice()));
    }

    fn linearise(&self, x: &DVector<f64>, _items: Range<usize>, block: &mut Block) {
        let n = x.len();
        block.column_mut(n).copy_from_slice(&(self.value)(x.as_slice()));
        let mut dual: Vec<Dual64> = x.iter().map(|&x| Dual64::from(x)).collect();
        for j in 0..n {
            dual[j] = dual[j].derivative();
            for (out, row) in block.column_mut(j).iter_mut().zip((self.dual)(&dual)) {
                *out = row.eps;
            }
            dual[j] = Dual64::from(x[j]);
        }
    }
}

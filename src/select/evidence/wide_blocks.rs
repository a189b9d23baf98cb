//! Likelihoods of blocks with many columns beside sets with few. The Gram matrix of such a block is
//! factored once for each trial size, and each set changes the factors by few columns.

use std::sync::Arc;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::cache::Cache;
use crate::numeric::{inverse_lower, lower_factor, lower_product};

/// Smallest number of columns of a block whose factors are cached.
const MIN_WIDE: usize = 64;
/// Smallest number of columns of a block for each column of the set beside it.
const MIN_RATIO: usize = 3;

/// Returns true if a block of `columns` columns beside a set with `others` columns takes less work
/// with cached factors.
pub(super) fn is_wide(columns: usize, others: usize) -> bool {
    columns >= MIN_WIDE && columns >= MIN_RATIO * others
}

/// Inverse L⁻¹ of the Cholesky factor of 1/c² + G for one size c, and ½ ln det(1 + c² G).
struct Factor {
    inverse: DMatrix<f64>,
    determinant: f64,
}

/// Cached factors of a block, by the bit pattern of the size.
#[derive(Clone, Default)]
pub(super) struct Factors(Arc<Cache<u64, Arc<Factor>>>);

impl Factors {
    /// Returns the terms of `Normal::shrinkage_terms` at the size c for the Gram matrix G − YᵀY and
    /// the product b, given G = `gram` and Y = `along`; `None` if a factor does not exist.
    ///
    /// With T = L⁻¹Yᵀ and 1 − TᵀT = M Mᵀ: det(1/c² + G − YᵀY) = det(L)² det(M)², and
    /// bᵀ(1/c² + G − YᵀY)⁻¹b = |L⁻¹b|² + |M⁻¹TᵀL⁻¹b|².
    pub fn shrinkage_terms(
        &self,
        gram: &DMatrix<f64>,
        (along, product): (DMatrixView<f64>, &DVector<f64>),
        size: f64,
    ) -> Option<(f64, f64)> {
        let factor = self.0.get_or_compute(&size.to_bits(), || {
            let mut inner = gram.clone();
            for k in 0..inner.nrows() {
                inner[(k, k)] += (size * size).recip();
            }
            let lower = lower_factor(inner)?;
            let determinant = lower.diagonal().iter().map(|entry| (size * entry).ln()).sum();
            Some(Arc::new(Factor { inverse: inverse_lower(&lower), determinant }))
        })?;
        let whitened = &factor.inverse * product;
        if along.nrows() == 0 {
            return Some((factor.determinant, whitened.norm_squared()));
        }
        let within = lower_product(&factor.inverse, &along.transpose());
        let few = within.ncols();
        let rest = DMatrix::identity(few, few) - within.transpose() * &within;
        let lower = lower_factor(rest)?;
        let mut correction = within.tr_mul(&whitened);
        if !lower.solve_lower_triangular_mut(&mut correction) {
            return None;
        }
        let ln_rest: f64 = lower.diagonal().iter().map(|entry| entry.ln()).sum();
        let explained = whitened.norm_squared() + correction.norm_squared();
        Some((factor.determinant + ln_rest, explained))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_a_block_hold_beside_every_set() {
        let matrix = |rows: usize, columns: usize| {
            DMatrix::from_fn(rows, columns, |i, j| {
                ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0
            })
        };
        let (columns, few) = (matrix(200, 70), matrix(200, 75).columns(70, 5).into_owned());
        let q = few.qr().q();
        let product = columns.tr_mul(&matrix(200, 76).column(75));
        let factors = Factors::default();
        let gram = columns.tr_mul(&columns);
        for size in [0.3, 10.0, 100.0] {
            for along in [DMatrix::zeros(0, 70), q.tr_mul(&columns) * 0.999] {
                let inner = (&gram - along.tr_mul(&along)) * (size * size)
                    + DMatrix::<f64>::identity(70, 70);
                let lower = inner.cholesky().unwrap();
                let explained = product.dot(&lower.solve(&product)) * size * size;
                let determinant: f64 = lower.l().diagonal().iter().map(|d| d.ln()).sum();
                let set = (along.as_view(), &product);
                let (one, other) = factors.shrinkage_terms(&gram, set, size).unwrap();
                assert!((one - determinant).abs() < 1e-9 * determinant);
                assert!((other - explained).abs() < 1e-9 * explained);
            }
        }
    }
}

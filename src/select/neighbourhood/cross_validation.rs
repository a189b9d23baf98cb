//! Prediction of each block of poses from the others, by the fit of a linearised model.

use nalgebra::{DMatrix, DVector};

use super::linear::LinearNeighbourhood;
use crate::numeric::parallel;
use crate::numeric::{gram, inverse_factor};

/// Smallest fraction of a direction's squared length outside a block of poses at which the other
/// poses determine the direction.
const MIN_DETERMINED_ELSEWHERE: f64 = 1e-6;

impl LinearNeighbourhood {
    /// Returns the sum of squared whitened residuals of poses that are left out, block by block,
    /// predicted by the fit without them; `None` if it is not finite.
    ///
    /// `block` holds the block of each pose. A left-out residual is (I − H_bb)⁻¹ r_b, by Woodbury's
    /// identity r_b + Q_b (I − Q_bᵀQ_b)⁻¹ Q_bᵀ r_b. Along a direction that the block alone
    /// determines, the fitted value is kept.
    pub fn cross_validate(&self, block: &[usize]) -> Option<f64> {
        self.left_out(block).map(|blocks| blocks.iter().map(|block| block.squares).sum())
    }

    /// Returns how the rest of the poses predicts each block, as in
    /// [`cross_validate`](Self::cross_validate); `None` if a number is not finite.
    pub fn left_out(&self, block: &[usize]) -> Option<Vec<LeftOutBlock>> {
        let blocks = block.iter().max().map_or(0, |last| last + 1);
        let n = self.basis.ncols();
        let left_out = |number: usize| {
            let rows: Vec<usize> = (0..self.rows).filter(|row| block[row / 3] == number).collect();
            let (basis, residual) =
                (self.basis.select_rows(&rows), self.residual.select_rows(&rows));
            let inner = DMatrix::identity(n, n) - gram(&basis);
            let (step, ln_determinant) = solve_projected(inner, &basis.tr_mul(&residual));
            let predicted = &residual + basis * step;
            LeftOutBlock {
                squares: predicted.norm_squared(),
                weighted_squares: residual.dot(&predicted),
                ln_determinant,
            }
        };
        let blocks = parallel::map(blocks, left_out);
        blocks.iter().all(LeftOutBlock::is_finite).then_some(blocks)
    }
}

/// Residuals r of a block of poses that is left out, as the other poses predict it.
///
/// Their covariance is V = (I − H_bb)⁻¹ in units of the noise: that of the noise and of the
/// prediction.
#[derive(Debug, Clone, Copy)]
pub(in crate::select) struct LeftOutBlock {
    /// Sum of squares rᵀr of the whitened residuals r of the block, predicted by the other poses.
    pub squares: f64,
    /// Sum of squares rᵀV⁻¹r of the block, with the covariance V of noise and prediction.
    pub weighted_squares: f64,
    /// ln det V⁻¹ of the covariance V of the residuals of the block, noise and prediction together.
    pub ln_determinant: f64,
}

impl LeftOutBlock {
    fn is_finite(&self) -> bool {
        [self.squares, self.weighted_squares, self.ln_determinant].iter().all(|x| x.is_finite())
    }
}

/// Solves M x = `right` for a symmetric M with eigenvalues from 0 to 1, and returns ln det M too.
/// Components along eigenvalues near 0 are zero and add nothing to the determinant.
fn solve_projected(matrix: DMatrix<f64>, right: &DVector<f64>) -> (DVector<f64>, f64) {
    if let Some(root) = inverse_factor(&matrix)
        && root.diagonal().iter().all(|value| (value * value).recip() > MIN_DETERMINED_ELSEWHERE)
    {
        let ln_determinant = -2.0 * root.diagonal().map(f64::ln).sum();
        return (root.tr_mul(&(&root * right)), ln_determinant);
    }
    let eigen = matrix.symmetric_eigen();
    let is_kept = |value: &&f64| **value > MIN_DETERMINED_ELSEWHERE;
    let ln_determinant = eigen.eigenvalues.iter().filter(is_kept).map(|value| value.ln()).sum();
    let inverted =
        eigen.eigenvalues.map(|value| if is_kept(&&value) { value.recip() } else { 0.0 });
    let solved = &eigen.eigenvectors * eigen.eigenvectors.tr_mul(right).component_mul(&inverted);
    (solved, ln_determinant)
}

#[cfg(test)]
mod tests {
    use super::super::linear::Unknowns;
    use super::*;

    #[test]
    fn a_block_is_predicted_with_the_covariance_of_its_prediction() {
        const SIGMA: f64 = 0.7;
        let columns = DMatrix::from_fn(12, 3, |i, j| (1.7 * i as f64 + 2.3 * j as f64).sin());
        let residual = DVector::from_fn(12, |i, _| (0.9 * i as f64).cos());
        let unknowns = Unknowns {
            x: vec![0.0; 3],
            priors: vec![Some(SIGMA); 3],
            active: DMatrix::zeros(0, 3),
        };
        let fit = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let blocks = fit.left_out(&[0, 1, 1, 2]).unwrap();
        // Data have the covariance C = I + J σ² Jᵀ; a block given the rest is normal, with the
        // inverse covariance and the mean that C⁻¹ contains.
        let covariance =
            DMatrix::identity(12, 12) + &columns * columns.transpose() * (SIGMA * SIGMA);
        let inverse = covariance.try_inverse().unwrap();
        let pull = &inverse * &residual;
        for (block, rows) in blocks.iter().zip([0..3, 3..9, 9..12]) {
            let (first, count) = (rows.start, rows.len());
            let of_block = inverse.view((first, first), (count, count)).into_owned();
            let error = of_block.clone().try_inverse().unwrap() * pull.rows(first, count);
            assert!((block.squares - error.norm_squared()).abs() < 1e-10);
            let expected = error.dot(&(&of_block * &error));
            assert!((block.weighted_squares - expected).abs() < 1e-10);
            assert!((block.ln_determinant - of_block.determinant().ln()).abs() < 1e-10);
        }
    }
}

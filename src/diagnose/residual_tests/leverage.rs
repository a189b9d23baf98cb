//! How much of each pose the fit takes away.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::LEAST_FREEDOM;
use super::outcome::Untestable;

/// Directions of a pose that keep less than this part of their variance say nothing.
const LEAST_LEFT: f64 = 1e-4;
/// Directions that priors decide by less than this part count as decided by the data.
const LEAST_PRIOR: f64 = 1e-6;

/// The projection I − H with H = Q Qᵀ, and the studentising of each pose.
#[derive(Debug, Clone)]
pub(super) struct Leverage {
    /// Q, shape = (3 N, p).
    pub fitted: DMatrix<f64>,
    /// Qᵀ.
    pub transposed: DMatrix<f64>,
    /// A root of I − QᵀQ, shape = (p, k): what priors add to the residuals, k directions.
    pub prior: DMatrix<f64>,
    /// Degrees of freedom ν = tr(I − H).
    pub freedom: f64,
    /// tr (I − H)², ν without priors.
    pub squared_freedom: f64,
    /// (I − H)ᵦᵦ^(−½) of each pose b.
    pub whiteners: Vec<Matrix3<f64>>,
}

impl Leverage {
    /// Of Q, shape = (3 N, p).
    ///
    /// # Errors
    /// The fit leaves too few degrees of freedom.
    pub fn of(fitted: &DMatrix<f64>) -> Result<Self, Untestable> {
        let p = fitted.ncols();
        let transposed = fitted.transpose();
        let gram = &transposed * fitted;
        let freedom = fitted.nrows() as f64 - gram.trace();
        if freedom < LEAST_FREEDOM {
            return Err(Untestable::NoFreedom);
        }
        let squared_freedom = freedom - gram.trace() + gram.norm_squared();
        let prior = prior_root(DMatrix::identity(p, p) - gram);
        let whiteners = (0..fitted.nrows() / 3).map(|pose| {
            let rows = transposed.columns(3 * pose, 3);
            let taken = Matrix3::from_fn(|i, j| rows.column(i).dot(&rows.column(j)));
            inverse_root(Matrix3::identity() - taken)
        });
        Ok(Self { fitted: fitted.clone(), prior, freedom, squared_freedom, whiteners: whiteners.collect(), transposed })
    }

    /// (I − H)ᵦᵦ^(−½) rᵦ of each pose b: residuals with unit covariance, if the noise has it [Cook and Weisberg 1982].
    ///
    /// Directions of a pose that the fit always meets become zero.
    pub fn studentise(&self, residual: &[f64]) -> Vec<Vector3<f64>> {
        let poses = residual.chunks_exact(3).zip(&self.whiteners);
        poses.map(|(residual, whitener)| whitener * Vector3::from_column_slice(residual)).collect()
    }
}

/// A root of I − QᵀQ, a column for each direction that priors help to decide.
fn prior_root(left: DMatrix<f64>) -> DMatrix<f64> {
    let p = left.nrows();
    if p == 0 {
        return left;
    }
    let eigen = left.symmetric_eigen();
    let by_priors: Vec<usize> = (0..p).filter(|&k| eigen.eigenvalues[k] > LEAST_PRIOR).collect();
    let entry = |i: usize, k: usize| eigen.eigenvectors[(i, by_priors[k])] * eigen.eigenvalues[by_priors[k]].sqrt();
    DMatrix::from_fn(p, by_priors.len(), entry)
}

/// A^(−½) of a symmetric matrix, zero along directions in which A vanishes.
fn inverse_root(matrix: Matrix3<f64>) -> Matrix3<f64> {
    let eigen = matrix.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| if value > LEAST_LEFT { value.sqrt().recip() } else { 0.0 });
    eigen.eigenvectors * Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose()
}

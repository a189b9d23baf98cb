//! What a fit would leave without some of its poses.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::Remainder;
use super::leverage::Leverage;

/// Poses are not left out where they alone decide a direction: less than this part of it is left to the others.
const LEAST_DECIDED: f64 = 1e-6;

/// The poses that are kept, and what a (linear) fit to them alone leaves.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    /// Their numbers, ascending.
    pub poses: Vec<usize>,
    /// Their residuals, shape = (3 per pose).
    pub residual: DVector<f64>,
    /// Their leverage.
    pub leverage: Leverage,
}

impl Kept {
    /// All poses.
    pub fn all(remainder: &Remainder, leverage: Leverage) -> Self {
        let residual = remainder.residual.clone();
        Self { poses: (0..residual.len() / 3).collect(), residual, leverage }
    }

    /// All but those `out`; `None` where the others do not decide the fit.
    ///
    /// With Q_A and Q_B the rows of the kept and the others, and M = I − Q_BᵀQ_B = L Lᵀ, it leaves r_A + Q_A M⁻¹ Q_Bᵀ r_B, and
    /// Q_A L⁻ᵀ takes the place of Q [Cook and Weisberg 1982, section 3.6].
    pub fn without(remainder: &Remainder, out: &[bool]) -> Option<Self> {
        let p = remainder.fitted.ncols();
        let (gone, poses): (Vec<usize>, Vec<usize>) = (0..out.len()).partition(|&pose| out[pose]);
        let rows_of = |poses: &[usize]| -> Vec<usize> { poses.iter().flat_map(|&b| 3 * b..3 * b + 3).collect() };
        let (gone, kept) = (rows_of(&gone), rows_of(&poses));
        let fitted_gone = remainder.fitted.select_rows(&gone);
        let fitted = remainder.fitted.select_rows(&kept);
        let decided = Cholesky::new(DMatrix::identity(p, p) - fitted_gone.tr_mul(&fitted_gone))?;
        if decided.l_dirty().diagonal().iter().any(|&pivot| pivot * pivot < LEAST_DECIDED) {
            return None;
        }
        let pull = decided.solve(&fitted_gone.tr_mul(&remainder.residual.select_rows(&gone)));
        let residual = remainder.residual.select_rows(&kept) + &fitted * pull;
        let fitted = decided.l().solve_lower_triangular(&fitted.transpose())?.transpose();
        Some(Self { poses, residual, leverage: Leverage::of(&fitted).ok()? })
    }
}

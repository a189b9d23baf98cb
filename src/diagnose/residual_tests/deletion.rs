//! What a fit would leave without some of its poses.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

use super::FitResidual;
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
    pub fn all(fit: &FitResidual, leverage: Leverage) -> Self {
        let residual = fit.residual.clone();
        Self { poses: (0..residual.len() / 3).collect(), residual, leverage }
    }

    /// All but those `out`; `None` where the others do not decide the fit.
    ///
    /// With Q_A and Q_B the rows of the kept and the others, and M = I − Q_BᵀQ_B = L Lᵀ, it leaves r_A + Q_A M⁻¹ Q_Bᵀ r_B, and
    /// Q_A L⁻ᵀ takes the place of Q [Cook and Weisberg 1982, section 3.6].
    pub fn without(fit: &FitResidual, out: &[bool]) -> Option<Self> {
        let p = fit.fitted.ncols();
        let (gone, poses): (Vec<usize>, Vec<usize>) = (0..out.len()).partition(|&pose| out[pose]);
        let rows_of = |poses: &[usize]| -> Vec<usize> { poses.iter().flat_map(|&b| 3 * b..3 * b + 3).collect() };
        let (gone, kept) = (rows_of(&gone), rows_of(&poses));
        let fitted_gone = fit.fitted.select_rows(&gone);
        let fitted = fit.fitted.select_rows(&kept);
        let decided = Cholesky::new(DMatrix::identity(p, p) - fitted_gone.tr_mul(&fitted_gone))?;
        if decided.l_dirty().diagonal().iter().any(|&pivot| pivot * pivot < LEAST_DECIDED) {
            return None;
        }
        let pull = decided.solve(&fitted_gone.tr_mul(&fit.residual.select_rows(&gone)));
        let residual = fit.residual.select_rows(&kept) + &fitted * pull;
        let fitted = decided.l().solve_lower_triangular(&fitted.transpose())?.transpose();
        Some(Self { poses, residual, leverage: Leverage::of(&fitted).ok()? })
    }
}

/// What a fit without one pose leaves at the others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Others {
    /// ‖r‖² of the others.
    pub squares: f64,
    /// Its degrees of freedom.
    pub freedom: f64,
}

/// Leaves out each pose in turn.
///
/// The rows of pose b are Q_b; with D = (I − H_bb)⁻¹, a = D r_b and W = Q_b QᵀQ Q_bᵀ, as in [`Kept::without`],
///
/// ‖r‖² becomes ‖r‖² − |r_b|² + 2 a·(Q_b Qᵀr − H_bb r_b) + a·(W − H_bb²) a,  tr H becomes tr H − tr H_bb + tr D (W − H_bb²)
pub(super) fn each_left_out(leverage: &Leverage, residual: &DVector<f64>) -> Vec<Others> {
    let fitted = &leverage.fitted;
    let gram_rows = &leverage.transposed * fitted * &leverage.transposed;
    let again = fitted * (&leverage.transposed * residual);
    let total = residual.norm_squared();
    let poses = residual.as_slice().chunks_exact(3).zip(again.as_slice().chunks_exact(3)).zip(&leverage.whiteners);
    let others = poses.enumerate().map(|(pose, ((own, again), whitener))| {
        let (own, again) = (Vector3::from_column_slice(own), Vector3::from_column_slice(again));
        let rows = leverage.transposed.columns(3 * pose, 3);
        let products = |of: &DMatrix<f64>| Matrix3::from_fn(|i, j| rows.column(i).dot(&of.column(3 * pose + j)));
        let taken = products(&leverage.transposed);
        let more = products(&gram_rows) - taken * taken;
        let inverse = whitener * whitener;
        let pull = inverse * own;
        let change = 2.0 * pull.dot(&(again - taken * own)) + pull.dot(&(more * pull));
        Others {
            squares: total - own.norm_squared() + change,
            freedom: leverage.freedom - 3.0 + taken.trace() - (inverse * more).trace(),
        }
    });
    others.collect()
}

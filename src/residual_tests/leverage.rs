//! Leverage of each pose, and the fit without some poses.

use std::borrow::Cow;

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

use super::fit_residual::FitResidual;
use super::outcome::Untestable;
use crate::numeric::parallel;
use crate::numeric::{gram, lower_factor, multiply_by_upper};

/// Minimum number of residual degrees of freedom for any test.
const MIN_DEGREES_OF_FREEDOM: f64 = 4.0;
/// Smallest fraction of the squared length of a fitted direction that must lie in the kept poses.
/// With less, these poses do not determine the direction.
const MIN_KEPT_SHARE: f64 = 1e-6;
/// Smallest fraction of the noise variance that a residual must keep along a direction of a pose
/// for studentisation. With less, the pose alone determines that direction.
const MIN_RESIDUAL_SHARE: f64 = 1e-4;
/// Smallest eigenvalue of I − QᵀQ that is not neglected: the part of a fitted direction that priors
/// determine instead of data.
const MIN_PRIOR_SHARE: f64 = 1e-6;
/// Value added to the diagonal of I − QᵀQ so that a Cholesky factor exists in spite of rounding.
const CHOLESKY_JITTER: f64 = 1e-10;
/// Number of poses whose rows of Q are transposed together, chosen for the processor cache.
const POSES_PER_BLOCK: usize = 32;
/// Number of fitted directions p from which I − QᵀQ is factored by Cholesky, because eigenvectors
/// take more time.
const MAX_EIGENVECTOR_DIRECTIONS: usize = 100;

/// Projection I − H with H = Q Qᵀ, and the matrices that studentise each pose.
#[derive(Debug, Clone)]
pub(super) struct Leverage<'a> {
    /// Matrix Q, shape = (3 N, p), with H = Q Qᵀ.
    pub fitted: Cow<'a, DMatrix<f64>>,
    /// Gram matrix QᵀQ, shape = (p, p).
    gram: DMatrix<f64>,
    /// Degrees of freedom ν = tr(I − H).
    pub freedom: f64,
    /// Trace tr (I − H)²; equal to ν if there are no priors.
    pub squared_freedom: f64,
    /// Matrix (I − H)_bb^(−½) of each pose b, shape = (3, 3).
    pub whiteners: Vec<Matrix3<f64>>,
    /// Number of measured coordinates of each pose.
    pub coordinates: Vec<usize>,
}

impl<'a> Leverage<'a> {
    /// Creates the leverage from Q, shape = (3 N, p), and the number of measured coordinates of
    /// each pose; unmeasured rows of Q are 0.
    ///
    /// # Errors
    /// Returns an error if the fit leaves too few degrees of freedom.
    pub fn new(fitted: Cow<'a, DMatrix<f64>>, coordinates: Vec<usize>) -> Result<Self, Untestable> {
        let gram = gram(&fitted);
        let freedom = coordinates.iter().sum::<usize>() as f64 - gram.trace();
        if freedom < MIN_DEGREES_OF_FREEDOM {
            return Err(Untestable::NoFreedom);
        }
        let squared_freedom = freedom - gram.trace() + gram.norm_squared();
        let whiteners = by_poses(&fitted, |_, rows| {
            let whitener = |pose| inverse_root(Matrix3::identity() - products(rows, rows, pose));
            (0..rows.ncols() / 3).map(whitener).collect()
        });
        Ok(Self { fitted, gram, freedom, squared_freedom, whiteners, coordinates })
    }

    /// Returns a matrix R with R Rᵀ = I − QᵀQ, shape = (p, k). k is the number of directions that
    /// priors help to determine, or p.
    pub fn prior_root(&self) -> DMatrix<f64> {
        let p = self.gram.nrows();
        let mut prior_part = DMatrix::identity(p, p) - &self.gram;
        if p < MAX_EIGENVECTOR_DIRECTIONS || prior_part.trace() <= MIN_PRIOR_SHARE {
            return root_of_priors(prior_part);
        }
        // Every root of the matrix is valid. This one has a column for every direction; columns of
        // directions that data alone determine are almost zero.
        (0..p).for_each(|k| prior_part[(k, k)] += CHOLESKY_JITTER);
        lower_factor(prior_part.clone()).unwrap_or_else(|| root_of_priors(prior_part))
    }

    /// Returns (I − H)_bb^(−½) r_b of each pose b: residuals with unit covariance if the noise has
    /// unit covariance [Cook and Weisberg 1982].
    ///
    /// Components along directions that a pose alone determines are set to zero.
    pub fn studentise(&self, residual: &[f64]) -> Vec<Vector3<f64>> {
        let mut poses = residual.as_chunks().0.to_vec();
        self.studentise_in_place(&mut poses);
        poses.into_iter().map(Vector3::from).collect()
    }

    /// Replaces the residual r_b of each pose by the studentised one, as [`Self::studentise`]
    /// returns it.
    pub fn studentise_in_place(&self, poses: &mut [[f64; 3]]) {
        for (pose, whitener) in poses.iter_mut().zip(&self.whiteners) {
            *pose = (whitener * Vector3::from(*pose)).into();
        }
    }
}

/// Applies a function to blocks of poses in parallel and concatenates the results. The function
/// receives the index of the first pose of a block and the block's rows of Q as columns, three a
/// pose.
fn by_poses<T: Send>(
    fitted: &DMatrix<f64>,
    of: impl Fn(usize, &DMatrix<f64>) -> Vec<T> + Sync,
) -> Vec<T> {
    let poses = fitted.nrows() / 3;
    // The poses are divided evenly, so that no part is much smaller than the others.
    let together = poses.div_ceil(poses.div_ceil(POSES_PER_BLOCK).max(1)).max(1);
    let part = |part: usize| {
        let first = part * together;
        of(first, &fitted.rows(3 * first, 3 * together.min(poses - first)).transpose())
    };
    parallel::joined(parallel::map(poses.div_ceil(together), part))
}

/// Returns A_bᵀ B_b, where A_b and B_b are the three columns that belong to pose b.
fn products(a: &DMatrix<f64>, b: &DMatrix<f64>, pose: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| a.column(3 * pose + i).dot(&b.column(3 * pose + j)))
}

/// Returns R with R Rᵀ = `prior_part` = I − QᵀQ, with one column for each direction that priors
/// help to determine.
fn root_of_priors(prior_part: DMatrix<f64>) -> DMatrix<f64> {
    let p = prior_part.nrows();
    if prior_part.trace() <= MIN_PRIOR_SHARE {
        return DMatrix::zeros(p, 0);
    }
    let eigen = prior_part.symmetric_eigen();
    let by_priors: Vec<usize> =
        (0..p).filter(|&k| eigen.eigenvalues[k] > MIN_PRIOR_SHARE).collect();
    let entry = |i: usize, k: usize| {
        eigen.eigenvectors[(i, by_priors[k])] * eigen.eigenvalues[by_priors[k]].sqrt()
    };
    DMatrix::from_fn(p, by_priors.len(), entry)
}

/// Returns A^(−½) of a symmetric matrix A; eigenvalues up to [`MIN_RESIDUAL_SHARE`] become 0.
fn inverse_root(matrix: Matrix3<f64>) -> Matrix3<f64> {
    let eigen = matrix.symmetric_eigen();
    let roots = eigen
        .eigenvalues
        .map(|value| if value > MIN_RESIDUAL_SHARE { value.sqrt().recip() } else { 0.0 });
    eigen.eigenvectors * Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose()
}

/// Subset of the poses with the residual of a linear fit to them alone.
#[derive(Debug, Clone)]
pub(super) struct Kept<'a> {
    /// Indices of the kept poses, ascending.
    pub poses: Vec<usize>,
    /// Residuals of the kept poses, shape = (3 per pose).
    pub residual: DVector<f64>,
    /// Leverage of the kept poses.
    pub leverage: Leverage<'a>,
}

impl<'a> Kept<'a> {
    /// Creates the subset of all poses, with the residual as given.
    pub fn all(fit: &FitResidual, leverage: Leverage<'a>) -> Self {
        let residual = fit.residual.clone();
        Self { poses: (0..residual.len() / 3).collect(), residual, leverage }
    }

    /// Refits without the poses whose entry of `out` is true; `None` if the others do not determine
    /// the fit.
    ///
    /// With Q_A and Q_B the rows of the kept and of the other poses, and M = I − Q_BᵀQ_B = L Lᵀ,
    /// the residual is r_A + Q_A M⁻¹ Q_Bᵀ r_B, and Q_A L⁻ᵀ replaces Q [Cook and Weisberg 1982,
    /// section 3.6].
    pub fn without(fit: &FitResidual, out: &[bool]) -> Option<Self> {
        let p = fit.fitted.ncols();
        let (removed, poses): (Vec<usize>, Vec<usize>) =
            (0..out.len()).partition(|&pose| out[pose]);
        let rows_of = |poses: &[usize]| -> Vec<usize> {
            poses.iter().flat_map(|&b| 3 * b..3 * b + 3).collect()
        };
        let coordinates = poses.iter().map(|&pose| fit.coordinates_of(pose)).collect();
        let (removed, kept) = (rows_of(&removed), rows_of(&poses));
        let fitted_removed = fit.fitted.select_rows(&removed);
        let mut fitted = fit.fitted.select_rows(&kept);
        let decided =
            Cholesky::new(DMatrix::identity(p, p) - fitted_removed.tr_mul(&fitted_removed))?;
        if decided.l_dirty().diagonal().iter().any(|&pivot| pivot * pivot < MIN_KEPT_SHARE) {
            return None;
        }
        let pull = decided.solve(&fitted_removed.tr_mul(&fit.residual.select_rows(&removed)));
        let residual = fit.residual.select_rows(&kept) + &fitted * pull;
        let inverse = decided.l().solve_lower_triangular(&DMatrix::identity(p, p))?;
        multiply_by_upper(&mut fitted, &inverse.transpose());
        Some(Self {
            poses,
            residual,
            leverage: Leverage::new(Cow::Owned(fitted), coordinates).ok()?,
        })
    }
}

/// Residual of the other poses in a fit without one pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct Others {
    /// Sum of squared residuals of the other poses.
    pub squares: f64,
    /// Degrees of freedom of that sum of squares.
    pub freedom: f64,
}

/// For each pose b, returns the sum of squares of the other poses in the fit without b, and its
/// degrees of freedom.
///
/// The rows of pose b are Q_b; with D = (I − H_bb)⁻¹, a = D r_b and W = Q_b QᵀQ Q_bᵀ, as in
/// [`Kept::without`],
///
/// ‖r‖² becomes ‖r‖² − |r_b|² + 2 a·(Q_b Qᵀr − H_bb r_b) + a·(W − H_bb²) a, and tr H becomes tr H −
/// tr H_bb + tr D (W − H_bb²).
pub(super) fn each_left_out(leverage: &Leverage, residual: &DVector<f64>) -> Vec<Others> {
    let fitted = leverage.fitted.as_ref();
    let hat_residual = fitted * transposed_product(fitted, residual);
    let total = residual.norm_squared();
    by_poses(fitted, |first, rows| {
        let gram_rows = &leverage.gram * rows;
        let others = |number: usize| {
            let pose = first + number;
            let of_pose = |values: &DVector<f64>| values.fixed_rows::<3>(3 * pose).into_owned();
            let (residual_of_pose, hat_residual) = (of_pose(residual), of_pose(&hat_residual));
            let hat_block = products(rows, rows, number);
            let more = products(rows, &gram_rows, number) - hat_block * hat_block;
            let inverse = leverage.whiteners[pose] * leverage.whiteners[pose];
            let pull = inverse * residual_of_pose;
            let change = 2.0 * pull.dot(&(hat_residual - hat_block * residual_of_pose))
                + pull.dot(&(more * pull));
            Others {
                squares: total - residual_of_pose.norm_squared() + change,
                freedom: leverage.freedom - leverage.coordinates[pose] as f64 + hat_block.trace()
                    - (inverse * more).trace(),
            }
        };
        (0..rows.ncols() / 3).map(others).collect()
    })
}

/// Returns Qᵀr, with Q = `fitted`, summed in blocks of poses.
fn transposed_product(fitted: &DMatrix<f64>, residual: &DVector<f64>) -> DVector<f64> {
    let mut sum = DVector::zeros(fitted.ncols());
    for first in (0..residual.len()).step_by(3 * POSES_PER_BLOCK) {
        let count = (3 * POSES_PER_BLOCK).min(residual.len() - first);
        sum.gemv(1.0, &fitted.rows(first, count).transpose(), &residual.rows(first, count), 1.0);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the leverage of 60 poses and p unknowns; if `has_priors`, each second unknown has
    /// one.
    fn leverage(p: usize, has_priors: bool) -> Leverage<'static> {
        let entry =
            |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0;
        let prior = |i: usize, j: usize| {
            if has_priors && i == j && j.is_multiple_of(2) { 3.0 } else { 0.0 }
        };
        let stacked =
            DMatrix::from_fn(
                180 + p,
                p,
                |i, j| if i < 180 { entry(i, j) } else { prior(i - 180, j) },
            );
        Leverage::new(Cow::Owned(stacked.qr().q().rows(0, 180).into_owned()), vec![3; 60]).unwrap()
    }

    #[test]
    fn what_priors_add_is_a_root_of_what_the_data_leave_open() {
        for p in [9, 110] {
            let leverage_with_priors = leverage(p, true);
            let root = leverage_with_priors.prior_root();
            let prior_part = DMatrix::identity(p, p) - &leverage_with_priors.gram;
            assert!(
                prior_part.trace() > 1.0 && (&root * root.transpose() - prior_part).amax() < 1e-6,
                "{p}"
            );
            assert_eq!(leverage(p, false).prior_root().shape(), (p, 0));
        }
    }
}

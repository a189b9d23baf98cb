//! Evidence for causes of a change of an arm, against "unchanged".
//!
//! Unchanged: the whitened residuals r of all rows are N(0, S) with S = Σ + K C Kᵀ. C is the
//! covariance of the estimate. Σ is that of the noise, I, and of the misfit that the rows of one
//! configuration share ([`Sums`]). A cause adds columns V of K with independent normal amplitudes
//! of size D: r ~ N(0, S + V D² Vᵀ). With A = Vᵀ S⁻¹ V and b = Vᵀ S⁻¹ r its likelihood ratio is
//!
//! ln LR = −½ ln det(I + D A D) + ½ bᵀ D (I + D A D)⁻¹ D b            [Bishop 2006, §2.3]
//!
//! Larger noise, and something else: their part of Σ becomes κ² I. One gross row i: S + λ² on the
//! coordinates of row i.
//!
//! Each ratio is a density of all rows so far over that of "unchanged". It is a martingale while
//! the arm is unchanged, and so is a mixture of such ratios. The mixture exceeds 1/α at any time
//! with a probability of at most α [Ville 1939; Grünwald, de Heide & Koolen 2024].

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::rows::{SensitiveRows, Sums};

/// Ratios of the noise to the assumed one that are tried for the cause "larger noise".
pub(super) const NOISE_RATIOS: [f64; 4] = [1.5, 2.0, 3.0, 5.0];
/// Ratios of the errors to the assumed noise that are tried for the cause "something else": errors
/// without a pattern that are too large to be noise.
pub(super) const OTHER_RATIOS: [f64; 5] = [30.0, 300.0, 3e3, 3e4, 3e5];
/// Smallest probability at which the most probable cause is named as the cause.
pub(super) const MIN_NAMED_PROBABILITY: f64 = 0.9;
/// Prior odds that two things changed together, against one thing alone.
pub(super) const SECOND_CHANGE_ODDS: f64 = 0.05;
/// Standard deviations λ of a gross row's error that are tried, in units of the row's σ.
const GROSS_SIZES: [f64; 3] = [10.0, 50.0, 500.0];
/// Smallest eigenvalue of a correlation matrix, relative to the largest, that does not count as 0.
const MIN_RELATIVE_EIGENVALUE: f64 = 1e-13;

/// Density of the rows if nothing changed, with the quantities that the likelihood ratios need.
pub(super) struct Unchanged {
    /// Matrix A = Kᵀ S⁻¹ K of all columns.
    pub information: DMatrix<f64>,
    /// Vector b = Kᵀ S⁻¹ r of all columns.
    pub vector: DVector<f64>,
    /// Squared length rᵀ S⁻¹ r.
    pub squares: f64,
    /// Logarithm of the determinant of S.
    ln_det: f64,
    /// Cholesky factor L of I + Fᵀ G F; G and g are those of [`Sums`].
    lower: DMatrix<f64>,
    /// Vector L⁻¹ Fᵀ g.
    along: DVector<f64>,
}

/// Returns F with F Fᵀ = C for a covariance matrix C. F has a row for each parameter, and a column
/// for each principal direction with a variance.
pub(super) fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let free: Vec<usize> = (0..scale.len()).filter(|&k| scale[k] > 0.0).collect();
    let correlation = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        covariance[(free[i], free[j])] / (scale[free[i]] * scale[free[j]])
    });
    let eigen = correlation.symmetric_eigen();
    let largest = if free.is_empty() { 0.0 } else { eigen.eigenvalues.amax() };
    let kept: Vec<usize> = (0..free.len())
        .filter(|&k| eigen.eigenvalues[k] > MIN_RELATIVE_EIGENVALUE * largest)
        .collect();
    let mut factor = DMatrix::zeros(scale.len(), kept.len());
    for (column, &k) in kept.iter().enumerate() {
        let root = eigen.eigenvalues[k].sqrt();
        for (i, &row) in free.iter().enumerate() {
            factor[(row, column)] = scale[row] * root * eigen.eigenvectors[(i, k)];
        }
    }
    factor
}

impl Unchanged {
    /// Computes the density of rows with these sums, for an estimate with the covariance F Fᵀ, F =
    /// `factor`. Returns `None` if a number is not finite.
    pub fn new(sums: &Sums, factor: &DMatrix<f64>) -> Option<Self> {
        let mut matrix = factor.tr_mul(&(&sums.information * factor));
        for k in 0..matrix.nrows() {
            matrix[(k, k)] += 1.0;
        }
        let lower = matrix.cholesky()?.unpack();
        let ln_inner: f64 = lower.diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        let carried = lower.solve_lower_triangular(&factor.tr_mul(&sums.information))?;
        let along = lower.solve_lower_triangular(&factor.tr_mul(&sums.vector))?;
        Some(Self {
            information: &sums.information - carried.tr_mul(&carried),
            vector: &sums.vector - carried.tr_mul(&along),
            squares: sums.squares - along.norm_squared(),
            ln_det: sums.ln_det + ln_inner,
            lower,
            along,
        })
    }

    /// Returns ln LR of a cause that moves these columns, and the posterior mean and covariance of
    /// its amplitudes. `sizes` are the prior 1 σ of the amplitudes. `None` if a number is not
    /// finite.
    pub fn likelihood_ratio(
        &self,
        columns: &[usize],
        sizes: &[f64],
    ) -> Option<(f64, DVector<f64>, DMatrix<f64>)> {
        let n = columns.len();
        let (solved, pull) = self.solved(columns, sizes)?;
        let mean = solved.solve(&pull);
        let ln_det: f64 = solved.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        let ratio = 0.5 * (pull.dot(&mean) - ln_det);
        let inverse = solved.inverse();
        let covariance = DMatrix::from_fn(n, n, |i, j| sizes[i] * inverse[(i, j)] * sizes[j]);
        Some((ratio, DVector::from_fn(n, |i, _| sizes[i] * mean[i]), covariance))
    }

    /// Returns the posterior mean of the amplitudes as [`likelihood_ratio`](Self::likelihood_ratio)
    /// does, without the rest.
    pub fn mean(&self, columns: &[usize], sizes: &[f64]) -> Option<DVector<f64>> {
        let (solved, pull) = self.solved(columns, sizes)?;
        let mean = solved.solve(&pull);
        Some(DVector::from_fn(columns.len(), |i, _| sizes[i] * mean[i]))
    }

    /// Returns the Cholesky decomposition of I + D A D, and the vector D b.
    fn solved(
        &self,
        columns: &[usize],
        sizes: &[f64],
    ) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let n = columns.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            sizes[i] * self.information[(columns[i], columns[j])] * sizes[j]
                + f64::from(u8::from(i == j))
        });
        let pull = DVector::from_fn(n, |i, _| sizes[i] * self.vector[columns[i]]);
        Some((scaled.cholesky()?, pull))
    }

    /// Returns ln LR of the density `other` of the same rows against this one.
    pub fn against(&self, other: &Self) -> f64 {
        0.5 * (self.ln_det - other.ln_det + self.squares - other.squares)
    }

    /// Returns ln LR of a gross error in one row; LR is averaged over [`GROSS_SIZES`]. `None` if a
    /// number is not finite.
    pub fn gross_row(
        &self,
        rows: &SensitiveRows,
        row: usize,
        (sums, factor): (&Sums, &DMatrix<f64>),
    ) -> Option<f64> {
        let (sensitivity, residual, diagonal) = sums.of_row(rows, row);
        let carried = self.lower.solve_lower_triangular(&(sensitivity * factor).transpose())?;
        let n = residual.len();
        let information = DMatrix::from_diagonal(&diagonal) - carried.tr_mul(&carried);
        let vector = residual - carried.tr_mul(&self.along);
        let ratios = GROSS_SIZES.iter().filter_map(|size| {
            let solved = (DMatrix::identity(n, n) + &information * (size * size)).cholesky()?;
            let ln_det: f64 = solved.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
            Some(0.5 * (vector.dot(&solved.solve(&vector)) * size * size - ln_det))
        });
        Some(ln_sum(ratios) - (GROSS_SIZES.len() as f64).ln())
    }
}

/// Returns ln Σ exp(x) over the numbers x without overflow; −∞ without numbers.
pub(super) fn ln_sum(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let numbers: Vec<f64> = numbers.into_iter().collect();
    let largest = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    largest + numbers.iter().map(|number| (number - largest).exp()).sum::<f64>().ln()
}

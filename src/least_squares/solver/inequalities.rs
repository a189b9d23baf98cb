//! Linear inequalities between unknowns.

use nalgebra::{DMatrix, DVector};

use super::AtBound;

/// A row is on its limit when it is this near, relative to the size of its terms and of x.
const NEAR: f64 = 1e-12;
/// A row holds when it is outside by no more than this, relative to the size of its terms.
const ROUNDING: f64 = 1e-14;

/// Rows lo ≤ A x ≤ hi; infinite where there is no limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Inequalities {
    matrix: DMatrix<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Inequalities that make no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InequalitiesError {
    /// Matrix and limits differ in their number of rows.
    #[error("setting inequalities: {rows} rows, but {lower} lower and {upper} upper limits")]
    Sizes {
        /// Rows of the matrix.
        rows: usize,
        /// Number of lower limits.
        lower: usize,
        /// Number of upper limits.
        upper: usize,
    },
    /// Not lo ≤ hi, or a coefficient that is not finite, or nothing but zeros.
    #[error("setting inequalities: row {row} cannot hold between {lower} and {upper}")]
    Empty {
        /// Which row.
        row: usize,
        /// Its lower limit.
        lower: f64,
        /// Its upper limit.
        upper: f64,
    },
}

impl Inequalities {
    /// Rows lo ≤ A x ≤ hi; lo = hi is an equation.
    ///
    /// # Errors
    /// When the sizes differ, or a row is empty, or its limits leave no value.
    pub fn new(
        matrix: DMatrix<f64>,
        lower: DVector<f64>,
        upper: DVector<f64>,
    ) -> Result<Self, InequalitiesError> {
        let rows = matrix.nrows();
        if lower.len() != rows || upper.len() != rows {
            return Err(InequalitiesError::Sizes { rows, lower: lower.len(), upper: upper.len() });
        }
        for (row, (&lower, &upper)) in lower.iter().zip(&upper).enumerate() {
            let size = matrix.row(row).norm();
            let possible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !(possible && size.is_finite() && size > 0.0) {
                return Err(InequalitiesError::Empty { row, lower, upper });
            }
        }
        Ok(Self { matrix, lower, upper })
    }

    /// No rows, for `n` unknowns.
    pub fn none(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(0, n), lower: DVector::zeros(0), upper: DVector::zeros(0) }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.matrix.nrows() == 0
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.matrix.nrows()
    }

    /// A.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// lo.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// hi.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// The limit that row `i` is on to within rounding, if any.
    pub fn at(&self, x: &DVector<f64>, i: usize) -> Option<AtBound> {
        let (value, size) = self.value(x, i);
        let size = size + self.matrix.row(i).amax() * x.amax();
        let on =
            |limit: f64| limit.is_finite() && (value - limit).abs() <= NEAR * (size + limit.abs());
        if on(self.lower[i]) {
            Some(AtBound::Lower)
        } else if on(self.upper[i]) {
            Some(AtBound::Upper)
        } else {
            None
        }
    }

    /// Whether row `i` holds to within rounding.
    pub(super) fn holds(&self, x: &DVector<f64>, i: usize) -> bool {
        let (value, size) = self.value(x, i);
        let (lower, upper) = (self.lower[i], self.upper[i]);
        lower - value <= ROUNDING * (size + lower.abs())
            && value - upper <= ROUNDING * (size + upper.abs())
    }

    /// Whether every row holds to within rounding.
    pub fn contain(&self, x: &DVector<f64>) -> bool {
        (0..self.len()).all(|i| self.holds(x, i))
    }

    /// `aᵢᵀx` and Σ |aᵢⱼ xⱼ|.
    fn value(&self, x: &DVector<f64>, i: usize) -> (f64, f64) {
        let terms = self.matrix.row(i);
        terms
            .iter()
            .zip(x.iter())
            .fold((0.0, 0.0), |(sum, size), (a, x)| (sum + a * x, size + (a * x).abs()))
    }
}

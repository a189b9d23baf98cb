//! Linear inequalities between unknowns.

use nalgebra::{DMatrix, DVector};

use super::AtBound;

/// Distance from its limit, relative to the size of its terms and of x, up to which a row counts as
/// active (on the limit).
const MAX_ACTIVE_DISTANCE: f64 = 1e-12;
/// Largest violation at which a row counts as satisfied, relative to the size of its terms.
const MAX_ROUNDING_VIOLATION: f64 = 1e-14;

/// Linear inequalities lo ≤ A x ≤ hi, infinite where a side has no limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Inequalities {
    matrix: DMatrix<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Error of inequalities whose shape is wrong or that no x satisfies.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InequalitiesError {
    /// Matrix and limits differ in their number of rows.
    #[error("setting inequalities: {rows} rows, but {lower} lower and {upper} upper limits")]
    Sizes {
        /// Number of rows of the matrix of the inequalities.
        rows: usize,
        /// Number of lower limits.
        lower: usize,
        /// Number of upper limits.
        upper: usize,
    },
    /// A row violates lo ≤ hi, has a coefficient that is not finite, or only zeros.
    #[error("setting inequalities: row {row} cannot hold between {lower} and {upper}")]
    Empty {
        /// Index of the inequality whose limits are wrong, from 0.
        row: usize,
        /// Lower limit of this inequality.
        lower: f64,
        /// Upper limit of this inequality.
        upper: f64,
    },
}

impl Inequalities {
    /// Creates rows lo ≤ A x ≤ hi; lo = hi is an equation.
    ///
    /// # Errors
    /// Returns an error if the sizes differ, a row has no coefficient, or its limits leave no
    /// value.
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
            let is_possible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !(is_possible && size.is_finite() && size > 0.0) {
                return Err(InequalitiesError::Empty { row, lower, upper });
            }
        }
        Ok(Self { matrix, lower, upper })
    }

    /// Creates an empty set of rows for `n` unknowns.
    pub fn none(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(0, n), lower: DVector::zeros(0), upper: DVector::zeros(0) }
    }

    /// Returns true if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.matrix.nrows() == 0
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.matrix.nrows()
    }

    /// Returns the matrix A, shape = (rows, n).
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Returns the lower limits lo.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// Returns the upper limits hi.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// Returns the limit that row `i` is on, to within rounding, if any.
    pub fn at(&self, x: &DVector<f64>, i: usize) -> Option<AtBound> {
        let (value, size) = self.value_and_size(x, i);
        let size = size + self.matrix.row(i).amax() * x.amax();
        let is_at = |limit: f64| {
            limit.is_finite() && (value - limit).abs() <= MAX_ACTIVE_DISTANCE * (size + limit.abs())
        };
        if is_at(self.lower[i]) {
            Some(AtBound::Lower)
        } else if is_at(self.upper[i]) {
            Some(AtBound::Upper)
        } else {
            None
        }
    }

    /// Returns true if row `i` is satisfied to within rounding.
    pub(super) fn holds(&self, x: &DVector<f64>, i: usize) -> bool {
        let (value, size) = self.value_and_size(x, i);
        let (lower, upper) = (self.lower[i], self.upper[i]);
        lower - value <= MAX_ROUNDING_VIOLATION * (size + lower.abs())
            && value - upper <= MAX_ROUNDING_VIOLATION * (size + upper.abs())
    }

    /// Returns true if every row is satisfied to within rounding.
    pub fn contain(&self, x: &DVector<f64>) -> bool {
        (0..self.len()).all(|i| self.holds(x, i))
    }

    /// Returns the value `aᵢᵀx` of row `i` and its size Σ |aᵢⱼ xⱼ|.
    fn value_and_size(&self, x: &DVector<f64>, i: usize) -> (f64, f64) {
        let terms = self.matrix.row(i);
        terms
            .iter()
            .zip(x.iter())
            .fold((0.0, 0.0), |(sum, size), (a, x)| (sum + a * x, size + (a * x).abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_hold_and_are_active_to_within_rounding() {
        let vector = |values: &[f64]| DVector::from_column_slice(values);
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 1e3, -1e3]);
        let rows = Inequalities::new(matrix, vector(&[-3.0, -f64::INFINITY]), vector(&[5.0, 2e3]));
        let rows = rows.unwrap();
        // The first row has the value x₀ + 2 x₁, with terms of size 1 and 4.
        for (excess, holds, at) in [
            (0.0, true, Some(AtBound::Upper)),
            (1e-15, true, Some(AtBound::Upper)),
            (-1e-3, true, None),
            (1e-3, false, None),
            (1e-9, false, None),
        ] {
            let x = vector(&[1.0 + excess, 2.0]);
            assert_eq!((rows.holds(&x, 0), rows.at(&x, 0)), (holds, at), "{excess}");
            assert_eq!(rows.contain(&x), holds);
            let x = vector(&[-1.0 - excess, -1.0]);
            let at = at.map(|_| AtBound::Lower);
            assert_eq!((rows.holds(&x, 0), rows.at(&x, 0)), (holds, at), "{excess}");
        }
        // Rounding is relative to the terms, here 2e6 each.
        let x = vector(&[2e3 + 2.0 + 1e-12, 2e3]);
        assert!(rows.holds(&x, 1) && rows.at(&x, 1) == Some(AtBound::Upper));
        assert!(!rows.holds(&vector(&[2e3 + 2.0 + 1e-6, 2e3]), 1));
        assert!(rows.holds(&vector(&[-1e9, 2e3]), 1));
        assert!(!rows.is_empty() && Inequalities::none(2).is_empty());
    }

    #[test]
    fn rows_without_a_value_are_refused() {
        let row = |matrix: [f64; 2], lower: f64, upper: f64| {
            let (lower, upper) = (DVector::from_element(1, lower), DVector::from_element(1, upper));
            Inequalities::new(DMatrix::from_row_slice(1, 2, &matrix), lower, upper)
        };
        assert!(row([1.0, 0.0], -1.0, 1.0).is_ok() && row([1.0, 0.0], 1.0, 1.0).is_ok());
        let refused = [
            row([1.0, 0.0], 1.0, -1.0),
            row([1.0, 0.0], f64::INFINITY, f64::INFINITY),
            row([1.0, 0.0], f64::NEG_INFINITY, f64::NEG_INFINITY),
            row([1.0, 0.0], f64::NAN, 1.0),
            row([0.0, 0.0], -1.0, 1.0),
            row([f64::NAN, 0.0], -1.0, 1.0),
            row([f64::INFINITY, 0.0], -1.0, 1.0),
        ];
        for found in refused {
            assert!(matches!(found, Err(InequalitiesError::Empty { row: 0, .. })), "{found:?}");
        }
    }
}

//! Score of columns that were not fitted, and the F test of its gain.

use crate::residual_tests::MIN_RESIDUAL_SIGMAS;
use crate::select::settings::MIN_NEW_LENGTH;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

/// Score of columns C that were not fitted: products of C̃, which is C with the fitted parameters
/// projected out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Score {
    /// Gram matrix C̃ᵀC̃ of the columns C̃ of the candidate, fitted parameters projected out, shape
    /// = (k, k).
    pub gram: DMatrix<f64>,
    /// Product C̃ᵀr of the projected columns C̃ with the whitened residual r, length k.
    pub product: DVector<f64>,
    /// Squared length ‖C‖² of each column before the projection.
    pub lengths: Vec<f64>,
}

/// Sums of squares and degrees of freedom of a fit.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    /// Sum of squared whitened residuals of data and priors.
    pub squares: f64,
    /// Sum of squared whitened residuals of the data alone.
    data_squares: f64,
    /// Degrees of freedom of the residuals of the data.
    pub data_freedom: f64,
}

/// Gain of a fit by a candidate, with its p-value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// Reduction of the sum of squared whitened residuals.
    pub squares: f64,
    /// Number of new directions k, the degrees of freedom of the numerator.
    pub freedom: usize,
    /// F statistic of the gain.
    pub f: f64,
    /// Probability of an F at least as large under noise alone, uncorrected for other candidates.
    pub p: f64,
    /// Information criterion: change of ν ln(squares) + k ln ν by the candidate. It is not
    /// corrected for the number of candidates.
    pub criterion: f64,
}

impl Sums {
    /// Creates the sums of a residual, whose first `rows` rows are data and the others priors, with
    /// `data_freedom` degrees of freedom of the data.
    pub fn new(residual: &DVector<f64>, rows: usize, data_freedom: f64) -> Self {
        let data_squares = residual.rows(0, rows).norm_squared();
        Self { squares: residual.norm_squared(), data_squares, data_freedom }
    }

    /// Returns the degrees of freedom of the whole sum of squares, estimated from the scatter of
    /// the data.
    ///
    /// If the priors are true, they are 3 N. If the priors are far wider than the deviations, they
    /// are 3 N − tr H.
    pub fn freedom(&self) -> f64 {
        self.data_freedom * self.squares / self.data_squares.max(f64::MIN_POSITIVE)
    }

    /// Returns the gain by columns with this score; `None` if they add nothing.
    pub fn gain(&self, score: &Score) -> Option<Gain> {
        let (squares, freedom) = score.reduction()?;
        self.gain_of_reduction(squares, freedom)
    }

    /// Returns the gain for a reduction of the sum of squares by `squares` with `freedom` new
    /// directions; `None` if no degrees of freedom remain.
    pub fn gain_of_reduction(&self, squares: f64, freedom: usize) -> Option<Gain> {
        let degrees = self.freedom();
        let total = self.squares.max(MIN_RESIDUAL_SIGMAS.powi(2) * degrees);
        let remaining_degrees = degrees - freedom as f64;
        if remaining_degrees < 1.0 || freedom == 0 {
            return None;
        }
        let part = (squares / total).clamp(0.0, 1.0 - 1e-15);
        let f = part / (1.0 - part) * remaining_degrees / freedom as f64;
        // If the squares overflow, p is 1.
        let chance =
            FisherSnedecor::new(freedom as f64, remaining_degrees).ok().filter(|_| !f.is_nan());
        let p = chance.map_or(1.0, |chance| chance.sf(f)).max(f64::MIN_POSITIVE);
        let criterion = degrees * (-part).ln_1p() + freedom as f64 * degrees.ln();
        Some(Gain { squares, freedom, f, p, criterion })
    }
}

impl Score {
    /// Returns the estimates −G⁺b of the columns' parameters (G = `gram`, b = `product`), each with
    /// its standard error for whitened residuals of variance 1.
    pub fn estimates(&self) -> Vec<(f64, f64)> {
        let scale = self.scale();
        let (mut estimates, mut variances) = (vec![0.0; scale.len()], vec![0.0; scale.len()]);
        for (value, vector, along) in self.detectable_directions() {
            for (i, scale) in scale.iter().enumerate() {
                estimates[i] -= vector[i] * along / value / scale;
                variances[i] += vector[i] * vector[i] / value / (scale * scale);
            }
        }
        estimates
            .into_iter()
            .zip(variances)
            .map(|(estimate, variance)| (estimate, variance.sqrt()))
            .collect()
    }

    /// Returns the rank of G: the number of independent directions that the columns add to the fit.
    pub fn rank(&self) -> usize {
        self.detectable_directions().len()
    }

    /// Returns the reduction bᵀG⁺b of the sum of squares and the rank of G; `None` if the fitted
    /// parameters reproduce the columns completely.
    fn reduction(&self) -> Option<(f64, usize)> {
        let seen = self.detectable_directions();
        let sum = seen.iter().map(|(value, _, along)| along * along / value).sum();
        (!seen.is_empty()).then_some((sum, seen.len()))
    }

    /// Returns the length ‖C‖ of each column before the projection, 1 for a column of zeros.
    fn scale(&self) -> Vec<f64> {
        self.lengths.iter().map(|length| if *length > 0.0 { length.sqrt() } else { 1.0 }).collect()
    }

    /// Returns eigenvalue, eigenvector and the component of b along it for each direction of G that
    /// the fitted parameters do not reproduce, all for columns scaled to unit length.
    fn detectable_directions(&self) -> Vec<(f64, DVector<f64>, f64)> {
        let (k, scale) = (self.lengths.len(), self.scale());
        let product = DVector::from_fn(k, |i, _| self.product[i] / scale[i]);
        let eigen = DMatrix::from_fn(k, k, |i, j| self.gram[(i, j)] / (scale[i] * scale[j]))
            .symmetric_eigen();
        let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let is_seen = |(value, _): &(&f64, _)| **value > MIN_NEW_LENGTH.powi(2);
        directions
            .filter(is_seen)
            .map(|(value, vector)| (*value, vector.into_owned(), vector.dot(&product)))
            .collect()
    }
}

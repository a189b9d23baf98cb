//! What a residual says about columns that were not fitted, and what that means.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use crate::select::rules::SelectionRules;

/// What the residual says about columns that were not fitted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Score {
    /// C̃ᵀC̃ of the columns with everything fitted projected out.
    pub gram: DMatrix<f64>,
    /// C̃ᵀr.
    pub product: DVector<f64>,
    /// ‖C‖² of each column before the projection.
    pub lengths: Vec<f64>,
}

/// What is left of a fit in numbers: all that judging a candidate needs.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    /// With priors.
    pub squares: f64,
    /// Of the data alone.
    data_squares: f64,
    /// Degrees of freedom of the data.
    pub data_freedom: f64,
}

/// What a fit would gain by a candidate, and how probable that gain is by chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// Reduction of the sum of squares.
    pub squares: f64,
    /// New directions.
    pub freedom: usize,
    /// F statistic.
    pub f: f64,
    /// Probability of as large an F by chance, for one candidate alone.
    pub p: f64,
    /// Change of ν ln(squares) + k ln ν: an information criterion without regard to how many
    /// candidates there are.
    pub criterion: f64,
}

impl Sums {
    /// Of a residual, priors below its first `rows`, that has `data_freedom` degrees of freedom in
    /// the data.
    pub fn of(residual: &DVector<f64>, rows: usize, data_freedom: f64) -> Self {
        let data_squares = residual.rows(0, rows).norm_squared();
        Self { squares: residual.norm_squared(), data_squares, data_freedom }
    }

    /// Degrees of freedom of the whole sum of squares at the scatter of the data.
    ///
    /// With true priors it has 3 N, with priors far wider than the deviations 3 N − tr H: the
    /// data's scatter decides.
    pub fn freedom(&self) -> f64 {
        self.data_freedom * self.squares / self.data_squares.max(f64::MIN_POSITIVE)
    }

    /// What the fit gains by columns with this score.
    pub fn gain(&self, score: &Score, rules: &SelectionRules) -> Option<Gain> {
        let (squares, freedom) = score.reduction(rules)?;
        self.gain_of(squares, freedom, rules)
    }

    /// What a reduction of the sum of squares by so many new directions means.
    pub fn gain_of(&self, squares: f64, freedom: usize, rules: &SelectionRules) -> Option<Gain> {
        let degrees = self.freedom();
        let total = self.squares.max(rules.rounding.powi(2) * degrees);
        let left = degrees - freedom as f64;
        if left < 1.0 || freedom == 0 {
            return None;
        }
        let part = (squares / total).clamp(0.0, 1.0 - 1e-15);
        let f = part / (1.0 - part) * left / freedom as f64;
        // Of squares that overflow nothing can be said.
        let chance = FisherSnedecor::new(freedom as f64, left).ok().filter(|_| !f.is_nan());
        let p = chance.map_or(1.0, |chance| chance.sf(f)).max(f64::MIN_POSITIVE);
        let criterion = degrees * (-part).ln_1p() + freedom as f64 * degrees.ln();
        Some(Gain { squares, freedom, f, p, criterion })
    }
}

impl Score {
    /// What the fit would make of the columns' parameters, −G⁺b, each with its standard error for
    /// residuals of unit scatter.
    pub fn estimates(&self, rules: &SelectionRules) -> Vec<(f64, f64)> {
        let scale = self.scale();
        let (mut estimates, mut variances) = (vec![0.0; scale.len()], vec![0.0; scale.len()]);
        for (value, vector, along) in self.seen(rules) {
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

    /// How many new directions the columns have.
    pub fn rank(&self, rules: &SelectionRules) -> usize {
        self.seen(rules).len()
    }

    /// bᵀ G⁺ b and the rank of G; `None` where nothing new is left of the columns.
    fn reduction(&self, rules: &SelectionRules) -> Option<(f64, usize)> {
        let seen = self.seen(rules);
        let sum = seen.iter().map(|(value, _, along)| along * along / value).sum();
        (!seen.is_empty()).then_some((sum, seen.len()))
    }

    fn scale(&self) -> Vec<f64> {
        self.lengths.iter().map(|length| if *length > 0.0 { length.sqrt() } else { 1.0 }).collect()
    }

    /// Eigenvalues and vectors of G, for columns of length one, with bᵀ along each; those that the
    /// fit absorbs left out.
    fn seen(&self, rules: &SelectionRules) -> Vec<(f64, DVector<f64>, f64)> {
        let (k, scale) = (self.lengths.len(), self.scale());
        let product = DVector::from_fn(k, |i, _| self.product[i] / scale[i]);
        let eigen = DMatrix::from_fn(k, k, |i, j| self.gram[(i, j)] / (scale[i] * scale[j]))
            .symmetric_eigen();
        let all = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let is_seen = |(value, _): &(&f64, _)| **value > rules.absorbed.powi(2);
        all.filter(is_seen)
            .map(|(value, vector)| (*value, vector.into_owned(), vector.dot(&product)))
            .collect()
    }

    /// Takes off directions that have been fitted since: `along` = Cᵀq, `given` = qᵀr before they
    /// were fitted.
    pub fn take_off(&mut self, along: &DMatrix<f64>, given: &DVector<f64>) {
        self.gram -= along * along.transpose();
        self.product -= along * given;
    }

    /// The reverse: the score without directions that were fitted.
    pub fn give_back(&self, along: &DMatrix<f64>, given: &DVector<f64>) -> Self {
        let (gram, product) =
            (&self.gram + along * along.transpose(), &self.product + along * given);
        Self { gram, product, lengths: self.lengths.clone() }
    }
}

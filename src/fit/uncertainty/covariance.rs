//! Covariance and correlations of estimates.

use nalgebra::DMatrix;

use crate::model::Model;

/// Covariance of the estimates, as their standard errors have it: priors, active constraints, the
/// weights of a robust loss and the factor on the noise taken into account.
///
/// Combinations that neither data nor priors see are held where they were: a parameter that is part
/// of one has a variance here, but no standard error. Parameters of sessions or targets that only
/// held-out rows use are fitted with the arm given: their covariance with all others is 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Places among the estimates of the parameters it is of, ascending: those that were fitted and
    /// rest on no bound.
    pub parameters: Vec<usize>,
    /// Of the values, SI, shape = (parameters, parameters): entry (i, j) is in the product of both
    /// units.
    pub matrix: DMatrix<f64>,
}

/// Correlations of the parameters that were fitted together, those left out that rest on a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlations {
    /// Names.
    pub names: Vec<String>,
    /// −1…1, shape = (names, names).
    pub matrix: DMatrix<f64>,
}

/// Collects the covariance of the values from the stages of an identification.
pub(in crate::fit) struct Collected(DMatrix<f64>);

impl Collected {
    /// Nothing yet, of so many parameters.
    pub fn new(parameters: usize) -> Self {
        Self(DMatrix::zeros(parameters, parameters))
    }

    /// Enters the covariance of the unknowns x of one stage, numbers of the model's parameters, at
    /// the full vector x: of the values, it is S C S with S = diag(∂value/∂x).
    pub fn enter(
        &mut self,
        model: &Model,
        unknowns: &[usize],
        x: &[f64],
        covariance: &DMatrix<f64>,
    ) {
        let scale: Vec<f64> =
            unknowns.iter().map(|&k| model.parameters[k].value_error(x[k], 1.0)).collect();
        for (i, &k) in unknowns.iter().enumerate() {
            for (j, &l) in unknowns.iter().enumerate() {
                self.0[(k, l)] = scale[i] * covariance[(i, j)] * scale[j];
            }
        }
    }

    /// The covariance of those that have a variance.
    pub fn finish(self) -> Covariance {
        let parameters: Vec<usize> =
            (0..self.0.ncols()).filter(|&k| self.0[(k, k)] > 0.0).collect();
        let matrix = self.0.select_rows(&parameters).select_columns(&parameters);
        Covariance { parameters, matrix }
    }
}

impl Covariance {
    /// Covariance of two parameters by their places among the estimates; `None` where one of them
    /// was not fitted or rests on a bound.
    pub fn of(&self, one: usize, other: usize) -> Option<f64> {
        let place = |k| self.parameters.binary_search(&k).ok();
        Some(self.matrix[(place(one)?, place(other)?)])
    }

    /// The correlation matrix, C_ij / √(C_ii C_jj), shape = (parameters, parameters).
    pub fn correlation(&self) -> DMatrix<f64> {
        let error = self.matrix.diagonal().map(f64::sqrt);
        let of =
            |i: usize, j: usize| (self.matrix[(i, j)] / (error[i] * error[j])).clamp(-1.0, 1.0);
        DMatrix::from_fn(error.len(), error.len(), of)
    }
}

impl Correlations {
    /// Pairs that are correlated by more than `least` in absolute value, strongest first.
    pub fn above(&self, least: f64) -> Vec<(&str, &str, f64)> {
        let n = self.names.len();
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        let mut pairs: Vec<_> = pairs.filter(|&pair| self.matrix[pair].abs() > least).collect();
        pairs.sort_by(|&a, &b| {
            self.matrix[b].abs().total_cmp(&self.matrix[a].abs()).then(a.cmp(&b))
        });
        pairs
            .into_iter()
            .map(|(i, j)| (self.names[i].as_str(), self.names[j].as_str(), self.matrix[(i, j)]))
            .collect()
    }
}

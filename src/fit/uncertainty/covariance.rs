//! Covariance and correlations of estimates.

use nalgebra::DMatrix;

use crate::model::Model;

/// Covariance of the estimates, consistent with their standard errors. It accounts for priors,
/// active constraints, the weights of a robust loss and the noise that the fit assumed.
///
/// Unidentifiable combinations keep their start values: their parameters have a variance here, but
/// no standard error. Parameters of sessions or targets that only held-out rows use are fitted with
/// the arm's parameters fixed, so their covariance with all others is 0. An unknown that rests on a
/// bound along a direction that the data hardly determine has the variance of its distance from
/// that bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Indices, among the estimates, of the parameters that were fitted and have a variance, in
    /// ascending order.
    pub parameters: Vec<usize>,
    /// Covariance of the values, shape = (parameters, parameters); entry (i, j) is in the product
    /// of both SI units.
    pub matrix: DMatrix<f64>,
}

/// Correlations of the parameters that were fitted together and have a variance.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlations {
    /// Names of the parameters, in the order of the rows and columns of `matrix`.
    pub names: Vec<String>,
    /// Correlations, −1…1, shape = (names, names).
    pub matrix: DMatrix<f64>,
}

/// Covariance of the values of all parameters of the model, collected from the stages of an
/// identification; 0 for parameters without a variance.
pub(in crate::fit) struct Collected(DMatrix<f64>);

impl Collected {
    /// Creates a covariance of zeros for `parameters` parameters.
    pub fn new(parameters: usize) -> Self {
        Self(DMatrix::zeros(parameters, parameters))
    }

    /// Writes the covariance C of the `unknowns` of one stage, which are indices into the
    /// parameters of the model. The covariance of their values is S C S with S = diag(∂value/∂x) at
    /// the full parameter vector `x`.
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

    /// Returns the covariance of the parameters that have a variance.
    pub fn finish(self) -> Covariance {
        let parameters: Vec<usize> =
            (0..self.0.ncols()).filter(|&k| self.0[(k, k)] > 0.0).collect();
        let matrix = self.0.select_rows(&parameters).select_columns(&parameters);
        Covariance { parameters, matrix }
    }
}

impl Covariance {
    /// Returns the covariance of two parameters, given by their indices among the estimates
    /// \[product of their SI units\]; `None` if one of them has no variance.
    pub fn entry(&self, one: usize, other: usize) -> Option<f64> {
        let place = |k| self.parameters.binary_search(&k).ok();
        Some(self.matrix[(place(one)?, place(other)?)])
    }

    /// Returns the correlation matrix C_ij / √(C_ii C_jj), shape = (parameters, parameters).
    #[doc(hidden)]
    pub fn correlation(&self) -> DMatrix<f64> {
        let error = self.matrix.diagonal().map(f64::sqrt);
        let of =
            |i: usize, j: usize| (self.matrix[(i, j)] / (error[i] * error[j])).clamp(-1.0, 1.0);
        DMatrix::from_fn(error.len(), error.len(), of)
    }
}

impl Correlations {
    /// Returns the pairs whose correlation exceeds `least` in absolute value, strongest first.
    #[doc(hidden)]
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

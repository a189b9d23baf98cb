//! Measured rows, linearised about an estimate, and their sums.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::jacobian_and_residual;
use crate::model::{Model, Pose, PoseResiduals};

/// Whitened residuals r of measured rows at a parameter vector, and their sensitivities K: a change
/// δ of the true deviations gives r = K δ + noise.
#[derive(Debug, Clone)]
pub(super) struct SensitiveRows {
    /// Matrix K, shape = (rows × stride, columns).
    pub sensitivity: DMatrix<f64>,
    /// Whitened residuals r.
    pub residual: DVector<f64>,
    /// Number of residuals of a row; those that a row does not measure are 0.
    pub stride: usize,
    /// Number of coordinates that each row measures.
    pub coordinates: Vec<usize>,
    /// Standard deviation (1 σ) of a coordinate of each row \[m\] or \[rad\].
    pub sigma: Vec<f64>,
}

/// Sums over rows: G = KᵀK, g = Kᵀr, ‖r‖², and the number of coordinates.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    pub information: DMatrix<f64>,
    pub vector: DVector<f64>,
    pub squares: f64,
    pub coordinates: f64,
}

impl SensitiveRows {
    /// Linearises the residuals of `poses` in all parameters of a model at the deviations `x`.
    pub fn new(model: &Model, poses: Vec<Pose>, x: &DVector<f64>) -> Self {
        let coordinates = poses.iter().map(Pose::coordinates).collect();
        let sigma: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
        let unknowns = (0..model.parameters.len()).collect();
        let residuals = PoseResiduals::new(model, poses, unknowns, x.clone());
        let (jacobian, residual) = jacobian_and_residual(&residuals, x);
        let stride = residual.len() / sigma.len().max(1);
        Self { sensitivity: -jacobian, residual, stride, coordinates, sigma }
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.sigma.len()
    }

    /// Returns the sensitivities of one row, shape = (stride, columns).
    pub fn of_row(&self, row: usize) -> DMatrix<f64> {
        self.sensitivity.rows(row * self.stride, self.stride).into_owned()
    }

    /// Returns the residuals of one row.
    pub fn residual_of(&self, row: usize) -> DVector<f64> {
        self.residual.rows(row * self.stride, self.stride).into_owned()
    }

    /// Adds a column: the sum of other columns times a factor, times a factor of each row.
    pub fn add_column(&mut self, terms: &[(usize, f64)], of_row: impl Fn(usize) -> f64) -> usize {
        let column = self.sensitivity.ncols();
        let mut sum = DVector::zeros(self.sensitivity.nrows());
        for &(k, factor) in terms {
            sum += self.sensitivity.column(k) * factor;
        }
        for (place, value) in sum.iter_mut().enumerate() {
            *value *= of_row(place / self.stride);
        }
        let sensitivity = std::mem::replace(&mut self.sensitivity, DMatrix::zeros(0, 0));
        self.sensitivity = sensitivity.insert_column(column, 0.0);
        self.sensitivity.set_column(column, &sum);
        column
    }
}

impl Sums {
    /// Creates the sums of no rows, for `columns` columns.
    pub fn new(columns: usize) -> Self {
        let (information, vector) = (DMatrix::zeros(columns, columns), DVector::zeros(columns));
        Self { information, vector, squares: 0.0, coordinates: 0.0 }
    }

    /// Adds one row, `weight` times; −1 removes it.
    pub fn add(&mut self, rows: &SensitiveRows, row: usize, weight: f64) {
        let (sensitivity, residual) = (rows.of_row(row), rows.residual_of(row));
        self.information += sensitivity.tr_mul(&sensitivity) * weight;
        self.vector += sensitivity.tr_mul(&residual) * weight;
        self.squares += residual.norm_squared() * weight;
        self.coordinates += rows.coordinates[row] as f64 * weight;
    }
}

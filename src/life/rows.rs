//! Measured rows, linearised about an estimate, and their sums of products.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::least_squares::jacobian_and_residual;
use crate::measurement::Measurements;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::Problem;

/// Whitened residuals r of measured rows at a parameter vector, and their sensitivities K: a change
/// δ of the true deviations gives r = K δ + noise.
#[derive(Debug, Clone)]
pub(super) struct SensitiveRows {
    /// Matrix K, shape = (rows × stride, columns).
    pub sensitivity: DMatrix<f64>,
    /// Whitened residuals r.
    pub residual: DVector<f64>,
    /// Number of residuals that every row has; those that the row does not measure are 0.
    pub stride: usize,
    /// Number of coordinates that each row measures.
    pub coordinates: Vec<usize>,
    /// Standard deviation (1 σ) of the noise of each row's first coordinate \[m\] or \[rad\].
    pub sigma: Vec<f64>,
    /// Misfit that rows share; `None` if all errors are independent noise.
    misfit: Option<SharedMisfit>,
}

/// Misfit of the estimate that all rows of one configuration share, independent in each coordinate.
#[derive(Debug, Clone)]
pub(super) struct SharedMisfit {
    /// Index of the configuration of each row.
    pub configuration: Vec<usize>,
    /// Standard deviation (1 σ) of the misfit of each residual in units of its noise,
    /// shape = (rows × stride); 0 where a row measures nothing.
    pub sigma: DVector<f64>,
}

/// Sums over rows, weighted by the inverse of Σ, the covariance of noise and shared misfit:
/// G = KᵀΣ⁻¹K, g = KᵀΣ⁻¹r and rᵀΣ⁻¹r.
///
/// The rows of one configuration have Σ = κ² I + m mᵀ in each coordinate, with κ the ratio of the
/// noise to the assumed one and m the misfit in units of the noise. Its inverse is
/// κ⁻² (I − m mᵀ / (κ² + mᵀm)), and its determinant κ²ⁿ (1 + mᵀm / κ²).
#[derive(Debug, Clone)]
pub(super) struct Sums {
    /// Matrix G.
    pub information: DMatrix<f64>,
    /// Vector g.
    pub vector: DVector<f64>,
    /// Squared length rᵀΣ⁻¹r.
    pub squares: f64,
    /// Number of measured coordinates of the added rows.
    pub coordinates: f64,
    /// Logarithm of the determinant of Σ.
    pub ln_det: f64,
    /// Variance κ² of the noise, relative to the assumed one.
    variance: f64,
    /// Sums of each configuration and coordinate that has a misfit.
    configurations: BTreeMap<(usize, usize), ConfigurationSums>,
}

/// Sums over the rows of one configuration in one coordinate: mᵀK, mᵀr and mᵀm.
#[derive(Debug, Clone)]
struct ConfigurationSums {
    sensitivity: DVector<f64>,
    residual: f64,
    squares: f64,
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
        Self { sensitivity: -jacobian, residual, stride, coordinates, sigma, misfit: None }
    }

    /// Sets the misfit that the rows of one configuration share.
    pub fn set_misfit(&mut self, misfit: SharedMisfit) {
        self.misfit = Some(misfit);
    }

    /// Returns the standard deviation (1 σ) of the first coordinate of a row, noise and misfit
    /// together \[m\] or \[rad\].
    pub fn total_sigma(&self, row: usize) -> f64 {
        let misfit = self.misfit.as_ref().map_or(0.0, |misfit| misfit.sigma[row * self.stride]);
        self.sigma[row] * misfit.hypot(1.0)
    }

    /// Returns 1 σ of each measured coordinate of a row in units of its noise: noise, misfit, and the
    /// uncertainty of the estimate, which gives all residuals the covariance A Aᵀ, A = `of_estimate`.
    pub fn expected_errors(&self, row: usize, of_estimate: &DMatrix<f64>) -> DVector<f64> {
        DVector::from_fn(self.coordinates[row], |coordinate, _| {
            let misfit = self.misfit_of(row, coordinate).map_or(0.0, |(_, sigma)| sigma);
            of_estimate.row(row * self.stride + coordinate).norm().hypot(misfit).hypot(1.0)
        })
    }

    /// Returns the configuration of a row and the 1 σ of the misfit of one of its coordinates, in
    /// units of the noise; `None` without a misfit.
    fn misfit_of(&self, row: usize, coordinate: usize) -> Option<(usize, f64)> {
        let misfit = self.misfit.as_ref()?;
        let sigma = misfit.sigma[row * self.stride + coordinate];
        (sigma > 0.0).then(|| (misfit.configuration[row], sigma))
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

    /// Adds a column for each of the first `coordinates` residuals of each row, which is 1 there
    /// and
    /// 0 elsewhere: errors of the predictions, in units of the noise. Returns the index of the
    /// first column.
    pub fn add_error_columns(&mut self, coordinates: usize) -> usize {
        let (first, added) = (self.sensitivity.ncols(), coordinates * self.len());
        let sensitivity = std::mem::replace(&mut self.sensitivity, DMatrix::zeros(0, 0));
        self.sensitivity = sensitivity.resize_horizontally(first + added, 0.0);
        for k in 0..added {
            let place = self.stride * (k / coordinates) + k % coordinates;
            self.sensitivity[(place, first + k)] = 1.0;
        }
        first
    }

    /// Adds a column and returns its index. It is Σ factor × column over `terms`, multiplied in
    /// each row by the number that `of_row` returns.
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

    /// Returns the rows with copies of some columns appended, and the indices of the copies. A copy
    /// is 0 in the rows before `first`, so that it represents a change from that row on.
    pub fn masked_before(&self, first: usize, columns: &[usize]) -> (Self, Vec<usize>) {
        let (before, mut masked) = (self.sensitivity.ncols(), self.clone());
        let added = columns.len();
        masked.sensitivity = masked.sensitivity.resize_horizontally(before + added, 0.0);
        let changed = first * self.stride..self.residual.len();
        for (place, &column) in columns.iter().enumerate() {
            let copied = self.sensitivity.column(column);
            let copied = copied.rows(changed.start, changed.len());
            let mut target = masked.sensitivity.column_mut(before + place);
            target.rows_mut(changed.start, changed.len()).copy_from(&copied);
        }
        (masked, (before..before + added).collect())
    }

    /// Returns the sensitivities to the first parameters, as many as `factor` has rows.
    pub fn columns(&self, factor: &DMatrix<f64>) -> DMatrix<f64> {
        self.sensitivity.columns(0, factor.nrows()).into_owned()
    }

    /// Returns the rows with `added` columns appended, and their indices.
    pub fn with_columns(&self, added: &DMatrix<f64>) -> (Self, Vec<usize>) {
        let (before, mut extended) = (self.sensitivity.ncols(), self.clone());
        let after = before + added.ncols();
        extended.sensitivity = extended.sensitivity.resize_horizontally(after, 0.0);
        extended.sensitivity.columns_mut(before, added.ncols()).copy_from(added);
        (extended, (before..after).collect())
    }

    /// Returns the sum over all residuals of the variance of the shared misfit, in units of the
    /// noise variance; 0 without a misfit.
    pub fn sum_of_misfit_variances(&self) -> f64 {
        self.misfit.as_ref().map_or(0.0, |misfit| misfit.sigma.norm_squared())
    }
}

impl Sums {
    /// Creates the sums of no rows, for `columns` columns and noise that is `ratio` times the
    /// assumed one.
    pub fn new(columns: usize, ratio: f64) -> Self {
        Self {
            information: DMatrix::zeros(columns, columns),
            vector: DVector::zeros(columns),
            squares: 0.0,
            coordinates: 0.0,
            ln_det: 0.0,
            variance: ratio * ratio,
            configurations: BTreeMap::new(),
        }
    }

    /// Adds one row with a weight: 1 adds it, −1 removes it again.
    pub fn add(&mut self, rows: &SensitiveRows, row: usize, weight: f64) {
        let (sensitivity, residual) = (rows.of_row(row), rows.residual_of(row));
        let coordinates = rows.coordinates[row] as f64 * weight;
        let precision = weight / self.variance;
        self.information += sensitivity.tr_mul(&sensitivity) * precision;
        self.vector += sensitivity.tr_mul(&residual) * precision;
        self.squares += residual.norm_squared() * precision;
        self.coordinates += coordinates;
        self.ln_det += coordinates * self.variance.ln();
        for coordinate in 0..rows.coordinates[row] {
            let Some((configuration, misfit)) = rows.misfit_of(row, coordinate) else { continue };
            let place = (configuration, coordinate);
            let none = || ConfigurationSums {
                sensitivity: DVector::zeros(self.vector.len()),
                residual: 0.0,
                squares: 0.0,
            };
            let mut sums = self.configurations.remove(&place).unwrap_or_else(none);
            self.add_configuration(&sums, -1.0);
            sums.sensitivity += sensitivity.row(coordinate).transpose() * (weight * misfit);
            sums.residual += weight * misfit * residual[coordinate];
            sums.squares += weight * misfit * misfit;
            self.add_configuration(&sums, 1.0);
            self.configurations.insert(place, sums);
        }
    }

    /// Adds the part of a configuration by which Σ⁻¹ differs from κ⁻² I; a weight of −1 subtracts
    /// it.
    fn add_configuration(&mut self, sums: &ConfigurationSums, weight: f64) {
        let factor = -weight / (self.variance * (self.variance + sums.squares));
        let ConfigurationSums { sensitivity, residual, squares } = sums;
        self.information.ger(factor, sensitivity, sensitivity, 1.0);
        self.vector.axpy(factor * residual, sensitivity, 1.0);
        self.squares += factor * residual * residual;
        self.ln_det += weight * (squares / self.variance).ln_1p();
    }

    /// Returns Σ⁻¹K, Σ⁻¹r and the diagonal of Σ⁻¹, restricted to the measured coordinates of one
    /// row that these sums contain. Shapes = (coordinates, columns), (coordinates), (coordinates).
    pub fn of_row(
        &self,
        rows: &SensitiveRows,
        row: usize,
    ) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let measured = rows.coordinates[row];
        let mut sensitivity = rows.of_row(row).rows(0, measured) / self.variance;
        let mut residual = rows.residual_of(row).rows(0, measured) / self.variance;
        let mut diagonal = DVector::from_element(measured, self.variance.recip());
        for coordinate in 0..measured {
            let Some((configuration, misfit)) = rows.misfit_of(row, coordinate) else { continue };
            let Some(sums) = self.configurations.get(&(configuration, coordinate)) else {
                continue;
            };
            let factor = misfit / (self.variance * (self.variance + sums.squares));
            let mut line = sensitivity.row_mut(coordinate);
            line -= sums.sensitivity.transpose() * factor;
            residual[coordinate] -= factor * sums.residual;
            diagonal[coordinate] -= factor * misfit;
        }
        (sensitivity, residual, diagonal)
    }
}

/// Returns the difference of the temperature of `rows` from the reference \[K\], if the table
/// states both.
pub(super) fn warmth(
    problem: &Problem,
    measurements: &Measurements,
    rows: &[usize],
) -> Option<Vec<f64>> {
    let (temperature, reference) =
        (measurements.temperature.as_ref()?, problem.data.reference_temperature?);
    Some(rows.iter().map(|&row| temperature[row] - reference).collect())
}

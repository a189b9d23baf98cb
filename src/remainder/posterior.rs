//! Posterior of parameters and remainder: a linear model in features of the rows.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::kernel::{Hyperparameters, covariance, variance};
use super::prior::ParameterPrior;
use super::rows::{AXES, Inputs, Rows};
use crate::numeric::{gram, inverse_lower, lower_factor, product};

/// Share of its mean variance that is added to the covariance of the centres, against rounding.
const JITTER: f64 = 1e-9;

/// Gaussian posterior of the remainder's values at its centres and of the parameters.
///
/// With the centres' covariance K_c = L Lᵀ, a row has the features φ = (k(x, centres) L⁻ᵀ, J S½),
/// standard normal weights w before and N(ŵ, A⁻¹) after, A = I + ΦᵀN⁻¹Φ. Where all rows are
/// centres this is the Gaussian process itself; with fewer it is its fully independent training
/// conditional approximation, whose N also holds what the features leave of K
/// [Snelson & Ghahramani 2006].
#[derive(Debug, Clone)]
pub(super) struct Posterior {
    pub hyper: Hyperparameters,
    pub inputs: Inputs,
    pub prior: ParameterPrior,
    /// Rows that the functions are expanded about; their residuals and Jacobians are not used.
    pub centres: Rows,
    /// L⁻¹.
    inverse: DMatrix<f64>,
    /// Lower factor of A, and its inverse.
    pub factor: DMatrix<f64>,
    inverse_factor: DMatrix<f64>,
    /// ŵ.
    pub weights: DVector<f64>,
}

/// Posterior of the correction of one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowPosterior {
    /// Mean of measured − predicted by the fit \[m\].
    pub mean: Vector3<f64>,
    /// Its covariance, noise left out \[m²\].
    pub covariance: Matrix3<f64>,
    /// Prior variance of the remainder there, its trace \[m²\].
    pub prior: f64,
}

/// A row as predicted from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LeftOut {
    /// Measured − predicted \[m\].
    pub error: Vector3<f64>,
    /// Trace of the covariance of that, noise included \[m²\].
    pub variance: f64,
}

/// A posterior with what its training rows need to be left out again.
pub(super) struct Training {
    pub posterior: Posterior,
    /// Features of the rows, their noise taken off: N^(−½) Φ.
    whitened: DMatrix<f64>,
    /// N^(−½) y.
    target: DVector<f64>,
    /// Rows of each configuration with the factor of their noise.
    groups: Vec<(Vec<usize>, DMatrix<f64>)>,
    /// Φᵀ N⁻¹ y.
    projected: DVector<f64>,
}

fn coordinates(rows: &[usize]) -> Vec<usize> {
    rows.iter().flat_map(|&row| (0..AXES).map(move |axis| AXES * row + axis)).collect()
}

impl Posterior {
    /// Features of rows, shape = (3 rows, features).
    fn features(&self, rows: &Rows) -> DMatrix<f64> {
        features(&self.hyper, &self.inputs, (&self.centres, &self.inverse), &self.prior, rows)
    }

    /// Posterior restored from the factor of its precision, from the weights of the centres and
    /// from the change of the parameters; `None` where the centres' covariance is not positive
    /// definite.
    pub fn restored(
        (hyper, inputs): (Hyperparameters, Inputs),
        (centres, prior): (Rows, ParameterPrior),
        (factor, weights, change): (DMatrix<f64>, DVector<f64>, DVector<f64>),
    ) -> Option<Self> {
        let lower = centre_factor(&hyper, &inputs, &centres)?;
        let standard = lower.tr_mul(&weights);
        let parameters = (change - &prior.mean).component_div(&prior.spread);
        let all = standard.iter().chain(parameters.iter()).copied();
        let weights = DVector::from_iterator(standard.len() + parameters.len(), all);
        let (inverse, inverse_factor) = (inverse_lower(&lower), inverse_lower(&factor));
        Some(Self { hyper, inputs, prior, centres, inverse, factor, inverse_factor, weights })
    }

    /// Weights c of the centres: the remainder's mean at x is k(x, centres) c.
    pub fn kernel_weights(&self) -> DVector<f64> {
        self.inverse.tr_mul(&self.weights.rows(0, AXES * self.centres.len()))
    }

    /// Change of each parameter beside the remainder: m + S½ ŵ.
    pub fn parameters(&self) -> DVector<f64> {
        let first = self.weights.len() - self.prior.mean.len();
        let change = self.weights.rows_range(first..).component_mul(&self.prior.spread);
        &self.prior.mean + change
    }

    /// Posterior covariance of the parameters.
    pub fn parameter_covariance(&self) -> DMatrix<f64> {
        let (weights, parameters) = (self.factor.nrows(), self.prior.mean.len());
        let columns = self.inverse_factor.columns(weights - parameters, parameters);
        let scaled = self.prior.scale(&columns.into_owned());
        gram(&scaled)
    }

    /// Posterior of the correction at rows whose Jacobian has the columns of the prior.
    pub fn at(&self, rows: &Rows) -> Vec<RowPosterior> {
        let features = self.features(rows);
        let mean = &features * &self.weights + &rows.jacobian * &self.prior.mean;
        let spread = product(&features, &self.inverse_factor.transpose());
        let kernel = AXES * self.centres.len();
        let one = |row: usize| {
            let first = AXES * row;
            let block = |of: &DMatrix<f64>, columns: usize| {
                let of = of.view((first, 0), (AXES, columns));
                let product = of * of.transpose();
                Matrix3::from_fn(|a, b| product[(a, b)])
            };
            let prior = variance(&self.hyper, rows, row);
            let covariance = prior - block(&features, kernel) + block(&spread, spread.ncols());
            let mean = Vector3::from_fn(|a, _| mean[first + a]);
            RowPosterior { mean, covariance, prior: prior.trace() }
        };
        (0..rows.len()).into_par_iter().map(one).collect()
    }
}

/// Factor L of the covariance of the centres.
fn centre_factor(hyper: &Hyperparameters, inputs: &Inputs, centres: &Rows) -> Option<DMatrix<f64>> {
    let mut matrix = covariance(hyper, inputs, centres, centres);
    let jitter = JITTER * matrix.trace() / matrix.nrows().max(1) as f64;
    (0..matrix.nrows()).for_each(|k| matrix[(k, k)] += jitter);
    lower_factor(matrix)
}

fn features(
    hyper: &Hyperparameters,
    inputs: &Inputs,
    (centres, inverse): (&Rows, &DMatrix<f64>),
    prior: &ParameterPrior,
    rows: &Rows,
) -> DMatrix<f64> {
    let cross = covariance(hyper, inputs, rows, centres);
    let kernel = product(&cross, &inverse.transpose());
    let parameters = prior.scale(&rows.jacobian);
    let width = kernel.ncols();
    let mut all = kernel.resize_horizontally(width + parameters.ncols(), 0.0);
    all.columns_range_mut(width..).copy_from(&parameters);
    all
}

impl Training {
    /// Conditions on `rows`, with functions expanded about `centres`, places among the rows; `None`
    /// where rounding makes a matrix lose its definiteness.
    pub fn of(
        (rows, inputs): (&Rows, &Inputs),
        prior: &ParameterPrior,
        hyper: &Hyperparameters,
        centres: &[usize],
    ) -> Option<Self> {
        let centres = rows.select(if hyper.sites() == 0 { &[] } else { centres });
        let inverse = inverse_lower(&centre_factor(hyper, inputs, &centres)?);
        let mut whitened = features(hyper, inputs, (&centres, &inverse), prior, rows);
        let (mut target, _) = prior.reduce(rows);
        let kernel = AXES * centres.len();
        let groups: Option<Vec<_>> = rows
            .configurations()
            .into_iter()
            .map(|group| {
                let noise = noise(hyper, rows, (&group, &whitened, kernel), inputs);
                Some((group, lower_factor(noise)?))
            })
            .collect();
        let groups = groups?;
        for (group, factor) in &groups {
            let places = coordinates(group);
            let mut block = whitened.select_rows(&places);
            let mut left = target.select_rows(&places);
            factor.solve_lower_triangular_mut(&mut block);
            factor.solve_lower_triangular_mut(&mut left);
            for (k, &place) in places.iter().enumerate() {
                whitened.row_mut(place).copy_from(&block.row(k));
                target[place] = left[k];
            }
        }
        let n = whitened.ncols();
        let factor = lower_factor(DMatrix::identity(n, n) + gram(&whitened))?;
        let projected = whitened.tr_mul(&target);
        let weights = solved(&factor, &projected);
        let posterior = Posterior {
            hyper: hyper.clone(),
            inputs: inputs.clone(),
            prior: prior.clone(),
            centres,
            inverse,
            inverse_factor: inverse_lower(&factor),
            factor,
            weights,
        };
        Some(Self { posterior, whitened, target, groups, projected })
    }

    /// Every row as predicted without its configuration, in closed form.
    ///
    /// e_b = [K⁻¹]_bb⁻¹ [K⁻¹y]_b and V_b = [K⁻¹]_bb⁻¹ of the rows b of a configuration
    /// [Rasmussen & Williams 2006, section 5.4.2].
    pub fn without_each_configuration(&self) -> Vec<LeftOut> {
        let left = &self.target - &self.whitened * &self.posterior.weights;
        let inverse = &self.posterior.inverse_factor;
        let spread = product(&self.whitened, &inverse.transpose());
        let mut out = vec![LeftOut { error: Vector3::zeros(), variance: 0.0 }; left.len() / AXES];
        for (group, noise) in &self.groups {
            let places = coordinates(group);
            let of_group = spread.select_rows(&places);
            let n = places.len();
            let precision = DMatrix::identity(n, n) - &of_group * of_group.transpose();
            let Some(precision) = precision.cholesky() else { continue };
            let error = noise * precision.solve(&left.select_rows(&places));
            let variance = noise * precision.solve(&noise.transpose());
            enter(&mut out, group, &error, |k| variance[(k, k)]);
        }
        out
    }

    /// Every row as predicted without its block of configurations; `block` numbers the block of
    /// each row.
    pub fn without_each_block(&self, block: &[usize]) -> Option<Vec<LeftOut>> {
        let blocks = block.iter().max().map_or(0, |last| last + 1);
        let count = block.len();
        let whole = product(&self.posterior.factor, &self.posterior.factor.transpose());
        let one = |number: usize| {
            let groups: Vec<_> =
                self.groups.iter().filter(|(group, _)| block[group[0]] == number).collect();
            let places: Vec<usize> =
                groups.iter().flat_map(|(group, _)| coordinates(group)).collect();
            let features = self.whitened.select_rows(&places);
            let target = self.target.select_rows(&places);
            if groups.is_empty() {
                return Some(Vec::new());
            }
            let factor = lower_factor(&whole - gram(&features))?;
            let weights = solved(&factor, &(&self.projected - features.tr_mul(&target)));
            let left = target - &features * weights;
            let spread = product(&features, &inverse_lower(&factor).transpose());
            let mut out = Vec::new();
            let mut first = 0;
            for (group, noise) in groups {
                let n = AXES * group.len();
                let of_group = spread.rows(first, n);
                let covariance = DMatrix::identity(n, n) + of_group * of_group.transpose();
                let variance = noise * covariance * noise.transpose();
                out.push((group, noise * left.rows(first, n), variance));
                first += n;
            }
            Some(out)
        };
        let mut all = vec![LeftOut { error: Vector3::zeros(), variance: 0.0 }; count];
        for number in 0..blocks {
            for (group, error, variance) in one(number)? {
                enter(&mut all, group, &error, |k| variance[(k, k)]);
            }
        }
        Some(all)
    }
}

/// Enters the errors of a group of rows and the traces of their covariances.
fn enter(
    out: &mut [LeftOut],
    group: &[usize],
    error: &DVector<f64>,
    variance: impl Fn(usize) -> f64,
) {
    for (k, &row) in group.iter().enumerate() {
        let first = AXES * k;
        out[row] = LeftOut {
            error: Vector3::from_fn(|axis, _| error[first + axis]),
            variance: (first..first + AXES).map(&variance).sum(),
        };
    }
}

/// A⁻¹ b from the lower factor of A.
fn solved(factor: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let mut solution = right.clone();
    factor.solve_lower_triangular_mut(&mut solution);
    factor.tr_solve_lower_triangular_mut(&mut solution);
    solution
}

/// Noise of the rows of one configuration, and what their features leave of the remainder's prior.
fn noise(
    hyper: &Hyperparameters,
    rows: &Rows,
    (group, features, kernel): (&[usize], &DMatrix<f64>, usize),
    inputs: &Inputs,
) -> DMatrix<f64> {
    let n = AXES * group.len();
    let shared = hyper.shared_noise.powi(2);
    let mut noise = DMatrix::from_fn(n, n, |i, j| if i % AXES == j % AXES { shared } else { 0.0 });
    for (k, &row) in group.iter().enumerate() {
        for i in AXES * k..AXES * (k + 1) {
            noise[(i, i)] += (hyper.noise * rows.relative_sigma[row]).powi(2);
        }
    }
    if kernel > 0 {
        let members = rows.select(group);
        let seen = features.select_rows(&coordinates(group));
        let seen = seen.columns(0, kernel);
        noise += covariance(hyper, inputs, &members, &members) - seen * seen.transpose();
    }
    noise
}

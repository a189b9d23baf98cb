//! Posterior of parameters and remainder, computed as a linear model of features with Gaussian
//! weights.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::inducing::Inducing;
use super::kernel::{Hyperparameters, covariance, variance};
use super::prior::ParameterPrior;
use super::rows::{AXES, Inputs, Rows, coordinates};
use crate::numeric::parallel;
use crate::numeric::{gram, inverse_lower, lower_factor, product, product_with_upper};

/// Fraction of its variance that is added to each inducing variable, so that the covariance remains
/// positive definite despite rounding.
const JITTER: f64 = 1e-9;

/// Gaussian posterior of the inducing variables z and of the parameters.
///
/// With the covariance K_z = L Lᵀ of z, a row has the features φ = (k(x, z) L⁻ᵀ, J S½). The weights
/// w of the features are standard normal a priori. A posteriori they are N(ŵ, A⁻¹) with A = I +
/// ΦᵀN⁻¹Φ.
///
/// If all rows are centres, this is the exact Gaussian process. With fewer it is the fully
/// independent training conditional approximation. N then also contains the part of K that the
/// features do not represent. [Snelson & Ghahramani 2006]
#[derive(Debug, Clone)]
pub(super) struct Posterior {
    pub hyper: Hyperparameters,
    pub inputs: Inputs,
    pub prior: ParameterPrior,
    /// Inducing variables z, which represent the error functions.
    pub inducing: Inducing,
    /// Inverse L⁻¹ of the lower triangular factor of K_z.
    pub(super) inverse: DMatrix<f64>,
    /// Lower triangular factor of A, and its inverse.
    pub factor: DMatrix<f64>,
    pub(super) inverse_factor: DMatrix<f64>,
    /// Posterior mean ŵ of the weights of all features: those of the inducing variables, then those
    /// of the parameters.
    pub weights: DVector<f64>,
}

/// Posterior distribution of the correction of one row's position, in its three coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowPosterior {
    /// Mean of measured − predicted position, with the parameters at their fitted values in the
    /// prediction \[m\].
    pub mean: Vector3<f64>,
    /// Covariance of the correction, without measurement noise \[m²\].
    pub covariance: Matrix3<f64>,
    /// Trace of the remainder's prior covariance at the row \[m²\].
    pub prior: f64,
}

/// Posterior of the corrections of some rows, with their joint covariance as a factor.
#[derive(Debug, Clone)]
pub(super) struct RowFactors {
    /// Mean of measured − predicted position, three coordinates for each row \[m\].
    pub mean: DVector<f64>,
    /// Factor F of the part F Fᵀ of the covariance that the uncertain weights cause, shape = (3
    /// rows, features) \[m\].
    pub spread: DMatrix<f64>,
    /// For each row, the trace of the remainder's prior covariance \[m²\], and the part of that
    /// covariance that the features do not represent \[m²\].
    priors: Vec<(f64, Matrix3<f64>)>,
}

impl RowFactors {
    /// Returns the posterior of each row.
    pub fn rows(&self) -> Vec<RowPosterior> {
        let of_row = |row: usize| {
            let (prior, left) = self.priors[row];
            RowPosterior {
                mean: Vector3::from_fn(|axis, _| self.mean[AXES * row + axis]),
                covariance: left + outer_block(&self.spread, row, self.spread.ncols()),
                prior,
            }
        };
        parallel::map(self.priors.len(), of_row)
    }
}

impl RowFactors {
    /// Returns the joint covariance of the corrections of all rows \[m²\].
    pub fn covariance(&self) -> DMatrix<f64> {
        let mut whole = product(&self.spread, &self.spread.transpose());
        for (row, (_, left)) in self.priors.iter().enumerate() {
            let mut block = whole.fixed_view_mut::<AXES, AXES>(AXES * row, AXES * row);
            block += left;
        }
        whole
    }
}

/// Returns F Fᵀ for the three coordinates of a row, with F the first `columns` columns of the
/// matrix `of`.
fn outer_block(of: &DMatrix<f64>, row: usize, columns: usize) -> Matrix3<f64> {
    let block = of.view((AXES * row, 0), (AXES, columns));
    let product = block * block.transpose();
    Matrix3::from_fn(|a, b| product[(a, b)])
}

/// Error of a row's prediction by a posterior that was conditioned without the row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LeftOut {
    /// Measured − predicted position \[m\], measuring frame.
    pub error: Vector3<f64>,
    /// Covariance of the error, including measurement noise \[m²\].
    pub covariance: Matrix3<f64>,
}

/// Posterior, with the matrices from which training rows can be left out in closed form.
pub(super) struct Training {
    pub posterior: Posterior,
    /// Features of the training rows, whitened by their noise: N^(−½) Φ.
    whitened: DMatrix<f64>,
    /// Residuals of the training rows at the mean of the parameters' prior, whitened by their
    /// noise: N^(−½) y.
    target: DVector<f64>,
    /// Rows of each configuration, with the lower factor of their noise covariance.
    groups: Vec<Group>,
}

impl Posterior {
    /// Restores a posterior from the factor of A, the kernel weights c of the inducing variables,
    /// and the change of the parameters. Returns `None` if the covariance of the inducing variables
    /// is not positive definite.
    pub fn restored(
        (hyper, inputs): (Hyperparameters, Inputs),
        (inducing, prior): (Inducing, ParameterPrior),
        (factor, weights, change): (DMatrix<f64>, DVector<f64>, DVector<f64>),
    ) -> Option<Self> {
        let lower = inducing_factor(&hyper, &inputs, &inducing)?;
        let standard = lower.tr_mul(&weights);
        let parameters = (change - &prior.mean).component_div(&prior.spread);
        let values = standard.iter().chain(parameters.iter()).copied();
        let weights = DVector::from_iterator(standard.len() + parameters.len(), values);
        let (inverse, inverse_factor) = (inverse_lower(&lower), inverse_lower(&factor));
        Some(Self { hyper, inputs, prior, inducing, inverse, factor, inverse_factor, weights })
    }

    /// Returns the kernel weights c, with which the mean of the remainder at x is k(x, z) c.
    pub fn kernel_weights(&self) -> DVector<f64> {
        self.inverse.tr_mul(&self.weights.rows(0, self.inducing.len()))
    }

    /// Returns the change m + S½ ŵ of each parameter when it is fitted together with the remainder.
    pub fn parameters(&self) -> DVector<f64> {
        let first = self.weights.len() - self.prior.mean.len();
        let change = self.weights.rows_range(first..).component_mul(&self.prior.spread);
        &self.prior.mean + change
    }

    /// Returns the posterior covariance of the parameters, SI.
    pub fn parameter_covariance(&self) -> DMatrix<f64> {
        let (weights, parameters) = (self.factor.nrows(), self.prior.mean.len());
        let columns = self.inverse_factor.columns(weights - parameters, parameters);
        let scaled = self.prior.scale(&columns.into_owned());
        gram(&scaled)
    }

    /// Returns the matrix E with tr(Φ E Φᵀ) = prior − posterior variance of a row's correction. Φ
    /// is (k(x, z), J S½) at the row, and the prior variance is that of the remainder alone.
    pub fn explained(&self) -> DMatrix<f64> {
        let kernel = self.inducing.len();
        let precision = gram(&self.inverse_factor);
        let mut middle = -precision;
        (0..kernel).for_each(|k| middle[(k, k)] += 1.0);
        let n = middle.nrows();
        let mut outer = DMatrix::identity(n, n);
        outer.view_mut((0, 0), (kernel, kernel)).copy_from(&self.inverse);
        product(&outer.transpose(), &product(&middle, &outer))
    }

    /// Returns the posterior of the correction at `rows`, whose Jacobians have one column for each
    /// parameter of the prior.
    pub fn at(&self, rows: &Rows) -> Vec<RowPosterior> {
        self.factors(rows).rows()
    }

    /// Returns mean and covariance factor of the correction at `rows`.
    pub fn factors(&self, rows: &Rows) -> RowFactors {
        self.factors_of(&self.hyper, rows)
    }

    /// Returns mean and covariance factor of the correction by some of the Gaussian processes.
    /// `part` holds the hyperparameters with the amplitudes of all other processes set to 0.
    pub fn factors_of(&self, part: &Hyperparameters, rows: &Rows) -> RowFactors {
        let inducing = (&self.inducing, &self.inverse);
        let features = features(part, &self.inputs, inducing, &self.prior, rows);
        let kernel = self.inducing.len();
        let of_row = |row: usize| {
            let prior = variance(part, rows, row);
            (prior.trace(), prior - outer_block(&features, row, kernel))
        };
        RowFactors {
            mean: &features * &self.weights + &rows.jacobian * &self.prior.mean,
            spread: product_with_upper(&features, &self.inverse_factor.transpose()),
            priors: parallel::map(rows.len(), of_row),
        }
    }

    /// Returns the prediction errors of measured rows that were not used for training.
    pub fn left_out(&self, rows: &Rows) -> Vec<LeftOut> {
        let left_out = |(row, predicted): (usize, RowPosterior)| {
            let noise = self.hyper.noise_variance_of(rows.relative_sigma[row]);
            let measured = Vector3::from_fn(|axis, _| rows.residual[AXES * row + axis]);
            LeftOut {
                error: measured - predicted.mean,
                covariance: predicted.covariance + Matrix3::from_diagonal_element(noise),
            }
        };
        self.at(rows).into_iter().enumerate().map(left_out).collect()
    }
}

/// Returns the lower factor L of the covariance of the inducing variables; `None` if the covariance
/// is not positive definite.
fn inducing_factor(
    hyper: &Hyperparameters,
    inputs: &Inputs,
    inducing: &Inducing,
) -> Option<DMatrix<f64>> {
    let mut matrix = inducing.covariance(hyper, inputs);
    (0..matrix.nrows()).for_each(|k| matrix[(k, k)] *= 1.0 + JITTER);
    lower_factor(matrix)
}

/// Returns the features φ = (k(x, z) L⁻ᵀ, J S½) of `rows`, shape = (3 rows, features); `inverse` is
/// L⁻¹.
fn features(
    hyper: &Hyperparameters,
    inputs: &Inputs,
    (inducing, inverse): (&Inducing, &DMatrix<f64>),
    prior: &ParameterPrior,
    rows: &Rows,
) -> DMatrix<f64> {
    let cross = inducing.cross(hyper, inputs, rows);
    let kernel = product_with_upper(&cross, &inverse.transpose());
    let parameters = prior.scale(&rows.jacobian);
    let width = kernel.ncols();
    let mut joined = kernel.resize_horizontally(width + parameters.ncols(), 0.0);
    joined.columns_range_mut(width..).copy_from(&parameters);
    joined
}

impl Training {
    /// Conditions on `rows`, with inducing variables at the rows with the indices `centres` and at
    /// knots. Returns `None` if a matrix is not positive definite because of rounding.
    pub fn new(
        (rows, inputs): (&Rows, &Inputs),
        prior: &ParameterPrior,
        hyper: &Hyperparameters,
        centres: &[usize],
    ) -> Option<Self> {
        let inducing = Inducing::new(rows, centres, hyper, inputs);
        let inverse = inverse_lower(&inducing_factor(hyper, inputs, &inducing)?);
        let n = inducing.len() + prior.mean.len();
        let none = DMatrix::zeros(0, 0);
        let weights = DVector::zeros(n);
        let before = Posterior {
            hyper: hyper.clone(),
            inputs: inputs.clone(),
            prior: prior.clone(),
            inducing,
            inverse,
            factor: none.clone(),
            inverse_factor: none,
            weights: weights.clone(),
        };
        let (mut precision, mut pull) = (DMatrix::identity(n, n), weights);
        prior.add_information(&mut precision, &mut pull);
        Self::from_precision(before, (precision, pull), rows)
    }

    /// Conditions an earlier posterior on further rows, which are linearised about the same
    /// parameter values. Returns `None` if a matrix is not positive definite because of rounding.
    pub fn continued(earlier: &Posterior, rows: &Rows) -> Option<Self> {
        let precision = product_with_upper(&earlier.factor, &earlier.factor.transpose());
        let pull = &precision * &earlier.weights;
        Self::from_precision(earlier.clone(), (precision, pull), rows)
    }

    /// Conditions weights with the precision `precision` and the mean `precision`⁻¹ `pull` on
    /// `rows`. The weights and factors of `before` are replaced.
    fn from_precision(
        before: Posterior,
        (precision, pull): (DMatrix<f64>, DVector<f64>),
        rows: &Rows,
    ) -> Option<Self> {
        let Posterior { hyper, inputs, prior, inducing, inverse, .. } = &before;
        let mut whitened = features(hyper, inputs, (inducing, inverse), prior, rows);
        let mut target = prior.residuals(rows);
        let kernel = inducing.len();
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
            let mut target_of_block = target.select_rows(&places);
            factor.solve_lower_triangular_mut(&mut block);
            factor.solve_lower_triangular_mut(&mut target_of_block);
            for (k, &place) in places.iter().enumerate() {
                whitened.row_mut(place).copy_from(&block.row(k));
                target[place] = target_of_block[k];
            }
        }
        let factor = lower_factor(precision + gram(&whitened))?;
        let weights = solved(&factor, &(whitened.tr_mul(&target) + pull));
        let inverse_factor = inverse_lower(&factor);
        let posterior = Posterior { factor, inverse_factor, weights, ..before };
        Some(Self { posterior, whitened, target, groups })
    }

    /// Predicts each row of `judged` without the rows of its part, in closed form. `part` holds the
    /// index of the part to which each row belongs; rows of one configuration must share it.
    /// Returns `None` if a matrix is not positive definite because of rounding.
    pub fn without_each(&self, part: &[usize], judged: &[usize]) -> Option<Vec<LeftOut>> {
        let mut parts = vec![Vec::new(); part.iter().max().map_or(0, |last| last + 1)];
        for group in &self.groups {
            parts[part[group.0[0]]].push(group);
        }
        let mut is_judged = vec![false; part.len()];
        for &row in judged {
            is_judged[row] = true;
        }
        parts.retain(|groups: &Vec<&(Vec<usize>, DMatrix<f64>)>| {
            groups.iter().any(|(group, _)| is_judged[group[0]])
        });
        let of_groups = |groups: &[&Group]| -> Vec<usize> {
            groups.iter().flat_map(|(group, _)| coordinates(group)).collect()
        };
        // S = Φ L⁻ᵀ is computed for all small parts at once, and A once for all large parts.
        let width = self.whitened.ncols();
        let places: Vec<Vec<usize>> = parts.iter().map(|groups| of_groups(groups)).collect();
        let small: Vec<usize> =
            places.iter().filter(|of| of.len() <= width).flatten().copied().collect();
        let upper = self.posterior.inverse_factor.transpose();
        let spread = product_with_upper(&self.whitened.select_rows(&small), &upper);
        let row_of: HashMap<usize, usize> =
            small.iter().enumerate().map(|(row, &of)| (of, row)).collect();
        let factor = &self.posterior.factor;
        let whole = (small.len() < places.iter().map(Vec::len).sum())
            .then(|| product_with_upper(factor, &factor.transpose()));
        let without = |(groups, places): (&Vec<&Group>, &Vec<usize>)| {
            let judged = groups.iter().copied().filter(|(group, _)| is_judged[group[0]]);
            let judged: Vec<_> = judged.collect();
            let of_judged = of_groups(&judged);
            let predicted = match &whole {
                Some(whole) if places.len() > width => {
                    self.without_large(places, &of_judged, whole)?
                }
                _ => {
                    let rows: Vec<usize> = places.iter().map(|place| row_of[place]).collect();
                    self.without_small(places, &of_judged, &spread.select_rows(&rows))?
                }
            };
            let mut out = Vec::new();
            let mut first = 0;
            for (group, noise) in judged {
                let n = AXES * group.len();
                let error = noise * predicted.error.rows(first, n);
                let covariance = noise * predicted.covariance(first, n) * noise.transpose();
                for (k, &row) in group.iter().enumerate() {
                    let at = |a: usize| AXES * k + a;
                    let error = Vector3::from_fn(|a, _| error[at(a)]);
                    let covariance = Matrix3::from_fn(|a, b| covariance[(at(a), at(b))]);
                    out.push((row, LeftOut { error, covariance }));
                }
                first += n;
            }
            Some(out)
        };
        let each: Option<Vec<_>> = parts.par_iter().zip(&places).map(without).collect();
        let mut out = vec![LeftOut::default(); part.len()];
        each?.into_iter().flatten().for_each(|(row, left_out)| out[row] = left_out);
        Some(judged.iter().map(|&row| out[row]).collect())
    }

    /// Predicts the whitened coordinates `judged` without the coordinates `left_out`, which contain
    /// them. `spread` is their S = Φ L⁻ᵀ.
    ///
    /// For the left-out coordinates b, the errors are e_b = [K⁻¹]_bb⁻¹ [K⁻¹y]_b, with the
    /// covariance V_b = [K⁻¹]_bb⁻¹. [Rasmussen & Williams 2006, section 5.4.2] With A = L Lᵀ,
    /// [K⁻¹]_bb = I − S Sᵀ.
    fn without_small(
        &self,
        left_out: &[usize],
        judged: &[usize],
        spread: &DMatrix<f64>,
    ) -> Option<WhitenedErrors> {
        let n = left_out.len();
        let features = self.whitened.select_rows(left_out);
        let error = self.target.select_rows(left_out) - features * &self.posterior.weights;
        let precision = DMatrix::identity(n, n) - spread * spread.transpose();
        let root = inverse_lower(&lower_factor(precision)?);
        let error = root.tr_mul(&(&root * error));
        let place: HashMap<usize, usize> =
            left_out.iter().enumerate().map(|(place, &of)| (of, place)).collect();
        let of_judged: Vec<usize> = judged.iter().map(|of| place[of]).collect();
        Some(WhitenedErrors {
            error: error.select_rows(&of_judged),
            identity_factor: 0.0,
            root: root.select_columns(&of_judged),
        })
    }

    /// Predicts like [`Self::without_small`], but is faster if more coordinates than features are
    /// left out. `whole` is the precision A of the weights, and V_b = I + Φ_b (A − Φ_bᵀΦ_b)⁻¹ Φ_bᵀ.
    fn without_large(
        &self,
        left_out: &[usize],
        judged: &[usize],
        whole: &DMatrix<f64>,
    ) -> Option<WhitenedErrors> {
        let Posterior { factor, weights, .. } = &self.posterior;
        let features = self.whitened.select_rows(left_out);
        let lower = lower_factor(whole - gram(&features))?;
        // Φᵀy of the rows that are not left out.
        let target = self.target.select_rows(left_out);
        let projected = factor * factor.tr_mul(weights) - features.tr_mul(&target);
        let of_judged = self.whitened.select_rows(judged);
        let error = self.target.select_rows(judged) - &of_judged * solved(&lower, &projected);
        let root = product_with_upper(&of_judged, &inverse_lower(&lower).transpose()).transpose();
        Some(WhitenedErrors { error, identity_factor: 1.0, root })
    }
}

/// Rows of one configuration, and the lower factor of their noise covariance.
type Group = (Vec<usize>, DMatrix<f64>);

/// Errors of whitened coordinates that were predicted without these coordinates, and the covariance
/// of the errors.
struct WhitenedErrors {
    error: DVector<f64>,
    /// Number c and matrix R that give the covariance c I + RᵀR of the errors.
    identity_factor: f64,
    root: DMatrix<f64>,
}

impl WhitenedErrors {
    /// Returns the covariance of `count` errors from index `first` on.
    fn covariance(&self, first: usize, count: usize) -> DMatrix<f64> {
        let root = self.root.columns(first, count);
        DMatrix::identity(count, count) * self.identity_factor + root.tr_mul(&root)
    }
}

/// Returns A⁻¹ b, where `factor` is the lower factor of A and `right` is b.
fn solved(factor: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let mut solution = right.clone();
    factor.solve_lower_triangular_mut(&mut solution);
    factor.tr_solve_lower_triangular_mut(&mut solution);
    solution
}

/// Returns the noise covariance of one configuration's rows, plus the part of the remainder's prior
/// covariance that their features do not represent \[m²\].
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

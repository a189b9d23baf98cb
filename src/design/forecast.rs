//! Forecast of the errors of identification from given poses.

use nalgebra::{DMatrix, DVector};

use super::Sensitivity;
use crate::least_squares::{Identifiability, Uncertainty};
use crate::model::parameter::{Parameter, ParameterSite};
use crate::numeric::parallel;
use crate::quantity::Unit;

/// Part of a parameter, 0 to 1, that lies in undetermined combinations, from which on the forecast
/// gives no standard error for it.
const UNDETERMINED_SHARE: f64 = 1e-3;
/// Identified share up to which the forecast gives no standard error for a parameter.
const MIN_IDENTIFIED: f64 = 1e-6;

/// Expected result of the identification for one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedParameter {
    /// Name of the parameter, as in the problem file.
    pub name: String,
    /// Unit of the parameter.
    pub unit: Unit,
    /// Nominal value of the parameter, SI.
    pub nominal: f64,
    /// Standard deviation of the prior at the nominal value, SI; `None` without a prior.
    pub prior: Option<f64>,
    /// Expected standard error of the estimate, SI (for a logarithm times the nominal value);
    /// `None` if the data will not determine the parameter at all.
    pub std_error: Option<f64>,
    /// Expected identified share: part of the value that the data will determine, 0…1.
    pub identified: f64,
    /// Identified share at the nominal arm, 0…1. Other arms may separate parameters that are
    /// confounded there.
    pub identified_at_nominal: f64,
    /// True for a parameter of a base or target, false for one of the arm.
    pub is_placement: bool,
}

/// Expected result of the identification of all free parameters from a set of poses.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// Number of poses of the forecast.
    pub poses: usize,
    /// Identifiability by the measurements alone, without priors.
    pub identifiability: Identifiability,
    /// Forecast for every free parameter.
    pub expected: Vec<ExpectedParameter>,
    /// Expected covariance of the deviations x from nominal at the nominal arm, with undetermined
    /// combinations held fixed, shape = (parameters, parameters).
    pub covariance: DMatrix<f64>,
    /// Number of combinations that neither measurements nor priors determine.
    pub undetermined: usize,
}

/// Expected error of predicted positions over some poses \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Median over the poses of the root mean square error length \[m\].
    pub median: f64,
    /// 95 % quantile over the poses of the root mean square error length \[m\].
    pub quantile_95: f64,
    /// Root mean square error length over all poses \[m\].
    pub rms: f64,
}

impl Forecast {
    /// Smallest identified share at which a parameter counts as well identified.
    pub(crate) const WELL_IDENTIFIED: f64 = 0.9;

    /// Forecasts the identification from measurements with the given `sensitivity` and from the
    /// priors of `parameters`.
    #[doc(hidden)]
    pub fn new(parameters: &[Parameter], sensitivity: &Sensitivity) -> Self {
        let triangle = sensitivity.triangle();
        let identifiability = Identifiability::of(&triangle);
        let Posterior { covariance, variances, gauge, visible } =
            Posterior::of(&triangle, parameters);
        let expected = parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| {
                let mut expected = ExpectedParameter {
                    name: parameter.name.clone(),
                    unit: parameter.unit(),
                    nominal: parameter.nominal,
                    prior: parameter.sigma.map(|sigma| parameter.value_error(0.0, sigma)),
                    std_error: None,
                    identified: identifiability.visible[k],
                    identified_at_nominal: identifiability.visible[k],
                    is_placement: parameter.site.is_placement(),
                };
                if visible[k] > 1.0 - UNDETERMINED_SHARE {
                    expected.set_variance(parameter, variances[k]);
                }
                expected.identified_at_nominal = expected.identified;
                expected
            })
            .collect();
        Self {
            poses: sensitivity.len(),
            identifiability,
            expected,
            covariance,
            undetermined: gauge.nrows(),
        }
    }

    /// Replaces the standard errors by their root mean squares over other arms than the nominal
    /// one; `arms` holds the sensitivity of each.
    ///
    /// If a combination is unidentifiable at the nominal arm and has a wide prior, it is confounded
    /// with other parameters at other arms. Errors are then larger than the linearisation at the
    /// nominal arm predicts.
    #[must_use]
    pub(crate) fn over(mut self, parameters: &[Parameter], arms: &[Sensitivity]) -> Self {
        if arms.is_empty() {
            return self;
        }
        let variances =
            parallel::map_items(arms, |arm| Posterior::of(&arm.triangle(), parameters).variances);
        for (k, (expected, parameter)) in self.expected.iter_mut().zip(parameters).enumerate() {
            if expected.std_error.is_some() {
                let mean =
                    variances.iter().map(|of_arm| of_arm[k]).sum::<f64>() / arms.len() as f64;
                expected.set_variance(parameter, mean);
            }
        }
        self
    }

    /// Returns the expected error of positions that the identified arm predicts. `poses` is the
    /// sensitivity of the predicted poses for σ = 1 m, so that it is in metres.
    ///
    /// The error of a prediction J x has the covariance J C Jᵀ. Measurement noise is not included.
    pub(crate) fn prediction(&self, poses: &Sensitivity) -> Prediction {
        let mut squares: Vec<f64> = (0..poses.len())
            .map(|k| {
                let rows = poses.pose(k);
                (rows.transpose() * &self.covariance * rows).trace().max(0.0)
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        let count = squares.len().max(1);
        let percentile =
            |share: usize| squares.get((count - 1) * share / 100).copied().unwrap_or(0.0).sqrt();
        Prediction {
            median: percentile(50),
            quantile_95: percentile(95),
            rms: (squares.iter().sum::<f64>() / count as f64).sqrt(),
        }
    }

    /// Returns the number of parameters of the arm that will be identified to 90 % or more.
    pub(crate) fn well_identified(&self) -> usize {
        self.expected
            .iter()
            .filter(|expected| !expected.is_placement && expected.is_well_identified())
            .count()
    }
}

impl ExpectedParameter {
    /// Sets the standard error and the identified share for a variance of the parameter's deviation
    /// x.
    fn set_variance(&mut self, parameter: &Parameter, variance: f64) {
        if let Some(sigma) = parameter.sigma {
            self.identified = (1.0 - variance / (sigma * sigma)).clamp(0.0, 1.0);
        }
        let is_informed = self.identified > MIN_IDENTIFIED;
        self.std_error = is_informed.then(|| parameter.value_error(0.0, variance.sqrt()));
    }

    /// Returns true if the data will determine 90 % of the value or more.
    pub(crate) fn is_well_identified(&self) -> bool {
        self.identified >= Forecast::WELL_IDENTIFIED && self.std_error.is_some()
    }
}

/// Posterior of the unknowns given data and priors.
struct Posterior {
    /// Covariance of the deviations x of the unknowns, with undetermined combinations held fixed.
    covariance: DMatrix<f64>,
    /// Diagonal of the covariance: variances of the deviations x.
    variances: Vec<f64>,
    /// Rows that span the combinations of parameters that data and priors leave undetermined, shape
    /// = (combinations, parameters).
    gauge: DMatrix<f64>,
    /// Share of each unknown outside the undetermined combinations.
    visible: Vec<f64>,
}

impl Posterior {
    fn of(triangle: &DMatrix<f64>, parameters: &[Parameter]) -> Self {
        let n = parameters.len();
        let sigmas: Vec<Option<f64>> = parameters.iter().map(|parameter| parameter.sigma).collect();
        let Identifiability { gauge, visible, .. } =
            Identifiability::of(&with_priors(triangle, &sigmas));
        let covariance =
            Uncertainty::of(triangle, &sigmas, &gauge, &vec![false; n], 1.0).covariance;
        let variances = covariance.diagonal().iter().map(|variance| variance.max(0.0)).collect();
        Self { covariance, variances, gauge, visible }
    }
}

/// Returns the triangular factor R of data and priors together; `triangle` is that of the data, and
/// `sigmas` are those of the priors.
fn with_priors(triangle: &DMatrix<f64>, sigmas: &[Option<f64>]) -> DMatrix<f64> {
    let n = triangle.ncols();
    let mut stacked = DMatrix::zeros(2 * n, n);
    stacked.rows_mut(0, n).copy_from(triangle);
    let inverse =
        DVector::from_iterator(n, sigmas.iter().map(|sigma| sigma.map_or(0.0, f64::recip)));
    stacked.rows_mut(n, n).set_diagonal(&inverse);
    stacked.qr().unpack_r()
}

/// Returns the number of fixture unknowns without a prior on which none of `rows` depends. A plan
/// need not determine them, because no row uses the fixture.
pub(super) fn untouched(parameters: &[Parameter], rows: &[Option<&Sensitivity>]) -> usize {
    let is_informed =
        |k: usize| rows.iter().flatten().any(|of| of.rows.row(k).iter().any(|slope| *slope != 0.0));
    let is_free = |parameter: &Parameter| {
        matches!(parameter.site, ParameterSite::Fixture { .. }) && parameter.sigma.is_none()
    };
    (0..parameters.len()).filter(|&k| is_free(&parameters[k]) && !is_informed(k)).count()
}

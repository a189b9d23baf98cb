//! What identification from given poses will tell.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::Sensitivity;
use crate::least_squares::{Identifiability, Uncertainty};
use crate::model::parameter::Parameter;
use crate::quantity::Unit;

/// A part this large in combinations that stay open leaves a parameter without an error of its own.
const PARTLY_OPEN: f64 = 1e-3;
/// A parameter of which the data will give no more than this part has no standard error.
const NOTHING_LEARNED: f64 = 1e-6;

/// What is to be expected of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// Name as in the problem file.
    pub name: String,
    /// Kind of quantity.
    pub unit: Unit,
    /// Nominal value, SI.
    pub nominal: f64,
    /// 1 σ of the prior at the nominal value, SI.
    pub prior: Option<f64>,
    /// 1 σ of the estimate, SI (that of a logarithm times the nominal value); `None` where nothing
    /// will be learned.
    pub std_error: Option<f64>,
    /// Part of the value that the data will give, 0…1.
    pub identified: f64,
    /// The same at the nominal arm, where parameters may go together that other arms tell apart.
    pub identified_at_nominal: f64,
    /// Whether it belongs to a base or a target rather than to the arm.
    pub is_placement: bool,
}

/// What identification from a set of poses will tell about the free parameters.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// Number of poses.
    pub poses: usize,
    /// What the positions alone tell, priors left out.
    pub identifiability: Identifiability,
    /// Every free parameter.
    pub expected: Vec<Expected>,
    /// Covariance of x, unidentifiable combinations held, shape = (parameters, parameters).
    pub covariance: DMatrix<f64>,
    /// Combinations that neither positions nor priors see.
    pub open: usize,
}

/// Expected error of predicted positions over some poses \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Median over the poses of the root mean square length of the error.
    pub median: f64,
    /// The value that 95 % of the poses keep below.
    pub most: f64,
    /// Root mean square length over all poses.
    pub rms: f64,
}

impl Forecast {
    /// A share of the data from which a parameter counts as well identified.
    pub const WELL: f64 = 0.9;

    /// Of measurements in the poses of `sensitivity`, with the priors of `parameters`.
    pub fn new(parameters: &[Parameter], sensitivity: &Sensitivity) -> Self {
        let triangle = sensitivity.triangle();
        let identifiability = Identifiability::of(&triangle);
        let Known { covariance, variances, gauge, visible } = Known::of(&triangle, parameters);
        let expected = parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| {
                let mut expected = Expected {
                    name: parameter.name.clone(),
                    unit: parameter.unit(),
                    nominal: parameter.nominal,
                    prior: parameter.sigma.map(|sigma| parameter.value_error(0.0, sigma)),
                    std_error: None,
                    identified: identifiability.visible[k],
                    identified_at_nominal: identifiability.visible[k],
                    is_placement: parameter.site.is_placement(),
                };
                if visible[k] > 1.0 - PARTLY_OPEN {
                    expected.learn(parameter, variances[k]);
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
            open: gauge.nrows(),
        }
    }

    /// The same, with the errors to expect of arms that differ from the nominal one: root mean
    /// squares over what the poses tell about each of them, in `arms`.
    ///
    /// Where a combination is unidentifiable at the nominal arm and its prior is wide, other
    /// parameters go with it at other arms: their errors are larger than the nominal arm's
    /// linearisation says.
    #[must_use]
    pub fn over(mut self, parameters: &[Parameter], arms: &[Sensitivity]) -> Self {
        if arms.is_empty() {
            return self;
        }
        let variances: Vec<Vec<f64>> =
            arms.par_iter().map(|arm| Known::of(&arm.triangle(), parameters).variances).collect();
        for (k, (expected, parameter)) in self.expected.iter_mut().zip(parameters).enumerate() {
            if expected.std_error.is_some() {
                let mean = variances.iter().map(|own| own[k]).sum::<f64>() / arms.len() as f64;
                expected.learn(parameter, mean);
            }
        }
        self
    }

    /// How well the identified arm predicts positions elsewhere; `poses` in metres (σ = 1 m).
    ///
    /// The error of a prediction J x has the covariance J C Jᵀ. Noise of a measurement there comes
    /// on top.
    pub fn prediction(&self, poses: &Sensitivity) -> Prediction {
        let mut squares: Vec<f64> = (0..poses.len())
            .map(|k| {
                let rows = poses.pose(k);
                (rows.transpose() * &self.covariance * rows).trace().max(0.0)
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        let count = squares.len().max(1);
        let at =
            |share: usize| squares.get((count - 1) * share / 100).copied().unwrap_or(0.0).sqrt();
        Prediction {
            median: at(50),
            most: at(95),
            rms: (squares.iter().sum::<f64>() / count as f64).sqrt(),
        }
    }

    /// How many of the arm's parameters will be identified to 90 % or more.
    pub fn well_identified(&self) -> usize {
        self.expected
            .iter()
            .filter(|expected| !expected.is_placement && expected.is_well_identified())
            .count()
    }
}

impl Expected {
    /// Enters a variance of x.
    fn learn(&mut self, parameter: &Parameter, variance: f64) {
        if let Some(sigma) = parameter.sigma {
            self.identified = (1.0 - variance / (sigma * sigma)).clamp(0.0, 1.0);
        }
        let learned = self.identified > NOTHING_LEARNED;
        self.std_error = learned.then(|| parameter.value_error(0.0, variance.sqrt()));
    }

    /// Whether the data will give 90 % of the value or more.
    pub fn is_well_identified(&self) -> bool {
        self.identified >= Forecast::WELL && self.std_error.is_some()
    }
}

/// What data and priors leave of the unknowns.
struct Known {
    /// Of x, open combinations held.
    covariance: DMatrix<f64>,
    /// Its diagonal.
    variances: Vec<f64>,
    /// Rows that span the combinations that stay open.
    gauge: DMatrix<f64>,
    /// Part of each unknown outside of them.
    visible: Vec<f64>,
}

impl Known {
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

/// Triangular factor of data and priors together.
fn with_priors(triangle: &DMatrix<f64>, sigmas: &[Option<f64>]) -> DMatrix<f64> {
    let n = triangle.ncols();
    let mut stacked = DMatrix::zeros(2 * n, n);
    stacked.rows_mut(0, n).copy_from(triangle);
    let inverse =
        DVector::from_iterator(n, sigmas.iter().map(|sigma| sigma.map_or(0.0, f64::recip)));
    stacked.rows_mut(n, n).set_diagonal(&inverse);
    stacked.qr().unpack_r()
}

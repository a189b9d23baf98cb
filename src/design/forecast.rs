//! What identification from given poses will tell.

use nalgebra::{DMatrix, DVector};

use super::Sensitivity;
use crate::fit::{Identifiability, Uncertainty};
use crate::parameter::{Parameter, Unit};

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
    /// 1 σ of the estimate at the nominal value, SI; `None` where nothing will be learned.
    pub std_error: Option<f64>,
    /// Part of the value that the data will give, 0…1.
    pub identified: f64,
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
    /// Covariance of x, blind combinations held, shape = (parameters, parameters).
    pub covariance: DMatrix<f64>,
    /// Combinations that neither positions nor priors see.
    pub open: usize,
}

/// Expected error of predicted positions over some poses [m].
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
        let n = parameters.len();
        let triangle = sensitivity.triangle();
        let identifiability = Identifiability::of(&triangle);
        let sigmas: Vec<Option<f64>> = parameters.iter().map(|parameter| parameter.sigma).collect();
        let seen = Identifiability::of(&with_priors(&triangle, &sigmas));
        let uncertainty = Uncertainty::of(&triangle, &sigmas, &seen.gauge, &vec![false; n], 1.0);
        let errors = uncertainty.standard_errors();
        let expected = parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| {
                let identified = match parameter.sigma {
                    Some(sigma) => (1.0 - (errors[k] / sigma).powi(2)).clamp(0.0, 1.0),
                    None => identifiability.visible[k],
                };
                let known = seen.visible[k] > 1.0 - PARTLY_OPEN && identified > NOTHING_LEARNED;
                Expected {
                    name: parameter.name.clone(),
                    unit: parameter.unit(),
                    nominal: parameter.nominal,
                    prior: parameter.sigma.map(|sigma| parameter.value_error(0.0, sigma)),
                    std_error: known.then(|| parameter.value_error(0.0, errors[k])),
                    identified,
                    is_placement: parameter.slot.is_placement(),
                }
            })
            .collect();
        let open = seen.gauge.nrows();
        Self { poses: sensitivity.len(), identifiability, expected, covariance: uncertainty.covariance, open }
    }

    /// How well the identified arm predicts positions elsewhere; `poses` in metres (σ = 1 m).
    ///
    /// The error of a prediction J x has the covariance J C Jᵀ. Noise of a measurement there comes on top.
    pub fn prediction(&self, poses: &Sensitivity) -> Prediction {
        let mut squares: Vec<f64> = (0..poses.len())
            .map(|k| {
                let rows = poses.pose(k);
                (rows.transpose() * &self.covariance * rows).trace().max(0.0)
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        let count = squares.len().max(1);
        let at = |share: usize| squares.get((count - 1) * share / 100).copied().unwrap_or(0.0).sqrt();
        Prediction { median: at(50), most: at(95), rms: (squares.iter().sum::<f64>() / count as f64).sqrt() }
    }

    /// How many of the arm's parameters will be identified to 90 % or more.
    pub fn well_identified(&self) -> usize {
        self.expected.iter().filter(|expected| !expected.is_placement && expected.is_well_identified()).count()
    }
}

impl Expected {
    /// Whether the data will give 90 % of the value or more.
    pub fn is_well_identified(&self) -> bool {
        self.identified >= Forecast::WELL && self.std_error.is_some()
    }
}

/// Triangular factor of data and priors together.
pub(super) fn with_priors(triangle: &DMatrix<f64>, sigmas: &[Option<f64>]) -> DMatrix<f64> {
    let n = triangle.ncols();
    let mut stacked = DMatrix::zeros(2 * n, n);
    stacked.rows_mut(0, n).copy_from(triangle);
    let inverse = DVector::from_iterator(n, sigmas.iter().map(|sigma| sigma.map_or(0.0, f64::recip)));
    stacked.rows_mut(n, n).set_diagonal(&inverse);
    stacked.qr().unpack_r()
}

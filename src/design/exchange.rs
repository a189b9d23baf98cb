//! Exchange algorithm: replaces poses one by one by better candidates.

use nalgebra::{DMatrix, DVector};

use super::criterion::{Criterion, Measure, ScaledCriterion};
use super::greedy::Greedy;
use super::scan::CandidateScan;
use super::sensitivity::Sensitivity;
use crate::least_squares::Identifiability;
use crate::model::parameter::Parameter;

/// Fraction of the information of as many average candidates that is added to every set of poses.
/// It keeps the information of too few poses regular, so that sets can be compared.
const RIDGE: f64 = 1e-6;
/// Information added along each combination that neither candidates nor priors determine, which
/// holds the combination fixed; in scaled unknowns.
const FIXING_INFORMATION: f64 = 1e4;
/// Smallest decrease of the logarithm of the criterion in one sweep after which another one
/// follows.
const MIN_GAIN: f64 = 1e-6;
/// Maximum number of sweeps, each of which tries to exchange every pose once.
const MAX_SWEEPS: usize = 50;

/// Candidates and criterion of an exchange of poses.
///
/// Unknowns are scaled so that average candidates and priors give each of them unit information.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// Jᵀ of the candidates with respect to the scaled unknowns, shape = (unknowns, coordinates ·
    /// candidates).
    candidates: DMatrix<f64>,
    /// Number of measured coordinates of each candidate.
    coordinates: usize,
    /// Factor on each unknown, so that average candidates and priors give each of them unit
    /// information.
    scale: DVector<f64>,
    /// Information on the scaled unknowns without any candidate: priors, given poses, ridge.
    base_information: DMatrix<f64>,
    criterion: ScaledCriterion,
}

/// Properties of the unknowns of a design: the free parameters, followed by the weights of an
/// assumed misfit if there is one.
#[derive(Debug, Clone)]
pub(super) struct Unknowns {
    /// Standard deviation of the prior of each unknown; `None` without a prior.
    pub sigmas: Vec<Option<f64>>,
    /// True for parameters of bases and targets. A criterion measures their errors only if there
    /// are no other unknowns.
    pub placements: Vec<bool>,
}

impl Unknowns {
    /// Returns, for each free parameter, its prior σ and whether it belongs to a base or target.
    pub fn of(parameters: &[Parameter]) -> Self {
        Self {
            sigmas: parameters.iter().map(|parameter| parameter.sigma).collect(),
            placements: parameters.iter().map(|of| of.site.is_placement()).collect(),
        }
    }

    /// Adds `count` unknowns with standard normal priors.
    #[must_use]
    pub fn and_standard(mut self, count: usize) -> Self {
        self.sigmas.resize(self.sigmas.len() + count, Some(1.0));
        self.placements.resize(self.placements.len() + count, false);
        self
    }
}

/// Set of poses that exchanging any single pose does not improve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExchangeResult {
    /// Indices of the chosen candidates, in ascending order.
    pub chosen: Vec<usize>,
    /// Logarithm of the criterion at the start and after each sweep; never increases.
    pub values: Vec<f64>,
}

impl ExchangeResult {
    /// Returns the logarithm of the criterion at the end.
    pub fn value(&self) -> f64 {
        self.values.last().copied().unwrap_or(f64::INFINITY)
    }
}

impl Exchange {
    /// Prepares the exchange of `poses` poses, in addition to the poses `given`, which are measured
    /// in any case.
    ///
    /// Returns `None` if the information is not finite, because a candidate has no equilibrium, or
    /// if it is singular.
    pub fn new(
        parameters: &[Parameter],
        candidates: &Sensitivity,
        given: Option<&Sensitivity>,
        poses: usize,
        criterion: &Criterion,
    ) -> Option<Self> {
        Self::of(&Unknowns::of(parameters), candidates, given, poses, (criterion, None))
    }

    /// Prepares the exchange as [`new`](Self::new) does, for parameters and the weights of a
    /// misfit. The criterion I minimises tr(C M) with the matrix M `goal`, in the units of the
    /// unknowns.
    pub(super) fn of(
        unknowns: &Unknowns,
        candidates: &Sensitivity,
        given: Option<&Sensitivity>,
        poses: usize,
        (criterion, goal): (&Criterion, Option<&DMatrix<f64>>),
    ) -> Option<Self> {
        let n = unknowns.sigmas.len();
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(
            n,
            unknowns.sigmas.iter().map(|sigma| sigma.map_or(0.0, |sigma| sigma.powi(-2))),
        ));
        let mut average =
            candidates.information() * (poses as f64 / candidates.len().max(1) as f64);
        let mut base = &prior + &average * RIDGE;
        if let Some(given) = given {
            let information = given.information();
            average += &information;
            base += information;
        }
        let mut total = &average + &prior;
        let scale =
            DVector::from_fn(
                n,
                |k, _| {
                    if total[(k, k)] > 0.0 { total[(k, k)].sqrt() } else { 1.0 }
                },
            );
        let scaled = |mut matrix: DMatrix<f64>| {
            for j in 0..n {
                for i in 0..n {
                    matrix[(i, j)] /= scale[i] * scale[j];
                }
            }
            matrix
        };
        let rows = in_scale(candidates, &scale);
        let (scaled_prior, mut base) = (scaled(prior), scaled(base));
        total = scaled(total);
        if total.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let stacked = DMatrix::from_fn(n + candidates.rows.ncols(), n, |i, j| match i {
            i if i < n => scaled_prior[(i, j)].sqrt(),
            i => rows[(j, i - n)],
        });
        let unidentifiable = Identifiability::of(&stacked.qr().r()).gauge;
        let fixing = unidentifiable.transpose() * &unidentifiable * FIXING_INFORMATION;
        base += &fixing;
        total += &fixing;
        // A unit of a scaled unknown is `scale` units of the unknown.
        let goal =
            goal.map(|goal| DMatrix::from_fn(n, n, |i, j| goal[(i, j)] / (scale[i] * scale[j])));
        let criterion = criterion.scaled(&unknowns.placements, (&total, &scaled_prior), goal)?;
        Some(Self {
            candidates: rows,
            coordinates: candidates.coordinates,
            scale,
            base_information: base,
            criterion,
        })
    }

    /// Replaces the candidates; criterion and scale stay the same.
    #[must_use]
    pub fn with_candidates(&self, candidates: &Sensitivity) -> Self {
        Self {
            candidates: in_scale(candidates, &self.scale),
            coordinates: candidates.coordinates,
            ..self.clone()
        }
    }

    /// Starts a choice of poses one after the other, by the criterion I. Returns `None` for another
    /// criterion, or if the information without candidates is singular.
    pub(super) fn greedy(&self) -> Option<Greedy<'_>> {
        let Measure::Mean(goal) = &self.criterion.measure else { return None };
        Greedy::new((&self.candidates, self.coordinates), goal, &self.base_information)
    }

    /// Converts the matrix M of a goal tr(C M) to scaled unknowns.
    pub(super) fn scaled(&self, goal: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(goal.nrows(), goal.ncols(), |i, j| {
            goal[(i, j)] / (self.scale[i] * self.scale[j])
        })
    }

    /// Returns the number of candidates.
    pub fn candidates(&self) -> usize {
        self.candidates.ncols() / self.coordinates
    }

    /// Returns the logarithm of the criterion for a set of candidates, given by their indices.
    pub fn value(&self, chosen: &[usize]) -> f64 {
        self.criterion.value(&self.information(chosen.iter().copied()))
    }

    /// Exchanges each pose in turn for the best candidate until a sweep over all poses gains
    /// nothing (modified Fedorov exchange) [Cook & Nachtsheim 1980].
    ///
    /// No candidate is chosen twice. `swept` is called after every sweep.
    pub fn improve(
        &self,
        mut chosen: Vec<usize>,
        mut swept: impl FnMut(usize, f64),
    ) -> ExchangeResult {
        let mut values = vec![self.value(&chosen)];
        for sweep in 1..=MAX_SWEEPS {
            let before = values[values.len() - 1];
            let mut value = before;
            for index in 0..chosen.len() {
                let others =
                    (0..chosen.len()).filter(|&other| other != index).map(|other| chosen[other]);
                let Some(scan) = CandidateScan::new(&self.criterion, &self.information(others))
                else {
                    continue;
                };
                // A decrease within rounding is no gain.
                let limit = value - 1e-10 * value.abs().max(1.0);
                if let Some((better, gained)) =
                    scan.best((&self.candidates, self.coordinates), |k| !chosen.contains(&k), limit)
                {
                    (chosen[index], value) = (better, gained);
                }
            }
            let value = self.value(&chosen).min(before);
            values.push(value);
            swept(sweep, value);
            if before - value < MIN_GAIN {
                break;
            }
        }
        chosen.sort_unstable();
        ExchangeResult { chosen, values }
    }

    /// Returns the information on the scaled unknowns from priors, given poses and a set of
    /// candidates.
    fn information(&self, poses: impl Iterator<Item = usize>) -> DMatrix<f64> {
        let mut information = self.base_information.clone();
        for pose in poses {
            let rows = self.candidates.columns(self.coordinates * pose, self.coordinates);
            information.gemm(1.0, &rows, &rows.transpose(), 1.0);
        }
        information
    }
}

/// Returns Jᵀ with respect to the scaled unknowns.
fn in_scale(candidates: &Sensitivity, scale: &DVector<f64>) -> DMatrix<f64> {
    let mut rows = candidates.rows.clone();
    rows.column_iter_mut().for_each(|mut column| column.component_div_assign(scale));
    rows
}

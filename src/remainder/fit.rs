//! Fits a remainder beside the parameters of an identification, and decides whether it is kept.

use std::collections::HashSet;

use nalgebra::DVector;
use rand::seq::SliceRandom as _;

use super::blocks::blocks;
use super::correction::Correction;
use super::kernel::Hyperparameters;
use super::likelihood::MarginalLikelihood;
use super::linearise::{Linearisation, layout, prior, timed_poses};
use super::posterior::Training;
use super::prior::ParameterPrior;
use super::residuals::{CorrectedResiduals, residuals};
use super::rows::{AXES, Layout, Rows};
use super::scores::{Gain, LeftOutErrors, Scores};
use super::search::minimise;
use crate::fit::{Identification, IdentifyError, Placement};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::problem::{Observation, Problem};
use crate::random::stream;

/// Fewest configurations from which errors of predictions are judged.
const MIN_CONFIGURATIONS: usize = 10;
/// Fewest configurations to which a remainder is fitted.
const MIN_CONFIGURATIONS_FOR_REMAINDER: usize = 20;
/// Most rows that a correction is fitted to.
const MAX_ROWS: usize = 10_000;
/// Least share of σ² in the variance of a residual, against a rank that is lost by rounding.
const MIN_NOISE_SHARE: f64 = 1e-4;
/// Most rows from which hyperparameters are searched, and then refined: the time grows with their
/// cube.
const HYPER_ROWS: [usize; 2] = [150, 400];
/// Most rows that the functions are expanded about.
const MAX_CENTRES: usize = 500;
/// Most rows × centres²: the time grows with this product.
const MAX_CENTRE_WORK: usize = 500_000_000;
/// Lengths ℓᵤ and ℓᵥ from which hyperparameters are searched: each start reaches another optimum on
/// some of the arms measured.
const STARTS: [[f64; 2]; 3] = [[1.0, 1.0], [0.15, 0.15], [0.1, 3.0]];
/// Most steps of the search from each start, and of the refinement.
const MAX_STEPS: [usize; 2] = [60, 20];
/// Gain of the left-out error over its standard error above which a remainder is kept.
const MIN_GAIN: f64 = 3.0;
/// Gain in the logarithm of the marginal likelihood above which a remainder is kept. With few
/// configurations left-out errors follow the hyperparameters, which saw all of them. Of 24 simulated
/// arms without discrepancy none reached 4; measured arms reach 11 and more.
const MIN_EVIDENCE: f64 = 6.0;
/// Number of blocks of neighbouring configurations that are left out.
const BLOCKS: usize = 10;
/// Configurations that a block has at least on average.
const MIN_BLOCK: usize = 3;
/// Seed of the rows for hyperparameters and of the centres.
const SEED: u64 = 0x7265_6d61_696e;

/// What left-out configurations say of the predictions of an identified arm.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The identified arm itself, with the uncertainty of its predictions.
    pub alone: Correction,
    /// The arm corrected by a remainder, if that is kept.
    pub remainder: Option<Correction>,
    /// What a remainder gains on configurations left out, whether it is kept or not.
    #[doc(hidden)]
    pub gain: Option<Gain>,
    /// What the corrected arm leaves of all rows, where a remainder is kept.
    #[doc(hidden)]
    pub residuals: Option<CorrectedResiduals>,
    /// True if the remainder was read from a file that the problem declares.
    pub is_declared: bool,
}

impl Fitted {
    /// The same predictions with a remainder that the problem declares.
    ///
    /// # Errors
    /// Problem and data are not those identified.
    pub(crate) fn with_declared(
        self,
        remainder: Correction,
        (found, problem): (&Identification, &Problem),
        data: &Dataset,
    ) -> Result<Self, IdentifyError> {
        let residuals = Some(residuals(found, problem, data, &remainder)?);
        Ok(Self { remainder: Some(remainder), residuals, is_declared: true, ..self })
    }
}

/// Fits a remainder to the identification rows of `data` that are no outliers, beside the
/// parameters of `found`, and keeps it if configurations left out gain by more than three standard
/// errors.
///
/// Returns `None` for data that do not consist of positions, or have fewer than ten configurations.
///
/// # Errors
/// Problem and data are not those identified.
pub fn fit(
    found: &Identification,
    problem: &Problem,
    data: &Dataset,
) -> Result<Option<Fitted>, IdentifyError> {
    fitted((found, problem), data, true)
}

/// Uncertainty of the predictions of `found` without a remainder, as [`fit`].
///
/// # Errors
/// As [`fit`].
pub fn uncertainty(
    found: &Identification,
    problem: &Problem,
    data: &Dataset,
) -> Result<Option<Fitted>, IdentifyError> {
    fitted((found, problem), data, false)
}

fn fitted(
    (found, problem): (&Identification, &Problem),
    data: &Dataset,
    is_remainder_wanted: bool,
) -> Result<Option<Fitted>, IdentifyError> {
    let placement = Placement::of(&data.measurements);
    let model = found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let Some(setting) = Setting::new(found, problem, &model, data) else { return Ok(None) };
    let fitted = setting.fitted((found, problem), is_remainder_wanted);
    let Some(mut fitted) = fitted else { return Ok(None) };
    let corrected = fitted.remainder.as_ref().map(|kept| residuals(found, problem, data, kept));
    fitted.residuals = corrected.transpose()?;
    Ok(Some(fitted))
}

/// Training rows of an identification.
struct Setting {
    layout: Layout,
    /// Places of the free parameters.
    unknowns: Vec<usize>,
    rows: Rows,
    prior: ParameterPrior,
    /// Root mean square length of a residual \[m\].
    size: f64,
    configurations: Vec<Vec<usize>>,
}

impl Setting {
    fn new(
        found: &Identification,
        problem: &Problem,
        model: &Model,
        data: &Dataset,
    ) -> Option<Self> {
        let rows = training_rows(found, data)?;
        let times = (found.sigma, found.first_time);
        let poses = timed_poses(&data.measurements, &rows, times);
        let layout = layout(problem, model, &found.x, &poses);
        let is_free = |k: &usize| {
            let estimate = &found.estimates[*k];
            estimate.fitted && estimate.at_bound.is_none()
        };
        let unknowns = (0..found.estimates.len()).filter(is_free).collect();
        let mut linearisation =
            Linearisation { problem, model, x: &found.x, unknowns, sigma: found.sigma };
        let mut rows = linearisation.rows(&layout, poses);
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let is_usable = finite(rows.residual.as_slice())
            && finite(rows.jacobian.as_slice())
            && finite(rows.sites.as_slice());
        // Bases and tools of sessions that are held out have no column here.
        let seen: Vec<usize> =
            (0..rows.jacobian.ncols()).filter(|&j| rows.jacobian.column(j).amax() > 0.0).collect();
        rows.jacobian = rows.jacobian.select_columns(&seen);
        linearisation.unknowns = seen.iter().map(|&j| linearisation.unknowns[j]).collect();
        let prior = prior(model, &found.x, &linearisation.unknowns, &rows);
        let size = (rows.residual.norm_squared() / rows.len().max(1) as f64).sqrt();
        let configurations = rows.configurations();
        let enough = configurations.len() >= MIN_CONFIGURATIONS && size > 0.0;
        (is_usable && enough).then_some(Self {
            layout,
            unknowns: linearisation.unknowns,
            rows,
            prior,
            size,
            configurations,
        })
    }

    /// Predictions with and without a remainder; `None` where rounding spoils a factorisation.
    fn fitted(
        &self,
        (found, problem): (&Identification, &Problem),
        is_remainder_wanted: bool,
    ) -> Option<Fitted> {
        let sites = self.layout.joints.len();
        let training = |hyper: &Hyperparameters| {
            let centres = self.some_rows(self.centres(), 1);
            Training::of((&self.rows, &self.layout.inputs), &self.prior, hyper, &centres)
        };
        let alone = training(&self.noise())?;
        let count = BLOCKS.min(self.configurations.len() / MIN_BLOCK).max(2);
        let block = blocks(&self.rows, &self.layout.inputs, count);
        let left_out =
            |of: &Training| Some((of.without_each_configuration(), of.without_each_block(&block)?));
        let (single_alone, blocks_alone) = left_out(&alone)?;
        let judged = |of: &Training, single: &[_], blocks: &[_]| {
            let hyper = &of.posterior.hyper;
            let errors = LeftOutErrors::of(hyper, &self.rows, &single_alone, single);
            let of_blocks = LeftOutErrors::of(hyper, &self.rows, &blocks_alone, blocks);
            (errors, of_blocks)
        };
        let correction = |of: Training, errors: &LeftOutErrors, of_blocks: LeftOutErrors| {
            let scores = (errors.scores.clone(), of_blocks.scores);
            let scores = Scores::new(self.configurations.len(), scores.0, scores.1);
            Correction::new(found, problem, (&self.layout, &self.unknowns), of.posterior, scores)
        };
        let (errors_alone, of_blocks) = judged(&alone, &single_alone, &blocks_alone);
        let plain = correction(alone, &errors_alone, of_blocks);
        let enough = is_remainder_wanted
            && sites > 0
            && self.configurations.len() >= MIN_CONFIGURATIONS_FOR_REMAINDER;
        let beside =
            enough.then(|| self.hyperparameters()).flatten().and_then(|(hyper, evidence)| {
                let of = training(&hyper)?;
                let left = left_out(&of)?;
                Some((of, left, evidence))
            });
        let Some((of, (single, of_blocks), evidence)) = beside else {
            return Some(Fitted {
                alone: plain,
                remainder: None,
                gain: None,
                residuals: None,
                is_declared: false,
            });
        };
        let (errors, of_blocks) = judged(&of, &single, &of_blocks);
        let both = (errors_alone.errors.as_slice(), errors.errors.as_slice());
        let gain = Gain::of(&self.configurations, both, evidence);
        let remainder = (gain.ratio() > MIN_GAIN && evidence > MIN_EVIDENCE)
            .then(|| correction(of, &errors, of_blocks));
        Some(Fitted {
            alone: plain,
            remainder,
            gain: Some(gain),
            residuals: None,
            is_declared: false,
        })
    }

    /// Some rows of whole configurations, at most `count` of them unless one configuration has
    /// more.
    fn some_rows(&self, count: usize, number: u64) -> Vec<usize> {
        if self.rows.len() <= count {
            return (0..self.rows.len()).collect();
        }
        let mut configurations = self.configurations.clone();
        configurations.shuffle(&mut stream(SEED, number));
        let mut picked = Vec::new();
        for rows in configurations {
            if picked.len() + rows.len() > count && !picked.is_empty() {
                break;
            }
            picked.extend(rows);
        }
        picked.sort_unstable();
        picked
    }

    /// Number of rows that the functions are expanded about.
    fn centres(&self) -> usize {
        (MAX_CENTRE_WORK / self.rows.len().max(1)).isqrt().min(MAX_CENTRES)
    }

    /// True where rows of one configuration may share noise: a tenth of them repeats one.
    fn shares_noise(&self) -> bool {
        10 * self.configurations.len() < 9 * self.rows.len()
    }

    /// Noise of predictions without a remainder: σ² from the scatter within configurations, σ_c²
    /// from what their means scatter beyond that.
    fn noise(&self) -> Hyperparameters {
        let coordinate = |row: usize, axis: usize| self.rows.residual[AXES * row + axis];
        let coordinates = (AXES * self.rows.len()) as f64;
        let freedom = (coordinates - self.unknowns.len() as f64).max(1.0);
        let whole = self.rows.residual.norm_squared() / freedom;
        if !self.shares_noise() {
            return Hyperparameters::without_remainder(whole.sqrt(), 0.0);
        }
        let mut within = 0.0;
        for rows in &self.configurations {
            for axis in 0..AXES {
                let mean = rows.iter().map(|&row| coordinate(row, axis)).sum::<f64>();
                let mean = mean / rows.len() as f64;
                within +=
                    rows.iter().map(|&row| (coordinate(row, axis) - mean).powi(2)).sum::<f64>();
            }
        }
        let repeated = AXES * (self.rows.len() - self.configurations.len());
        let within = (within / repeated.max(1) as f64).clamp(MIN_NOISE_SHARE * whole, whole);
        Hyperparameters::without_remainder(within.sqrt(), (whole - within).sqrt())
    }

    /// Mean error of rows predicted without their configuration [m].
    fn left_out_error(&self, rows: &Rows, hyper: &Hyperparameters) -> Option<f64> {
        let centres: Vec<usize> = (0..rows.len()).collect();
        let training = Training::of((rows, &self.layout.inputs), &self.prior, hyper, &centres)?;
        let left_out = training.without_each_configuration();
        Some(left_out.iter().map(|row| row.error.norm()).sum::<f64>() / rows.len() as f64)
    }

    /// Hyperparameters of a local maximum of the marginal likelihood: searched on few of the rows
    /// from every start, taken where rows left out are predicted best, refined on more rows. With
    /// them comes the gain in the logarithm of the likelihood over noise alone.
    fn hyperparameters(&self) -> Option<(Hyperparameters, f64)> {
        let [few, more] = HYPER_ROWS.map(|count| self.rows.select(&self.some_rows(count, 0)));
        let function = |rows| {
            let shape = (self.layout.joints.len(), self.shares_noise());
            MarginalLikelihood::new((rows, &self.layout.inputs), &self.prior, shape, self.size)
        };
        let searched = function(&few);
        let bounds = searched.bounds();
        let minima = STARTS.iter().filter_map(|&lengths| {
            let value = |x: &DVector<f64>| searched.value_and_gradient(x);
            let minimum = minimise(value, searched.start(lengths), &bounds, MAX_STEPS[0])?;
            // Optima of nearly the same likelihood predict differently.
            let error = self.left_out_error(&few, &searched.hyperparameters(&minimum))?;
            Some((minimum, error))
        });
        let (mut best, _) = minima.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let refined = function(&more);
        let value = |x: &DVector<f64>| refined.value_and_gradient(x);
        if few.len() < more.len() {
            best = minimise(value, best, &bounds, MAX_STEPS[1])?;
        }
        let noise = MarginalLikelihood::new(
            (&more, &self.layout.inputs),
            &self.prior,
            (0, self.shares_noise()),
            self.size,
        );
        let alone = |x: &DVector<f64>| noise.value_and_gradient(x);
        let start = noise.start(STARTS[0]);
        let least = minimise(alone, start, &noise.bounds(), MAX_STEPS[0])?;
        let evidence = alone(&least)?.0 - value(&best)?.0;
        Some((refined.hyperparameters(&best), evidence))
    }
}

/// Identification rows that are no outliers, evenly spaced ones where they are very many;
/// `None` where some measure no position.
fn training_rows(found: &Identification, data: &Dataset) -> Option<Vec<usize>> {
    let outliers: HashSet<usize> = found.outliers.iter().map(|outlier| outlier.row).collect();
    let rows = data.split.identification.iter().copied().filter(|row| !outliers.contains(row));
    let rows: Vec<usize> = rows.collect();
    let measures_position = |&row: &usize| {
        matches!(data.measurements.observation(row), Observation::Position | Observation::Point(_))
    };
    if !rows.iter().all(measures_position) {
        return None;
    }
    let step = rows.len().div_ceil(MAX_ROWS).max(1);
    Some(rows.into_iter().step_by(step).collect())
}

//! Results of the commands `check` and `plan`: check.json and plan.json.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use super::effect::{EffectKeys, Untestable};
use super::identification::{Combination, Conditioning};
use crate::design::{self, Check, Criterion, PairSeparation, Plan, Prediction, PredictionPoses};
use crate::problem::{Effect, Problem};
use crate::quantity::Unit;
use crate::select::{self, Separation, Side};

/// Forecast of the results of measurements at some poses.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CheckResult {
    pub problem: String,
    pub poses: usize,
    pub sufficient: bool,
    pub rank: usize,
    /// Number of parameter combinations that a long series of poses of this kind determines.
    pub attainable_rank: usize,
    #[serde(flatten)]
    pub conditioning: Conditioning,
    pub parameters: Vec<ExpectedParameter>,
    pub unidentified: Vec<Combination>,
    /// Root mean square length of the error of one measured position; null if no length is
    /// measured.
    pub noise_mm: Option<f64>,
    pub prediction: JudgedPrediction,
    /// Forecast for smaller and larger numbers of such poses.
    pub growth: Vec<GrowthStep>,
    /// Smallest number of poses that determine `attainable_rank` combinations and predict with an
    /// rms error no larger than that of one measurement. Null if the series is too short.
    pub enough: Option<usize>,
    /// Smallest size of each effect that would be found.
    pub detectable: Detectable,
}

/// Planned poses and the accuracy that they are expected to give.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PlanResult {
    pub problem: String,
    pub criterion: &'static str,
    pub seed: u64,
    /// Number of planned poses.
    pub poses: usize,
    /// Number of poses that are already measured.
    pub given: usize,
    pub candidates: usize,
    /// Number of poses drawn to find candidates that cameras see; null if cameras do not measure,
    /// or if the candidates are rows of a table.
    pub drawn: Option<usize>,
    pub sufficient: bool,
    /// Logarithm of the criterion that the exchange algorithm reached from each of its starts.
    pub starts: Vec<f64>,
    /// Logarithm of the criterion of the plan.
    pub value: f64,
    /// Ratio of the standard errors of random poses to those of the plan: geometric mean of
    /// `random_std_error` / `std_error` over the parameters in `gain_over`.
    pub gain: Option<f64>,
    pub gain_over: Vec<String>,
    pub rank: usize,
    /// Number of parameter combinations that all candidates together determine.
    pub attainable_rank: usize,
    /// Smallest number of poses that can reach the rank `attainable_rank`.
    pub least_poses: usize,
    #[serde(flatten)]
    pub conditioning: Conditioning,
    pub parameters: Vec<ParameterForecast>,
    pub unidentified: Vec<Combination>,
    /// How well the plan distinguishes two effects; absent if that is not its purpose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation: Option<SeparationResult>,
}

/// Parameter with the standard error that the measurements are expected to give, SI units.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ExpectedParameter {
    pub name: String,
    pub unit: Cow<'static, str>,
    pub nominal: f64,
    pub prior_sigma: Option<f64>,
    pub std_error: Option<f64>,
    /// Expected identified share, 0 to 1: part of the value that the data will determine, over arms
    /// drawn from the priors.
    pub identified: f64,
    pub identified_at_nominal: f64,
}

/// Parameter with its expected standard error after the planned poses and after as many random
/// ones.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParameterForecast {
    #[serde(flatten)]
    pub expected: ExpectedParameter,
    pub random_std_error: Option<f64>,
}

/// Expected error of predicted positions.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct PredictionError {
    pub median_mm: f64,
    /// 95 % quantile of the expected error over the positions.
    pub most_mm: f64,
    pub rms_mm: f64,
}

/// Expected error of predicted positions, with the poses at which it is evaluated.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct JudgedPrediction {
    /// Poses at which the prediction is evaluated: `ranges` (drawn from ranges), `held-out`
    /// (held-out rows) or `same` (the checked poses).
    pub judged_in: &'static str,
    #[serde(flatten)]
    pub error: PredictionError,
    /// Expected root mean square of measured − predicted, with the noise of a measurement; null
    /// unless positions are measured.
    pub held_out_rms_mm: Option<f64>,
}

/// Forecast for one number of poses.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct GrowthStep {
    pub poses: usize,
    pub rank: usize,
    /// Number of parameter combinations that neither the poses nor the priors determine.
    pub open: usize,
    /// Number of parameters with an identified share of 90 % or more.
    pub well_identified: usize,
    #[serde(flatten)]
    pub error: PredictionError,
}

/// Smallest sizes of effects that would be found, SI units.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Detectable {
    /// Probability with which an effect of the stated size is found.
    pub power: f64,
    pub level: f64,
    /// True if the poses have no times, so that equal time steps were assumed.
    pub times_assumed: bool,
    pub effects: Vec<DetectableEffect>,
    pub untestable: Vec<Untestable>,
}

/// Effect with the detectable sizes of its parameters.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DetectableEffect {
    #[serde(flatten)]
    #[schemars(with = "EffectKeys")]
    pub effect: Effect,
    pub sizes: Vec<DetectableSize>,
}

/// Detectable size of the parameters of an effect that have one unit.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DetectableSize {
    pub parameters: Vec<String>,
    pub unit: Cow<'static, str>,
    pub prior_sigma: f64,
    /// Smallest size that is found even in the least visible combination of the parameters; null if
    /// no size is.
    pub found_from: Option<f64>,
    /// Smallest size that is found in the most visible combination of the parameters.
    pub found_from_at_best: Option<f64>,
}

/// How well poses distinguish two effects.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SeparationResult {
    /// Largest principal angle between the displacements by the two effects, 0 to 90; null if one
    /// of them displaces nothing.
    pub angle_deg: Option<f64>,
    pub random_angle_deg: Option<f64>,
    pub effects: [SeparatedEffect; 2],
}

/// Detectability of one of two effects with the planned poses; the keys `random_…` are medians over
/// random sets of poses.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SeparatedEffect {
    #[serde(flatten)]
    #[schemars(with = "EffectKeys")]
    pub effect: Effect,
    pub parameters: Vec<String>,
    #[serde(serialize_with = "super::parameter_value::serialize_symbol")]
    #[schemars(with = "String")]
    pub unit: Unit,
    /// Standard deviation (1 σ) of the prior of the parameters.
    pub prior_sigma: f64,
    /// Smallest size at which the effect is found; null if no size suffices.
    pub found_from: Option<f64>,
    pub random_found_from: Option<f64>,
    /// Smallest size at which the other effect is ruled out as an explanation; null if no size
    /// suffices.
    pub told_from: Option<f64>,
    pub random_told_from: Option<f64>,
    /// Assumed size of the effect, to which the p-values apply.
    pub size: f64,
    pub p_value: f64,
    pub random_p_value: f64,
}

impl CheckResult {
    /// Collects the result of a check.
    pub fn new(problem: &Problem, check: &Check) -> Self {
        let forecast = &check.forecast;
        let found = &forecast.identifiability;
        let noise = check.noise.filter(|_| check.noise_of == "position");
        let step = |step: &design::GrowthStep| GrowthStep {
            poses: step.poses,
            rank: step.rank,
            open: step.undetermined,
            well_identified: step.well_identified,
            error: (&step.prediction).into(),
        };
        let name = |k: usize| forecast.expected[k].name.clone();
        Self {
            problem: problem.name.clone(),
            poses: forecast.poses,
            sufficient: check.suffices(),
            rank: found.rank,
            attainable_rank: check.growth.attainable_rank,
            conditioning: Conditioning::new(found, check.coordinates),
            parameters: forecast.expected.iter().map(ExpectedParameter::new).collect(),
            unidentified: Combination::all(&found.unidentifiable, name),
            noise_mm: check.noise.map(|noise| noise * 1e3),
            prediction: JudgedPrediction {
                judged_in: match check.predicted_at {
                    PredictionPoses::Ranges => "ranges",
                    PredictionPoses::HeldOut => "held-out",
                    PredictionPoses::Same => "same",
                },
                error: (&check.prediction).into(),
                held_out_rms_mm: noise.map(|noise| check.prediction.rms.hypot(noise) * 1e3),
            },
            growth: check.growth.steps.iter().map(step).collect(),
            enough: check.growth.enough,
            detectable: Detectable::new(&check.detection),
        }
    }
}

impl PlanResult {
    /// Collects the result of a plan; `separated` is given if the plan is to distinguish two
    /// effects.
    pub fn new(
        problem: &Problem,
        criterion: &Criterion,
        seed: u64,
        plan: &Plan,
        separated: Option<&PairSeparation>,
    ) -> Self {
        let planned = &plan.planned;
        let (meaningful, name) = (plan.meaningful(), |k: usize| planned.expected[k].name.clone());
        let parameter = |(k, expected): (usize, &design::ExpectedParameter)| ParameterForecast {
            expected: ExpectedParameter::new(expected),
            random_std_error: plan.random_error(k),
        };
        Self {
            problem: problem.name.clone(),
            criterion: criterion.as_str(),
            seed,
            poses: plan.poses.len(),
            given: plan.given,
            candidates: plan.candidates,
            drawn: plan.drawn,
            sufficient: plan.suffices,
            starts: plan.starts.clone(),
            value: plan.value,
            gain: plan.gain(&meaningful),
            gain_over: meaningful.iter().map(|&k| name(k)).collect(),
            rank: planned.identifiability.rank,
            attainable_rank: plan.attainable_rank,
            least_poses: plan.least_poses,
            conditioning: Conditioning::new(&planned.identifiability, plan.coordinates),
            parameters: planned.expected.iter().enumerate().map(parameter).collect(),
            unidentified: Combination::all(&planned.identifiability.unidentifiable, name),
            separation: separated.map(SeparationResult::new),
        }
    }
}

impl ExpectedParameter {
    fn new(expected: &design::ExpectedParameter) -> Self {
        Self {
            name: expected.name.clone(),
            unit: expected.unit.symbol(),
            nominal: expected.nominal,
            prior_sigma: expected.prior,
            std_error: expected.std_error,
            identified: expected.identified,
            identified_at_nominal: expected.identified_at_nominal,
        }
    }
}

impl From<&Prediction> for PredictionError {
    fn from(prediction: &Prediction) -> Self {
        let [median_mm, most_mm, rms_mm] =
            [prediction.median, prediction.quantile_95, prediction.rms].map(|length| length * 1e3);
        Self { median_mm, most_mm, rms_mm }
    }
}

impl Detectable {
    fn new(detection: &select::Detection) -> Self {
        let size = |size: &select::Size| DetectableSize {
            parameters: size.parameters.clone(),
            unit: size.unit.symbol(),
            prior_sigma: size.prior,
            found_from: size.worst,
            found_from_at_best: size.best,
        };
        let effect = |detectable: &select::Detectable| DetectableEffect {
            effect: detectable.effect.clone(),
            sizes: detectable.sizes.iter().map(size).collect(),
        };
        let untestable = |(effect, reason): &(Effect, &'static str)| Untestable {
            effect: effect.clone(),
            reason,
        };
        Self {
            power: detection.power,
            level: detection.level,
            times_assumed: detection.times_assumed,
            effects: detection.effects.iter().map(effect).collect(),
            untestable: detection.untestable.iter().map(untestable).collect(),
        }
    }
}

impl SeparationResult {
    /// Collects how well a plan distinguishes two effects.
    pub fn new(separated: &PairSeparation) -> Self {
        let angle = |separation: &Separation| separation.angle;
        let random = Some(separated.random(angle)).filter(|angle| angle.is_finite());
        Self {
            angle_deg: separated.planned.angle.map(f64::to_degrees),
            random_angle_deg: random.map(f64::to_degrees),
            effects: [0, 1].map(|side| SeparatedEffect::new(separated, side)),
        }
    }
}

impl SeparatedEffect {
    fn new(separated: &PairSeparation, side: usize) -> Self {
        let planned = &separated.planned.sides[side];
        let median = |of: fn(&Side) -> Option<f64>| {
            Some(separated.random(|separation| of(&separation.sides[side])))
                .filter(|value| value.is_finite())
        };
        let random_found_from = median(|side| side.found.worst);
        let prior = planned.found.prior;
        let size = random_found_from.unwrap_or(prior).min(prior);
        Self {
            effect: separated.effects[side].clone(),
            parameters: planned.found.parameters.clone(),
            unit: planned.found.unit,
            prior_sigma: prior,
            found_from: planned.found.worst,
            random_found_from,
            told_from: planned.told.worst,
            random_told_from: median(|side| side.told.worst),
            size,
            p_value: planned.expected_p(size),
            random_p_value: separated
                .random(|separation| Some(separation.sides[side].expected_p(size))),
        }
    }
}

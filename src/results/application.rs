//! Results of commands that apply an estimate or prepare a problem: `predict` (errors.json),
//! `compensate`, `export` and `init` (with `--json`).

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::identification::Spread;
use super::remainder::BoundSummary;
use super::summary::Summary;
use crate::fit::{Command, ErrorsBySession, PointSpread};
use crate::problem::Problem;
use crate::remainder::{BoundTest, Bounds, Compared, Uncorrected};
use crate::urdf::{Chain, Description, names_of_joints};

/// Errors of predictions against measurements.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub struct PredictionErrors {
    /// Errors of all rows of the leading kind (positions, if there are any); absent if the rows
    /// contain no measurements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub all: Option<Summary>,
    /// Errors of each kind of rows, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<Summary>,
    pub sessions: BTreeMap<String, Summary>,
    /// Spread of the predicted target at each touched point, by the point's name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub spread: BTreeMap<String, SpreadAtPoint>,
    /// Share of the rows whose error is within its bound, 0 to 1; absent without bounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Probability that chance alone leaves as few of the configurations that were not fitted
    /// within their bounds; absent without bounds or such configurations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage_p_value: Option<f64>,
    #[serde(flatten)]
    pub bounds: Option<BoundSummary>,
}

/// Spread of the predicted target over the `n` rows at one point.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SpreadAtPoint {
    pub n: usize,
    #[serde(flatten)]
    pub spread: Spread,
}

impl PredictionErrors {
    /// Collects the errors of predictions and the spreads at touched points.
    pub fn new(errors: &ErrorsBySession, spreads: &[PointSpread]) -> Self {
        let spread = |spread: &PointSpread| {
            (spread.point.clone(), SpreadAtPoint { n: spread.n, spread: Spread::new(spread) })
        };
        let sessions = errors.sessions.iter();
        Self {
            all: Some(Summary::of(&errors.all)),
            kinds: errors.kinds.iter().map(Summary::of).collect(),
            sessions: sessions.map(|(name, errors)| (name.clone(), Summary::of(errors))).collect(),
            spread: spreads.iter().map(spread).collect(),
            coverage: None,
            coverage_p_value: None,
            bounds: None,
        }
    }

    /// Returns the errors with a summary of their bounds, with the share of measured positions that
    /// are within the bounds, and with the test of the bounds by rows that were not fitted.
    #[must_use]
    pub fn with_bounds(self, Compared { bounds, errors, test }: Compared) -> Self {
        let coverage = (!errors.is_empty()).then(|| bounds.coverage(errors.iter().copied()));
        let coverage_p_value = test.map(BoundTest::chance);
        Self { coverage, coverage_p_value, bounds: Some(BoundSummary::new(bounds)), ..self }
    }
}

/// Summary of the commands by which the arm reaches targets. Means are over the targets that are
/// reached.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CompensationResult {
    pub problem: String,
    pub targets: usize,
    pub reached: usize,
    /// Mean predicted distance to the targets with the commands of the file.
    pub mean_miss_before_mm: Option<f64>,
    /// Mean predicted distance to the targets with the commands found.
    pub mean_miss_mm: Option<f64>,
    pub mean_turn_before_deg: Option<f64>,
    pub mean_turn_deg: Option<f64>,
    /// Rows of the targets that cannot be reached, counted from 1.
    pub unreached: Vec<usize>,
    /// Declared effects of the instrument, by which commands are not corrected; the bounds include
    /// that the arm or its base moves by them instead.
    pub uncorrected: Vec<UncorrectedEffect>,
    #[serde(flatten)]
    pub bounds: Option<BoundSummary>,
}

/// Effect of the instrument, with what it changes in the readings at the targets.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UncorrectedEffect {
    /// Effect as declared in a problem.
    pub effect: String,
    pub rms_mm: f64,
    pub max_mm: f64,
}

/// Problem file that was written from a URDF.
#[derive(Debug, Serialize, JsonSchema)]
pub struct InitResult {
    pub problem: String,
    pub file: String,
    pub base: String,
    pub tip: String,
    /// Moving joints from base to tip, then those of each further branch.
    pub joints: Vec<String>,
    pub notes: Vec<String>,
}

impl CompensationResult {
    /// Counts the targets that are reached, and averages the distances over them.
    pub fn new(problem: &Problem, commands: &[Command]) -> Self {
        let (reached, missed): (Vec<&Command>, Vec<&Command>) =
            commands.iter().partition(|command| command.is_reached());
        let mean = |of: fn(&Command) -> Option<f64>, to: fn(f64) -> f64| {
            let values: Vec<f64> = reached.iter().filter_map(|command| of(command)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            Some(to(mean)).filter(|mean| mean.is_finite())
        };
        let mm: fn(f64) -> f64 = |length| length * 1e3;
        Self {
            problem: problem.name.clone(),
            targets: commands.len(),
            reached: reached.len(),
            mean_miss_before_mm: mean(|command| Some(command.seed_miss), mm),
            mean_miss_mm: mean(|command| Some(command.miss.norm()), mm),
            mean_turn_before_deg: mean(|command| command.seed_orientation_error, f64::to_degrees),
            mean_turn_deg: mean(|command| Some(command.turn?.norm()), f64::to_degrees),
            unreached: missed.iter().map(|command| command.row + 1).collect(),
            uncorrected: Vec::new(),
            bounds: None,
        }
    }

    /// Returns the result with the effects by which the commands are not corrected.
    #[must_use]
    pub fn with_uncorrected(self, uncorrected: &[Uncorrected]) -> Self {
        let each = |of: &Uncorrected| {
            let (rms, most) = of.sizes();
            let effect = of.effect.declaration();
            UncorrectedEffect { effect, rms_mm: rms * 1e3, max_mm: most * 1e3 }
        };
        Self { uncorrected: uncorrected.iter().map(each).collect(), ..self }
    }

    /// Returns the result with the expected error at the targets that are reached, and with its
    /// bounds, which `bounds` contains for all targets.
    #[must_use]
    pub fn with_bounds(self, bounds: &Bounds) -> Self {
        let is_reached = |target: &usize| !self.unreached.contains(&(target + 1));
        let reached: Vec<usize> = (0..bounds.poses.len()).filter(is_reached).collect();
        let of_reached = || BoundSummary::new(&bounds.of_poses(&reached));
        Self { bounds: (!reached.is_empty()).then(of_reached), ..self }
    }
}

impl InitResult {
    /// Collects the result of completing a `problem` into `description`, which was written to `file`.
    pub(crate) fn of_sheet(problem: &Problem, description: &Description, file: &Path) -> Self {
        let joints = problem.joints.iter();
        Self {
            problem: description.name.clone(),
            file: file.display().to_string(),
            base: "base".to_owned(),
            tip: problem.joints.last().map(|joint| joint.name.clone()).unwrap_or_default(),
            joints: joints
                .filter(|joint| joint.takes_command())
                .map(|joint| joint.name.clone())
                .collect(),
            notes: description.notes.clone(),
        }
    }

    /// Collects the result of converting a chain, with the `further` ones of a tree, into
    /// `description`, which was written to `file`.
    pub fn new(chain: &Chain, further: &[Chain], description: &Description, file: &Path) -> Self {
        let (base, tip) = chain.ends();
        Self {
            problem: description.name.clone(),
            file: file.display().to_string(),
            base: base.to_owned(),
            tip: tip.to_owned(),
            joints: names_of_joints(chain, further),
            notes: description.notes.iter().map(ToString::to_string).collect(),
        }
    }
}

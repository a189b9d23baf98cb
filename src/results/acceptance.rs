//! Result of the command `accept`: acceptance.json.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::identification::FindingKeys;
use super::remainder::BoundSummary;
use super::summary::{nominal_arm, rows_in};
use super::tables::commanded_joints;
use crate::fit::{Acceptance, Accuracy, Finding, Identification, ToleranceTest};
use crate::measurement::Measurements;
use crate::numeric::range;
use crate::problem::{HeldOut, Problem};
use crate::quantity::format::number;
use crate::remainder::{BoundTest, Bounds};

/// Input files of an acceptance record, and facts from the command line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AcceptanceRecord {
    /// Each input file with its SHA-256 digest; `None` if it cannot be read a second time.
    pub inputs: Vec<(PathBuf, Option<String>)>,
    /// Commit of the repository that holds the problem; `None` outside a repository.
    pub commit: Option<String>,
    /// Description of the measuring instrument, if the user gave one.
    pub instrument: Option<String>,
}

/// Accuracy in the held-out poses after ISO 9283, with the conditions of the measurement.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AcceptanceResult {
    pub problem: String,
    /// Version of flexcal.
    pub flexcal: &'static str,
    /// Commit of the repository of the problem.
    pub commit: Option<String>,
    /// SHA-256 digest of all declarations on which predictions depend.
    pub arm_digest: String,
    pub inputs: Vec<Input>,
    pub instrument: Option<String>,
    pub position_sigma_mm: Option<f64>,
    /// Description of the choice of the held-out poses.
    pub protocol: String,
    pub strategy: &'static str,
    pub solver: &'static str,
    pub trusted: bool,
    /// Findings of the checks of the fit.
    #[schemars(with = "Vec<FindingKeys>")]
    pub findings: Vec<Finding>,
    pub conditions: Vec<Condition>,
    pub identification_rows: usize,
    pub held_out_rows: usize,
    /// Number of held-out poses; one pose may be measured several times.
    pub poses: usize,
    /// Description of the nominal arm, with the parts that were fitted to the rows.
    #[serde(skip)]
    pub(crate) nominal_arm: String,
    /// Accuracy of the nominal arm, with base and tool fitted if they are free.
    pub before: PoseAccuracy,
    /// Accuracy of the identified arm.
    pub after: PoseAccuracy,
    /// Number of poses measured three times or more.
    pub repeated_poses: usize,
    /// Largest repeatability RP of the poses measured three times or more; null if there are none.
    pub repeatability_max_mm: Option<f64>,
    /// True if a remainder corrects the predictions of the identified arm.
    pub remainder: bool,
    /// Bounds of the errors of the held-out rows; null for fewer than ten configurations.
    pub bound: Option<CoveredBound>,
    /// Test of a tolerance; null if none is required.
    pub tolerance: Option<TestedTolerance>,
}

/// Summary of the error bounds of the held-out rows, with the share of rows within their bounds.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CoveredBound {
    #[serde(flatten)]
    pub bounds: BoundSummary,
    /// Share of the rows whose error is within its bound, 0 to 1.
    pub coverage: f64,
    /// Number of held-out rows that have an error and a bound.
    pub rows: usize,
    /// Probability that chance alone leaves as few held-out configurations within their bounds.
    pub coverage_p_value: f64,
    /// Comparison of the bounds with the held-out configurations.
    #[serde(skip)]
    pub(crate) test: BoundTest,
}

/// Test of a tolerance on the accuracy AP of the identified arm in the held-out poses.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TestedTolerance {
    /// `pass`, `fail`, or `undecided` if the poses are too few, or if a base or tool was fitted to
    /// the held-out rows or the arm to their poses, which then do not test the arm.
    pub verdict: &'static str,
    pub tolerance_mm: f64,
    /// Share of the poses that must be within the tolerance.
    pub share: f64,
    /// Largest acceptable probability of a wrong pass, which is also that of a wrong fail.
    pub risk: f64,
    pub poses: usize,
    /// Number of tested poses with an error above the tolerance, or without a prediction.
    pub beyond: usize,
    /// Lower and upper bound of the share of all poses within the tolerance; each bound is wrong
    /// with at most the probability `risk`.
    pub share_within: [f64; 2],
    /// Number of poses at which the test would pass if no more poses than now were beyond the
    /// tolerance; null above a million.
    pub poses_to_pass: Option<usize>,
    /// Reason for which the held-out poses do not test the arm; `None` if they do.
    #[serde(skip)]
    pub(crate) no_test: Option<&'static str>,
}

impl TestedTolerance {
    fn new(test: &ToleranceTest, no_test: Option<&'static str>) -> Self {
        Self {
            no_test,
            verdict: test.verdict.as_str(),
            tolerance_mm: test.tolerance.length * 1e3,
            share: test.tolerance.share,
            risk: test.tolerance.risk,
            poses: test.poses,
            beyond: test.beyond,
            share_within: test.share_within,
            poses_to_pass: test.poses_to_pass,
        }
    }
}

/// Input file with its digest.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Input {
    pub file: String,
    /// SHA-256 of the file; null if the file cannot be read a second time.
    pub sha256: Option<String>,
}

/// Range of a quantity over the held-out poses.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Condition {
    pub of: String,
    pub unit: String,
    pub range: (f64, f64),
}

/// Pose accuracy AP over the held-out poses. The AP of a pose is the distance from the predicted
/// position to the barycentre of the positions measured in this pose, after ISO 9283.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct PoseAccuracy {
    /// Mean of the AP over the held-out poses.
    pub mean_mm: f64,
    /// Bootstrap interval of `mean_mm` (95 %), over poses.
    pub interval_95_mm: [f64; 2],
    /// Root mean square of the AP over the held-out poses.
    pub rms_mm: f64,
    /// Largest AP of a held-out pose.
    pub max_mm: f64,
}

impl From<&Accuracy> for PoseAccuracy {
    fn from(accuracy: &Accuracy) -> Self {
        let Accuracy { mean, rms, max } = accuracy;
        Self {
            mean_mm: mean.value * 1e3,
            interval_95_mm: [mean.low * 1e3, mean.high * 1e3],
            rms_mm: rms * 1e3,
            max_mm: max * 1e3,
        }
    }
}

impl AcceptanceResult {
    /// Collects the record of an acceptance, without bounds and without a tolerance.
    pub fn new(
        problem: &Problem,
        rows: &Measurements,
        found: &Identification,
        judged: &Acceptance,
        record: &AcceptanceRecord,
    ) -> Self {
        let input = |(file, sha256): &(PathBuf, Option<String>)| Input {
            file: file.display().to_string(),
            sha256: sha256.clone(),
        };
        let repeatabilities = || judged.poses.iter().filter_map(|pose| pose.repeatability);
        Self {
            problem: problem.name.clone(),
            flexcal: env!("CARGO_PKG_VERSION"),
            commit: record.commit.clone(),
            arm_digest: problem.digest(),
            inputs: record.inputs.iter().map(input).collect(),
            instrument: record.instrument.clone(),
            position_sigma_mm: problem.data.position_sigma.map(|sigma| sigma * 1e3),
            protocol: protocol(problem, judged),
            strategy: found.strategy.as_str(),
            solver: found.solver.as_str(),
            trusted: found.is_trusted(),
            findings: found.findings.clone(),
            conditions: conditions(problem, rows, judged),
            identification_rows: rows_in(found, |errors| errors.identification),
            held_out_rows: found.fitted.held_out.n,
            poses: judged.poses.len(),
            nominal_arm: nominal_arm(found),
            before: (&judged.before).into(),
            after: (&judged.after).into(),
            repeated_poses: repeatabilities().count(),
            repeatability_max_mm: repeatabilities().max_by(f64::total_cmp).map(|most| most * 1e3),
            remainder: false,
            bound: None,
            tolerance: None,
        }
    }

    /// Returns the record with the error bounds of the held-out rows, the share (`coverage`) of
    /// rows within them, and the test of the bounds by these rows. `remainder` is true if a
    /// remainder corrects the predictions.
    #[must_use]
    pub fn with_bounds(
        self,
        bounds: &Bounds,
        (coverage, rows, test): (f64, usize, BoundTest),
        remainder: bool,
    ) -> Self {
        let bounds = BoundSummary::new(bounds);
        let coverage_p_value = test.chance();
        let bound = CoveredBound { bounds, coverage, rows, coverage_p_value, test };
        Self { remainder, bound: Some(bound), ..self }
    }

    /// Returns the record with the test of a tolerance by the `judged` poses.
    #[must_use]
    pub fn with_tolerance(self, test: &ToleranceTest, judged: &Acceptance) -> Self {
        Self { tolerance: Some(TestedTolerance::new(test, judged.no_test())), ..self }
    }
}

/// Describes how the held-out poses were chosen.
fn protocol(problem: &Problem, judged: &Acceptance) -> String {
    let chosen = match &problem.data.held_out {
        Some(HeldOut::Fraction { fraction, seed }) => {
            format!(
                "a random part of at least {} % of the configurations (seed {seed})",
                number(100.0 * fraction, 1).trim_end_matches(".0")
            )
        }
        Some(HeldOut::Session(name)) => {
            format!("every row of session {name}, to which its base and tool alone were fitted")
        }
        Some(HeldOut::Nothing) => "no rows".to_owned(),
        Some(HeldOut::Column(name)) => format!("rows that the column {name} marks as validation"),
        _ => "rows that the column split marks as validation".to_owned(),
    };
    let scope = if judged.are_poses_fitted {
        "the arm was fitted to other measurements of these poses"
    } else {
        "they took part in no fit of the arm and in no choice"
    };
    format!("held out: {chosen}; {scope}")
}

/// Returns the range of each quantity over the held-out poses: commands, measured positions, and
/// the optional columns.
fn conditions(problem: &Problem, rows: &Measurements, judged: &Acceptance) -> Vec<Condition> {
    let rows_judged = || judged.poses.iter().flat_map(|pose| pose.rows.iter().copied());
    let condition = |of: &str, unit: &str, value: &dyn Fn(usize) -> f64| Condition {
        of: of.to_owned(),
        unit: unit.to_owned(),
        range: range(rows_judged().map(value)),
    };
    let joints = commanded_joints(problem).into_iter().map(|joint| {
        condition(&joint.name(), &joint.symbol(), &|row| {
            rows.configuration(row)[joint.joint] * joint.factor()
        })
    });
    let axes = ["x", "y", "z"].into_iter().enumerate();
    let positions =
        axes.map(|(axis, name)| condition(name, "mm", &|row| rows.positions[row][axis] * 1e3));
    let columns = [
        ("temperature", "°C", &rows.temperature),
        ("payload", "kg", &rows.payload),
        ("hoist", "N", &rows.hoist),
    ];
    let measured = columns.into_iter().filter_map(|(name, unit, values)| {
        values.as_ref().map(|values| condition(name, unit, &|row| values[row]))
    });
    joints.chain(positions).chain(measured).collect()
}

//! Result of `accept`: acceptance.json.

use schemars::JsonSchema;
use serde::Serialize;

use super::document::Document;
use crate::fit::Accuracy;

/// Accuracy of the held-out poses, counted after ISO 9283, with the conditions of the measurement.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AcceptanceResult {
    pub problem: String,
    /// Version of the program.
    pub flexcal: &'static str,
    /// Commit of the repository of the problem.
    pub commit: Option<String>,
    /// SHA-256 of all declarations that predictions depend on.
    pub arm_digest: String,
    pub inputs: Vec<Input>,
    pub instrument: Option<String>,
    pub position_sigma_mm: Option<f64>,
    /// Description of the choice of the held-out poses.
    pub protocol: String,
    pub strategy: &'static str,
    pub solver: &'static str,
    pub trusted: bool,
    pub conditions: Vec<Condition>,
    pub identification_rows: usize,
    pub held_out_rows: usize,
    /// Number of held-out poses; one pose may be measured several times.
    pub poses: usize,
    /// Accuracy of the nominal arm.
    pub before: PoseAccuracy,
    /// Accuracy of the identified arm.
    pub after: PoseAccuracy,
    /// Number of poses measured three times or more.
    pub repeated_poses: usize,
    /// Largest repeatability RP of these poses.
    pub repeatability_max_mm: Option<f64>,
}

impl Document for AcceptanceResult {
    const FORMAT: &'static str = "flexcal-acceptance";
}

/// Input file with its digest.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Input {
    pub file: String,
    /// Null if the file cannot be read again.
    pub sha256: Option<String>,
}

/// Range of a quantity over the held-out poses.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Condition {
    pub of: String,
    pub unit: String,
    pub range: (f64, f64),
}

/// Pose accuracy AP over the held-out poses.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct PoseAccuracy {
    pub mean_mm: f64,
    /// Bootstrap interval of the mean, 95 %.
    pub interval_95_mm: [f64; 2],
    pub rms_mm: f64,
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

//! Result of the command `fleet`, printed with `--json`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::life::{Fleet, FleetArm, FleetParameter};

/// Mean and spread of the parameters of arms of one type.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FleetResult {
    pub problem: String,
    pub parameters: Vec<FleetParameterResult>,
    /// Names of parameters that have no variance in some estimate, and are left out.
    pub parameters_left_out: Vec<String>,
    pub arms: Vec<FleetArmResult>,
}

/// Parameter of the fleet. Mean and spread are those of the deviations from nominal, SI; for
/// stiffnesses, of their logarithms.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FleetParameterResult {
    pub name: String,
    /// SI unit of the value.
    pub unit: String,
    pub nominal: f64,
    pub mean: f64,
    pub mean_error: f64,
    /// Standard deviation about the mean that the next arm is expected to have: the spread of these
    /// arms, shrunk towards the data sheet.
    pub spread: f64,
    /// Declared 1 σ of the prior; null without a prior.
    pub declared: Option<f64>,
}

/// Arm of the fleet, compared with the others.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FleetArmResult {
    pub file: String,
    /// True if the arm is unlike the others: an arm like them would deviate as much with a
    /// probability below 1 %.
    pub unlike: bool,
    /// Parameter that deviates most from the other arms; null if the rows do not determine any.
    pub parameter: Option<String>,
    /// Deviation of that parameter from the other arms, in its standard deviations.
    pub sigmas: Option<f64>,
}

impl FleetResult {
    /// Converts the mean, the spread and the arms of a fleet.
    pub fn new(fleet: &Fleet) -> Self {
        let parameter = |parameter: &FleetParameter| FleetParameterResult {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            nominal: parameter.nominal,
            mean: parameter.mean,
            mean_error: parameter.mean_error,
            spread: parameter.spread,
            declared: parameter.declared,
        };
        let arm = |arm: &FleetArm| FleetArmResult {
            file: arm.file.display().to_string(),
            unlike: arm.is_unlike,
            parameter: arm.most.as_ref().map(|most| most.0.clone()),
            sigmas: arm.most.as_ref().map(|most| most.1),
        };
        Self {
            problem: fleet.problem.clone(),
            parameters: fleet.parameters.iter().map(parameter).collect(),
            parameters_left_out: fleet.left_out.clone(),
            arms: fleet.arms.iter().map(arm).collect(),
        }
    }
}

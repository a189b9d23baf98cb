//! What the figures of a report show, as numbers: errors pose by pose, correlations, residuals against their cause.
//!
//! - `states`: the arm before, with elasticity, after the loop, and its errors on held-out poses; with geometry alone where a
//!   comparison has it. `cause`: the residual against what drives a found effect. `trend`: the same for
//!   structure that no effect explains.

mod cause;
mod joint;
mod states;
mod trend;

use nalgebra::Vector3;

use crate::diagnose::{ClosedLoop, Findings, examine};
use crate::identify::{Comparison, Identification, IdentifyError, Noise, Placement, Strategy};
use crate::measurement::Dataset;
use crate::model::{Ablation, Model};
use crate::problem::Problem;

pub use crate::identify::Correlations;
pub use cause::{Abscissa, Cause, Ordinate, Point};
pub use states::{Stand, State};

use states::{Arm, Sight};

/// A pose and what a fit leaves of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Row of the measurements, counted from 0.
    pub row: usize,
    /// Whether it was held out.
    pub held_out: bool,
    /// Measured position, measuring frame [m].
    pub position: Vector3<f64>,
    /// Residual measured − predicted, measuring frame [m].
    pub error: Vector3<f64>,
    /// 1 σ of each coordinate [m].
    pub sigma: f64,
    /// Time [s], or the row's number where no time was measured.
    pub time: f64,
}

/// Everything that the figures of one report show.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Numbers of the held-out rows, counted from 0.
    pub held_out: Vec<usize>,
    /// States of the arm, from the nominal one to the best.
    pub states: Vec<State>,
    /// What the best leaves, pose by pose, in the order of the rows.
    pub residuals: Vec<Residual>,
    /// Whether `time` of the residuals was measured.
    pub time_measured: bool,
    /// Checks of what it leaves of the fitted poses.
    pub findings: Findings,
    /// Correlations of its parameters.
    pub correlations: Correlations,
    /// The residual against the cause of each found effect, in the order in which they were found.
    pub causes: Vec<Cause>,
    /// The residual against what structure without a cause depends on.
    pub trend: Option<Cause>,
}

/// The picture of one identification.
///
/// # Errors
/// Problem and data do not fit each other.
pub fn of_identification(problem: &Problem, data: &Dataset, found: &Identification) -> Result<Picture, IdentifyError> {
    let sight = Sight::new(data);
    let fitted = Arm::of(problem, &sight, found)?;
    let states = vec![sight.registered(&fitted, found), sight.identified(&fitted, found)];
    let findings = examine(problem, data, found)?;
    Ok(sight.picture(states, &fitted, found, (sigma_of(problem, found, &sight), findings)))
}

/// The picture of a comparison: of its joint fit, and of geometry alone.
///
/// # Errors
/// Problem and data do not fit each other.
pub fn of_comparison(problem: &Problem, data: &Dataset, comparison: &Comparison) -> Result<Picture, IdentifyError> {
    let sight = Sight::new(data);
    let fitted = Arm::of(problem, &sight, &comparison.joint)?;
    let mut states = vec![sight.registered(&fitted, &comparison.joint)];
    if states::is_elastic(&fitted.model) {
        let rigid = Arm { model: fitted.model.ablated(Ablation::Rigid), x: comparison.rigid.x.clone() };
        states.push(sight.state(Stand::GeometryOnly, &rigid));
    }
    states.push(sight.identified(&fitted, &comparison.joint));
    let findings = examine(problem, data, &comparison.joint)?;
    Ok(sight.picture(states, &fitted, &comparison.joint, (sigma_of(problem, &comparison.joint, &sight), findings)))
}

/// The picture of a closed loop, with the cause of every effect that it found.
///
/// # Errors
/// Problem and data do not fit each other.
pub fn of_closure(problem: &Problem, data: &Dataset, closure: &ClosedLoop) -> Result<Picture, IdentifyError> {
    let sight = Sight::new(data);
    let before = Arm::of(problem, &sight, &closure.before.fit)?;
    let after = Arm::of(&closure.closed, &sight, &closure.after)?;
    let states = vec![
        sight.registered(&before, &closure.before.fit),
        sight.identified(&before, &closure.before.fit),
        sight.state(Stand::Closed, &after),
    ];
    let sigma = sigma_of(&closure.closed, &closure.after, &sight);
    let mut picture = sight.picture(states, &after, &closure.after, (sigma, closure.findings.clone()));
    picture.causes =
        closure.effects.iter().filter_map(|found| cause::of(&found.effect, &closure.closed, &after, &sight)).collect();
    picture.trend = closure.unexplained.as_ref().and_then(|left| trend::of(left, &closure.closed));
    Ok(picture)
}

/// 1 σ of a coordinate in rows without one of their own [m].
fn sigma_of(problem: &Problem, found: &Identification, sight: &Sight) -> f64 {
    match found.noise {
        Noise::Estimated(sigma) => sigma,
        Noise::Declared | Noise::Unknown => {
            sight.placement.sigma(sight.measurements, &sight.split.identification, problem)
        }
    }
}

impl Sight<'_> {
    fn identified(&self, arm: &Arm, found: &Identification) -> State {
        let elastic = states::is_elastic(&arm.model) && found.strategy != Strategy::GeometryOnly;
        self.state(if elastic { Stand::Elastic } else { Stand::Identified }, arm)
    }

    fn picture(
        &self,
        states: Vec<State>,
        best: &Arm,
        found: &Identification,
        (sigma, findings): (f64, Findings),
    ) -> Picture {
        let rows: Vec<usize> = (0..self.measurements.len()).collect();
        let poses = self.placement.poses(self.measurements, &rows, sigma);
        let errors = self.errors(best, &rows);
        let residual = |((row, pose), error): ((usize, &crate::model::Pose), Vector3<f64>)| Residual {
            row,
            held_out: self.split.held_out.binary_search(&row).is_ok(),
            position: pose.measured,
            error,
            sigma: pose.sigma,
            time: if self.measurements.time_measured { pose.setup.time } else { (row + 1) as f64 },
        };
        Picture {
            held_out: self.split.held_out.clone(),
            states,
            residuals: rows.iter().copied().zip(&poses).zip(errors).map(residual).collect(),
            time_measured: self.measurements.time_measured,
            findings,
            correlations: found.correlations(),
            causes: Vec::new(),
            trend: None,
        }
    }
}

/// The model of a problem with the bases and targets of its measurements.
fn model_of(problem: &Problem, placement: &Placement) -> Result<Model, IdentifyError> {
    Ok(Model::new(problem, &placement.bases, &placement.targets)?)
}

//! An arm among its measurements: errors pose by pose, and how positions answer to one coordinate.

use nalgebra::{DVector, Vector3};

use crate::fit::{Identification, IdentifyError, Placement};
use crate::least_squares::jacobian;
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::Problem;

/// A pose whose position moves by less than this part of the most is left out: it says little about
/// the coordinate.
pub const LEAST_LEVER: f64 = 0.1;

/// Measurements with what their poses need.
pub struct Poses<'a> {
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: Placement,
}

/// An arm that predicts.
#[derive(Debug, Clone)]
pub struct Arm {
    pub model: Model,
    /// Full parameter vector.
    pub x: DVector<f64>,
}

impl<'a> Poses<'a> {
    pub fn new(data: &'a Dataset) -> Self {
        let Dataset { measurements, split } = data;
        Self { measurements, split, placement: Placement::of(measurements) }
    }

    /// The arm of `problem` as identified.
    pub fn arm(&self, problem: &Problem, found: &Identification) -> Result<Arm, IdentifyError> {
        let model = Model::new(problem, &self.placement.bases, &self.placement.targets)?;
        Ok(Arm { model: found.strategy.model(model), x: found.x.clone() })
    }

    /// Numbers of all rows.
    pub fn rows(&self) -> Vec<usize> {
        (0..self.measurements.len()).collect()
    }

    /// All of them, σ \[m\] where a row has none of its own.
    pub fn all(&self, sigma: f64) -> Vec<Pose<'_>> {
        self.placement.poses(self.measurements, &self.rows(), sigma)
    }

    /// Where some poses were measured, or where an arm has its target in those that measure no
    /// position, measuring frame \[m\].
    pub fn places(arm: &Arm, poses: &[Pose]) -> Vec<Vector3<f64>> {
        let (others, places): (Vec<Pose>, Vec<usize>) = poses
            .iter()
            .copied()
            .zip(0..)
            .filter(|(pose, _)| !pose.observation.is_position())
            .unzip();
        let mut at: Vec<Vector3<f64>> = poses.iter().map(|pose| *pose.measured).collect();
        for (place, target) in
            places.into_iter().zip(arm.model.predicted_targets(&others, arm.x.as_slice()))
        {
            at[place] = target;
        }
        at
    }

    /// Errors measured − predicted of some rows, measuring frame \[m\].
    pub fn errors(&self, arm: &Arm, rows: &[usize]) -> Vec<Vector3<f64>> {
        self.placement.position_errors(&arm.model, &arm.x, self.measurements, rows)
    }

    /// ∂p/∂(coordinate) of all rows, of one coordinate after the other [m/rad] or [m/m].
    pub fn levers(&self, arm: &Arm, slots: &[ParameterSite]) -> Vec<Vec<Vector3<f64>>> {
        let (first, count) = (arm.x.len(), slots.len());
        if slots.is_empty() {
            return Vec::new();
        }
        let model =
            arm.model.with_probes(&slots.iter().map(|&site| (site, 0.0)).collect::<Vec<_>>());
        let x = arm.x.clone().resize_vertically(first + count, 0.0);
        let poses = self.all(1.0);
        let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
        let residuals = PoseResiduals::new(&model, poses, (first..first + count).collect(), x);
        let columns = jacobian(&residuals, &DVector::zeros(count));
        let of_slot = |place: usize| {
            let lever = |(k, sigma): (usize, &f64)| {
                Vector3::from_fn(|axis, _| -columns[(3 * k + axis, place)] * sigma)
            };
            sigmas.iter().enumerate().map(lever).collect()
        };
        (0..count).map(of_slot).collect()
    }
}

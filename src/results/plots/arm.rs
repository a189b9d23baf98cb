//! Arm and measurements from which figures are drawn: errors of each row, and levers of
//! coordinates.

use nalgebra::{DVector, Vector3};

use crate::fit::{Identification, IdentifyError, Placement};
use crate::least_squares::jacobian;
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::Problem;

/// Smallest lever of a coordinate in a pose at which a figure shows the pose, relative to the
/// longest lever in all poses. Poses with a shorter lever hardly determine the coordinate.
pub const MIN_LEVER: f64 = 0.1;

/// Measurements with their split into identification and held-out rows, and with the base and
/// target of each row.
pub struct Poses<'a> {
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: Placement,
}

/// Model of an arm with its full parameter vector.
#[derive(Debug, Clone)]
pub struct Arm {
    pub model: Model,
    /// Full parameter vector of the model.
    pub x: DVector<f64>,
}

impl<'a> Poses<'a> {
    pub fn new(data: &'a Dataset) -> Self {
        let Dataset { measurements, split } = data;
        Self { measurements, split, placement: Placement::of(measurements) }
    }

    /// Returns the arm of `problem` as the fit `found` identified it.
    pub fn arm(&self, problem: &Problem, found: &Identification) -> Result<Arm, IdentifyError> {
        let model = Model::new(problem, &self.placement.bases, &self.placement.targets)?;
        Ok(Arm { model: found.strategy.model(model), x: found.x.clone() })
    }

    /// Returns the indices of all rows.
    pub fn row_indices(&self) -> Vec<usize> {
        (0..self.measurements.len()).collect()
    }

    /// Returns the poses of all rows; `sigma` \[m\] is the 1 σ of a coordinate in rows that state
    /// none.
    pub fn all(&self, sigma: f64) -> Vec<Pose<'_>> {
        self.placement.poses(self.measurements, &self.row_indices(), sigma)
    }

    /// Returns the measured position of each pose, measuring frame \[m\]. For a pose without a
    /// measured position, it is the position of the target that `arm` predicts.
    pub fn positions(arm: &Arm, poses: &[Pose]) -> Vec<Vector3<f64>> {
        let (unmeasured, indices): (Vec<Pose>, Vec<usize>) = poses
            .iter()
            .copied()
            .zip(0..)
            .filter(|(pose, _)| !pose.observation.is_position())
            .unzip();
        let mut at: Vec<Vector3<f64>> = poses.iter().map(|pose| *pose.measured).collect();
        let predicted = arm.model.predicted_targets(&unmeasured, arm.x.as_slice());
        for (index, target) in indices.into_iter().zip(predicted) {
            at[index] = target;
        }
        at
    }

    /// Returns measured − predicted of the rows with the indices `rows`, measuring frame \[m\].
    pub fn errors(&self, arm: &Arm, rows: &[usize]) -> Vec<Vector3<f64>> {
        self.placement.position_errors(&arm.model, &arm.x, self.measurements, rows)
    }

    /// Returns the lever of every row for each parameter site, shape = (sites, rows). A lever is
    /// the derivative of the target's position with respect to the quantity at the site, measuring
    /// frame \[m/rad\] or \[m/m\].
    pub fn levers(&self, arm: &Arm, sites: &[ParameterSite]) -> Vec<Vec<Vector3<f64>>> {
        let (first, count) = (arm.x.len(), sites.len());
        if sites.is_empty() {
            return Vec::new();
        }
        let model =
            arm.model.with_probes(&sites.iter().map(|&site| (site, 0.0)).collect::<Vec<_>>());
        let x = arm.x.clone().resize_vertically(first + count, 0.0);
        let poses = self.all(1.0);
        let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
        let residuals = PoseResiduals::new(&model, poses, (first..first + count).collect(), x);
        let columns = jacobian(&residuals, &DVector::zeros(count));
        let of_site = |site: usize| {
            let lever = |(k, sigma): (usize, &f64)| {
                Vector3::from_fn(|axis, _| -columns[(3 * k + axis, site)] * sigma)
            };
            sigmas.iter().enumerate().map(lever).collect()
        };
        (0..count).map(of_site).collect()
    }
}

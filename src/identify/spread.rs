//! How far apart the arm puts its target in rows in which it was at one and the same point.

use nalgebra::{DVector, Vector3};

use crate::model::{Model, Pose};
use crate::problem::{Fixture, Observation};

/// What an arm makes of the rows at one point; no place of the point takes part.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSpread {
    /// Name of the point.
    pub point: String,
    /// Its rows.
    pub n: usize,
    /// Mean distance of the predicted target from its mean \[m\].
    pub mean: f64,
}

/// The spread at each point that some of `poses` touch, with the arm at the full parameter vector `x`; NaN where a pose has no
/// equilibrium.
pub(super) fn spreads(model: &Model, fixtures: &[Fixture], poses: &[Pose], x: &DVector<f64>) -> Vec<PointSpread> {
    let bases = model.base_frames(x.as_slice());
    let points = model.points(poses, x.as_slice());
    let of_point = |(index, fixture): (usize, &Fixture)| {
        let own = poses.iter().zip(&points).filter(|(pose, _)| pose.observation == Observation::Point(index));
        let lost = Vector3::from_element(f64::NAN);
        let own: Vec<Vector3<f64>> =
            own.map(|(pose, point)| point.map_or(lost, |point| bases[pose.base].point(&point))).collect();
        let n = own.len() as f64;
        let middle = own.iter().sum::<Vector3<f64>>() / n;
        let mean = own.iter().map(|point| (point - middle).norm()).sum::<f64>() / n;
        (!own.is_empty()).then(|| PointSpread { point: fixture.name.clone(), n: own.len(), mean })
    };
    fixtures.iter().enumerate().filter_map(of_point).collect()
}

//! Search for a pose that would distinguish two effects that the measured poses hardly distinguish.

use crate::select::settings::MAX_SEPARATING_POSES;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::data::Data;
use super::neighbourhood::{LinearNeighbourhood, Linearised};
use crate::measurement::Measurements;
use crate::observation::Needs;
use crate::problem::Effect;

/// Pose whose measurement would distinguish two effects.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatingPose {
    /// Effect from which the pose distinguishes the ranked candidate.
    pub other: Effect,
    /// Configuration within the measured ranges, shape = (joints) \[rad\] or \[m\].
    pub configuration: Vec<f64>,
    /// Target that is measured, if the data name targets.
    pub target: Option<String>,
    /// Payload in the pose \[kg\]; `None` if the data have no such column.
    pub payload: Option<f64>,
    /// Hoist force in the pose \[N\]; `None` if the data have no such column.
    pub hoist: Option<f64>,
    /// Temperature in the pose [°C]; `None` if the data have no such column.
    pub temperature: Option<f64>,
    /// Distance between the predictions with the one and with the other effect, each fitted to the
    /// measured poses \[m\].
    pub difference: f64,
}

/// Returns [`MAX_SEPARATING_POSES`] random poses within the measured ranges: each quantity of a
/// pose has the value of a randomly chosen identification row. Joints of image rows stay together,
/// because cameras see nothing in most other configurations.
pub(super) fn random_poses(data: &Data) -> Measurements {
    let mut rng = ChaCha8Rng::seed_from_u64(data.rules.seed);
    let (rows, count) = (data.rows(), MAX_SEPARATING_POSES);
    let drawn: Vec<usize> = (0..count).map(|_| rows[rng.random_range(0..rows.len())]).collect();
    let mut poses = data.measurements.select(&drawn);
    let mut from = || rows[rng.random_range(0..rows.len())];
    let (measured, n) = (data.measurements, poses.joints);
    for pose in 0..count {
        let is_image = poses.observation(pose).description().needs == Needs::Carriers;
        for joint in (0..n).filter(|_| !is_image) {
            poses.configurations[pose * n + joint] = measured.configurations[from() * n + joint];
        }
        let columns = [
            (&mut poses.payload, &measured.payload),
            (&mut poses.hoist, &measured.hoist),
            (&mut poses.temperature, &measured.temperature),
        ];
        for (column, measured) in columns {
            if let (Some(column), Some(measured)) = (column, measured) {
                column[pose] = measured[from()];
            }
        }
    }
    poses
}

/// Returns the pose among `poses` at which the predictions of the fits with the one and with the
/// other effect differ most. `here` is linearised at the measured poses, `there` at `poses`. `None`
/// if there are no poses.
pub(super) fn separating_pose(
    fit: &LinearNeighbourhood,
    [here, there]: [&Linearised; 2],
    poses: &Measurements,
    (one, other): (&Effect, &Effect),
) -> Option<SeparatingPose> {
    let moved = |effect: &Effect| {
        let fit = fit.with(&here.columns(effect));
        side_by_side(there.fitted().clone(), &there.columns(effect)) * fit.step()
    };
    let difference: DVector<f64> = moved(one) - moved(other);
    let distance = |pose: usize| difference.rows(3 * pose, 3).norm() * there.poses()[pose].sigma;
    let best = (0..poses.len()).max_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
    let at = |column: &Option<Vec<f64>>| column.as_ref().map(|column| column[best]);
    Some(SeparatingPose {
        other: other.clone(),
        configuration: poses.configuration(best).to_vec(),
        target: poses
            .target
            .as_ref()
            .and_then(|table| table.names.get(table.of_row[best]).cloned()),
        payload: at(&poses.payload),
        hoist: at(&poses.hoist),
        temperature: at(&poses.temperature),
        difference: distance(best),
    })
}

fn side_by_side(left: DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let first = left.ncols();
    let mut both = left.resize_horizontally(first + right.ncols(), 0.0);
    both.columns_mut(first, right.ncols()).copy_from(right);
    both
}

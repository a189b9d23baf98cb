//! How accurately positions are predicted in poses that decided nothing, before and after, counted
//! as ISO 9283 counts positions.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::error::InputErrorKind;
use crate::fit::identification::IdentifyError;
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::measurement::Dataset;
use crate::model::Model;
use crate::numeric::{Interval, mean_interval};
use crate::problem::Problem;

/// Resamples of the confidence interval, and how often it covers.
const DRAWS: usize = 5000;
const COVERED: f64 = 0.95;
const SEED: u64 = 9283;
/// Positions of a pose from which a spread of distances can be told.
const LEAST_CYCLES: usize = 3;

/// What held-out poses say of an arm.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Acceptance {
    /// Each configuration with its base and target once.
    pub poses: Vec<AcceptancePose>,
    /// Of the nominal arm, with base and target fitted where they are free.
    pub before: Accuracy,
    /// Of the identified arm.
    pub after: Accuracy,
}

/// A pose, measured once or several times.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct AcceptancePose {
    /// Its rows, ascending.
    pub rows: Vec<usize>,
    /// AP of the nominal arm: distance from the predicted position to the barycentre of the
    /// measured ones \[m\].
    pub before: f64,
    /// AP of the identified arm \[m\].
    pub after: f64,
    /// RP = l̄ + 3 `S_l` of the distances l of the measured positions to their barycentre \[m\];
    /// `None` of a pose measured less than three times: two positions are equally far from their
    /// middle.
    pub repeatability: Option<f64>,
}

/// AP over all poses \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Its mean, with the interval that covers it in 95 of 100 cases: bootstrap over poses (BCa)
    /// [Efron 1987].
    pub mean: Interval,
    /// Root mean square.
    pub rms: f64,
    /// The largest.
    pub max: f64,
}

impl Accuracy {
    fn of(all: &[f64]) -> Self {
        let sums: Vec<(f64, f64)> = all.iter().map(|own| (*own, 1.0)).collect();
        let squares: f64 = all.iter().map(|own| own * own).sum();
        Self {
            mean: mean_interval(&sums, DRAWS, COVERED, SEED),
            rms: (squares / all.len().max(1) as f64).sqrt(),
            max: all.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Held-out rows that measure positions, of which alone a pose accuracy is.
///
/// # Errors
/// There are none.
pub fn held_out_positions(
    problem: &Problem,
    Dataset { measurements, split }: &Dataset,
) -> Result<Vec<usize>, IdentifyError> {
    let is_position = |row: &usize| measurements.observation(*row).is_position();
    let rows: Vec<usize> = split.held_out.iter().copied().filter(is_position).collect();
    if rows.is_empty() {
        return Err(problem.data.location.clone().error(InputErrorKind::NoPositionsHeldOut).into());
    }
    Ok(rows)
}

/// Of the held-out poses of an identification whose positions were measured; poses without an
/// equilibrium are left out.
///
/// # Errors
/// Problem and data do not fit each other, or no held-out row measures a position.
pub fn acceptance(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
) -> Result<Acceptance, IdentifyError> {
    let measurements = &data.measurements;
    let held_out = held_out_positions(problem, data)?;
    let placement = Placement::of(measurements);
    let model = found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let errors = |x| placement.position_errors(&model, x, measurements, &held_out);
    let (before, after) = (errors(&found.registered_x), errors(&found.x));
    let numbers = measurements.pose_numbers(problem);
    let mut groups: BTreeMap<(usize, [i64; 3]), Vec<usize>> = BTreeMap::new();
    for (k, &row) in held_out.iter().enumerate() {
        if !(before[k].norm().is_finite() && after[k].norm().is_finite()) {
            continue;
        }
        // Poses that the declared arm does not tell apart may differ in loads and temperature all
        // the same.
        let set = [&measurements.payload, &measurements.hoist, &measurements.temperature];
        #[expect(
            clippy::cast_possible_truncation,
            reason = "steps of 0.1 kg, 0.1 N and 1 K, of which as many as matter have room"
        )]
        let set = [10.0, 10.0, 1.0]
            .iter()
            .zip(set)
            .map(|(per, own)| own.as_ref().map_or(0, |all| (all[row] * per).round() as i64));
        let mut key = [0; 3];
        key.iter_mut().zip(set).for_each(|(own, value)| *own = value);
        groups.entry((numbers[row], key)).or_default().push(k);
    }
    let mean = |all: &[Vector3<f64>], own: &[usize]| {
        own.iter().map(|&k| all[k]).sum::<Vector3<f64>>() / own.len().max(1) as f64
    };
    let pose = |own: Vec<usize>| {
        let positions: Vec<Vector3<f64>> =
            own.iter().map(|&k| measurements.positions[held_out[k]]).collect();
        AcceptancePose {
            before: mean(&before, &own).norm(),
            after: mean(&after, &own).norm(),
            repeatability: repeatability(&positions),
            rows: own.into_iter().map(|k| held_out[k]).collect(),
        }
    };
    let mut poses: Vec<AcceptancePose> = groups.into_values().map(pose).collect();
    poses.sort_by(|a, b| a.rows.cmp(&b.rows));
    let each = |of: fn(&AcceptancePose) -> f64| poses.iter().map(of).collect::<Vec<f64>>();
    Ok(Acceptance {
        before: Accuracy::of(&each(|pose| pose.before)),
        after: Accuracy::of(&each(|pose| pose.after)),
        poses,
    })
}

/// RP = l̄ + 3 `S_l`  [ISO 9283, 7.2.2].
fn repeatability(positions: &[Vector3<f64>]) -> Option<f64> {
    let n = positions.len() as f64;
    if positions.len() < LEAST_CYCLES {
        return None;
    }
    let barycentre = positions.iter().sum::<Vector3<f64>>() / n;
    let distances: Vec<f64> = positions.iter().map(|at| (at - barycentre).norm()).collect();
    let mean = distances.iter().sum::<f64>() / n;
    let spread = (distances.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    Some(mean + 3.0 * spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_positions_scatter_about_their_barycentre() {
        assert_eq!(repeatability(&[Vector3::zeros()]), None);
        assert_eq!(repeatability(&[Vector3::zeros(), Vector3::x()]), None);
        // Four points at a distance of 1 from the middle: no spread of the distances.
        let square = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .map(|(x, y)| Vector3::new(x, y, 5.0));
        assert!((repeatability(&square).unwrap_or(0.0) - 1.0).abs() < 1e-12);
        let line = [0.0, 0.0, 3.0].map(|x| Vector3::new(x, 0.0, 0.0));
        // Barycentre at 1: distances 1, 1, 2; mean 4/3, spread 1/√3.
        assert!((repeatability(&line).unwrap_or(0.0) - (4.0 / 3.0 + 3.0_f64.sqrt())).abs() < 1e-12);
    }
}

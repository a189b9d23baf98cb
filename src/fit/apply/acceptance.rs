//! Acceptance of an identified arm: pose accuracy and repeatability in held-out poses, as ISO 9283
//! defines them.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::error::TableErrorKind;
use crate::fit::apply::predict::Residual;
use crate::fit::apply::tolerance::{Tolerance, ToleranceTest, Verdict};
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::fit::{FindingCode, IdentifyError};
use crate::measurement::Dataset;
use crate::numeric::{Interval, mean_interval};
use crate::problem::{HeldOut, Problem};

/// Number of bootstrap resamples of a confidence interval.
const RESAMPLES: usize = 5000;
/// Level of the confidence intervals of mean accuracies.
const INTERVAL_LEVEL: f64 = 0.95;
/// Seed of the random numbers of the bootstrap.
const SEED: u64 = 9283;
/// Smallest number of measurements of a pose for which a repeatability is computed.
const MIN_CYCLES: usize = 3;

/// Pose accuracy of an arm in held-out poses, before and after identification.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Acceptance {
    /// Held-out poses; rows with equal configuration, base and target form one pose.
    pub poses: Vec<AcceptancePose>,
    /// Number of held-out rows that measure a position but have no finite prediction, with the
    /// nominal or with the identified arm. `poses` does not contain them.
    pub lost: usize,
    /// True if a base or tool that only held-out rows use was fitted to these rows. They are then
    /// no test of a tolerance.
    pub is_placed_anew: bool,
    /// True if the arm was fitted to most of the poses. They are then no test of a tolerance.
    pub are_poses_fitted: bool,
    /// True if the fit is trusted. Otherwise its held-out errors are no test of a tolerance.
    pub is_trusted: bool,
    /// Accuracy of the registered nominal arm.
    pub before: Accuracy,
    /// Accuracy of the identified arm.
    pub after: Accuracy,
}

impl Acceptance {
    /// Tests a tolerance on the accuracies AP of the identified arm in all poses. Each row without
    /// a prediction is a pose beyond the tolerance. If a base or tool was fitted to the held-out
    /// rows, or the arm to most of their poses, or if the fit is not trusted, the verdict is
    /// undecided.
    pub fn test(&self, tolerance: Tolerance) -> ToleranceTest {
        let lost = std::iter::repeat_n(f64::NAN, self.lost);
        let errors: Vec<f64> = self.poses.iter().map(|pose| pose.after).chain(lost).collect();
        let tested = tolerance.test(&errors);
        let verdict = self.no_test().map_or(tested.verdict, |_| Verdict::Undecided);
        ToleranceTest { verdict, ..tested }
    }

    /// Returns the reason for which the held-out poses do not test a tolerance; `None` if they do.
    pub(crate) fn no_test(&self) -> Option<&'static str> {
        if !self.is_trusted {
            return Some("the fit is not to be trusted");
        }
        if self.are_poses_fitted {
            return Some("the arm was fitted to the poses that are held out");
        }
        self.is_placed_anew.then_some("a base or tool was fitted to the held-out poses")
    }
}

/// Held-out pose that was measured once or several times, with its accuracy.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct AcceptancePose {
    /// Indices of the rows of the pose in the measurements, ascending.
    pub rows: Vec<usize>,
    /// Accuracy AP of the registered nominal arm: distance from the predicted position to the
    /// barycentre of the measured positions \[m\].
    pub before: f64,
    /// Accuracy AP of the identified arm: distance from the predicted position to the barycentre of
    /// the measured positions \[m\].
    pub after: f64,
    /// Repeatability RP = l̄ + 3 `S_l` of the distances l from the measured positions to their
    /// barycentre \[m\]; `None` for less than three measurements, since two positions are equally
    /// far from their centre.
    pub repeatability: Option<f64>,
}

/// Statistics of the accuracy AP of an arm over all held-out poses \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Mean accuracy AP with its 95 % confidence interval \[m\], by the BCa bootstrap over poses
    /// [Efron 1987].
    pub mean: Interval,
    /// Root mean square of the accuracies AP over the poses \[m\].
    pub rms: f64,
    /// Largest accuracy AP of a pose \[m\].
    pub max: f64,
}

impl Accuracy {
    /// Computes the statistics of the accuracies AP of all poses \[m\].
    fn of(accuracies: &[f64]) -> Self {
        let sums: Vec<(f64, f64)> = accuracies.iter().map(|accuracy| (*accuracy, 1.0)).collect();
        let squares: f64 = accuracies.iter().map(|accuracy| accuracy * accuracy).sum();
        Self {
            mean: mean_interval(&sums, RESAMPLES, INTERVAL_LEVEL, SEED),
            rms: (squares / accuracies.len().max(1) as f64).sqrt(),
            max: accuracies.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Returns the indices of the held-out rows that measure positions. Rows of other kinds have no
/// pose accuracy.
///
/// # Errors
/// Returns an error if there are none.
pub fn held_out_positions(
    problem: &Problem,
    Dataset { measurements, split }: &Dataset,
) -> Result<Vec<usize>, IdentifyError> {
    let is_position = |row: &usize| measurements.observation(*row).is_position();
    let rows: Vec<usize> = split.held_out.iter().copied().filter(is_position).collect();
    if problem.data.held_out == Some(HeldOut::Nothing) {
        let location = problem.data.held_out_location.clone();
        return Err(location.error(TableErrorKind::NothingHeldOut).into());
    }
    if rows.is_empty() {
        return Err(problem.data.location.clone().error(TableErrorKind::NoPositionsHeldOut).into());
    }
    Ok(rows)
}

/// Computes pose accuracy and repeatability of the identified arm in the held-out poses with
/// measured positions. Rows without an equilibrium are left out.
///
/// If a remainder corrects the predictions, `corrected` contains the residuals of all rows of the
/// table after the correction.
///
/// # Errors
/// Returns an error if problem and data are not compatible, or no held-out row measures a
/// position.
pub fn acceptance(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    corrected: Option<&[Residual]>,
) -> Result<Acceptance, IdentifyError> {
    let measurements = &data.measurements;
    let held_out = held_out_positions(problem, data)?;
    let placement = Placement::of(measurements);
    let model = found.model(problem, &placement)?;
    let later = placement.held_out_only(&model, measurements, &data.split);
    // A fitted parameter is practically never exactly at its nominal value.
    let is_fitted = |(is_later, x): (&bool, &f64)| *is_later && x.abs() > 0.0;
    let is_placed_anew = later.parameters.iter().zip(found.x.iter()).any(is_fitted);
    let errors = |x| placement.position_errors(&model, x, measurements, &held_out);
    let before = errors(&found.registered_x);
    let after = match corrected {
        Some(rows) => held_out.iter().map(|&row| rows[row].position).collect(),
        None => errors(&found.x),
    };
    let numbers = measurements.pose_numbers(problem);
    let mut groups: BTreeMap<(usize, [i64; 3]), Vec<usize>> = BTreeMap::new();
    let mut lost = 0;
    for (k, &row) in held_out.iter().enumerate() {
        if !(before[k].norm().is_finite() && after[k].norm().is_finite()) {
            lost += 1;
            continue;
        }
        // Rows of one pose of the declared arm may differ in load or temperature. They are then
        // different poses here.
        let set = [&measurements.payload, &measurements.hoist, &measurements.temperature];
        #[expect(
            clippy::cast_possible_truncation,
            reason = "steps of 0.1 kg, 0.1 N and 1 K, of which as many as matter have room"
        )]
        let set = [10.0, 10.0, 1.0].iter().zip(set).map(|(per, column)| {
            column.as_ref().map_or(0, |values| (values[row] * per).round() as i64)
        });
        let mut key = [0; 3];
        key.iter_mut().zip(set).for_each(|(entry, value)| *entry = value);
        groups.entry((numbers[row], key)).or_default().push(k);
    }
    let mean = |errors: &[Vector3<f64>], group: &[usize]| {
        group.iter().map(|&k| errors[k]).sum::<Vector3<f64>>() / group.len().max(1) as f64
    };
    let pose = |group: Vec<usize>| {
        let positions: Vec<Vector3<f64>> =
            group.iter().map(|&k| measurements.positions[held_out[k]]).collect();
        AcceptancePose {
            before: mean(&before, &group).norm(),
            after: mean(&after, &group).norm(),
            repeatability: repeatability(&positions),
            rows: group.into_iter().map(|k| held_out[k]).collect(),
        }
    };
    let mut poses: Vec<AcceptancePose> = groups.into_values().map(pose).collect();
    poses.sort_by(|a, b| a.rows.cmp(&b.rows));
    let each = |of: fn(&AcceptancePose) -> f64| poses.iter().map(of).collect::<Vec<f64>>();
    Ok(Acceptance {
        before: Accuracy::of(&each(|pose| pose.before)),
        after: Accuracy::of(&each(|pose| pose.after)),
        poses,
        lost,
        is_placed_anew,
        is_trusted: found.is_trusted(),
        are_poses_fitted: found.has(FindingCode::HeldOutPosesFitted),
    })
}

/// Returns the repeatability RP = l̄ + 3 `S_l` of positions measured in one pose \[m\] \[ISO 9283,
/// 7.2.2\]; `None` if there are fewer than [`MIN_CYCLES`].
fn repeatability(positions: &[Vector3<f64>]) -> Option<f64> {
    let n = positions.len() as f64;
    if positions.len() < MIN_CYCLES {
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
        // All four points are at a distance of 1 from their barycentre, so the distances have no
        // spread.
        let square = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .map(|(x, y)| Vector3::new(x, y, 5.0));
        assert!((repeatability(&square).unwrap_or(0.0) - 1.0).abs() < 1e-12);
        let line = [0.0, 0.0, 3.0].map(|x| Vector3::new(x, 0.0, 0.0));
        // The barycentre is at 1: the distances are 1, 1 and 2, with mean 4/3 and standard
        // deviation 1/√3.
        assert!((repeatability(&line).unwrap_or(0.0) - (4.0 / 3.0 + 3.0_f64.sqrt())).abs() < 1e-12);
    }
}

//! Watch: test whether an arm has changed since its estimate, and of the causes.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::assessment::{AssessedCause, assess};
use super::causes::{Cause, CauseKind, Extended};
use super::earlier::Earlier;
use super::error::PriorError;
use super::evidence::{Unchanged, factor};
use super::identify::{covariance, warmth};
use super::known_noise::KnownNoise;
use super::onset::{padded_factor, sums_of, with_onsets};
use super::rows::{SensitiveRows, SharedMisfit};
use crate::fit::{self, Placement, SavedEstimate, register};
use crate::measurement::Measurements;
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose};
use crate::observation::kind_named;
use crate::problem::{JointKind, Problem};
use crate::quantity::Unit;
use crate::spatial::Frame;

/// Maximum number of causes that are reported.
const MAX_REPORTED_CAUSES: usize = 6;
/// Smallest probability at which a cause is reported that is not the most probable one.
const MIN_REPORTED_PROBABILITY: f64 = 0.005;
/// Smallest probability at which the most probable cause is named as the cause.
const MIN_NAMED_PROBABILITY: f64 = 0.9;
/// Maximum number of groups of rows that are left out in turn to test a cause.
const MAX_GROUPS: usize = 60;
/// Prior odds that something else changed together with the base, against the base alone.
const SECOND_CHANGE_ODDS: f64 = 0.05;
/// Smallest number of measured positions that determine a moved base and test the fit.
const MIN_BASE_ROWS: usize = 4;
/// Smallest ratio of the two largest principal variances of points that are not on a line.
const MIN_SQUARED_SPREAD: f64 = 1e-6;
/// Largest tilt \[rad\] of the axis of joint 1 at which the move of a base counts as a rotation
/// about that axis.
const MAX_TILT: f64 = 1e-3;
/// Largest displacement \[m\] of a point on the axis of joint 1 at which the move of a base counts
/// as a rotation about that axis.
const MAX_SHIFT: f64 = 2e-3;
/// Smallest expected evidence per pose for one cause against another \[nats\] at which more poses
/// can distinguish the causes.
const MIN_NATS_PER_POSE: f64 = 1e-3;

/// Result of the test whether an arm has changed since its estimate.
#[derive(Debug, Clone)]
pub struct Watch {
    /// Largest probability of any false alarm over all rows of one test.
    pub false_alarm_rate: f64,
    /// True if the fit of the estimate was trusted.
    pub estimate_trusted: bool,
    /// Number of rows that were tested.
    pub rows: usize,
    /// Number of rows that were left out, because the estimate was fitted to them.
    pub left_out: usize,
    /// Number of rows at each look, and ln of the evidence for a change from these rows.
    pub looks: Vec<(usize, f64)>,
    /// Number of rows at the first look with an alarm; `None` if the arm is unchanged.
    pub changed_at: Option<usize>,
    /// χ² of all rows under "unchanged", its degrees of freedom, and its p-value.
    pub chi2: (f64, f64, f64),
    /// Root mean square error with which the estimate predicts the rows of the leading kind \[m\]
    /// or \[rad\].
    pub error: f64,
    /// Unit of the errors: that of the leading kind of rows.
    pub unit: Unit,
    /// Standard deviation (1 σ) of a coordinate of the first row of the leading kind, noise and
    /// known misfit together \[m\] or \[rad\].
    pub sigma: f64,
    /// Causes of a change, the most probable first.
    pub causes: Vec<WatchedCause>,
}

/// Cause of a change with its probability and size.
#[derive(Debug, Clone)]
pub struct WatchedCause {
    /// Kind of the cause.
    pub kind: CauseKind,
    /// Name for people, such as "zero of joint 2".
    pub label: String,
    /// Index of the gross row among all rows of the table, from 0; `None` for other causes.
    pub row: Option<usize>,
    /// Index of the first row that shows the change among all rows of the table, from 0; `None` if
    /// the change happened before the table.
    pub from_row: Option<usize>,
    /// Probability among all causes, given that something changed.
    pub probability: f64,
    /// Changes of the parameters that the cause moves. For larger noise and for something else,
    /// this is the ratio of the errors to the assumed noise.
    pub changes: Vec<Change>,
    /// Root mean square error of rows of the leading kind, each predicted with this cause as
    /// estimated without the row \[m\] or \[rad\]. For a gross row it is the error of the other
    /// rows; `None` for noise and for something else.
    pub left_out_error: Option<f64>,
    /// Number of additional poses like the measured ones after which the data are expected to
    /// decide between this cause and the most probable other one; `None` if no number would
    /// suffice, or if there is no other cause.
    pub poses_to_tell_apart: Option<usize>,
}

/// Change of one parameter since the estimate.
#[derive(Debug, Clone)]
pub struct Change {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of the change.
    pub unit: Unit,
    /// Change, SI; of the logarithm for stiffnesses.
    pub change: f64,
    /// Standard error of the change; NaN for a ratio of the noise.
    pub std_error: f64,
}

impl Watch {
    /// Returns true if the test found that the arm or its measurement has changed.
    pub fn is_changed(&self) -> bool {
        self.changed_at.is_some()
    }

    /// Returns the most probable cause if it can be named: the arm has changed, the probability is
    /// at least 90 %, and left-out rows are predicted better with the cause than by the estimate.
    pub fn named(&self) -> Option<&WatchedCause> {
        let is_named = |cause: &&WatchedCause| {
            cause.probability >= MIN_NAMED_PROBABILITY
                && cause.left_out_error.is_none_or(|left| left < self.error)
        };
        self.causes.first().filter(|_| self.is_changed()).filter(is_named)
    }
}

/// Tests measured rows, in their order, against an estimate that is `days` days old.
///
/// The residuals of an unchanged arm are normal, with the covariance of noise, known misfit and
/// estimate. If the rows state temperatures, the covariance also contains effects of temperature as
/// large as the misfit. The misfit is the same in all rows of one configuration. The density of the
/// residuals is compared with a mixture of densities, one for each cause and size of a change. If
/// nothing changed, the ratio exceeds 1 / `false_alarm_rate` at any look with at most the
/// probability `false_alarm_rate`. Rows to which the estimate was fitted are left out.
///
/// # Errors
/// Returns an error if the estimate is of another arm or has other laws, if no row is new, or if
/// rows have no σ.
pub fn watch(
    problem: &Problem,
    estimate: &SavedEstimate,
    measurements: &Measurements,
    (days, false_alarm_rate): (f64, f64),
) -> Result<Watch, PriorError> {
    let fitted = &estimate.posterior.fitted_rows;
    let new: Vec<usize> = (0..measurements.len())
        .filter(|&row| !fitted.contains(&measurements.row_digest(row)))
        .collect();
    let left_out = measurements.len() - new.len();
    if new.is_empty() {
        return Err(PriorError::NothingNew { file: estimate.file.clone(), rows: left_out });
    }
    let kept = if left_out > 0 { measurements.select(&new) } else { measurements.clone() };
    let placement = Placement::of(&kept);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let earlier = Earlier::of_estimate(estimate, problem, &model, days)?;
    let x = fit::predict(problem, Some(estimate), &kept, None)?.x;
    let every_row: Vec<usize> = (0..kept.len()).collect();
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let known = KnownNoise::of(problem, estimate);
    if known.sigma.is_none() && !kept.has_sigma_in_every_row() && has_positions(&kept) {
        return Err(PriorError::NoSigma { file: estimate.file.clone() });
    }
    let sigma = known.sigma.unwrap_or(f64::NAN);
    let mut poses = placement.oriented_poses(&kept, &every_row, (sigma, turn));
    estimate.count_time_in(&placement, &mut poses);
    let misfit = known.misfit_of(&poses);
    let leading = kept.leading();
    let leads: Vec<bool> =
        every_row.iter().map(|&row| kept.observation(row).kind() == leading.kind()).collect();
    let tested = TestedRows { problem, model: &model, placement: &placement, kept: &kept, misfit };
    let not_finite = || PriorError::NotFinite { file: estimate.file.clone() };
    let at_estimate = tested.linearised(&poses, &x, &earlier);
    let mut assessed = assess(&at_estimate.rows, &at_estimate.factor, &at_estimate.causes, true)
        .ok_or_else(not_finite)?;
    let threshold = -false_alarm_rate.ln();
    let changed_at = assessed.looks.iter().find(|look| look.1 >= threshold).map(|look| look.0);
    if changed_at.is_some() {
        let Linearised { rows, factor, causes, .. } = &at_estimate;
        assessed.causes = with_onsets(&assessed, rows, factor, causes).ok_or_else(not_finite)?;
    }
    let p_value = ChiSquared::new(assessed.coordinates)
        .map_or(f64::NAN, |distribution| distribution.sf(assessed.chi2));
    let report = at_estimate.reporter(&leads);
    let reported: Vec<&AssessedCause> = assessed
        .causes
        .iter()
        .enumerate()
        .filter(|(k, cause)| *k == 0 || cause.probability >= MIN_REPORTED_PROBABILITY)
        .map(|(_, cause)| cause)
        .take(MAX_REPORTED_CAUSES)
        .collect();
    let location = |row: usize| kept.location(row).to_string();
    let mut watched: Vec<WatchedCause> = (0..reported.len())
        .map(|k| WatchedCause {
            row: reported[k].row.map(|row| new[row]),
            from_row: Some(reported[k].onset).filter(|onset| *onset > 0).map(|row| new[row]),
            label: reported[k].label(&at_estimate.causes, location),
            ..report.cause(reported[k], reported.get(usize::from(k == 0)).copied())
        })
        .collect();
    let is_unexplained = watched.first().is_some_and(|cause| cause.kind == CauseKind::Other);
    if changed_at.is_some() && is_unexplained {
        let moved = tested.moved_base(&poses, &x, (&earlier, &leads), threshold);
        watched = moved.unwrap_or(watched);
    }
    Ok(Watch {
        false_alarm_rate,
        estimate_trusted: estimate.trusted,
        rows: kept.len(),
        left_out,
        looks: assessed.looks,
        changed_at,
        chi2: (assessed.chi2, assessed.coordinates, p_value),
        error: report.rms(|row| at_estimate.rows.residual_of(row)),
        unit: kind_named(leading.kind()).unit,
        sigma: leads
            .iter()
            .position(|leads| *leads)
            .map_or(f64::NAN, |first| at_estimate.rows.total_sigma(first)),
        causes: watched,
    })
}

/// Rows that are tested against an estimate, with the model of the estimate.
struct TestedRows<'a> {
    problem: &'a Problem,
    model: &'a Model,
    placement: &'a Placement,
    /// Table of the rows.
    kept: &'a Measurements,
    /// Misfit of each coordinate of each pose in units of its noise; `None` without a misfit.
    misfit: Option<Vec<Vec<f64>>>,
}

/// Rows that are linearised at a parameter vector, with the causes of a change.
struct Linearised {
    extended: Extended,
    rows: SensitiveRows,
    causes: Vec<Cause>,
    /// Matrix F with F Fᵀ the covariance of the estimate.
    factor: DMatrix<f64>,
}

impl Linearised {
    /// Returns the reporter of these causes; `leads` is true for rows of the leading kind.
    fn reporter<'a>(&'a self, leads: &'a [bool]) -> Reporter<'a> {
        Reporter { rows: &self.rows, factor: &self.factor, causes: &self.causes, leads }
    }
}

impl TestedRows<'_> {
    /// Linearises the rows at the full parameter vector `x`, for an estimate with the covariance of
    /// `earlier`.
    fn linearised(&self, poses: &[Pose], x: &DVector<f64>, earlier: &Earlier) -> Linearised {
        let Self { problem, model, placement, kept, .. } = *self;
        let extended = Extended::new(problem, model, x, [&placement.bases, &placement.targets]);
        let mut rows = SensitiveRows::new(&extended.model, poses.to_vec(), &extended.x);
        if let Some(misfit) = &self.misfit {
            let coordinate = |place: usize| misfit[place / rows.stride].get(place % rows.stride);
            let sigma = (0..rows.residual.len()).map(|k| coordinate(k).copied().unwrap_or(0.0));
            let sigma = DVector::from_iterator(rows.residual.len(), sigma);
            rows.set_misfit(SharedMisfit { configuration: kept.pose_numbers(problem), sigma });
        }
        let every_row: Vec<usize> = (0..kept.len()).collect();
        let warmth = warmth(problem, kept, &every_row);
        let causes = extended.causes(problem, &mut rows, warmth.as_deref());
        let warmed = warmth.as_ref().map(|_| (&*causes, rows.sum_of_misfit_variances()));
        let factor = factor(&covariance(&extended, earlier, &rows, warmed));
        Linearised { extended, rows, causes, factor }
    }

    /// Returns a move of the only base as the cause, if it explains the rows: after the base has
    /// been registered to them, ln of the evidence for another change is below `threshold`. A
    /// rotation about the axis of joint 1 may as well be a changed zero of that joint, which is
    /// then returned as a second cause. Returns `None` if the base does not explain the rows.
    ///
    /// Other tests take positions as linear in the changes, which fails for a base that is rotated
    /// by some degrees.
    fn moved_base(
        &self,
        poses: &[Pose],
        x: &DVector<f64>,
        (earlier, leads): (&Earlier, &[bool]),
        threshold: f64,
    ) -> Option<Vec<WatchedCause>> {
        if self.placement.bases.len() != 1 || !positions_determine_base(poses) {
            return None;
        }
        // Without priors and bounds, because the base was moved.
        let mut model = self.model.clone();
        for parameter in &mut model.parameters {
            (parameter.sigma, parameter.lower, parameter.upper) =
                (None, f64::NEG_INFINITY, f64::INFINITY);
        }
        let mut registered = x.clone();
        register(&model, poses, &mut registered);
        for (k, parameter) in model.parameters.iter().enumerate() {
            if !matches!(parameter.site, ParameterSite::Base { .. }) {
                registered[k] = x[k];
            }
        }
        let at_base = self.linearised(poses, &registered, earlier);
        let assessed = assess(&at_base.rows, &at_base.factor, &at_base.causes, false)?;
        let (_, evidence) = *assessed.looks.last()?;
        let is_base = |cause: &&AssessedCause| at_base.causes[cause.cause].kind == CauseKind::Base;
        let base = assessed.causes.iter().find(is_base).filter(|_| evidence < threshold)?;
        let mut watched = at_base.reporter(leads).cause(base, None);
        for (change, &k) in watched.changes.iter_mut().zip(&at_base.causes[base.cause].columns) {
            change.change += at_base.extended.x[k] - x.get(k).copied().unwrap_or(0.0);
        }
        watched.probability = 1.0 / (1.0 + SECOND_CHANGE_ODDS * evidence.exp());
        let frame = |x: &DVector<f64>| model.base_frames(x.as_slice()).into_iter().next();
        let angle = turn_about_first_joint(self.problem, &frame(x)?, &frame(&registered)?);
        let Some(angle) = angle else { return Some(vec![watched]) };
        // The rows cannot distinguish the base and the zero, so each has half of the probability.
        watched.probability *= 0.5;
        let zero = WatchedCause {
            kind: CauseKind::Zero,
            label: "zero of joint 1".to_owned(),
            changes: vec![Change {
                parameter: "joint1.theta".to_owned(),
                unit: Unit::Angle,
                change: angle,
                std_error: f64::NAN,
            }],
            ..watched.clone()
        };
        Some(vec![watched, zero])
    }
}

/// Returns true if the measured positions determine the pose of a base and leave residual degrees
/// of freedom: at least [`MIN_BASE_ROWS`] positions that do not lie on a line.
fn positions_determine_base(poses: &[Pose]) -> bool {
    let points: Vec<&Vector3<f64>> = poses
        .iter()
        .filter(|pose| pose.observation.is_position())
        .map(|pose| pose.measured)
        .collect();
    let mean = points.iter().copied().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let spread: Matrix3<f64> =
        points.iter().map(|point| (*point - mean) * (*point - mean).transpose()).sum();
    let mut squares = spread.symmetric_eigenvalues();
    squares.as_mut_slice().sort_by(f64::total_cmp);
    points.len() >= MIN_BASE_ROWS && squares[1] > MIN_SQUARED_SPREAD * squares[2]
}

/// Returns the angle \[rad\] about the axis of joint 1 by which a base was rotated from the frame
/// `old` to `new`; `None` if it moved otherwise, or joint 1 is not revolute.
fn turn_about_first_joint(problem: &Problem, old: &Frame<f64>, new: &Frame<f64>) -> Option<f64> {
    let first = problem.joints.first().filter(|joint| joint.kind == JointKind::Revolute)?;
    let (sin, cos) = first.alpha.sin_cos();
    let (axis, centre) = (Vector3::new(0.0, -sin, cos), Vector3::new(first.a, 0.0, 0.0));
    let move_in_base = old.inverse().compose(new);
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&move_in_base.axes));
    let shift = move_in_base.point(&centre) - centre;
    let is_about_it = (turn * axis - axis).norm() < MAX_TILT && shift.norm() < MAX_SHIFT;
    let vector = turn.scaled_axis();
    is_about_it.then_some(vector.dot(&axis))
}

/// Returns true if at least one row measures a position.
fn has_positions(measurements: &Measurements) -> bool {
    (0..measurements.len()).any(|row| measurements.observation(row).is_position())
}

/// Rows and causes from which the report of a cause is computed.
struct Reporter<'a> {
    rows: &'a SensitiveRows,
    factor: &'a DMatrix<f64>,
    causes: &'a [Cause],
    /// True for rows of the leading kind, whose errors are reported.
    leads: &'a [bool],
}

impl Reporter<'_> {
    /// Returns the report of a cause; `rival` is the most probable other one.
    fn cause(&self, assessed: &AssessedCause, rival: Option<&AssessedCause>) -> WatchedCause {
        let cause = &self.causes[assessed.cause];
        let changes = cause.amplitudes.iter().enumerate().map(|(i, (name, unit))| Change {
            parameter: name.clone(),
            unit: *unit,
            change: assessed.mean[i],
            std_error: assessed.covariance[(i, i)].sqrt(),
        });
        let mut changes: Vec<Change> = changes.collect();
        if matches!(cause.kind, CauseKind::Noise | CauseKind::Other) {
            let (parameter, unit) =
                ("noise, as a multiple of the known one".to_owned(), Unit::Number);
            changes.push(Change { parameter, unit, change: assessed.mean[0], std_error: f64::NAN });
        }
        let rival = rival.filter(|rival| rival.cause != assessed.cause);
        WatchedCause {
            kind: cause.kind,
            label: cause.label.clone(),
            row: assessed.row,
            from_row: None,
            probability: assessed.probability,
            changes,
            left_out_error: match (cause.kind, assessed.row) {
                (CauseKind::Noise | CauseKind::Other, _) => None,
                (_, Some(off)) => {
                    Some(self.rms_of(|row| row != off, |row| self.rows.residual_of(row)))
                }
                _ => self.left_out_error(cause, assessed),
            },
            poses_to_tell_apart: rival.and_then(|rival| self.poses_to_tell_apart(assessed, rival)),
        }
    }

    /// Returns the root mean square length, over the rows of the leading kind, of the residuals
    /// that `residual` returns in units of σ \[m\] or \[rad\].
    fn rms(&self, residual: impl Fn(usize) -> DVector<f64>) -> f64 {
        self.rms_of(|_| true, residual)
    }

    /// Returns the same length over those rows for which `is_included` is true.
    fn rms_of(
        &self,
        is_included: impl Fn(usize) -> bool,
        residual: impl Fn(usize) -> DVector<f64>,
    ) -> f64 {
        let chosen: Vec<usize> =
            (0..self.rows.len()).filter(|&row| self.leads[row] && is_included(row)).collect();
        let square = |&row: &usize| {
            let numbers = residual(row);
            numbers.rows(0, numbers.len().min(3)).norm_squared() * self.rows.sigma[row].powi(2)
        };
        (chosen.iter().map(square).sum::<f64>() / chosen.len().max(1) as f64).sqrt()
    }

    /// Returns the root mean square error of the rows of the leading kind, each predicted with the
    /// changes of the cause as estimated without the row's group. `None` if a number is not finite.
    fn left_out_error(&self, cause: &Cause, assessed: &AssessedCause) -> Option<f64> {
        let (rows, columns) = self.rows.masked_before(assessed.onset, &cause.columns);
        let (rows, factor) = (&rows, padded_factor(self.factor, columns.len()));
        let sums = sums_of(rows);
        let groups = rows.len().min(MAX_GROUPS);
        let means: Option<Vec<DVector<f64>>> = (0..groups)
            .map(|group| {
                let mut others = sums.clone();
                (group..rows.len()).step_by(groups).for_each(|row| others.add(rows, row, -1.0));
                let unchanged = Unchanged::new(&others, &factor)?;
                Some(unchanged.likelihood_ratio(&columns, &assessed.sizes)?.1)
            })
            .collect();
        let means = means?;
        Some(self.rms(|row| {
            let moved = rows.of_row(row).select_columns(&columns);
            rows.residual_of(row) - moved * &means[row % groups]
        }))
    }

    /// Returns the number of additional poses like these after which a cause is expected to be nine
    /// times as probable as its rival, if it is the true one. `None` if one of the two moves no
    /// parameter, or if the poses hardly distinguish them.
    fn poses_to_tell_apart(
        &self,
        assessed: &AssessedCause,
        rival: &AssessedCause,
    ) -> Option<usize> {
        let (cause, other) = (&self.causes[assessed.cause], &self.causes[rival.cause]);
        let wanted = (MIN_NAMED_PROBABILITY / (1.0 - MIN_NAMED_PROBABILITY)).ln()
            - (assessed.probability / rival.probability).ln();
        if wanted <= 0.0 {
            return Some(0);
        }
        if cause.columns.is_empty() || other.columns.is_empty() {
            return None;
        }
        let (rows, columns) = self.rows.masked_before(assessed.onset, &cause.columns);
        let (rows, of_rival) = rows.masked_before(rival.onset, &other.columns);
        let factor = padded_factor(self.factor, columns.len() + of_rival.len());
        let unchanged = Unchanged::new(&sums_of(&rows), &factor)?;
        let part = |a: &[usize], b: &[usize]| {
            DMatrix::from_fn(a.len(), b.len(), |i, j| unchanged.information[(a[i], b[j])])
        };
        // Evidence of the change for the cause, minus the part that the rival can imitate.
        let shown = part(&columns, &columns) * &assessed.mean;
        let seen = part(&of_rival, &columns) * &assessed.mean;
        let mut matrix = part(&of_rival, &of_rival);
        for (i, size) in rival.sizes.iter().enumerate() {
            matrix[(i, i)] += size.powi(-2);
        }
        let imitated = seen.dot(&matrix.cholesky()?.solve(&seen));
        let nats = 0.5 * (assessed.mean.dot(&shown) - imitated).max(0.0);
        let of_pose = nats / (rows.len() - assessed.onset) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small, ≥ 0")]
        let poses = (wanted / of_pose).ceil() as usize;
        (of_pose > MIN_NATS_PER_POSE).then_some(poses)
    }
}

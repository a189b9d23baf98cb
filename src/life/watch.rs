//! Watch: test whether an arm has changed since its estimate, and of the causes.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::assessment::{AssessedCause, assess};
use super::causes::{Cause, CauseKind, Extended};
use super::earlier::{EQUAL_SIGMA, Earlier};
use super::error::PriorError;
use super::evidence::factor;
use super::identify::covariance;
use super::onset::with_onsets;
use super::relocation::{self, MIN_RELOCATION_NATS, Placed};
use super::reporter::{Change, MIN_NAMED_PROBABILITY, Reporter, WatchedCause};
use super::rows::{SensitiveRows, SharedMisfit, warmth};
use crate::error::InputErrorKind;
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
/// p-value of χ² below which noise and the known misfit, with drift if there is any, do not explain
/// the rows.
pub(crate) const MIN_EXPECTED_P: f64 = 0.01;
/// Largest ratio of the errors after a base is registered to those before at which the base counts
/// as moved, though the rows show another change too.
const MAX_REGISTERED_ERROR: f64 = 0.05;
/// Largest root mean square error after a base is registered, in units of the noise, at which the
/// base counts as moved beside another change: more than that is read wrongly.
const MAX_REGISTERED_SIGMAS: f64 = 100.0;
/// Prior odds that something else changed together with a placement (a base, camera or marker),
/// against the placement alone.
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
    /// True if the estimate has a remainder, which the test leaves out.
    pub leaves_remainder: bool,
    /// Number of rows at each look, and ln of the evidence for a change from these rows.
    pub looks: Vec<(usize, f64)>,
    /// Number of rows at the first look with an alarm; `None` if the arm is unchanged.
    pub changed_at: Option<usize>,
    /// χ² of all rows under "unchanged", its degrees of freedom, and its p-value.
    pub chi2: (f64, f64, f64),
    /// Days since the estimate, whose drift counts as no change.
    pub days: f64,
    /// p-value of the rows under "unchanged" without any drift; `None` for an estimate without age.
    pub p_without_drift: Option<f64>,
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

impl Watch {
    /// Returns true if the test found that the arm or its measurement has changed.
    pub fn is_changed(&self) -> bool {
        self.changed_at.is_some()
    }

    /// Returns true if nothing has changed, but only because drift explains the rows: without drift
    /// their p-value is below 0.01.
    pub fn has_drifted(&self) -> bool {
        !self.is_changed()
            && self.chi2.2 >= MIN_EXPECTED_P
            && self.p_without_drift.is_some_and(|p| p < MIN_EXPECTED_P)
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
    let new: Vec<usize> =
        (0..measurements.len()).filter(|&row| !measurements.is_among(row, fitted)).collect();
    let left_out = measurements.len() - new.len();
    if new.is_empty() {
        return Err(PriorError::NothingNew { file: estimate.file.clone(), rows: left_out });
    }
    let kept = if left_out > 0 { measurements.select(&new) } else { measurements.clone() };
    let placement = Placement::of(&kept);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let earlier = Earlier::of_estimate(estimate, problem, &model, days)?;
    let predicted = fit::predict(problem, Some(estimate), &kept, None)?;
    if let [first, others @ ..] = predicted.lost_rows().as_slice() {
        let kind = InputErrorKind::LoadsTooLarge { others: others.len() };
        return Err(kept.location(*first).error(kind).into());
    }
    let x = predicted.x;
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
    let undrifted = (days > 0.0).then(|| Earlier::of_estimate(estimate, problem, &model, 0.0));
    let undrifted = undrifted.transpose()?.and_then(|earlier| {
        let Linearised { rows, factor, .. } = tested.linearised(&poses, &x, &earlier);
        let assessed = assess(&rows, &factor, &[], false)?;
        Some(p_value(assessed.chi2, assessed.coordinates))
    });
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
    if changed_at.is_some() {
        let at = (&*poses, &x);
        let linear = (assessed.chi2, assessed.looks.last().map_or(0.0, |look| look.1));
        let moved = tested.moved_fixture(at, (&earlier, &leads), threshold, linear);
        let base = || tested.moved_base(at, (&earlier, &leads), threshold, linear);
        let moved = moved.or_else(|| base().filter(|_| is_unexplained));
        watched = moved.unwrap_or(watched);
    }
    state_turns(&model, &x, &mut watched);
    Ok(Watch {
        false_alarm_rate,
        estimate_trusted: estimate.trusted,
        rows: kept.len(),
        left_out,
        leaves_remainder: estimate.remainder.is_some(),
        looks: assessed.looks,
        changed_at,
        chi2: (assessed.chi2, assessed.coordinates, p_value(assessed.chi2, assessed.coordinates)),
        days,
        p_without_drift: undrifted,
        error: report.rms(|row| at_estimate.rows.residual_of(row)),
        unit: kind_named(leading.kind()).unit,
        sigma: leads
            .iter()
            .position(|leads| *leads)
            .map_or(f64::NAN, |first| at_estimate.rows.total_sigma(first)),
        causes: watched,
    })
}

/// States the changes of the orientation of cameras and markers in `causes` as rotation vectors of
/// their turns. `x` is the full parameter vector of the unchanged arm. Turns have no standard
/// errors.
fn state_turns(model: &Model, x: &DVector<f64>, causes: &mut [WatchedCause]) {
    let fixtures = relocation::placements(model);
    for cause in causes {
        let of_cause = |placed: &&Placed| !placed.is_base && placed.label == cause.label;
        let Some(placed) = fixtures.iter().find(of_cause) else { continue };
        let mut after = x.clone();
        for (change, &k) in cause.changes.iter().zip(&placed.parameters) {
            after[k] += change.change;
        }
        let moves = placed.moved(model, x, &after);
        for (axis, (change, moved)) in cause.changes.iter_mut().zip(moves).enumerate() {
            change.change = moved;
            if axis >= 3 {
                change.std_error = f64::NAN;
            }
        }
    }
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

    /// Returns the move of a camera or marker as the cause, if the rows are as expected once its
    /// pose has been fitted to them, and if small changes explain them less well. `linear` holds χ²
    /// of the unchanged arm and ln of the evidence for all small changes. Returns `None` if no
    /// camera or marker explains the rows.
    fn moved_fixture(
        &self,
        (poses, x): (&[Pose], &DVector<f64>),
        (earlier, leads): (&Earlier, &[bool]),
        threshold: f64,
        (chi2, linear): (f64, f64),
    ) -> Option<Vec<WatchedCause>> {
        let fixtures = relocation::placements(self.model);
        let tried = fixtures.iter().filter(|placed| !placed.is_base).filter_map(|placed| {
            let located = relocation::located_anew(self.model, poses, x, placed)?;
            let at_place = self.linearised(poses, &located, earlier);
            let assessed = assess(&at_place.rows, &at_place.factor, &at_place.causes, false)?;
            let (_, evidence) = *assessed.looks.last()?;
            let gain = 0.5 * (chi2 - assessed.chi2) - MIN_RELOCATION_NATS;
            let is_moved =
                |cause: &&AssessedCause| at_place.causes[cause.cause].columns == placed.parameters;
            let moved = assessed.causes.iter().find(is_moved)?;
            let is_explained = gain > linear && evidence < threshold;
            let mut watched = at_place.reporter(leads).cause(moved, None);
            for (change, &k) in watched.changes.iter_mut().zip(&placed.parameters) {
                change.change += at_place.extended.x[k] - x[k];
            }
            watched.probability = 1.0 / (1.0 + SECOND_CHANGE_ODDS * evidence.exp());
            is_explained.then_some((gain, watched))
        });
        tried.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, watched)| vec![watched])
    }

    /// Returns a move of the only base as the cause, if it explains the rows: after the base has
    /// been registered to them, ln of the evidence for another change is below `threshold`, or the
    /// errors are a small fraction of those before, so that the base has moved whatever else
    /// changed. The last argument holds χ² of the unchanged arm and ln of the evidence for all small
    /// changes. A rotation about the axis of joint 1 may as well be a changed zero of that joint,
    /// which is then returned as a second cause. Returns `None` if the base does not explain the
    /// rows.
    ///
    /// Other tests take positions as linear in the changes, which fails for a base that is rotated
    /// by some degrees.
    fn moved_base(
        &self,
        (poses, x): (&[Pose], &DVector<f64>),
        (earlier, leads): (&Earlier, &[bool]),
        threshold: f64,
        (chi2, linear): (f64, f64),
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
        let base = assessed.causes.iter().find(is_base)?;
        let is_alone = evidence < threshold;
        let before = SensitiveRows::new(self.model, poses.to_vec(), x).residual.norm();
        let after = at_base.rows.residual.norm();
        let largest = MAX_REGISTERED_SIGMAS * assessed.coordinates.sqrt();
        // ln of the odds of the base with another change, against all small changes together.
        let both = evidence + SECOND_CHANGE_ODDS.ln();
        let gain = 0.5 * (chi2 - assessed.chi2) - MIN_RELOCATION_NATS + both - linear;
        let is_small = after <= largest.min(MAX_REGISTERED_ERROR * before);
        (is_alone || is_small && gain > 0.0).then_some(())?;
        let mut watched = at_base.reporter(leads).cause(base, None);
        for (change, &k) in watched.changes.iter_mut().zip(&at_base.causes[base.cause].columns) {
            change.change += at_base.extended.x[k] - x.get(k).copied().unwrap_or(0.0);
        }
        watched.probability = if is_alone {
            1.0 / (1.0 + SECOND_CHANGE_ODDS * evidence.exp())
        } else {
            1.0 / (1.0 + (-gain).exp())
        };
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

/// Returns the p-value of χ² with `coordinates` degrees of freedom.
fn p_value(chi2: f64, coordinates: f64) -> f64 {
    ChiSquared::new(coordinates).map_or(f64::NAN, |distribution| distribution.sf(chi2))
}

/// Number of standard errors by which the variance of prediction errors must exceed the declared
/// noise variance to count as misfit.
const MIN_EXCESS_ERRORS: f64 = 2.0;

/// Noise of new rows, and the misfit that the earlier fit found beyond it.
struct KnownNoise {
    /// Standard deviation (1 σ) of the noise of a position's coordinate in rows that state none
    /// \[m\]; `None` if neither problem nor estimate states it.
    pub sigma: Option<f64>,
    /// Standard deviation (1 σ) of the misfit of a position's coordinate \[m\].
    misfit: f64,
    /// Standard deviation (1 σ) of the misfit of other coordinates, in units of their noise.
    other_misfit: f64,
}

impl KnownNoise {
    /// Returns the declared noise, or else that of the earlier fit, and the misfit beyond it. The
    /// misfit is the excess of the larger of two: the σ that the earlier fit took, and the noise of
    /// its predictions if that is significantly larger than the declared one.
    pub fn of(problem: &Problem, estimate: &SavedEstimate) -> Self {
        let saved = &estimate.posterior;
        let declared = problem.data.position_sigma.or(estimate.estimated_sigma);
        // For rows that state their σ, the noise is the σ that the fit took without its misfit.
        let of_rows = |taken: f64| taken / saved.noise_factor.max(1.0).sqrt();
        let sigma = declared.or(saved.sigma_taken.map(of_rows));
        let of_predictions = |sigma: f64| {
            let text = estimate.prediction.as_ref()?;
            let prediction: serde_json::Value = serde_json::from_str(text).ok()?;
            let number = |key: &str| prediction.get(key)?.as_f64();
            let noise = number("noise_m")?.hypot(number("configuration_noise_m")?);
            // Relative standard error of the variance, estimated from about half the coordinates.
            let configurations = prediction.get("scores")?.get("configurations")?.as_f64()?;
            let scatter = (2.0 / (1.5 * configurations).max(1.0)).sqrt();
            Some(noise).filter(|noise| (noise / sigma).powi(2) > 1.0 + MIN_EXCESS_ERRORS * scatter)
        };
        let misfit = sigma.map_or(0.0, |sigma| {
            let taken = saved.sigma_taken.filter(|taken| *taken > sigma * (1.0 + EQUAL_SIGMA));
            let largest = taken.unwrap_or(0.0).max(of_predictions(sigma).unwrap_or(0.0));
            (largest * largest - sigma * sigma).max(0.0).sqrt()
        });
        let excess = saved.noise_factor - 1.0;
        let other_misfit = if excess > EQUAL_SIGMA { excess.sqrt() } else { 0.0 };
        Self { sigma, misfit, other_misfit }
    }

    /// Returns 1 σ of the misfit of each coordinate of each pose in units of its noise; `None`
    /// without a misfit.
    pub fn misfit_of(&self, poses: &[Pose]) -> Option<Vec<Vec<f64>>> {
        if self.misfit == 0.0 && self.other_misfit == 0.0 {
            return None;
        }
        let of_pose = |pose: &Pose| {
            let is_position = pose.observation.is_position();
            let first = if is_position { self.misfit / pose.sigma } else { self.other_misfit };
            let mut misfit = vec![first; pose.observation.coordinates()];
            misfit.resize(pose.coordinates(), self.other_misfit);
            misfit
        };
        Some(poses.iter().map(of_pose).collect())
    }
}

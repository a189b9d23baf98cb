//! Watch: test whether an arm has changed since its estimate, and of the causes.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::assessment::{AssessedCause, Assessment, assess};
use super::causes::{Cause, CauseKind, Extended};
use super::earlier::Earlier;
use super::error::PriorError;
use super::evidence::{MIN_NAMED_PROBABILITY, factor};
use super::identify::covariance;
use super::known_noise::KnownNoise;
use super::onset::with_onsets;
use super::pairs::with_pairs;
use super::relocation::{self, LocatedAnew, Placed};
use super::reporter::{Change, Reporter, WatchedCause};
use super::rows::{SensitiveRows, SharedMisfit, warmth};
use crate::error::TableErrorKind;
use crate::fit::{self, Placement, SavedEstimate, register};
use crate::measurement::Measurements;
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose};
use crate::observation::kind_named;
use crate::problem::{JointKind, Problem};
use crate::quantity::Unit;
use crate::remainder::{Uncorrected, unknown_sides};
use crate::spatial::Frame;

/// Maximum number of causes that are reported.
const MAX_REPORTED_CAUSES: usize = 6;
/// Smallest probability at which a cause is reported that is not the most probable one.
const MIN_REPORTED_PROBABILITY: f64 = 0.005;
/// p-value of χ² below which noise and the known misfit, with drift if there is any, do not explain
/// the rows.
pub(crate) const MIN_EXPECTED_P: f64 = 0.01;
/// Smallest ratio of the error that a named cause leaves to the expected one at which the cause is
/// not the whole change, or not the right one. Causes are linear in the change, so that the right
/// one, if large, may leave a little more than is expected.
const MIN_UNEXPLAINED_RATIO: f64 = 1.5;
/// Largest probability that chance alone leaves such an error.
const MAX_UNEXPLAINED_CHANCE: f64 = 1e-4;
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
    /// Root mean square error of these rows that noise, the known misfit and the uncertainty of the
    /// estimate without drift give \[m\] or \[rad\].
    pub expected_error: f64,
    /// Unit of the errors: that of the leading kind of rows.
    pub unit: Unit,
    /// Standard deviation (1 σ) of a coordinate of the first row of the leading kind, noise and
    /// known misfit together \[m\] or \[rad\].
    pub sigma: f64,
    /// Causes of a change, the most probable first.
    pub causes: Vec<WatchedCause>,
    /// Effects of unknown directions of approach; the test allows for both sides.
    pub(crate) sides: Vec<Uncorrected>,
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

    /// Returns the error of left-out rows with the named cause updated \[m\] or \[rad\], if it is so
    /// much larger than expected that something else has changed or drifted, instead or as well.
    pub fn unexplained_error(&self) -> Option<f64> {
        let cause = self.named()?;
        let left = cause.left_out_error?;
        let coordinates = self.chi2.1;
        let chi2 = ChiSquared::new(coordinates).ok()?.inverse_cdf(1.0 - MAX_UNEXPLAINED_CHANCE);
        let ratio = (chi2 / coordinates).sqrt().max(MIN_UNEXPLAINED_RATIO);
        // Each left-out row is predicted with p changes that the n other coordinates determine, which
        // multiplies its variance by n / (n − p) on average.
        let kept = coordinates - cause.changes.len() as f64;
        if kept <= 0.0 {
            return None;
        }
        let expected = (coordinates / kept).sqrt() * self.expected_error;
        (left > ratio * expected).then_some(left)
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
    let kept = measurements.select_with_past(&new);
    let kept = &*kept.with_sides(estimate.has_approach);
    let placement = Placement::of(kept);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let earlier = Earlier::of_estimate(estimate, problem, &model, days)?;
    let predicted = fit::predict(problem, Some(estimate), kept, None)?;
    if let [first, others @ ..] = predicted.lost_rows().as_slice() {
        let kind = TableErrorKind::LoadsTooLarge { others: others.len() };
        return Err(kept.location(*first).error(kind).into());
    }
    let x = predicted.x;
    let every_row: Vec<usize> = (0..kept.len()).collect();
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let known = KnownNoise::of(problem, estimate);
    if known.sigma.is_none() && !kept.has_sigma_in_every_row() && has_positions(kept) {
        return Err(PriorError::NoSigma { file: estimate.file.clone() });
    }
    let sigma = known.sigma.unwrap_or(f64::NAN);
    let mut poses = placement.oriented_poses(kept, &every_row, (sigma, turn));
    estimate.count_time_in(&placement, &mut poses);
    let sides = unknown_sides((problem, &model), x.as_slice(), &poses);
    let misfit = known.misfit_with_sides((problem, &model, &x), &poses);
    let leading = kept.leading();
    let leads: Vec<bool> =
        every_row.iter().map(|&row| kept.observation(row).kind() == leading.kind()).collect();
    let tested = TestedRows { problem, model: &model, placement: &placement, kept, misfit };
    let not_finite = || PriorError::NotFinite { file: estimate.file.clone() };
    let mut at_estimate = tested.linearised(&poses, &x, &earlier);
    let mut assessed = assess(&at_estimate.rows, &at_estimate.factor, &at_estimate.causes, true)
        .ok_or_else(not_finite)?;
    let threshold = -false_alarm_rate.ln();
    let changed_at = assessed.looks.iter().find(|look| look.1 >= threshold).map(|look| look.0);
    let mut is_unexplained = false;
    if changed_at.is_some() {
        let Linearised { rows, factor, causes, .. } = &mut at_estimate;
        let single = with_onsets(assessed, rows, factor, causes).ok_or_else(not_finite)?;
        let first = single.causes.first();
        is_unexplained = first.is_some_and(|of| causes[of.cause].kind == CauseKind::Other);
        assessed = with_pairs(single, rows, factor, causes).ok_or_else(not_finite)?;
    }
    let undrifted = (days > 0.0).then(|| Earlier::of_estimate(estimate, problem, &model, 0.0));
    let undrifted = undrifted.transpose()?.map(|earlier| tested.linearised(&poses, &x, &earlier));
    let p_without_drift = undrifted.as_ref().and_then(|Linearised { rows, factor, .. }| {
        let assessed = assess(rows, factor, &[], false)?;
        Some(p_value(assessed.chi2, assessed.coordinates))
    });
    let undrifted = &undrifted.as_ref().unwrap_or(&at_estimate).factor;
    let report = at_estimate.reporter(&leads, undrifted);
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
            alike: report.placement_alike(reported[k]),
            ..report.cause(reported[k], reported.get(usize::from(k == 0)).copied())
        })
        .collect();
    if changed_at.is_some() {
        let at = (&*poses, &x);
        let evidence = assessed.looks.last().map_or(0.0, |look| look.1.max(assessed.ln_sum));
        let linear = (assessed.chi2, evidence);
        let moved = tested.moved_fixture(at, (&earlier, &leads), threshold, linear);
        let base = || tested.moved_base(at, (&earlier, &leads), threshold, linear);
        let moved = moved.or_else(|| base().filter(|_| is_unexplained));
        let misread = fit::misread_table(problem, (&model, &x), kept);
        watched = WatchedCause::or_misread(moved.unwrap_or(watched), misread);
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
        p_without_drift,
        error: report.rms(|row| at_estimate.rows.residual_of(row)),
        expected_error: report.expected_error(),
        unit: kind_named(leading.kind()).unit,
        sigma: leads
            .iter()
            .position(|leads| *leads)
            .map_or(f64::NAN, |first| at_estimate.rows.total_sigma(first)),
        causes: watched,
        sides,
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
    /// Columns of bases and targets that the estimate does not know.
    unknown: Vec<usize>,
}

impl Linearised {
    /// Returns the reporter of these causes; `leads` is true for rows of the leading kind, and
    /// `undrifted` is the factor of the covariance without drift.
    fn reporter<'a>(&'a self, leads: &'a [bool], undrifted: &'a DMatrix<f64>) -> Reporter<'a> {
        let Self { rows, factor, unknown, causes, .. } = self;
        Reporter { rows, factor, undrifted, unknown, causes, leads }
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
        let is_unknown =
            |k: &usize| earlier.place_of(*k).is_none() && model.parameters[*k].site.is_placement();
        let unknown = (0..extended.declared).filter(is_unknown).collect();
        Linearised { extended, rows, causes, factor, unknown }
    }

    /// Returns the rows as they are `at_place`, after something has been located anew, beside those at
    /// the full parameter vector `x`. `assessed` is the test of the rows there.
    fn of_place(
        &self,
        poses: &[Pose],
        x: &DVector<f64>,
        at_place: &Linearised,
        assessed: &Assessment,
    ) -> LocatedAnew {
        let before = SensitiveRows::new(self.model, poses.to_vec(), x).residual.norm();
        LocatedAnew {
            chi2: assessed.chi2,
            evidence: assessed.looks.last().map_or(0.0, |look| look.1),
            coordinates: assessed.coordinates,
            residuals: [before, at_place.rows.residual.norm()],
        }
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
            let is_moved =
                |cause: &&AssessedCause| at_place.causes[cause.cause].columns == placed.parameters;
            let moved = assessed.causes.iter().find(is_moved)?;
            let of_place = self.of_place(poses, x, &at_place, &assessed);
            let (probability, gain) = of_place.weighed(threshold, (chi2, linear))?;
            // A single change of the place is compared with the small changes by χ² alone.
            let is_explained = of_place.evidence >= threshold || gain > linear;
            let mut watched = at_place.reporter(leads, &at_place.factor).cause(moved, None);
            for (change, &k) in watched.changes.iter_mut().zip(&placed.parameters) {
                change.change += at_place.extended.x[k] - x[k];
            }
            watched.probability = probability;
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
        let is_base = |cause: &&AssessedCause| at_base.causes[cause.cause].kind == CauseKind::Base;
        let base = assessed.causes.iter().find(is_base)?;
        let of_place = self.of_place(poses, x, &at_base, &assessed);
        let (probability, _) = of_place.weighed(threshold, (chi2, linear))?;
        let mut watched = at_base.reporter(leads, &at_base.factor).cause(base, None);
        for (change, &k) in watched.changes.iter_mut().zip(&at_base.causes[base.cause].columns) {
            change.change += at_base.extended.x[k] - x.get(k).copied().unwrap_or(0.0);
        }
        watched.probability = probability;
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

//! Search for the misreadings that explain why an arm does not fit its measurements.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{DVector, Vector3};

use super::Misreading;
use super::candidates::{candidates, is_far, of_loads, of_order, shift_step};
use super::chosen_rows::chosen_rows;
use super::explanation::{Explanation, Explanations, LeftOutMisfit};
use super::two_entries::of_two_entries;
use super::undo::is_unit_ratio;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::common_scale::MIN_SCALE_ERROR;
use crate::fit::checks::nominal_error::is_nominal_far_off;
use crate::fit::checks::parameter_limits::{MAX_PRIOR_SIGMAS, is_of_arm, prior_sigmas};
use crate::fit::checks::row_kind::spread;
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::{Placement, SolverChoice};
use crate::least_squares::{LinearisationCache, Loss};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::numeric::parallel;
use crate::problem::Problem;

/// Largest ratio of the rms error with a misreading corrected to that without a correction, at
/// which the misreading is an explanation.
pub(super) const MAX_EXPLAINED_RATIO: f64 = 0.2;
/// Largest ratio of the error with a misreading corrected to that with the best one, at which the
/// misreading is also named.
pub(super) const MAX_RATIO_TO_BEST: f64 = 1.5;
/// Largest rms error of the registered nominal arm, as a multiple of its reach, for which
/// misreadings are searched. Millimetres read as metres give a factor of 1000.
const MAX_REACHES: f64 = 1e4;
/// Largest rms error of the registered nominal arm, as a multiple of its reach, for which only
/// misread loads and shifted rows are searched. A joint angle that is wrong by one degree causes
/// seven times as much.
const MAX_REACHES_OF_LOADS: f64 = 2e-3;
/// Smallest error of the registered nominal arm with any other misreading, as a multiple of its reach,
/// at which other numbers in the joint table are tried.
const MIN_REACHES_OF_TYPED: f64 = 0.01;
/// Smallest motion of a joint over all rows, \[rad\] or \[m\], at which a fitted ratio of motion to
/// command is a misreading. A smaller motion means that the joint does not follow its command at
/// all.
const MIN_MOTION: f64 = 0.01;
/// Range of the fitted lead of a screw \[m\] in which it is a misreading: that of ball screws,
/// somewhat widened.
const SCREW_LEAD_RANGE: RangeInclusive<f64> = 1e-3..=0.2;
/// Largest rms error, as a multiple of the arm's reach, at which a misreading is named although
/// parameters deviate far beyond their priors. Nominal arms are wrong by about as much, and their
/// priors may be too narrow.
const MAX_REACHES_BEYOND_PRIORS: f64 = 5e-4;
/// Smallest deviation from 1 of a ratio of motion to command that is a misreading. The ratios of
/// gears deviate by less.
const MIN_RATIO_ERROR: f64 = 1e-3;
/// Maximum number of identification rows, evenly spaced, to which misreadings are applied.
const MAX_ROWS: usize = 120;
/// Largest error of the registered nominal arm with a misreading corrected, relative to the spread of
/// the points, at which the points follow the arm.
const MAX_PART_OF_SPREAD: f64 = 0.5;
/// Maximum number of misreadings that are fitted in full: those with the smallest error of the
/// registered nominal arm.
const MAX_FITTED_MISREADINGS: usize = 12;
/// Maximum number of solver steps of a full fit with a misreading.
const MAX_STEPS: u64 = 60;
/// Largest rms residual of a fit with a misreading undone that counts as noise, as a multiple of
/// the declared σ. Residuals of real arms reach several σ.
pub(in crate::fit) const MAX_NOISE_SIGMAS: f64 = 5.0;
/// Largest ratio of the error with a misreading undone to that as read, at which the misreading is
/// sure although more than noise is left. Another cause that acts alike hardly removes as much.
pub(in crate::fit) const MAX_CLEAR_RATIO: f64 = 0.02;
/// Relative reduction of the cost by one step below which a registration without a full fit ends.
/// The error is then accurate enough for a comparison at [`MAX_RATIO_TO_BEST`].
pub(super) const TRIAL_TOLERANCE: f64 = 1e-4;
/// Share of the rows with the largest errors that are excluded from rms errors if the problem has a
/// robust loss.
const MAX_SET_ASIDE_SHARE: f64 = 0.3;

/// Result of a trial with a misreading corrected.
pub(super) struct Outcome {
    /// Root mean squared error \[m\]; after a full fit it includes the deviations from priors.
    pub rms: f64,
    /// Fitted size of the misreading; `None` without a full fit, or if the misreading has no size.
    size: Option<f64>,
    /// Words on the base or target that a full fit found elsewhere than declared; otherwise empty.
    place: String,
    /// Cross-validation misfit of a full fit; `None` without one.
    left_out: Option<LeftOutMisfit>,
    /// True if no parameter of the arm deviates far beyond its prior; always true without a full
    /// fit.
    is_within_priors: bool,
}

/// Fit, problem and chosen rows to which misreadings are applied.
pub(super) struct Trial<'a> {
    pub fitting: &'a Fitting<'a>,
    pub problem: &'a Problem,
    pub chosen: Vec<usize>,
}

/// Finds the misreadings that explain why the fit does not agree with its measurements.
pub(super) fn explanations(fit: &CheckedFit) -> Explanations {
    let Fitting { measurements, model, .. } = fit.fitting;
    let nominal = fit.registered.identification.rms.norm;
    if nominal.is_nan() || nominal > MAX_REACHES * model.reach() {
        return Explanations::default();
    }
    let trial = Trial::new(fit);
    // The error as declared, without orientations as in all trials: reversing no joint changes
    // nothing.
    let as_declared = trial.outcome(Misreading::Reversed { joints: 0 }, false);
    let nominal = as_declared.map_or(nominal, |outcome| outcome.rms.min(nominal));
    let is_position = measurements.leading().is_position();
    // Contacts with one point agree with any arm whose target hardly moves. For rows other than
    // positions, only reversed joints are therefore tried.
    let last = trial.chosen.last().copied().unwrap_or_default();
    let is_tested = |misreading: &Misreading| match misreading {
        Misreading::Reversed { .. } => true,
        // A shift that begins behind the last row changes nothing.
        Misreading::Shifted { from, .. } => is_position && *from <= last,
        _ => is_position,
    };
    let listed = if is_position && nominal < MAX_REACHES_OF_LOADS * model.reach() {
        [of_loads(fit.problem, measurements), of_order(measurements)].concat()
    } else {
        candidates(fit.problem, measurements)
    };
    let mut tested: Vec<Misreading> = listed.into_iter().filter(is_tested).collect();
    let mirrored = Misreading::Mirrored { axes: None };
    if !fit.is_base_free() && tested.contains(&mirrored) {
        tested.retain(|misreading| *misreading != mirrored);
        let pairs = (0..3).flat_map(|first| (first..3).map(move |second| [first, second]));
        tested.extend(pairs.map(|axes| Misreading::Mirrored { axes: Some(axes) }));
    }
    // A base that is only a little off is no misreading.
    let is_base_held = is_position && fit.is_a_base_held() && is_nominal_far_off(fit);
    tested.extend(is_base_held.then_some(Misreading::HeldBase));
    // A target that is declared far from its frame may be in millimetres, which another misreading
    // covers.
    let is_target_held = is_position && fit.is_target_held() && !is_far(fit.problem);
    tested.extend(is_target_held.then_some(Misreading::HeldTarget));
    let mut errors = trial.registered_errors(&tested);
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    // Two reversed joints have the same effect as an α between them that is wrong by 180°.
    let alone: Vec<(Misreading, f64)> = errors
        .iter()
        .copied()
        .filter(|(misreading, _)| !matches!(misreading, Misreading::Twist { .. }))
        .collect();
    let is_near_alone = !near_misreadings(&alone, nominal).is_empty();
    let near_alone = if is_near_alone { near_misreadings(&errors, nominal) } else { Vec::new() };
    if is_position || near_misreadings(&errors, nominal).is_empty() {
        errors.extend(trial.several_reversed(&tested));
    }
    let is_near = !near_misreadings(&errors, nominal).is_empty();
    errors.extend(trial.registered_errors(&of_two_entries(&tested, is_near)));
    // Any other number in the joint table is only tried where no usual mistake comes near.
    let least = errors.iter().map(|(_, error)| *error).fold(nominal, f64::min);
    if is_position && least > MIN_REACHES_OF_TYPED * model.reach() {
        errors.extend(trial.typed_entries(fit.problem, nominal));
    }
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    if let Some(shift) = errors.iter_mut().find(|(found, _)| found.shifted_from().is_some()) {
        *shift = trial.with_best_start(*shift);
    }
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let near = if near_alone.is_empty() { near_misreadings(&errors, nominal) } else { near_alone };
    let near_error = errors.iter().find(|(found, _)| near.first() == Some(found));
    let near_error = near_error.map_or(f64::NAN, |(_, error)| *error);
    let mut explanations = Explanations { near, near_error, ..Explanations::default() };
    if is_position {
        explanations.as_read = trial.error_as_read(fit);
        let error = explanations.as_read.min(trial.refitted_error(fit));
        explanations.fitted = trial.fit_in_full(&errors, error);
        if explanations.fitted.is_empty() && least > MIN_REACHES_OF_TYPED * model.reach() {
            explanations.fitted = trial.of_two_mistakes(fit, (&tested, &errors), error);
        }
    }
    explanations
}

/// Returns the sum of the squared deviations of the full parameter vector `x` from nominal, in
/// units of the prior σ. Parameters of declared effects are left out, because they may be far
/// larger than their priors. So are parameters that only held-out rows use, because they are not
/// fitted.
fn deviations(fitting: &Fitting, x: &DVector<f64>) -> f64 {
    let later = &fitting.held_out_only.parameters;
    let parameters = fitting.model.parameters.iter().zip(x).zip(later);
    let of_arm = parameters.filter(|((parameter, _), later)| is_of_arm(parameter) && !**later);
    of_arm.filter_map(|((parameter, x), _)| Some((x / parameter.sigma?).powi(2))).sum()
}

/// Returns the misreadings whose error of the registered nominal arm is far smaller than `nominal`,
/// the error without a correction. `errors` is in ascending order.
pub(super) fn near_misreadings(errors: &[(Misreading, f64)], nominal: f64) -> Vec<Misreading> {
    let best = errors.first().map_or(0.0, |found| found.1);
    let limit = (MAX_EXPLAINED_RATIO * nominal).min(MAX_RATIO_TO_BEST * best);
    errors.iter().take_while(|found| found.1 <= limit).map(|(misreading, _)| *misreading).collect()
}

impl<'a> Trial<'a> {
    /// Creates the trial on some of the rows of a fit.
    pub(super) fn new(fit: &'a CheckedFit) -> Self {
        Self::with_rows(fit, MAX_ROWS)
    }

    /// Creates the trial on at most about `count` rows of a fit.
    pub(super) fn with_rows(fit: &'a CheckedFit, count: usize) -> Self {
        Self::of_rows(fit.fitting, fit.problem, chosen_rows(fit.fitting, count))
    }

    /// Creates the trial on the `chosen` rows of a fit.
    pub(super) fn of_rows(fitting: &'a Fitting, problem: &'a Problem, chosen: Vec<usize>) -> Self {
        Self { fitting, problem, chosen }
    }

    /// Returns the error of the fit as declared, or of its registered nominal arm if that is less
    /// \[m\].
    pub(super) fn error_as_read(&self, fit: &CheckedFit) -> f64 {
        let at = |x: &DVector<f64>| self.penalised(self.fitting, &self.chosen, x);
        at(&fit.end.x).min(at(fit.registered_x))
    }

    /// Returns the error of the declared problem that is fitted to the chosen rows alone, from the
    /// parameters of the fit \[m\]. A fit to few rows follows their errors more closely, and one
    /// without orientations need not follow these, with or without a misreading. Infinity if the fit
    /// itself is such a fit, or if it fails.
    pub(super) fn refitted_error(&self, fit: &CheckedFit) -> f64 {
        let are_all_chosen = self.chosen.len() == self.fitting.split.identification.len();
        if are_all_chosen && self.fitting.turn_sigma.is_none() {
            return f64::INFINITY;
        }
        let refitted =
            self.with_corrected(Misreading::Reversed { joints: 0 }, true, |fitting, _| {
                let end = fitting.run(&fit.end.x).ok()?;
                Some(self.penalised(fitting, &fitting.split.identification, &end.x))
            });
        refitted.unwrap_or(f64::INFINITY)
    }

    /// Returns the misreadings that can be corrected, each with the rms error of the registered
    /// nominal arm after the correction \[m\].
    pub(super) fn registered_errors(&self, misreadings: &[Misreading]) -> Vec<(Misreading, f64)> {
        let error =
            |&misreading: &Misreading| Some((misreading, self.outcome(misreading, false)?.rms));
        let errors = parallel::map_items(misreadings, error);
        errors.into_iter().flatten().collect()
    }

    /// Fits the misreading with the smallest of `errors` of each group in full, at most
    /// [`MAX_FITTED_MISREADINGS`]. Returns those with an rms error far below `as_read` \[m\], best
    /// first.
    fn fit_in_full(&self, errors: &[(Misreading, f64)], as_read: f64) -> Vec<Explanation> {
        let mut groups = Vec::new();
        let mut is_first = |misreading: &Misreading| {
            let is_new = !groups.contains(&misreading.group());
            groups.push(misreading.group());
            is_new
        };
        let chosen: Vec<Misreading> = errors
            .iter()
            .map(|(misreading, _)| *misreading)
            .filter(|misreading| is_first(misreading))
            .take(MAX_FITTED_MISREADINGS)
            .map(|misreading| self.with_best_ratio(misreading))
            .collect();
        self.explained(&chosen, MAX_EXPLAINED_RATIO * as_read)
    }

    /// Returns those of the `chosen` misreadings that leave less than `limit` \[m\] after a full
    /// fit, best first.
    pub(super) fn explained(&self, chosen: &[Misreading], limit: f64) -> Vec<Explanation> {
        let explanation = |&misreading: &Misreading| {
            if misreading.is_minute() {
                return None;
            }
            let Outcome { rms, size, place, left_out, is_within_priors } =
                self.outcome(misreading, true)?;
            // A negative ratio means that the joint turns against its command, and one of 1 is no
            // misreading.
            let is_impossible = |size: f64| match misreading {
                Misreading::Ratio { joint, .. } => {
                    let is_still = size * self.commanded_range(joint - 1) < MIN_MOTION;
                    is_still && !is_unit_ratio(size) || (size - 1.0).abs() < MIN_RATIO_ERROR
                }
                Misreading::Scale { .. } => (size - 1.0).abs() < MIN_SCALE_ERROR,
                Misreading::Screw { .. } => !SCREW_LEAD_RANGE.contains(&(TAU / size.abs())),
                _ => false,
            };
            if size.is_some_and(is_impossible) {
                return None;
            }
            // An explanation that needs deviations far beyond the priors is of another arm than the
            // measured one. Shifts of rows are exempt, because they leave one row with a wrong
            // configuration.
            let is_shift = misreading.shifted_from().is_some();
            let clocks = misreading.clock_hint(self.fitting.measurements);
            if !is_within_priors && !is_shift && rms > self.largest_usual_error() {
                return None;
            }
            let explanation = Explanation {
                words: misreading.described(size, self.problem) + &place + &clocks,
                rms,
                effect: size.and_then(|size| misreading.expressed(size)),
                left_out: left_out?,
            };
            // Errors are compared in the unit of the table.
            Some((rms / misreading.position_factor(), explanation))
        };
        let explained = parallel::map_items(chosen, explanation);
        let mut explained: Vec<(f64, Explanation)> =
            explained.into_iter().flatten().filter(|(_, of)| of.rms < limit).collect();
        explained.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = explained.first().map_or(0.0, |(rms, _)| *rms);
        explained.retain(|(rms, _)| *rms <= MAX_RATIO_TO_BEST * best);
        explained.into_iter().map(|(_, explanation)| explanation).collect()
    }

    /// Returns the errors with a misreading corrected: those of the registered nominal arm or, if
    /// `is_fitted`, those after a full fit. `None` if the misreading cannot be corrected or fitted.
    pub(super) fn outcome(&self, misreading: Misreading, is_fitted: bool) -> Option<Outcome> {
        self.with_corrected(misreading, is_fitted, |fitting, corrected| {
            let rows = &fitting.split.identification;
            if !is_fitted {
                let registered = fitting.registered_to(TRIAL_TOLERANCE).ok()?;
                let rms = self.error(fitting, rows, &registered);
                let place = String::new();
                let outcome =
                    Outcome { rms, size: None, place, left_out: None, is_within_priors: true };
                // An arm that a misreading shrinks to a point misses points by their spread, which
                // explains nothing, however small the spread is.
                let points = &fitting.measurements.positions;
                let spread = spread(fitting.placement, rows, |place| points[rows[place]]);
                let is_followed = !fitting.measurements.leading().is_position()
                    || misreading == (Misreading::Reversed { joints: 0 })
                    || misreading.typed_change().is_some()
                    || rms <= MAX_PART_OF_SPREAD * spread;
                return (rms.is_finite() && is_followed).then_some(outcome);
            }
            let end = fitting.run(&fitting.registered().ok()?).ok()?;
            let (model, x) = (fitting.model, &end.x);
            let rms = self.penalised(fitting, rows, x);
            let value = |name: &str| {
                let place = model.parameters.iter().position(|parameter| parameter.name == name)?;
                Some(x[place])
            };
            let name = misreading.size(0.0).map(|(name, _)| name);
            let size = name.and_then(|name| Some(misreading.size(value(&name)?)?.1));
            let left_out = Some(self.left_out(fitting, &end, corrected));
            let mut fitted = model.parameters.iter().zip(x);
            let is_within_priors = !fitted.any(|(parameter, x)| {
                prior_sigmas(parameter, *x).is_some_and(|sigmas| sigmas > MAX_PRIOR_SIGMAS)
            });
            let place = misreading.found_place(self.problem, model, x);
            rms.is_finite().then_some(Outcome { rms, size, place, left_out, is_within_priors })
        })
    }

    /// Returns what `result` returns for the fit with a misreading corrected and for the corrected
    /// problem. If `has_free_size`, the size of the misreading is a free parameter. `None` if the
    /// misreading cannot be corrected.
    pub(super) fn with_corrected<R>(
        &self,
        misreading: Misreading,
        has_free_size: bool,
        result: impl FnOnce(&Fitting, &Problem) -> Option<R>,
    ) -> Option<R> {
        let Fitting { model, measurements, .. } = *self.fitting;
        let needs_problem = misreading.rewritten(self.problem);
        if needs_problem.is_none() && misreading.concerns_problem() {
            return None;
        }
        let free = has_free_size
            .then(|| misreading.with_free_size(needs_problem.as_ref().unwrap_or(self.problem)));
        let rewritten = free.flatten().or(needs_problem);
        let joints = rewritten.as_ref().map_or(measurements.joints, |problem| problem.joints.len());
        let rows = misreading.undone(measurements, &self.chosen, (self.problem, joints));
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let placement = Placement::of(&rows);
        let rewritten_model;
        let model = match &rewritten {
            Some(problem) => {
                let declared = Model::new(problem, &placement.bases, &placement.targets).ok()?;
                rewritten_model = self.fitting.strategy.model(declared);
                &rewritten_model
            }
            None => model,
        };
        // The corrected model needs a cache of its own, because its linearisations differ.
        let cache = &LinearisationCache::default();
        let fitting = Fitting {
            model,
            measurements: &rows,
            split: &split,
            placement: &placement,
            held_out_only: placement.held_out_only(model, &rows, &split),
            strategy: self.fitting.strategy.without_sweeps(),
            solver: SolverChoice::Auto.decide(model),
            custom_solver: None,
            progress: None,
            max_steps: Some(MAX_STEPS),
            turn_sigma: None,
            cache,
            linear_model: None,
            ..self.fitting.with_declared_noise()
        };
        result(&fitting, rewritten.as_ref().unwrap_or(self.problem))
    }

    /// Returns the largest rms error \[m\] that noise, or priors that are too narrow, may explain.
    fn largest_usual_error(&self) -> f64 {
        let Fitting { measurements, model, sigma, .. } = self.fitting;
        let noise = MAX_NOISE_SIGMAS * measurements.leading().expected_norm() * sigma;
        noise.max(MAX_REACHES_BEYOND_PRIORS * model.reach())
    }

    /// Returns the cross-validation misfit of a fit, with each configuration left out in turn.
    /// `problem` is the corrected one, which may have another number of joints.
    pub(super) fn left_out(
        &self,
        fitting: &Fitting,
        end: &FitEnd,
        problem: &Problem,
    ) -> LeftOutMisfit {
        let whole = fitting.whole();
        let free = whole.unknowns.iter().zip(&end.at_bound).filter(|(_, bound)| bound.is_none());
        let unknowns: Vec<usize> = free.map(|(&k, _)| k).collect();
        let configurations = fitting.measurements.configurations(problem).0;
        let errors = fitting.left_out_errors(&end.x, &unknowns, &configurations);
        let of_kind = Self::of_leading_kind(fitting, &fitting.split.identification);
        let errors: Vec<Vector3<f64>> = of_kind.into_iter().map(|row| errors[row]).collect();
        LeftOutMisfit {
            mean_square: self.mean_square(&errors),
            deviations: deviations(fitting, &end.x),
            rows: errors.len(),
        }
    }

    /// Returns the root mean squared error of `rows` at the full parameter vector `x` \[m\] with
    /// the deviations from priors σₚ included: √((Σ e² + σ² Σ (x/σₚ)²) / n), with the noise σ and n
    /// rows.
    pub(super) fn penalised(&self, fitting: &Fitting, rows: &[usize], x: &DVector<f64>) -> f64 {
        let deviations = deviations(fitting, x) / rows.len().max(1) as f64;
        let square = self.error(fitting, rows, x).powi(2);
        (square + fitting.sigma.powi(2) * deviations).sqrt()
    }

    /// Returns a shift of rows with its first row moved to where the error is smallest, near its
    /// present first row, and that error. Misreadings other than shifts stay as they are.
    fn with_best_start(&self, (misreading, error): (Misreading, f64)) -> (Misreading, f64) {
        let step = shift_step(self.fitting.measurements.len());
        let places = misreading.shifted_from().into_iter().flat_map(|from| {
            let near = from.saturating_sub(step)..from + step;
            let rows = self.chosen.iter().copied().filter(move |row| near.contains(row));
            rows.map(move |from| (from, misreading))
        });
        let moved: Vec<Misreading> =
            places.map(|(from, misreading)| misreading.with_shift_from(from)).collect();
        let errors = self.registered_errors(&moved);
        errors
            .into_iter()
            .chain([(misreading, error)])
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((misreading, error))
    }

    /// Returns the root mean squared error of `rows` at the full parameter vector `x` \[m\]. With a
    /// robust loss, the rows with the largest errors are excluded.
    fn error(&self, fitting: &Fitting, rows: &[usize], x: &DVector<f64>) -> f64 {
        let rows = Self::of_leading_kind(fitting, rows);
        self.mean_square(&fitting.position_errors(&rows, x)).sqrt()
    }

    /// Returns those of `rows` that measure the leading kind of quantity (positions, if there are
    /// any).
    fn of_leading_kind(fitting: &Fitting, rows: &[usize]) -> Vec<usize> {
        let measurements: &Measurements = fitting.measurements;
        let kind = measurements.leading().kind();
        let is_of_kind = |row: &usize| measurements.observation(*row).kind() == kind;
        rows.iter().copied().filter(is_of_kind).collect()
    }

    /// Returns the mean squared length of errors \[m²\]. With a robust loss, the largest errors are
    /// excluded.
    fn mean_square(&self, errors: &[Vector3<f64>]) -> f64 {
        let mut squares: Vec<f64> = errors.iter().map(nalgebra::Matrix::norm_squared).collect();
        if self.fitting.loss != Loss::Squares {
            squares.sort_by(f64::total_cmp);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
            squares.truncate(((1.0 - MAX_SET_ASIDE_SHARE) * squares.len() as f64).ceil() as usize);
        }
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    }
}

//! Search for the misreadings that explain why an arm does not fit its measurements.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{DVector, Vector3};

use super::candidates::{candidates, is_far, of_order, shift_step};
use super::chosen_rows::chosen_rows;
use super::commands::is_unit_ratio;
use super::entries::of_two_entries;
use super::explanation::{Explanation, Explanations, LeftOutMisfit};
use super::loads::of_loads;
use super::{Kind, Misreading};
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
use crate::numeric::{parallel, whole};
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

/// Result of a full fit with a misreading corrected.
pub(super) struct Outcome {
    /// Root mean squared error with the deviations from priors \[m\].
    pub rms: f64,
    /// Fitted size of the misreading; `None` if it has no size.
    size: Option<f64>,
    /// Words on the base or target that was found elsewhere than declared; otherwise empty.
    place: String,
    left_out: LeftOutMisfit,
    /// True if no parameter of the arm deviates far beyond its prior.
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
    let as_declared = trial.registered_error(&Misreading::none());
    let nominal = as_declared.map_or(nominal, |error| error.min(nominal));
    let is_position = measurements.leading().is_position();
    // Contacts with one point agree with any arm whose target hardly moves. For rows other than
    // positions, only reversed joints are therefore tried.
    let last = trial.chosen.last().copied().unwrap_or_default();
    let is_tested = |misreading: &Misreading| match misreading.kind {
        Kind::Reversed(_) => true,
        // A shift that begins behind the last row changes nothing.
        Kind::Shifted(_, from) => is_position && from <= last,
        _ => is_position,
    };
    let listed = if is_position && nominal < MAX_REACHES_OF_LOADS * model.reach() {
        [of_loads(fit.problem, measurements), of_order(measurements)].concat()
    } else {
        candidates(fit.problem, measurements)
    };
    let mut tested: Vec<Misreading> = listed.into_iter().filter(is_tested).collect();
    let is_mirrored = |misreading: &Misreading| misreading.kind == Kind::Mirrored;
    if !fit.is_base_free() && tested.iter().any(is_mirrored) {
        tested.retain(|misreading| !is_mirrored(misreading));
        tested.extend(Misreading::all_mirrored());
    }
    // A base that is only a little off is no misreading.
    let is_base_held = is_position && fit.is_a_base_held() && is_nominal_far_off(fit);
    tested.extend(is_base_held.then(Misreading::held_base));
    // A target that is declared far from its frame may be in millimetres, which another misreading
    // covers.
    let is_target_held = is_position && fit.is_target_held() && !is_far(fit.problem);
    tested.extend(is_target_held.then(Misreading::held_target));
    let mut errors = trial.registered_errors(&tested);
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    // Two reversed joints have the same effect as an α between them that is wrong by 180°.
    let alone = errors.iter().filter(|(misreading, _)| misreading.kind != Kind::Twist);
    let alone: Vec<f64> = alone.map(|(_, error)| *error).collect();
    let is_near_alone = near_errors(&alone, nominal) > 0;
    let near_alone = if is_near_alone { near_misreadings(&errors, nominal) } else { Vec::new() };
    if is_position || near_misreadings(&errors, nominal).is_empty() {
        errors.extend(trial.several_reversed(&tested));
    }
    let is_near = !near_misreadings(&errors, nominal).is_empty();
    errors.extend(trial.registered_errors(&of_two_entries(fit.problem, &tested, is_near)));
    // Any other number in the joint table is only tried where no usual mistake comes near.
    let least = errors.iter().map(|(_, error)| *error).fold(nominal, f64::min);
    if is_position && least > MIN_REACHES_OF_TYPED * model.reach() {
        errors.extend(trial.typed_entries(fit.problem, nominal));
    }
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    if let Some(shift) =
        errors.iter_mut().find(|(found, _)| matches!(found.kind, Kind::Shifted(..)))
    {
        *shift = trial.with_best_start(shift);
    }
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let near = if near_alone.is_empty() { near_misreadings(&errors, nominal) } else { near_alone };
    let first = near.first().map(Misreading::key);
    let near_error = errors.iter().find(|(found, _)| Some(found.key()) == first);
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
    let count = near_errors(&errors.iter().map(|(_, error)| *error).collect::<Vec<_>>(), nominal);
    errors[..count].iter().map(|(misreading, _)| misreading.clone()).collect()
}

/// Returns the number of `errors`, which are in ascending order, that are far smaller than `nominal`.
pub(super) fn near_errors(errors: &[f64], nominal: f64) -> usize {
    let best = errors.first().copied().unwrap_or(0.0);
    let limit = (MAX_EXPLAINED_RATIO * nominal).min(MAX_RATIO_TO_BEST * best);
    errors.iter().take_while(|error| **error <= limit).count()
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
        let refitted = self.with_corrected(&Misreading::none(), true, |fitting, _| {
            let end = fitting.run(&fit.end.x).ok()?;
            Some(self.penalised(fitting, &fitting.split.identification, &end.x))
        });
        refitted.unwrap_or(f64::INFINITY)
    }

    /// Returns the misreadings that can be corrected, each with the rms error of the registered
    /// nominal arm after the correction \[m\].
    pub(super) fn registered_errors(&self, misreadings: &[Misreading]) -> Vec<(Misreading, f64)> {
        let error = |misreading: &Misreading| {
            Some((misreading.clone(), self.registered_error(misreading)?))
        };
        let errors = parallel::map_items(misreadings, error);
        errors.into_iter().flatten().collect()
    }

    /// Fits the misreading with the smallest of `errors` of each group in full, at most
    /// [`MAX_FITTED_MISREADINGS`]. Returns those with an rms error far below `as_read` \[m\], best
    /// first.
    fn fit_in_full(&self, errors: &[(Misreading, f64)], as_read: f64) -> Vec<Explanation> {
        let mut keys = Vec::new();
        let mut is_first = |misreading: &Misreading| {
            let key = misreading.key().to_owned();
            let is_new = !keys.contains(&key);
            keys.push(key);
            is_new
        };
        let first = errors.iter().map(|(misreading, _)| misreading).filter(|of| is_first(of));
        let chosen = first.take(MAX_FITTED_MISREADINGS).cloned();
        let chosen: Vec<Misreading> = chosen.map(|of| self.with_best_ratio(of)).collect();
        self.explained(&chosen, MAX_EXPLAINED_RATIO * as_read)
    }

    /// Returns those of the `chosen` misreadings that leave less than `limit` \[m\] after a full
    /// fit, best first.
    pub(super) fn explained(&self, chosen: &[Misreading], limit: f64) -> Vec<Explanation> {
        let explanation = |misreading: &Misreading| {
            if misreading.is_minute() {
                return None;
            }
            let Outcome { rms, size, place, left_out, is_within_priors } =
                self.outcome(misreading)?;
            // A negative ratio means that the joint turns against its command, and one of 1 is no
            // misreading.
            let is_impossible = |size: f64| match misreading.kind {
                Kind::Ratio(joint) => {
                    let is_still = size * self.commanded_range(joint) < MIN_MOTION;
                    is_still && !is_unit_ratio(size) || (size - 1.0).abs() < MIN_RATIO_ERROR
                }
                Kind::Scale => (size - 1.0).abs() < MIN_SCALE_ERROR,
                Kind::Screw => !SCREW_LEAD_RANGE.contains(&(TAU / size.abs())),
                _ => false,
            };
            if size.is_some_and(is_impossible) {
                return None;
            }
            // An explanation that needs deviations far beyond the priors is of another arm than the
            // measured one. Shifts of rows are exempt, because they leave one row with a wrong
            // configuration.
            let is_shift = matches!(misreading.kind, Kind::Shifted(..));
            let clocks = misreading.clock_hint(self.fitting.measurements);
            if !is_within_priors && !is_shift && rms > self.largest_usual_error() {
                return None;
            }
            let explanation = Explanation {
                words: misreading.described(size) + &place + &clocks,
                rms,
                effect: size.and_then(|size| misreading.expressed(size)),
                left_out,
            };
            // Errors are compared in the unit of the table.
            let factor = match misreading.kind {
                Kind::Unit(factor) | Kind::UsualUnit(factor) => factor,
                _ => 1.0,
            };
            Some((rms / factor, explanation))
        };
        let explained = parallel::map_items(chosen, explanation);
        let mut explained: Vec<(f64, Explanation)> =
            explained.into_iter().flatten().filter(|(_, of)| of.rms < limit).collect();
        explained.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = explained.first().map_or(0.0, |(rms, _)| *rms);
        explained.retain(|(rms, _)| *rms <= MAX_RATIO_TO_BEST * best);
        explained.into_iter().map(|(_, explanation)| explanation).collect()
    }

    /// Returns the rms error of the registered nominal arm with a misreading corrected \[m\]; `None` if
    /// it cannot be corrected, or if the arm then does not follow the points.
    pub(super) fn registered_error(&self, misreading: &Misreading) -> Option<f64> {
        self.with_corrected(misreading, false, |fitting, _| {
            let rows = &fitting.split.identification;
            let registered = fitting.registered_to(TRIAL_TOLERANCE).ok()?;
            let rms = self.error(fitting, rows, &registered);
            // An arm that a misreading shrinks to a point misses points by their spread, which
            // explains nothing, however small the spread is.
            let points = &fitting.measurements.positions;
            let spread = spread(fitting.placement, rows, |place| points[rows[place]]);
            let is_followed = !fitting.measurements.leading().is_position()
                || matches!(misreading.kind, Kind::Declared | Kind::Typed)
                || rms <= MAX_PART_OF_SPREAD * spread;
            (rms.is_finite() && is_followed).then_some(rms)
        })
    }

    /// Returns the result of a full fit with a misreading corrected; `None` if it cannot be corrected
    /// or fitted.
    pub(super) fn outcome(&self, misreading: &Misreading) -> Option<Outcome> {
        self.with_corrected(misreading, true, |fitting, corrected| {
            let end = fitting.refitted()?;
            let (model, x) = (fitting.model, &end.x);
            let rms = self.penalised(fitting, &fitting.split.identification, x);
            let value = |name: &str| {
                let place = model.parameters.iter().position(|parameter| parameter.name == name)?;
                Some(x[place])
            };
            let of = misreading.size.as_ref();
            let size = of.and_then(|size| Some((size.of)(value(&size.parameter)?)));
            let mut fitted = model.parameters.iter().zip(x);
            let is_within_priors = !fitted.any(|(parameter, x)| {
                prior_sigmas(parameter, *x).is_some_and(|sigmas| sigmas > MAX_PRIOR_SIGMAS)
            });
            rms.is_finite().then(|| Outcome {
                rms,
                size,
                place: misreading.found_place(self.problem, model, x),
                left_out: self.left_out(fitting, &end, corrected),
                is_within_priors,
            })
        })
    }

    /// Returns what `result` returns for the fit with a misreading corrected and for the corrected
    /// problem. If `has_free_size`, the size of the misreading is a free parameter. `None` if the
    /// misreading cannot be corrected.
    pub(super) fn with_corrected<R>(
        &self,
        misreading: &Misreading,
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
        let rows = misreading.undone(measurements, &self.chosen, joints);
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
        // The corrected model needs a new cache, because its linearisations differ.
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
        let errors = fitting.left_out(end, problem);
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
    fn with_best_start(&self, found: &(Misreading, f64)) -> (Misreading, f64) {
        let Kind::Shifted(by, from) = found.0.kind else { return found.clone() };
        let step = shift_step(self.fitting.measurements.len());
        let near = from.saturating_sub(step)..from + step;
        let rows = self.chosen.iter().copied().filter(|row| near.contains(row));
        let moved: Vec<Misreading> = rows.map(|from| Misreading::shifted(by, from)).collect();
        let errors = self.registered_errors(&moved).into_iter().chain([found.clone()]);
        errors.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_else(|| found.clone())
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
            let kept = (1.0 - MAX_SET_ASIDE_SHARE) * squares.len() as f64;
            squares.truncate(whole(kept.ceil()));
        }
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    }
}

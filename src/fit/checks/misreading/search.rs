//! Search for the misreadings that explain why an arm does not fit its measurements.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::Misreading;
use super::candidates::{candidates, is_far, of_loads, of_order, shift_step};
use super::explanation::{Explanation, Explanations, LeftOutMisfit};
use super::undo::is_unit_ratio;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::misread::MAX_NOISE_SIGMAS;
use crate::fit::checks::nominal_error::is_nominal_far_off;
use crate::fit::checks::parameter_limits::{MAX_PRIOR_SIGMAS, is_of_arm, prior_sigmas};
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::{Placement, SolverChoice};
use crate::least_squares::{LinearisationCache, Loss};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;

/// Largest ratio of the error with a misreading corrected to the error without, at which the
/// misreading is an explanation.
const MAX_EXPLAINED_RATIO: f64 = 0.2;
/// Largest ratio to the smallest error at which a misreading is named as well as the best one.
const MAX_RATIO_TO_BEST: f64 = 1.5;
/// Largest error, as a multiple of the arm's reach, for which misreadings are searched. Millimetres
/// read as metres give a factor of 1000.
const MAX_REACHES: f64 = 1e4;
/// Largest error of the nominal arm, as a multiple of the arm's reach, for which only misread loads
/// are searched. A joint angle that is wrong by one degree causes seven times as much.
const MAX_REACHES_OF_LOADS: f64 = 2e-3;
/// Smallest motion of a joint over all rows with which a ratio of motion to command is a misreading
/// \[rad\] or \[m\]. A smaller one means that the data contradict any motion of the joint.
const MIN_MOTION: f64 = 0.01;
/// Range of the lead of a screw that is a misreading \[m\]: that of ball screws, with room.
const SCREW_LEAD_RANGE: RangeInclusive<f64> = 1e-3..=0.2;
/// Error, as a multiple of the arm's reach, up to which an explanation far beyond the priors is
/// named: nominal arms are wrong by about as much, and their priors may be too narrow.
const MAX_REACHES_BEYOND_PRIORS: f64 = 5e-4;
/// Smallest relative error of a ratio of motion to command that is a misreading. Gears deviate by
/// less.
const MIN_RATIO_ERROR: f64 = 1e-3;
/// Maximum number of rows on which misreadings are tried.
const MAX_ROWS: usize = 120;
/// Maximum number of moving joints for which every subset is tried as reversed.
const MAX_REVERSED: usize = 7;
/// Maximum number of misreadings that are fitted in full: those with which the nominal arm is
/// nearest.
const MAX_FITTED_MISREADINGS: usize = 12;
/// Maximum number of solver steps of a full fit with a misreading.
const MAX_STEPS: u64 = 60;
/// Relative reduction of the cost per step at which a registration without a full fit ends. Its
/// error is then known far better than [`MAX_RATIO_TO_BEST`] asks.
const TRIAL_TOLERANCE: f64 = 1e-4;
/// Largest share of the rows that a robust loss may exclude; the error is then that of the other
/// rows.
const MAX_SET_ASIDE_SHARE: f64 = 0.3;

/// Result of a trial with a misreading corrected.
struct Outcome {
    /// Root mean squared error \[m\]; after a full fit with the deviations from priors.
    rms: f64,
    /// Size of the misreading that a full fit found, if it has one.
    size: Option<f64>,
    /// Misfit of configurations that are left out of a full fit.
    left_out: Option<LeftOutMisfit>,
    /// True if no parameter of the arm deviates far beyond its prior.
    is_within_priors: bool,
}

/// Rows and problem with which misreadings are tried.
struct Trial<'a> {
    fitting: &'a Fitting<'a>,
    problem: &'a Problem,
    chosen: Vec<usize>,
}

impl CheckedFit<'_> {
    /// Returns the misreadings of table or problem that explain the misfit.
    pub fn explanations(&self) -> &Explanations {
        self.explanations.get_or_init(|| explanations(self))
    }
}

/// Finds the misreadings that explain why the fit does not agree with its measurements.
fn explanations(fit: &CheckedFit) -> Explanations {
    let Fitting { split, measurements, model, .. } = fit.fitting;
    let nominal = fit.registered.identification.rms.norm;
    if nominal.is_nan() || nominal > MAX_REACHES * model.reach() {
        return Explanations::default();
    }
    let step = split.identification.len().div_ceil(MAX_ROWS).max(1);
    let chosen: Vec<usize> = split.identification.iter().copied().step_by(step).collect();
    let trial = Trial { fitting: fit.fitting, problem: fit.problem, chosen };
    // This trial leaves out orientations, as all trials do. Reversing no joint changes nothing.
    let as_declared = trial.outcome(Misreading::Reversed { joints: 0 }, false);
    let nominal = as_declared.map_or(nominal, |outcome| outcome.rms.min(nominal));
    let is_position = measurements.leading().is_position();
    // If the target hardly moves, contacts with one point agree with any arm.
    let is_tested =
        |misreading: &Misreading| is_position || matches!(misreading, Misreading::Reversed { .. });
    let listed = if is_position && nominal < MAX_REACHES_OF_LOADS * model.reach() {
        [of_loads(fit.problem, measurements), of_order(measurements)].concat()
    } else {
        candidates(fit.problem, measurements)
    };
    let mut tested: Vec<Misreading> = listed.into_iter().filter(is_tested).collect();
    // A base that is only a little off is no misreading.
    let is_base_held = is_position && !fit.is_base_free() && is_nominal_far_off(fit);
    tested.extend(is_base_held.then_some(Misreading::HeldBase));
    // A target that is far away is in millimetres.
    let is_target_held = is_position && fit.is_target_held() && !is_far(fit.problem);
    tested.extend(is_target_held.then_some(Misreading::HeldTarget));
    let mut errors = trial.registered_errors(&tested);
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    // Two reversed joints look like α between them that is turned by 180°.
    let alone: Vec<(Misreading, f64)> = errors
        .iter()
        .copied()
        .filter(|(misreading, _)| !matches!(misreading, Misreading::Twist { .. }))
        .collect();
    let is_near_alone = !near_misreadings(&alone, nominal).is_empty();
    let near_alone = if is_near_alone { near_misreadings(&errors, nominal) } else { Vec::new() };
    errors.extend(trial.several_reversed(&tested));
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    if let Some(shift) = errors.iter_mut().find(|(found, _)| found.shifted_from().is_some()) {
        *shift = trial.with_best_start(*shift);
    }
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let near = if near_alone.is_empty() { near_misreadings(&errors, nominal) } else { near_alone };
    let mut explanations = Explanations { near, ..Explanations::default() };
    if is_position {
        let at = |x: &DVector<f64>| trial.penalised(fit.fitting, &trial.chosen, x);
        explanations.as_read = at(&fit.end.x).min(at(fit.registered_x));
        explanations.fitted = trial.fit_in_full(&errors, explanations.as_read);
    }
    explanations
}

/// Returns the sum of the squared deviations of a fit from its priors \[σ²\]. Declared effects do
/// not count, because they may be far larger than their priors.
fn deviations(fitting: &Fitting, x: &DVector<f64>) -> f64 {
    let parameters = fitting.model.parameters.iter().zip(x);
    let of_arm = parameters.filter(|(parameter, _)| is_of_arm(parameter));
    of_arm.filter_map(|(parameter, x)| Some((x / parameter.sigma?).powi(2))).sum()
}

/// Returns the misreadings with which the nominal arm is far nearer than with the error `nominal`.
/// `errors` is in ascending order.
fn near_misreadings(errors: &[(Misreading, f64)], nominal: f64) -> Vec<Misreading> {
    let best = errors.first().map_or(0.0, |found| found.1);
    let limit = (MAX_EXPLAINED_RATIO * nominal).min(MAX_RATIO_TO_BEST * best);
    errors.iter().take_while(|found| found.1 <= limit).map(|(misreading, _)| *misreading).collect()
}

impl Trial<'_> {
    /// Returns the error of the registered nominal arm with each misreading corrected \[m\].
    fn registered_errors(&self, misreadings: &[Misreading]) -> Vec<(Misreading, f64)> {
        let error =
            |&misreading: &Misreading| Some((misreading, self.outcome(misreading, false)?.rms));
        let errors: Vec<_> = misreadings.par_iter().map(error).collect();
        errors.into_iter().flatten().collect()
    }

    /// Fits the most promising misreadings in full. Returns those that leave far less than
    /// `as_read` \[m\], best first.
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
            .collect();
        let explanation = |&misreading: &Misreading| {
            let Outcome { rms, size, left_out, is_within_priors } =
                self.outcome(misreading, true)?;
            // A negative ratio means that the joint turns against its command, and one of 1 is no
            // misreading.
            let is_impossible = |size: f64| match misreading {
                Misreading::Ratio { joint, .. } => {
                    let is_still = size * self.commanded_range(joint - 1) < MIN_MOTION;
                    is_still && !is_unit_ratio(size) || (size - 1.0).abs() < MIN_RATIO_ERROR
                }
                Misreading::Screw { .. } => !SCREW_LEAD_RANGE.contains(&(TAU / size.abs())),
                _ => false,
            };
            if size.is_some_and(is_impossible) {
                return None;
            }
            // An arm that must be bent far beyond its priors is not the one that was measured. A
            // shift of rows leaves one of them without its configuration.
            let is_shift = misreading.shifted_from().is_some();
            if !is_within_priors && !is_shift && rms > self.largest_usual_error() {
                return None;
            }
            Some(Explanation {
                words: misreading.described(size, self.problem),
                rms,
                effect: size.and_then(|size| misreading.expressed(size)),
                left_out: left_out?,
            })
        };
        let explained: Vec<_> = chosen.par_iter().map(explanation).collect();
        let mut explained: Vec<Explanation> = explained
            .into_iter()
            .flatten()
            .filter(|explanation| explanation.rms < MAX_EXPLAINED_RATIO * as_read)
            .collect();
        explained.sort_by(|a, b| a.rms.total_cmp(&b.rms));
        let best = explained.first().map_or(0.0, |explanation| explanation.rms);
        explained.retain(|explanation| explanation.rms <= MAX_RATIO_TO_BEST * best);
        explained
    }

    /// Returns what is left with a misreading corrected: with the registered nominal arm or, if
    /// `is_fitted`, after a full fit. `None` if it cannot be corrected or fitted.
    fn outcome(&self, misreading: Misreading, is_fitted: bool) -> Option<Outcome> {
        let Fitting { model, measurements, .. } = *self.fitting;
        let needs_problem = misreading.rewritten(self.problem);
        if needs_problem.is_none() && misreading.concerns_problem() {
            return None;
        }
        let free = is_fitted
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
            solver: SolverChoice::Auto.decide(model),
            custom_solver: None,
            progress: None,
            max_steps: Some(MAX_STEPS),
            turn_sigma: None,
            cache,
            linear_model: None,
            ..self.fitting.with_declared_noise()
        };
        let registered =
            if is_fitted { fitting.registered() } else { fitting.registered_to(TRIAL_TOLERANCE) };
        let registered = registered.ok()?;
        if !is_fitted {
            let rms = self.error(&fitting, &split.identification, &registered);
            let outcome = Outcome { rms, size: None, left_out: None, is_within_priors: true };
            return rms.is_finite().then_some(outcome);
        }
        let end = fitting.run(&registered).ok()?;
        let x = &end.x;
        let rms = self.penalised(&fitting, &split.identification, x);
        let value = |name: &str| {
            let place = model.parameters.iter().position(|parameter| parameter.name == name)?;
            Some(x[place])
        };
        let name = misreading.size(0.0).map(|(name, _)| name);
        let size = name.and_then(|name| Some(misreading.size(value(&name)?)?.1));
        let corrected = rewritten.as_ref().unwrap_or(self.problem);
        let left_out = Some(self.left_out(&fitting, &end, corrected));
        let mut fitted = model.parameters.iter().zip(x);
        let is_within_priors = !fitted.any(|(parameter, x)| {
            prior_sigmas(parameter, *x).is_some_and(|sigmas| sigmas > MAX_PRIOR_SIGMAS)
        });
        rms.is_finite().then_some(Outcome { rms, size, left_out, is_within_priors })
    }

    /// Returns the largest error that noise, or priors that are too narrow, leave \[m\].
    fn largest_usual_error(&self) -> f64 {
        let Fitting { measurements, model, sigma, .. } = self.fitting;
        let noise = MAX_NOISE_SIGMAS * measurements.leading().root() * sigma;
        noise.max(MAX_REACHES_BEYOND_PRIORS * model.reach())
    }

    /// Returns the difference between the largest and the smallest command of the joint at index
    /// `joint` \[rad\] or \[m\].
    fn commanded_range(&self, joint: usize) -> f64 {
        let commands = || {
            let measurements = self.fitting.measurements;
            let rows = self.fitting.split.identification.iter();
            rows.filter_map(move |&row| measurements.configuration(row).get(joint).copied())
        };
        commands().fold(f64::NEG_INFINITY, f64::max) - commands().fold(f64::INFINITY, f64::min)
    }

    /// Returns the misfit of a fit with each configuration left out. `problem` is that of the fit,
    /// because a correction may change the number of joints.
    fn left_out(&self, fitting: &Fitting, end: &FitEnd, problem: &Problem) -> LeftOutMisfit {
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

    /// Returns the root mean squared error of `rows` at the full parameter vector `x` \[m\].
    /// Deviations from priors count like measured numbers: √((Σ e² + σ² Σ (x/σₚ)²) / n).
    fn penalised(&self, fitting: &Fitting, rows: &[usize], x: &DVector<f64>) -> f64 {
        let deviations = deviations(fitting, x) / rows.len().max(1) as f64;
        let square = self.error(fitting, rows, x).powi(2);
        (square + fitting.sigma.powi(2) * deviations).sqrt()
    }

    /// Returns a shift of rows with the first shifted row that leaves the smallest error; other
    /// misreadings stay as they are.
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

    /// Returns those of `rows` that measure the leading kind of quantity.
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

    /// Returns the set of two or more joints that, if reversed, leave the smallest error of the
    /// registered nominal arm, with that error \[m\]. Of sets that are about as good, it is the
    /// smallest. `None` if fewer than two joints can be reversed.
    fn several_reversed(&self, singles: &[Misreading]) -> Option<(Misreading, f64)> {
        let joint = |misreading: &Misreading| match misreading {
            Misreading::Reversed { joints } => Some(*joints),
            _ => None,
        };
        let joints: Vec<u64> = singles.iter().filter_map(joint).take(MAX_REVERSED).collect();
        let set = |bits: u64| -> u64 {
            let members = joints.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1);
            members.map(|(_, joint)| joint).sum()
        };
        let sets = (1..1_u64 << joints.len()).filter(|bits| bits.count_ones() > 1).map(set);
        let sets: Vec<Misreading> = sets.map(|joints| Misreading::Reversed { joints }).collect();
        let errors = self.registered_errors(&sets);
        let best = errors.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
        let size = |found: &(Misreading, f64)| match found.0 {
            Misreading::Reversed { joints } => joints.count_ones(),
            _ => 0,
        };
        errors.into_iter().filter(|(_, error)| *error <= MAX_RATIO_TO_BEST * best).min_by_key(size)
    }
}

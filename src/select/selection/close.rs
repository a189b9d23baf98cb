//! The loop: fits the declared problem, searches for effects that the problem lacks, and collects
//! the result.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::excluded_rows::{searched_with_all_rows, withhold_claims};
use super::found::{Found, found, lower_contradicted};
use super::gravity::other_gravity;
use super::misread_effect::with_misread_effect;
use super::search::{Searched, search};
use super::state::{Round, SearchState};
use super::status::{Status, Verdict};
use crate::error::Location;
use crate::fit::{
    Errors, Finding, FindingCode, Identification, IdentifyError, Options, Progress, identify,
};
use crate::measurement::Dataset;
use crate::numeric::{Interval, mean_interval};
use crate::problem::{Effect, Problem};
use crate::residual_tests::ResidualTests;
use crate::select::data::{Data, bits};
use crate::select::evidence::{Evidence, evaluate};
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::{HarmonicPrior, is_periodic_of_many_orders};
use crate::select::left_out_gain::LeftOutGain;
use crate::select::rules::SelectionRules;
use crate::select::screening::{Trace, check_fit, trace_fit};
use crate::select::settings::{INTERVAL_LEVEL, RESAMPLES};
use crate::select::unexplained::{self, Unexplained};

/// Result of the loop, from the declared to the extended problem.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// Verdict of the search: explained, unexplained, or nothing found.
    pub verdict: Verdict,
    /// True if the loop was stopped before the search ended, so that there may be more effects.
    pub interrupted: bool,
    /// Fit of the declared problem, its residual tests, and the ranking of effects.
    pub before: Trace,
    /// Fit with all effects that were found.
    pub after: Identification,
    /// Errors of the declared problem fitted with the effects of status [`Status::Found`] alone.
    pub with_found: Errors,
    /// Residual tests of the fit `after`.
    pub residual_tests: ResidualTests,
    /// Extended problem: the declared one with all effects of `effects` declared, too.
    pub closed: Problem,
    /// Effects in the order in which they were found.
    pub effects: Vec<Found>,
    /// Result of each round.
    pub rounds: Vec<Round>,
    /// Common prior of the harmonics in the extended problem, if a joint has many orders.
    pub harmonic_prior: Option<HarmonicPrior>,
    /// Parameters of the extended problem that have no prior, because their effect expresses a
    /// misread table.
    pub(crate) freed: Vec<String>,
    /// Structure without a law, the most probable first.
    pub unexplained: Vec<Unexplained>,
    /// Mean reduction of the error on held-out rows by the effects, with its confidence interval
    /// \[m\] or \[rad\]. If no row is held out, it is that of identification rows predicted by fits
    /// without them.
    pub gain: Interval,
    /// Identification rows that were excluded from the choice of effects: rows with gross errors,
    /// and rows that alone supported an effect.
    pub set_aside: Vec<Location>,
    /// Settings with which the search ran.
    pub rules: SelectionRules,
    /// Fit with the effects of status [`Status::Found`] alone, if there are others and a remainder
    /// may replace these.
    pub(super) found_alone: Option<Box<FoundAlone>>,
}

/// Fit of the declared problem with the effects of status [`Status::Found`] alone, and its tests.
#[derive(Debug, Clone)]
pub(super) struct FoundAlone {
    pub found: Identification,
    pub problem: Problem,
    pub residual_tests: ResidualTests,
    /// Reduction of the error on held-out rows, as [`ClosedLoop::gain`] is.
    pub gain: Interval,
}

impl FoundAlone {
    fn new(sure: &Fitted, data: &Data, gain: Interval) -> Box<Self> {
        let residual_tests = check_fit(sure, data);
        let (found, problem) = (sure.found.clone(), sure.problem.clone());
        Box::new(Self { found, problem, residual_tests, gain })
    }
}

impl ClosedLoop {
    /// Returns the effects that round `k` (from 0) added to the model, and those that it removed.
    pub(crate) fn changes_of_round(&self, k: usize) -> (Vec<&Effect>, Vec<&Effect>) {
        let before = k.checked_sub(1).map_or(&[][..], |last| self.rounds[last].effects.as_slice());
        let after = &self.rounds[k].effects;
        let added = after.iter().filter(|effect| !before.contains(effect)).collect();
        let removed = before.iter().filter(|effect| !after.contains(effect)).collect();
        (added, removed)
    }
}

/// Finds the effects that `problem` lacks, from the identification rows alone; held-out rows only
/// measure the result.
///
/// If [`Options::stop`] requests a stop, the current round is abandoned and the result of the
/// earlier rounds is returned.
///
/// # Errors
/// Returns an error if problem, data and options do not match, or if a stop was requested before
/// the declared problem was fitted.
pub fn close(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
) -> Result<ClosedLoop, IdentifyError> {
    close_by(problem, data, options, &SelectionRules::DEFAULT)
}

/// Returns true if no effect is searched: with a lens error, because it would be mistaken for an
/// effect of the arm, and with errors as large as the spread of the measurements.
fn no_effect_explains(declared: &Fitted) -> bool {
    let misses = declared.found.finding(FindingCode::MissesMeasurements);
    let number = |name: &str| misses.and_then(|misses| misses.number(name));
    let is_hopeless = misses.is_some()
        && number("rms").unwrap_or(f64::INFINITY) > number("spread").unwrap_or(0.0);
    is_hopeless || declared.found.has(FindingCode::LensContradicted)
}

/// Returns true if rows contradict a fit: held-out ones, or some that are set aside.
fn is_contradicted(found: &Identification) -> bool {
    let codes = [FindingCode::HeldOutBeyondPrediction, FindingCode::RowsSetAside];
    codes.iter().any(|code| found.has(*code))
}

/// Runs the loop like [`close`], with other settings.
///
/// # Errors
/// Returns the errors of [`close`].
pub fn close_by(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    rules: &SelectionRules,
) -> Result<ClosedLoop, IdentifyError> {
    rules.check()?;
    // A stop request ends only the search; the effects found so far are still fitted and tested.
    let data = Data { candidates: &options.candidates, ..Data::new(problem, data, rules) };
    let (stoppable, unstoppable) = (
        Data { stop: options.stop.clone().unwrap_or_default(), ..data.clone() },
        options.clone().with_stop(None),
    );
    // Evidence is evaluated for positions only, so only positions are fitted.
    let declared = Fitted::new(problem.positions_alone(), &data, options)?;
    let before = trace_fit(&declared, &data);
    let mut state = SearchState::new(&stoppable, options, &declared);
    let result = search_effects(&mut state, &declared);
    let interrupted = result.as_ref().is_err_and(IdentifyError::is_interrupted);
    options.report_progress(|| Progress::Finishing);
    state.data = &data;
    let (fitted, evidence) = if interrupted {
        state.prior = state.prior_of_latest.take();
        let settled = state.latest.clone().converge(&data, &unstoppable)?;
        let moved = settled.differs_from(&state.latest, &data);
        (settled, state.evidence.take().filter(|_| !moved))
    } else {
        result?
    };
    // If the declared fit does not describe the arm, no evidence about it is used.
    let of_declared = state
        .evidence_of_declared
        .take()
        .filter(|_| declared.found.describes_arm() && !interrupted);
    let (fitted, evidence) = found_or_declared(
        (&declared, of_declared.as_ref()),
        (fitted, evidence),
        &data,
        &unstoppable,
    )?;
    // If no effect, with the plainer causes in its place, has the status found, the effects are kept
    // only if they predict left-out poses better: by more than one standard error of the gain, or
    // significantly if none is even probable.
    let gain = OnceCell::new();
    let gain = || gain.get_or_init(|| LeftOutGain::new(&fitted, &declared, &data)).as_ref();
    let is_used = |best: Option<Status>| match best {
        None | Some(Status::Found) => true,
        Some(Status::Probable) => gain().is_some_and(LeftOutGain::exceeds_standard_error),
        Some(_) => gain().is_some_and(LeftOutGain::is_significant),
    };
    let mut conclusion =
        conclude(&state, &declared, (fitted.clone(), evidence), interrupted, is_used);
    if !is_used(conclusion.effects.iter().map(|found| found.status_of_any).min()) {
        conclusion =
            conclude(&state, &declared, (declared.clone(), of_declared), interrupted, |_| true);
    }
    let (conclusion, with_found) =
        with_found_alone(&state, &declared, conclusion, (interrupted, &unstoppable))?;
    let Conclusion { fitted, evidence, residual_tests, mut effects, mut unexplained } = conclusion;
    if unexplained.is_empty() {
        unexplained.extend(unexplained::unlocated(&residual_tests));
    }
    let set_aside = set_aside(&fitted, evidence.as_ref(), &data);
    let is_noise = unexplained.is_empty() && !is_contradicted(&fitted.found);
    let (is_spoilt, excluded) = if is_noise && problem.robust.is_none() {
        withhold_claims(&fitted.found, &set_aside, &mut effects)
    } else {
        (false, None)
    };
    let is_noise = is_noise && !is_spoilt;
    let statuses: Vec<Status> = effects.iter().map(|found| found.status).collect();
    let is_noise_with_found =
        is_noise && with_found.as_ref().is_none_or(|sure| !check_fit(sure, &data).is_structured());
    let verdict = Verdict::of(&statuses, is_noise, is_noise_with_found);
    let judged = |of: &Fitted| match data.split.held_out.as_slice() {
        [] => of.found.left_out.clone(),
        held_out => of.errors(&data, held_out),
    };
    let gain_of = |of: &Fitted| mean_gain(&data, &judged(&declared), &judged(of));
    let gain = gain_of(&fitted);
    let replaceable = with_found.as_ref().filter(|sure| {
        !sure.found.provisional
            && sure.found.is_trusted()
            && fitted.found.describes_arm()
            && !problem.data.fits_orientation
            && !statuses.contains(&Status::Contradicted)
            && state.misread.is_none()
            && excluded.is_none()
    });
    let found_alone = replaceable.map(|sure| FoundAlone::new(sure, &data, gain_of(sure)));
    let has_gear = state.added(&fitted).iter().any(is_periodic_of_many_orders);
    let misread =
        state.misread.as_ref().filter(|misread| state.added(&fitted).contains(&misread.effect));
    let freed = misread.map_or_else(Vec::new, |misread| misread.parameters(&fitted.problem));
    let mut with_orientations = fitted.problem.clone();
    with_orientations.data.fits_orientation = problem.data.fits_orientation;
    let orientations = orientation_finding(&with_orientations, &data, &unstoppable);
    // A formula may fit an arm that gives way under another gravity as well.
    let has_formula = state.added(&fitted).iter().any(Effect::is_composed);
    let is_open =
        (verdict == Verdict::Unexplained || has_formula) && !interrupted && excluded.is_none();
    let gravity = is_open.then(|| other_gravity(&state, &declared, &fitted)).flatten();
    let verdict = if gravity.is_some() { Verdict::Unexplained } else { verdict };
    lower_contradicted(&mut effects, &fitted.found, (gain, gravity.is_some()));
    let is_sure = effects.iter().any(|found| found.status == Status::Found);
    let with_found = match with_found {
        _ if excluded.is_some() || !is_sure && !effects.is_empty() => declared.found.fitted,
        Some(sure) => sure.found.fitted,
        None => fitted.found.fitted,
    };
    let mut after = fitted.found;
    after.findings.splice(0..0, orientations.into_iter().chain(gravity).chain(excluded));
    if !interrupted {
        after.findings.iter_mut().for_each(Finding::set_remedy_after_loop);
    }
    Ok(ClosedLoop {
        verdict,
        interrupted,
        before,
        after,
        with_found,
        residual_tests,
        closed: fitted.problem,
        effects,
        rounds: state.rounds,
        harmonic_prior: state.prior.filter(|_| has_gear),
        freed,
        unexplained,
        gain,
        set_aside,
        rules: rules.clone(),
        found_alone: found_alone.filter(|_| is_sure),
    })
}

/// Runs the search from the fit of the declared problem, unless no effect can explain its residual.
fn search_effects(state: &mut SearchState, declared: &Fitted) -> Result<Searched, IdentifyError> {
    if no_effect_explains(declared) {
        return Ok((declared.clone(), None));
    }
    let first = with_misread_effect(state, declared)?.unwrap_or_else(|| declared.clone());
    let end = search(state, first)?;
    searched_with_all_rows(state, declared, end)
}

/// Returns the places of the rows that were excluded from the choice of effects: those with gross
/// errors, and those that alone supported an effect.
fn set_aside(fitted: &Fitted, evidence: Option<&Evidence>, data: &Data) -> Vec<Location> {
    let rows = data.evidence_rows();
    let supporting_alone =
        evidence.into_iter().flat_map(|evidence| &evidence.left_out).map(|&pose| rows[pose]);
    let aside: BTreeSet<usize> = fitted.set_aside.iter().copied().chain(supporting_alone).collect();
    aside.into_iter().map(|row| data.measurements.location(row)).collect()
}

/// Returns the finding that the extended problem does not fit the measured orientations; `None` if
/// there is no such finding, or if the problem does not fit orientations. The loop itself fits
/// positions alone.
fn orientation_finding(problem: &Problem, data: &Data, options: &Options) -> Option<Finding> {
    if !problem.data.fits_orientation {
        return None;
    }
    let options = Options { influential_rows: false, progress: None, ..options.clone() };
    let found = identify(problem, data.dataset, &options).ok()?;
    found.finding(FindingCode::OrientationMisfit).cloned()
}

/// Fit with which the loop ends, and the claims about it.
struct Conclusion {
    fitted: Fitted,
    evidence: Option<Evidence>,
    residual_tests: ResidualTests,
    effects: Vec<Found>,
    unexplained: Vec<Unexplained>,
}

/// Tests the residual of a fit and collects the claims about the effects that it contains, and
/// about structure without a law. Evidence that is missing is evaluated first. `is_used` receives
/// the best [`Found::status_of_any`] of the effects and returns true if the conclusion is used.
fn conclude(
    state: &SearchState,
    declared: &Fitted,
    (fitted, evidence): (Fitted, Option<Evidence>),
    interrupted: bool,
    is_used: impl Fn(Option<Status>) -> bool,
) -> Conclusion {
    let data = state.data;
    let is_trusted = fitted.found.describes_arm();
    let residual_tests = check_fit(&fitted, data);
    // If the search was stopped before it found anything, no evidence is needed.
    let is_wanted = is_trusted && !(interrupted && state.added(&fitted).is_empty())
        || !state.added(&fitted).is_empty();
    let evidence = evidence.or_else(|| {
        if is_wanted { evaluate(&fitted, data, &state.reconsidered(&fitted)) } else { None }
    });
    let best = evidence.as_ref().and_then(|evidence| {
        Some((evidence, evidence.certain_set(data.rules.inclusion_threshold)?))
    });
    let unexplained =
        best.map_or_else(Vec::new, |best| unexplained::without_law(&fitted, data, best));
    let of_all_rows = best.and_then(|_| evidence_with_doubtful_rows(state, declared, &fitted));
    let effects = found(
        state,
        &fitted,
        (best, of_all_rows.as_ref()),
        (is_trusted, residual_tests.is_structured()),
        is_used,
    );
    Conclusion { fitted, evidence, residual_tests, effects, unexplained }
}

/// Fits the problem with those effects of a conclusion alone that are found, if there are others.
///
/// If that fit, or the whole one, shows that the intrinsics of a camera are wrong, the effects may
/// only imitate them: the conclusion is then drawn again as of a fit that is not to be trusted.
fn with_found_alone(
    state: &SearchState,
    declared: &Fitted,
    conclusion: Conclusion,
    (interrupted, options): (bool, &Options),
) -> Result<(Conclusion, Option<Fitted>), IdentifyError> {
    let fit = |Conclusion { fitted, effects, .. }: &Conclusion| {
        let are_all = effects.iter().all(|found| found.status == Status::Found);
        (!are_all).then(|| fit_with_found(state, fitted, effects, options)).transpose()
    };
    let with_found = fit(&conclusion)?;
    let of = &with_found.as_ref().unwrap_or(&conclusion.fitted).found;
    let lens = of.finding(FindingCode::LensContradicted).cloned();
    let Some(lens) = lens.filter(|_| declared.found.describes_arm()) else {
        return Ok((conclusion, with_found));
    };
    let Conclusion { mut fitted, evidence, .. } = conclusion;
    if !fitted.found.has(FindingCode::LensContradicted) {
        fitted.found.findings.insert(0, lens);
    }
    let conclusion = conclude(state, declared, (fitted, evidence), interrupted, |_| true);
    let with_found = fit(&conclusion)?;
    Ok((conclusion, with_found))
}

/// Returns the fit with which the loop ends: that of the search, or the declared one if it predicts
/// left-out poses significantly better.
///
/// A fit of the search that does not describe the arm ([`Identification::describes_arm`]) is
/// repeated from the nominal arm, because terms that were missing at first may have driven a
/// parameter to a wrong optimum. If the repeated fit does not describe it either, a converged fit
/// is kept only if it predicts left-out poses significantly better than the declared fit, and never
/// if the table was misread. `of_declared` is the evidence about the declared fit, if it was
/// evaluated.
fn found_or_declared(
    (declared, of_declared): (&Fitted, Option<&Evidence>),
    (fitted, evidence): (Fitted, Option<Evidence>),
    data: &Data,
    options: &Options,
) -> Result<(Fitted, Option<Evidence>), IdentifyError> {
    let is_extended = fitted.problem.effects.len() > declared.problem.effects.len();
    let is_better = |new: &Fitted, old: &Fitted| {
        LeftOutGain::new(new, old, data).is_some_and(|gain| gain.is_significant())
    };
    if is_extended && is_better(declared, &fitted) {
        return Ok((declared.clone(), of_declared.cloned()));
    }
    if fitted.found.describes_arm() {
        return Ok((fitted, evidence));
    }
    let anew = Fitted::new(fitted.problem.clone(), data, options)?;
    if anew.found.describes_arm() {
        return Ok((anew, None));
    }
    // Effects that are fitted to a misread table do not describe the arm.
    if declared.found.has(FindingCode::Misread) {
        return Ok((declared.clone(), of_declared.cloned()));
    }
    let is_kept =
        |other: &Fitted| other.found.termination.converged() && is_better(other, declared);
    if is_kept(&fitted) {
        Ok((fitted, evidence))
    } else if is_kept(&anew) {
        Ok((anew, None))
    } else {
        Ok((declared.clone(), of_declared.cloned()))
    }
}

/// Returns the evidence about a fit that includes the rows which are outliers of this fit but not
/// of the declared one; `None` if there are no such rows. Such rows have gross errors, or they
/// contradict the added effects.
fn evidence_with_doubtful_rows(
    state: &SearchState,
    declared: &Fitted,
    fitted: &Fitted,
) -> Option<Evidence> {
    let is_aside = |row: &usize| declared.set_aside.contains(row);
    let aside: Vec<usize> = fitted.set_aside.iter().copied().filter(is_aside).collect();
    let added = state.reconsidered(fitted);
    if aside.len() == fitted.set_aside.len() || added.is_empty() {
        return None;
    }
    evaluate(&fitted.with_outliers(aside), state.data, &added)
}

/// Fits the declared problem with the effects of status [`Status::Found`] alone.
fn fit_with_found(
    state: &SearchState,
    fitted: &Fitted,
    effects: &[Found],
    options: &Options,
) -> Result<Fitted, IdentifyError> {
    let sure = effects.iter().filter(|found| found.status == Status::Found);
    let sure: Vec<Effect> = sure.map(|found| found.effect.clone()).collect();
    let problem = state.problem(fitted, &sure);
    // Only the errors of this fit are reported, so a fit of many unknowns is not checked.
    let options = if state.affordable_fits(fitted.unknowns.len()) > 1 {
        fitted.options_from_estimates(options)
    } else {
        Options { provisional: true, ..fitted.warm_started_options(options, true) }
    };
    fitted.fit_other(problem, state.data, &options)
}

/// Returns the mean of |`before`| − |`after`|, the errors of the held-out rows of the leading kind
/// (positions, if there are any) \[m\] or \[rad\], with a bootstrap interval over configurations.
/// If no row is held out, the errors are those of all identification rows.
fn mean_gain(data: &Data, before: &[Vector3<f64>], after: &[Vector3<f64>]) -> Interval {
    let kind = data.measurements.leading().kind();
    let held_out = &data.split.held_out;
    let rows = if held_out.is_empty() { data.rows() } else { held_out };
    let mut groups: BTreeMap<Vec<u64>, Vec<f64>> = BTreeMap::new();
    for ((&row, before), after) in rows.iter().zip(before).zip(after) {
        if data.measurements.observation(row).kind() != kind {
            continue;
        }
        let gain = before.norm() - after.norm();
        groups.entry(bits(data.measurements.configuration(row))).or_default().push(gain);
    }
    let sums: Vec<(f64, f64)> =
        groups.values().map(|gains| (gains.iter().sum::<f64>(), gains.len() as f64)).collect();
    mean_interval(&sums, RESAMPLES, INTERVAL_LEVEL, data.rules.seed)
}

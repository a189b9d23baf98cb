//! Ranking of the catalogue's effects by the residual of one fit.

use super::candidates::{Candidates, NOT_FINITE};
use super::data::Data;
use super::evidence::{Evidence, evaluate};
use super::fitted::Fitted;
use super::neighbourhood::{Scan, Tried};
use super::rules::SelectionRules;
use super::separating_pose::{SeparatingPose, random_poses, separating_pose};
use crate::fit::{Identification, IdentifyError, Noise, Options};
use crate::measurement::Dataset;
use crate::problem::{Effect, Problem};
use crate::residual_tests::{FitResidual, ResidualTests, Test, test_residual};
use crate::select::settings::{CONFOUNDED_ANGLE, MAX_COMPARED, MAX_RANKED};

/// Candidate of the ranking, with its test and expected gain.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Effect that the candidate would add to the model.
    pub effect: Effect,
    /// p-value of the F test, corrected for the candidates tried.
    pub p_value: f64,
    /// F statistic of adding the effect, and the degrees of freedom of its numerator (the number of
    /// new directions).
    pub f: (f64, usize),
    /// Expected reduction of the root mean squared error on the identification poses \[m\].
    pub gain: f64,
    /// Reduction of the root mean squared error of identification poses that are left out of the
    /// fit in ten blocks \[m\]; `None` if it was not computed.
    pub cross_validated: Option<f64>,
    /// Effects of the ranking that are confounded with this candidate, each with the largest
    /// principal angle between its columns and the candidate's \[rad\].
    pub alike: Vec<(Effect, f64)>,
    /// Pose that would distinguish this candidate from the first confounded effect; `None` if there
    /// is none, or if one of the two depends on earlier poses.
    pub separating_pose: Option<SeparatingPose>,
}

/// Result of `trace`: effects that may explain the residual of the declared problem's fit.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Fit of the declared problem to the identification rows.
    pub fit: Identification,
    /// Tests of the residual of the fit `fit` for structure.
    pub residual_tests: ResidualTests,
    /// Candidates in order of an information criterion, best first; only the best of each family at
    /// each place.
    pub ranking: Vec<Ranked>,
    /// Number of candidates that were tried; each order or time counts.
    pub tried: usize,
    /// Largest corrected p-value at which a candidate is significant.
    pub level: f64,
    /// Candidates that the data cannot show, with the reason.
    pub untestable: Vec<(Effect, &'static str)>,
    /// Candidates whose displacements the fitted parameters can reproduce completely, so that they
    /// cannot be detected.
    pub absorbed: Vec<Effect>,
    /// Evidence for sets of hypotheses; `None` if only the ranking was requested, or the residual
    /// is not finite.
    pub evidence: Option<Evidence>,
    /// Settings of the search for effects.
    pub rules: SelectionRules,
    /// True if times were measured; otherwise row numbers replace them.
    pub time_measured: bool,
    /// True for each prismatic joint.
    pub slides: Vec<bool>,
}

impl Trace {
    /// Describes an effect in words, with row numbers instead of times if these data have no times.
    pub fn describe(&self, effect: &Effect) -> String {
        effect.describe_in(self.time_measured, &self.slides)
    }
}

/// Fits `problem` to the identification rows and ranks the effects that may explain the residual.
/// Adds none of them.
///
/// # Errors
/// Returns an error if problem, data and options do not match.
pub fn trace(problem: &Problem, data: &Dataset, options: &Options) -> Result<Trace, IdentifyError> {
    trace_by(problem, data, options, &SelectionRules::DEFAULT)
}

/// Ranks effects like [`trace`], with other settings.
///
/// # Errors
/// Returns an error if problem, data and options do not match.
pub fn trace_by(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    rules: &SelectionRules,
) -> Result<Trace, IdentifyError> {
    rules.check()?;
    let data = Data { candidates: &options.candidates, ..Data::new(problem, data, rules) };
    // Evidence is evaluated for positions only, so only positions are fitted.
    let fitted = Fitted::new(problem.positions_alone(), &data, options)?;
    Ok(Trace { evidence: evaluate(&fitted, &data, &[]), ..trace_fit(&fitted, &data) })
}

/// Ranks the catalogue's effects by the residual of a fit.
pub(super) fn trace_fit(fitted: &Fitted, data: &Data) -> Trace {
    let rules = data.rules;
    let Candidates { testable, mut untestable } = Candidates::new(&fitted.problem, data);
    let linearised = fitted.linearised(data, &testable);
    let scan = Scan::new(&linearised, fitted.neighbourhood_at_rows(data), testable);
    untestable.extend(scan.refused.iter().map(|effect| (effect.clone(), NOT_FINITE)));
    let mut best: Vec<Tried> = Vec::new();
    for tried in scan.ranking() {
        let is_same_place = |other: &Tried| {
            scan.effects[other.index].name_and_place() == scan.effects[tried.index].name_and_place()
        };
        if !best.iter().any(is_same_place) {
            best.push(tried);
        }
    }
    best.truncate(MAX_RANKED);
    let compared_count =
        best.iter().take(MAX_COMPARED).filter(|tried| tried.corrected < rules.level).count();
    let rms =
        |squares: f64| (3.0 * squares.max(0.0) / scan.linear.rows() as f64).sqrt() * fitted.sigma;
    let without = scan.linear.cross_validate(&data.block);
    let poses = random_poses(data);
    let compared_effects: Vec<Effect> =
        best.iter().take(MAX_COMPARED).map(|tried| scan.effects[tried.index].clone()).collect();
    let all_poses: Vec<usize> = (0..poses.len()).collect();
    let elsewhere = Data { measurements: &poses, ..data.clone() };
    let there = (compared_count > 0)
        .then(|| fitted.linearised_at(&elsewhere, &all_poses, &compared_effects));
    let ranked = |(place, tried): (usize, &Tried)| {
        let close = place < compared_count;
        let cross_validated = without.filter(|_| close).and_then(|without| {
            let with = scan.linear.with(&scan.columns(tried.index));
            Some(rms(without) - rms(with.cross_validate(&data.block)?))
        });
        let alike = best
            .iter()
            .take(if close { MAX_COMPARED } else { 0 })
            .filter(|other| other.index != tried.index);
        let angle = |other: &Tried| {
            let angle =
                scan.angle(tried.index, other.index).filter(|angle| *angle < CONFOUNDED_ANGLE)?;
            Some((scan.effects[other.index].clone(), angle))
        };
        let alike: Vec<(Effect, f64)> = alike.filter_map(angle).collect();
        let candidate = &scan.effects[tried.index];
        // For effects that depend on earlier poses, no single pose distinguishes them.
        let have_no_memory =
            |(other, _): &&(Effect, f64)| !candidate.has_memory() && !other.has_memory();
        let pair = alike.first().filter(have_no_memory).zip(there.as_ref());
        let separating_pose = pair.and_then(|((other, _), there)| {
            separating_pose(&scan.linear, [&linearised, there], &poses, (candidate, other))
        });
        Ranked {
            effect: candidate.clone(),
            p_value: tried.corrected,
            f: (tried.gain.f, tried.gain.freedom),
            gain: rms(scan.linear.sums().squares)
                - rms(scan.linear.sums().squares - tried.gain.squares),
            cross_validated,
            alike,
            separating_pose,
        }
    };
    let ranking = best.iter().enumerate().map(ranked).collect();
    let absorbed = scan.absorbed().into_iter().cloned().collect();
    Trace {
        fit: fitted.found.clone(),
        residual_tests: check_fit(fitted, data),
        ranking,
        tried: scan.effects.len(),
        level: rules.level,
        rules: rules.clone(),
        untestable,
        absorbed,
        evidence: None,
        time_measured: data.measurements.time_measured,
        slides: fitted.problem.slides(),
    }
}

/// Tests the residual of a fit `found` of `problem` at the identification rows.
///
/// # Errors
/// Returns an error if problem, data and fit do not match.
pub fn examine(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
) -> Result<ResidualTests, IdentifyError> {
    let data = Data::new(problem, data, &SelectionRules::DEFAULT);
    Ok(check_fit(&Fitted::of(problem.clone(), &data, found.clone())?, &data))
}

/// Tests the residual of a fit.
pub(super) fn check_fit(fitted: &Fitted, data: &Data) -> ResidualTests {
    let linearised = fitted.linearised(data, &[]);
    let coordinates: Vec<usize> =
        (0..linearised.poses().len()).map(|pose| linearised.coordinates(pose)).collect();
    // With millions of rows, memory suffices for only one matrix of this size.
    let (columns, residual) = fitted.neighbourhood_as_fitted(linearised).into_fitted();
    let time = data.time();
    let fit = FitResidual {
        residual: &residual,
        fitted: &columns,
        coordinates: &coordinates,
        sigma_is_declared: fitted.found.noise == Noise::Declared,
        time: if data.measurements.time_measured { &time } else { &[] },
        session: &data.session(),
        setup: &data.setup,
        covariates: &data.covariates(&fitted.problem),
    };
    let mut residual_tests = test_residual(&fit, data.rules.level, data.rules.seed);
    // The tests count poses from 0; results name the rows of the files.
    for test in &mut residual_tests.tests {
        if let Test::Outliers { worst: Some(pose) } = test.test {
            test.row = data.rows().get(pose).map(|&row| data.measurements.location(row));
        }
    }
    // χ² refers to the declared σ, not to the smaller σ estimated from the scatter.
    let size = residual_tests.tests.iter_mut().find(|entry| entry.test == Test::ReducedChiSquared);
    if let Some(outcome) = size.and_then(|test| test.outcome.as_mut().ok()) {
        outcome.statistic *= fitted.found.sigma_scale.powi(2);
    }
    residual_tests
}

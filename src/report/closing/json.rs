//! `loop.json`.

use serde::Serialize;

use super::super::json::{Both, Summary, to_text};
use super::super::{effect, findings};
use crate::diagnose::{ClosedLoop, Correction, Found, Interval, Round, Unexplained, Verdict};
use crate::identify::{Estimate, Identification};
use crate::problem::Problem;

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    verdict: &'static str,
    trusted: bool,
    /// Whether structure in the residual could be tested for.
    tested: bool,
    registered: Both,
    before: FitEntry,
    after: FitEntry,
    /// Mean reduction of the error on held-out poses.
    held_out_gain_mm: IntervalEntry,
    effects: Vec<FoundEntry<'a>>,
    unexplained: Option<UnexplainedEntry>,
    /// 1 σ of the prior that waves of joints were given [rad].
    wave_prior_rad: Option<f64>,
    steps: Vec<StepEntry<'a>>,
    checks_before: Vec<findings::Entry>,
    checks_after: Vec<findings::Entry>,
}

#[derive(Debug, Serialize)]
struct FitEntry {
    #[serde(flatten)]
    errors: Both,
    reduced_chi2: Option<f64>,
}

#[derive(Debug, Serialize)]
struct IntervalEntry {
    mean: f64,
    /// 95 of 100 such intervals hold the true one.
    interval_95: [f64; 2],
}

#[derive(Debug, Serialize)]
struct FoundEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    description: String,
    p_value: f64,
    parameters: Vec<ParameterEntry<'a>>,
    alternatives: Vec<effect::Entry<'a>>,
    held_out_after: Summary,
}

#[derive(Debug, Serialize)]
struct ParameterEntry<'a> {
    name: &'a str,
    unit: &'static str,
    estimate: f64,
    std_error: Option<f64>,
}

#[derive(Debug, Serialize)]
struct UnexplainedEntry {
    #[serde(rename = "where")]
    place: String,
    depends_on: Vec<String>,
    p_value: f64,
    held_out_with_empirical_correction: Option<Summary>,
    correction: Option<CorrectionEntry>,
}

#[derive(Debug, Serialize)]
struct CorrectionEntry {
    /// Of what it depends on, SI; beyond it nothing is corrected.
    range: [f64; 2],
    held_out_beyond: usize,
    /// Root mean squared error of poses left out in turn, before and with the correction.
    cross_validated_rms_mm: [f64; 2],
}

#[derive(Debug, Serialize)]
struct StepEntry<'a> {
    effects: Vec<effect::Entry<'a>>,
    identification: Summary,
    held_out: Summary,
}

impl From<&Identification> for FitEntry {
    fn from(fit: &Identification) -> Self {
        Self { errors: (&fit.fitted).into(), reduced_chi2: fit.reduced_chi2 }
    }
}

impl From<Interval> for IntervalEntry {
    fn from(gain: Interval) -> Self {
        Self { mean: gain.value * 1e3, interval_95: [gain.low * 1e3, gain.high * 1e3] }
    }
}

impl<'a> From<&'a Estimate> for ParameterEntry<'a> {
    fn from(estimate: &'a Estimate) -> Self {
        Self {
            name: &estimate.name,
            unit: estimate.unit.symbol(),
            estimate: estimate.estimate,
            std_error: estimate.std_error,
        }
    }
}

impl<'a> FoundEntry<'a> {
    fn of(found: &'a Found, closure: &ClosedLoop) -> Self {
        Self {
            effect: effect::Entry(&found.effect),
            description: closure.before.describe(&found.effect),
            p_value: found.p_value,
            parameters: found.estimates.iter().map(ParameterEntry::from).collect(),
            alternatives: found.alternatives.iter().map(effect::Entry).collect(),
            held_out_after: (&found.held_out_after).into(),
        }
    }
}

impl From<&Correction> for CorrectionEntry {
    fn from(correction: &Correction) -> Self {
        let (before, with) = correction.cross_validated;
        Self {
            range: correction.range.into(),
            held_out_beyond: correction.beyond,
            cross_validated_rms_mm: [before * 1e3, with * 1e3],
        }
    }
}

impl From<&Unexplained> for UnexplainedEntry {
    fn from(unexplained: &Unexplained) -> Self {
        let correction = unexplained.correction.as_ref();
        Self {
            place: unexplained.place.to_string(),
            depends_on: unexplained.depends_on.iter().map(ToString::to_string).collect(),
            p_value: unexplained.p_value,
            held_out_with_empirical_correction: correction.map(|correction| (&correction.held_out).into()),
            correction: correction.map(CorrectionEntry::from),
        }
    }
}

impl<'a> From<&'a Round> for StepEntry<'a> {
    fn from(step: &'a Round) -> Self {
        Self {
            effects: step.effects.iter().map(effect::Entry).collect(),
            identification: (&step.identification).into(),
            held_out: (&step.held_out).into(),
        }
    }
}

/// What the loop came to as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn loop_json(problem: &Problem, closure: &ClosedLoop) -> String {
    to_text(&Document {
        problem: &problem.name,
        verdict: match closure.verdict {
            Verdict::NothingFound => "nothing-found",
            Verdict::Explained => "explained",
            Verdict::Unexplained => "unexplained",
        },
        trusted: closure.after.is_trusted(),
        tested: closure.findings.is_testable(),
        registered: (&closure.before.fit.registered).into(),
        before: (&closure.before.fit).into(),
        after: (&closure.after).into(),
        held_out_gain_mm: closure.gain.into(),
        effects: closure.effects.iter().map(|found| FoundEntry::of(found, closure)).collect(),
        unexplained: closure.unexplained.as_ref().map(UnexplainedEntry::from),
        wave_prior_rad: closure.harmonic_sigma,
        steps: closure.rounds.iter().map(StepEntry::from).collect(),
        checks_before: findings::entries(&closure.before.findings),
        checks_after: findings::entries(&closure.findings),
    })
}

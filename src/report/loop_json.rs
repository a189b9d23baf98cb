//! What `loop` writes: loop.json.

use super::closed_loop::says;
use super::errors::in_unit;
use super::identify::CarriersEntry;
use super::json::{Both, Kind, Summary, object, to_text};
use super::unexplained::place;
use super::verdict::verdict_word;
use super::{findings, trace};
use crate::diagnose::{ClosedLoop, Correction, Found, Interval, Round, Trace, Unexplained, Witness};
use crate::error::Location;
use crate::identify::{ErrorSummary, Estimate, Identification};
use crate::problem::{Effect, Problem};

object! {
    Document<'a>(problem: &'a Problem, closure: &'a ClosedLoop) {
        problem: &'a str = &problem.name,
        verdict: &'static str = verdict_word(closure.verdict),
        /// Only where the search was stopped before it ended.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        interrupted: bool = closure.interrupted,
        trusted: bool = closure.after.is_trusted(),
        /// Whether structure in the residual could be tested for.
        tested: bool = closure.findings.is_testable(),
        registered: Both = Both::of(&closure.before.fit.registered),
        before: FitEntry = FitEntry::of(&closure.before.fit),
        after: FitEntry = FitEntry::of(&closure.after),
        /// Mean reduction of the error on held-out poses, in mm; of tilts in °.
        #[serde(skip_serializing_if = "Option::is_none")]
        held_out_gain_mm: Option<IntervalEntry> = interval(closure, false),
        #[serde(skip_serializing_if = "Option::is_none")]
        held_out_gain_deg: Option<IntervalEntry> = interval(closure, true),
        effects: Vec<FoundEntry<'a>> = closure.effects.iter().map(|found| FoundEntry::of(found, closure)).collect(),
        unexplained: Option<UnexplainedEntry> = closure.unexplained.first().map(|left| UnexplainedEntry::of(left, &closure.before)),
        /// Rows too far off to be noise, which took no part in the choice of effects.
        set_aside: Vec<RowEntry> = closure.set_aside.iter().map(RowEntry::of).collect(),
        /// Further structure without a known law.
        further: Vec<UnexplainedEntry> = closure.unexplained.iter().skip(1).map(|left| UnexplainedEntry::of(left, &closure.before)).collect(),
        /// The prior that harmonics of joints were given.
        harmonic_prior: Option<Vec<PriorEntry>> = closure.harmonic_prior.as_ref().map(|prior| prior.by_order.iter().map(|&(order, sigma)| PriorEntry::of(order, sigma)).collect()),
        steps: Vec<StepEntry<'a>> = closure.rounds.iter().map(StepEntry::of).collect(),
        checks_before: Vec<findings::Entry> = findings::entries(&closure.before.findings),
        checks_after: Vec<findings::Entry> = findings::entries(&closure.findings),
    }
}
object! {
    FitEntry(fit: &Identification) {
        #[serde(flatten)]
        errors: Both = Both::of(&fit.fitted),
        reduced_chi2: Option<f64> = fit.reduced_chi2,
        misfit_carried_by: Option<CarriersEntry> = fit.carriers.as_ref().map(CarriersEntry::of),
        /// Of each kind of rows, where there are several.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        kinds: Vec<Kind> = fit.kinds.iter().map(Kind::of).collect(),
    }
}
object! {
    /// 1 σ of the prior of one order of harmonics.
    PriorEntry(order: u32, sigma: f64) {
        order: u32 = order,
        sigma_rad: f64 = sigma,
    }
}

object! {
    RowEntry(row: &Location) {
        file: String = row.file.display().to_string(),
        line: Option<usize> = row.line,
    }
}
object! {
    IntervalEntry(gain: &Interval, of: &ErrorSummary) {
        mean: f64 = in_unit(of, gain.value),
        /// 95 of 100 such intervals hold the true one.
        interval_95: [f64; 2] = [in_unit(of, gain.low), in_unit(of, gain.high)],
    }
}
object! {
    FoundEntry<'a>(found: &'a Found, closure: &ClosedLoop) {
        #[serde(flatten)]
        effect: &'a Effect = &found.effect,
        description: String = closure.before.describe(&found.effect),
        claims: Option<trace::ClaimsEntry> = found.claims.as_ref().map(|claims| trace::ClaimsEntry::of(claims, &closure.before)),
        /// Part of fits to configurations drawn anew that name it.
        stability: Option<f64> = found.stability,
        /// What data that took no part say.
        witness: Option<WitnessEntry<'a>> = found.witness.as_ref().map(WitnessEntry::of),
        p_value: f64 = found.p_value,
        parameters: Vec<ParameterEntry<'a>> = found.estimates.iter().map(ParameterEntry::of).collect(),
        alternatives: &'a [Effect] = &found.alternatives,
        held_out_after: Summary = Summary::of(&found.held_out_after),
    }
}
object! {
    WitnessEntry<'a>(own: &'a Witness) {
        data: &'a str = &own.data,
        says: &'static str = says(own),
    }
}
object! {
    ParameterEntry<'a>(estimate: &'a Estimate) {
        name: &'a str = &estimate.name,
        unit: &'static str = estimate.unit.symbol(),
        estimate: f64 = estimate.estimate,
        std_error: Option<f64> = estimate.std_error,
    }
}
object! {
    UnexplainedEntry(own: &Unexplained, trace: &Trace) {
        #[serde(rename = "where")]
        place: String = place(own),
        depends_on: Vec<String> = own.depends_on.iter().map(ToString::to_string).collect(),
        claims: Option<trace::ClaimsEntry> = own.claims.as_ref().map(|claims| trace::ClaimsEntry::of(claims, trace)),
        p_value: f64 = own.p_value,
        held_out_with_empirical_correction: Option<Summary> = own.correction.as_ref().map(|own| Summary::of(&own.held_out)),
        correction: Option<CorrectionEntry> = own.correction.as_ref().map(CorrectionEntry::of),
    }
}
object! {
    CorrectionEntry(own: &Correction) {
        /// Of each covariate that it depends on, SI; beyond it the correction keeps its last value.
        ranges: Vec<(String, [f64; 2])> = own.ranges.iter().map(|(of, range)| (of.to_string(), (*range).into())).collect(),
        held_out_beyond: usize = own.beyond,
        /// Root mean squared error of poses left out in turn, before and with the correction.
        #[serde(skip_serializing_if = "Option::is_none")]
        cross_validated_rms_mm: Option<[f64; 2]> = left_out(own, false),
        #[serde(skip_serializing_if = "Option::is_none")]
        cross_validated_rms_deg: Option<[f64; 2]> = left_out(own, true),
    }
}
object! {
    StepEntry<'a>(step: &'a Round) {
        effects: &'a [Effect] = &step.effects,
        identification: Summary = Summary::of(&step.identification),
        held_out: Summary = Summary::of(&step.held_out),
    }
}

/// What poses left out in turn are missed by, where it is an angle or is not, as asked for.
fn left_out(own: &Correction, angle: bool) -> Option<[f64; 2]> {
    let of = &own.held_out;
    let (without, with) = own.cross_validated;
    (of.is_angle() == angle).then(|| [in_unit(of, without), in_unit(of, with)])
}

/// The gain, where it is an angle or is not, as asked for.
fn interval(closure: &ClosedLoop, angle: bool) -> Option<IntervalEntry> {
    let of = &closure.after.fitted.held_out;
    (of.is_angle() == angle).then(|| IntervalEntry::of(&closure.gain, of))
}

/// What the loop came to as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn loop_json(problem: &Problem, closure: &ClosedLoop) -> String {
    to_text(&Document::of(problem, closure))
}

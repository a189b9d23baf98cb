//! What `loop` writes: loop.json.

use serde::Serialize;

use super::closed_loop::says;
use super::errors::in_unit;
use super::identify::influential_rows;
use super::json::{both, keyed, kind, list, object, summary, to_text, unless_empty};
use super::unexplained::place;
use super::{findings, trace};
use crate::fit::Identification;
use crate::problem::Problem;
use crate::select::{ClosedLoop, Correction, Found, Trace, Unexplained};

/// What the loop came to as JSON text, ending in a line break; SI units except where a key says
/// otherwise.
pub fn loop_json(problem: &Problem, closure: &ClosedLoop) -> String {
    let (of, gain) = (&closure.after.fitted.held_out, closure.gain);
    let mut unexplained =
        list(&closure.unexplained, |left| unexplained(left, &closure.before)).into_iter();
    to_text(&object! {
        problem: &problem.name,
        verdict: closure.verdict.as_str(),
        // Only where the search was stopped before it ended.
        ?interrupted: closure.interrupted.then_some(true),
        trusted: closure.after.is_trusted(),
        // Whether structure in the residual could be tested for.
        tested: closure.findings.is_testable(),
        registered: both(&closure.before.fit.registered),
        before: fit(&closure.before.fit),
        after: fit(&closure.after),
        with_found: both(&closure.with_found),
        // Mean reduction of the error on held-out poses; 95 of 100 such intervals hold the true
        // one.
        ..keyed("held_out_gain", of.is_angle(), object! {
            mean: in_unit(of, gain.value),
            interval_95: [in_unit(of, gain.low), in_unit(of, gain.high)],
        }),
        effects: list(&closure.effects, |own| found(own, closure)),
        unexplained: unexplained.next(),
        // Rows too far off to be noise, which took no part in the choice of effects.
        set_aside: list(&closure.set_aside, |row| object! { file: row.file.display().to_string(), line: row.line }),
        // Further structure without a known law.
        further: unexplained.collect::<Vec<_>>(),
        // The prior that harmonics of joints were given: 1 σ of each order.
        harmonic_prior: closure.harmonic_prior.as_ref().map(|prior| {
            list(&prior.by_order, |(order, sigma)| object! { order: order, sigma_rad: sigma })
        }),
        steps: list(&closure.rounds, |step| object! {
            effects: &step.effects,
            identification: summary(&step.identification),
            held_out: summary(&step.held_out),
        }),
        checks_before: findings::entries(&closure.before.findings),
        checks_after: findings::entries(&closure.findings),
    })
}

fn fit(own: &Identification) -> impl Serialize {
    object! {
        ..both(&own.fitted),
        reduced_chi2: own.reduced_chi2,
        misfit_carried_by: own.influential_rows.as_ref().map(influential_rows),
        // Of each kind of rows, where there are several.
        ?kinds: unless_empty(list(&own.kinds, kind)),
    }
}

fn found(own: &Found, closure: &ClosedLoop) -> impl Serialize {
    object! {
        ..&own.effect,
        description: closure.before.describe(&own.effect),
        status: own.status.as_str(),
        claims: own.claims.as_ref().map(|claims| trace::claims_entry(claims, &closure.before)),
        // Part of fits to configurations drawn anew that name it.
        stability: own.stability,
        // What data that took no part say.
        witness: own.reference_check.as_ref().map(|own| object! { data: &own.data, says: says(own) }),
        p_value: own.p_value,
        parameters: list(&own.estimates, |own| object! {
            name: &own.name,
            unit: own.unit.symbol(),
            estimate: own.estimate,
            std_error: own.std_error,
        }),
        alternatives: &own.alternatives,
        held_out_after: summary(&own.held_out_after),
    }
}

fn unexplained(own: &Unexplained, trace: &Trace) -> impl Serialize {
    object! {
        r#where: place(own),
        depends_on: list(&own.depends_on, ToString::to_string),
        claims: own.claims.as_ref().map(|claims| trace::claims_entry(claims, trace)),
        p_value: own.p_value,
        held_out_with_empirical_correction: own.correction.as_ref().map(|own| summary(&own.held_out)),
        correction: own.correction.as_ref().map(correction),
    }
}

fn correction(own: &Correction) -> impl Serialize + use<> {
    let (of, (without, with)) = (&own.held_out, own.cross_validated);
    object! {
        // Of each covariate that it depends on, SI; beyond it the correction keeps its last value.
        ranges: list(&own.ranges, |(of, range)| (of.to_string(), *range)),
        held_out_beyond: own.beyond,
        // Root mean squared error of poses left out in turn, before and with the correction.
        ..keyed("cross_validated_rms", of.is_angle(), [in_unit(of, without), in_unit(of, with)]),
    }
}

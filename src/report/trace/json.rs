//! `trace.json`.

use serde::Serialize;

use super::super::json::{Both, to_text};
use super::super::{effect, findings};
use crate::diagnose::{Ranked, Trace};
use crate::problem::{Effect, Problem};

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    trusted: bool,
    #[serde(flatten)]
    fitted: Both,
    reduced_chi2: Option<f64>,
    /// Whether the checks see structure that an effect could explain.
    structured: bool,
    checks: Vec<findings::Entry>,
    /// Candidates tried, orders and times counted.
    tried: usize,
    /// The p below which a candidate stands out.
    level: f64,
    ranking: Vec<RankedEntry<'a>>,
    untestable: Vec<UntestableEntry<'a>>,
    absorbed: Vec<effect::Entry<'a>>,
}

#[derive(Debug, Serialize)]
struct RankedEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    description: String,
    p_value: f64,
    f: f64,
    freedom: usize,
    /// Expected reduction of the root mean squared error on the identification poses.
    expected_gain_mm: f64,
    /// The same on poses left out in turn.
    cross_validated_gain_mm: Option<f64>,
    alike: Vec<AlikeEntry<'a>>,
    /// A pose that would tell it from the first of those.
    told_apart: Option<ApartEntry<'a>>,
}

#[derive(Debug, Serialize)]
struct ApartEntry<'a> {
    from: effect::Entry<'a>,
    /// Configuration [rad] or [m].
    q: &'a [f64],
    payload_kg: Option<f64>,
    #[serde(rename = "hoist_N")]
    hoist: Option<f64>,
    #[serde(rename = "temperature_C")]
    temperature: Option<f64>,
    difference_mm: f64,
}

#[derive(Debug, Serialize)]
struct AlikeEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    /// 0: the same on these poses; 90: nothing in common.
    angle_deg: f64,
}

#[derive(Debug, Serialize)]
struct UntestableEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    reason: &'static str,
}

impl<'a> RankedEntry<'a> {
    fn of(ranked: &'a Ranked, trace: &Trace) -> Self {
        let alike = ranked.alike.iter();
        Self {
            effect: effect::Entry(&ranked.effect),
            description: trace.describe(&ranked.effect),
            p_value: ranked.p_value,
            f: ranked.f.0,
            freedom: ranked.f.1,
            expected_gain_mm: ranked.gain * 1e3,
            cross_validated_gain_mm: ranked.cross_validated.map(|gain| gain * 1e3),
            alike: alike
                .map(|(effect, angle)| AlikeEntry { effect: effect::Entry(effect), angle_deg: angle.to_degrees() })
                .collect(),
            told_apart: ranked.telling_pose.as_ref().map(|apart| ApartEntry {
                from: effect::Entry(&apart.other),
                q: &apart.configuration,
                payload_kg: apart.payload,
                hoist: apart.hoist,
                temperature: apart.temperature,
                difference_mm: apart.difference * 1e3,
            }),
        }
    }
}

/// A trace as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn trace_json(problem: &Problem, trace: &Trace) -> String {
    let untestable: Vec<(Effect, &'static str)> = effect::joined(trace.untestable.iter().cloned());
    let absorbed: Vec<(Effect, ())> = effect::joined(trace.absorbed.iter().cloned().map(|effect| (effect, ())));
    to_text(&Document {
        problem: &problem.name,
        trusted: trace.fit.is_trusted(),
        fitted: (&trace.fit.fitted).into(),
        reduced_chi2: trace.fit.reduced_chi2,
        structured: trace.findings.is_structured(),
        checks: findings::entries(&trace.findings),
        tried: trace.tried,
        level: trace.level,
        ranking: trace.ranking.iter().map(|ranked| RankedEntry::of(ranked, trace)).collect(),
        untestable: untestable
            .iter()
            .map(|(effect, reason)| UntestableEntry { effect: effect::Entry(effect), reason })
            .collect(),
        absorbed: absorbed.iter().map(|(effect, ())| effect::Entry(effect)).collect(),
    })
}

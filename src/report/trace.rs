//! What `trace` says and writes: what the residual of a fit points to.

use std::fmt::Write as _;

use serde::Serialize;

use super::document::{Block, Point, named};
use super::errors::{held_out_rows, in_unit, rows_of, with_unit, without_equilibrium};
use super::json::{both, keyed, list, object, to_text};
use super::noise::short;
use super::quantity::{counted, number, p_value};
use super::render::text;
use super::table::{Command, commands};
use super::{effect, findings};
use crate::fit::Identification;
use crate::problem::{Effect, Problem};
use crate::quantity::Unit;
use crate::residual_tests::Covariate;
use crate::select::{
    Claims, Evidence, Hypothesis, HypothesisKind, HypothesisSet, Ranked, TellingPose, Trace,
};

/// Candidates that fit on a screen.
const SHOWN: usize = 6;
/// Explanations that fit on a screen, and their least probability in trace.json.
const SHOWN_EXPLANATIONS: usize = 4;
const LEAST_PROBABLE: f64 = 0.01;
/// Effects alike that are named.
const SHOWN_ALIKE: usize = 3;

fn document(problem: &Problem, trace: &Trace) -> impl Serialize {
    let absorbed = effect::joined(trace.absorbed.iter().cloned().map(|effect| (effect, ())));
    object! {
        problem: &problem.name,
        trusted: trace.fit.is_trusted(),
        ..both(&trace.fit.fitted),
        reduced_chi2: trace.fit.reduced_chi2,
        // Whether the tests see structure that an effect could explain.
        structured: trace.findings.is_structured(),
        checks: findings::entries(&trace.findings),
        // Candidates tried, orders and times counted.
        tried: trace.tried,
        // The p below which a candidate stands out.
        level: trace.level,
        ranking: list(&trace.ranking, |ranked| ranked_entry(ranked, trace)),
        // Explanations weighed against each other, most probable first; without hypotheses: noise
        // alone.
        explanations: list(explanations(trace), |one| object! {
            probability: one.probability,
            hypotheses: list(&one.hypotheses, |own| hypothesis(own, trace)),
        }),
        // What is claimed of the best of them, from the least to the most.
        claims: list(&claims(trace), |one| claims_entry(one, trace)),
        untestable: effect::untestable(effect::joined(trace.untestable.iter().cloned())),
        absorbed: list(absorbed, |(effect, ())| effect),
    }
}

fn ranked_entry(ranked: &Ranked, trace: &Trace) -> impl Serialize {
    let of = &trace.fit.fitted.identification;
    let cross_validated = ranked.cross_validated.map(|gain| in_unit(of, gain));
    object! {
        ..&ranked.effect,
        description: trace.describe(&ranked.effect),
        p_value: ranked.p_value,
        f: ranked.f.0,
        freedom: ranked.f.1,
        // Expected reduction of the root mean squared error on the identification poses, and on
        // poses left out in turn.
        ..keyed("expected_gain", of.is_angle(), in_unit(of, ranked.gain)),
        cross_validated_gain_mm: cross_validated.filter(|_| !of.is_angle()),
        ?cross_validated_gain_deg: cross_validated.filter(|_| of.is_angle()),
        // At 0° the same on these poses, at 90° nothing in common.
        alike: list(&ranked.alike, |(effect, angle)| object! { ..effect, angle_deg: angle.to_degrees() }),
        // A pose that would tell it from the first of those.
        distinguishable_parameters: ranked.telling_pose.as_ref().map(|apart| object! {
            from: &apart.other,
            // Configuration [rad] or [m].
            q: &apart.configuration,
            ?target: apart.target.as_deref(),
            payload_kg: apart.payload,
            hoist_N: apart.hoist,
            temperature_C: apart.temperature,
            ..keyed("difference", of.is_angle(), in_unit(of, apart.difference)),
        }),
    }
}

fn hypothesis(own: &Hypothesis, trace: &Trace) -> impl Serialize {
    object! {
        // The effect, if the law is one.
        effect: own.effect(),
        law: law(own),
        description: words(own, |effect| trace.describe(effect)),
        place: own.site.to_string(),
        depends_on: list(&own.depends_on, ToString::to_string),
    }
}

/// Claims as JSON, each with its probability.
pub(super) fn claims_entry(one: &Claims, trace: &Trace) -> impl Serialize + use<> {
    object! {
        place: object! { value: one.place.0.to_string(), probability: one.place.1 },
        depends_on: object! { value: list(&one.depends_on.0, ToString::to_string), probability: one.depends_on.1 },
        // None where it is not known.
        law: object! { value: one.law.0.effect().map(|effect| effect.name().to_owned()), probability: one.law.1 },
        description: words(&one.law.0, |effect| trace.describe(effect)),
    }
}

/// Explanations that are worth a line.
fn explanations(trace: &Trace) -> impl Iterator<Item = &HypothesisSet> {
    let all = trace.evidence.iter().flat_map(|evidence| &evidence.sets);
    all.filter(|one| one.probability > LEAST_PROBABLE)
}

/// What is claimed of the best explanation.
fn claims(trace: &Trace) -> Vec<Claims> {
    let of = |evidence: &Evidence| evidence.best().iter().map(|own| evidence.claims(own)).collect();
    trace.evidence.as_ref().map_or_else(Vec::new, of)
}

/// The law as JSON names it.
fn law(own: &Hypothesis) -> &str {
    match &own.kind {
        HypothesisKind::Effect(effect) => effect.name(),
        HypothesisKind::NearHarmonic(_) => "near-harmonic",
        HypothesisKind::PerPose => "per-pose",
        HypothesisKind::Wandering => "wandering",
        HypothesisKind::Linear => "linear",
        HypothesisKind::Sag => "sag",
        HypothesisKind::Limit(_) => "limit",
        _ => "smooth",
    }
}

/// A hypothesis in words.
fn words(own: &Hypothesis, describe: impl Fn(&Effect) -> String) -> String {
    let (part, on) = (own.site, depends_on(&own.depends_on));
    match &own.kind {
        HypothesisKind::Effect(effect) => describe(effect),
        HypothesisKind::NearHarmonic(order) => {
            let cycles =
                if *order == 1 { "once".to_owned() } else { format!("about {order} times") };
            format!(
                "{part}: a function of {on} that repeats {cycles} a revolution; its law is not known"
            )
        }
        HypothesisKind::PerPose => {
            format!("{part}: another error in every pose, by nothing that is known of the poses")
        }
        HypothesisKind::Wandering => {
            format!(
                "{part}: wanders with {on}, as noise does in which one reading follows the last, or a drift that has no law"
            )
        }
        HypothesisKind::Linear => {
            format!("{part}: linear in the position, as scale by axis and shear are")
        }
        HypothesisKind::Sag => format!("{part}: gives way under weight that is not declared"),
        HypothesisKind::Limit(limit) => {
            format!("{part}: the limit {limit}, which holds the fit, is wrong")
        }
        _ => format!("{part}: a smooth function of {on}; its law is not known"),
    }
}

fn depends_on(covariates: &[Covariate]) -> String {
    covariates.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ")
}

/// Explanations beside each other, and what is claimed of the best.
fn weighed<'a>(trace: &Trace) -> Vec<Block<'a>> {
    let together = |one: &HypothesisSet| match one.hypotheses.as_slice() {
        [] => "noise alone".to_owned(),
        several => several
            .iter()
            .map(|own| words(own, |effect| effect::both(effect, trace)))
            .collect::<Vec<_>>()
            .join("; and "),
    };
    let point = |one: &HypothesisSet| format!("{}: {}", percent(one.probability), together(one));
    let shown: Vec<String> = explanations(trace).take(SHOWN_EXPLANATIONS).map(point).collect();
    if shown.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![
        Block::heading(
            "Explanations weighed against each other, several effects and functions of unknown law among them",
        ),
        Block::list(shown),
    ];
    let claims: Vec<String> = claims(trace).iter().map(claimed).collect();
    if !claims.is_empty() {
        blocks.push(Block::heading(
            "How probable it is that something acts there, that it depends on that, and that this is its law",
        ));
        blocks.push(Block::list(claims));
    }
    blocks
}

/// What is claimed, from the least to the most.
pub(super) fn claimed(claims: &Claims) -> String {
    let law = match claims.law.0.effect() {
        Some(effect) => format!("law {} {}", effect.name(), percent(claims.law.1)),
        None if claims.law.0.kind == HypothesisKind::Wandering => {
            let sure = percent(claims.law.1);
            format!(
                "no law: it wanders {sure}, as noise does in which one reading follows the last"
            )
        }
        None => "its law is not known".to_owned(),
    };
    let on = match claims.depends_on.0.as_slice() {
        [] => String::new(),
        some => {
            format!("; there and depends on {} {}", depends_on(some), percent(claims.depends_on.1))
        }
    };
    format!("{} {}{on}; {law}", claims.place.0, percent(claims.place.1))
}

/// Probability of a law from which on it is the most probable one, and of a place from which on
/// something acts there.
pub(super) const EVEN: f64 = 0.5;

/// A probability for people.
pub(super) fn percent(probability: f64) -> String {
    match probability {
        p if p > 0.995 => "over 99 %".to_owned(),
        p if p < 0.005 => "under 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}

/// A trace as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn trace_json(problem: &Problem, trace: &Trace) -> String {
    to_text(&document(problem, trace))
}

/// A trace as text, ending in a line break.
pub fn trace_text(problem: &Problem, trace: &Trace) -> String {
    let mut blocks = vec![
        Block::Text(headline(problem, &trace.fit)),
        Block::heading(
            "What the residual (measured − predicted) of the identification poses looks like",
        ),
        Block::List(findings::all(&trace.findings)),
    ];
    blocks.extend(findings::another_size(&trace.findings, trace.fit.reduced_chi2).map(Block::Text));
    blocks.extend(weighed(trace));
    blocks.extend(ranking(problem, trace, SHOWN, "trace.json holds them all"));
    blocks.extend(not_seen(trace));
    text(&blocks)
}

fn headline(problem: &Problem, fit: &Identification) -> String {
    let held_out = &fit.fitted.held_out;
    let size = fit
        .reduced_chi2
        .map_or_else(String::new, |chi2| format!("; χ²/ν {}, 1 for noise alone", short(chi2)));
    let error = match held_out.unpredicted {
        0 => format!(
            "on {} the error is {} in the mean, rms {}",
            held_out_rows(fit),
            with_unit(held_out, held_out.mean.norm),
            with_unit(held_out, held_out.rms.norm),
        ),
        _ => without_equilibrium(held_out, "held-out"),
    };
    format!(
        "{}\n{} from {}{size}; {error}",
        problem.title,
        counted(fit.unknowns.len(), "parameter"),
        rows_of(fit, |errors| errors.identification)
    )
}

/// The candidates that stand out, at most so many of them, how to read them, and `where_all` are.
pub(super) fn ranking<'a>(
    problem: &Problem,
    trace: &Trace,
    most: usize,
    where_all: &str,
) -> Vec<Block<'a>> {
    let all: Vec<&Ranked> =
        trace.ranking.iter().filter(|ranked| ranked.p_value < trace.level).collect();
    let Some(first) = trace.ranking.first() else {
        return vec![
            Block::heading("What could explain it"),
            Block::Text("There is no candidate to try.".to_owned()),
        ];
    };
    if all.is_empty() {
        return vec![
            Block::heading("What could explain it"),
            Block::Text(format!(
                "None of {} candidates stands out. The best, {}, does no better than chance would (p {}, corrected for the \
                 number of candidates; below {} would stand out).",
                trace.tried,
                effect::both(&first.effect, trace),
                p_value(first.p_value),
                trace.level,
            )),
        ];
    }
    let shown = all.iter().take(most).map(|ranked| point(problem, trace, ranked)).collect();
    let mut notes = format!(
        "{} candidates were tried one by one; p is the probability that chance alone does as well, corrected for their \
         number, and below {} it stands out. One cause makes its neighbours stand out, too: the first is the best \
         explanation, not every entry a finding.",
        trace.tried, trace.level
    );
    if all.len() > most {
        let _ = write!(
            notes,
            " {} more that stand out are left out here; {where_all}.",
            all.len() - most
        );
    }
    if all.iter().take(most).any(|ranked| !ranked.alike.is_empty()) {
        notes.push_str(
            " The angle between two effects says how alike they are on these poses once all parameters have been fitted: \
             at 0° nothing tells them apart, at 90° they have nothing in common. A pose where they would differ is one \
             within the ranges that were measured.",
        );
    }
    vec![
        Block::heading("What could explain it, best first"),
        Block::Ranking(shown),
        Block::Text(notes),
    ]
}

fn point(problem: &Problem, trace: &Trace, ranked: &Ranked) -> Point {
    let of = &trace.fit.fitted.identification;
    let (take, off) = if ranked.gain < 0.0 { ("add", "to") } else { ("take", "off") };
    let mut gain = format!(
        "p {}; would {take} {} {off} the rms error of the identification poses",
        p_value(ranked.p_value),
        with_unit(of, ranked.gain.abs())
    );
    if let Some(cross_validated) = ranked.cross_validated {
        let size = with_unit(of, cross_validated.abs());
        let size = match (ranked.gain < 0.0, cross_validated < 0.0) {
            (false, true) => format!("and add {size}"),
            (true, false) => format!("and take {size} off"),
            _ => size,
        };
        let _ = write!(gain, ", {size} on poses left out in turn");
    }
    let mut details = vec![gain];
    if !ranked.alike.is_empty() {
        let alike = |(other, angle): &(Effect, f64)| {
            format!("{} ({:.0}°)", trace.describe(other), angle.to_degrees())
        };
        details.push(format!(
            "hard to tell from: {}",
            named(ranked.alike.iter().map(alike), SHOWN_ALIKE, "; ")
        ));
    }
    if let Some(apart) = &ranked.telling_pose {
        let other = trace.describe(&apart.other);
        details.push(format!(
            "“{other}” would differ by {} at {}",
            with_unit(of, apart.difference),
            pose(problem, apart)
        ));
    }
    Point { text: effect::both(&ranked.effect, trace), details, mark: None }
}

/// A pose in words: joints, payload, hoist, temperature.
fn pose(problem: &Problem, apart: &TellingPose) -> String {
    let joint = |own: Command| {
        let unit = if own.unit == Unit::Angle { "°" } else { " mm" };
        format!("{} {}{unit}", own.name(), number(apart.configuration[own.joint] * own.factor(), 1))
    };
    let mut words: Vec<String> = commands(problem).into_iter().map(joint).collect();
    words.extend(apart.target.as_ref().map(|target| format!("target {target}")));
    words.extend(apart.payload.map(|mass| format!("payload {} kg", number(mass, 2))));
    words.extend(apart.hoist.map(|force| format!("hoist {} N", number(force, 1))));
    words.extend(apart.temperature.map(|degrees| format!("{} °C", number(degrees, 1))));
    words.join(", ")
}

/// What these data can say nothing about.
pub(super) fn not_seen<'a>(trace: &Trace) -> Vec<Block<'a>> {
    let mut blocks = Vec::new();
    if !trace.untestable.is_empty() {
        blocks.push(Block::heading("What these data cannot show"));
        blocks.push(Block::List(effect::reasons(trace.untestable.iter().cloned())));
    }
    if !trace.absorbed.is_empty() {
        blocks.push(Block::heading(
            "What the fitted parameters absorb completely, so that it would not show",
        ));
        blocks.push(Block::list(effect::listed(&trace.absorbed)));
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Effect;
    use crate::select::Site;

    /// Other explanations may depend on the same elsewhere: the probability is of both together.
    #[test]
    fn what_it_depends_on_is_said_of_its_place() {
        let kind = HypothesisKind::Effect(Effect::GearRatio { joint: 2 });
        let own = Hypothesis {
            kind,
            site: Site::Joint(1),
            coordinate: None,
            depends_on: vec![Covariate::Load],
        };
        let claims = Claims {
            place: (Site::Joint(1), 0.5),
            depends_on: (vec![Covariate::Load], 0.14),
            law: (own, 0.1),
        };
        let words = claimed(&claims);
        assert_eq!(
            words,
            format!(
                "{} 50 %; there and depends on {} 14 %; law gear-ratio 10 %",
                Site::Joint(1),
                Covariate::Load
            )
        );
    }
}

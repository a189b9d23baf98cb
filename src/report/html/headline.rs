//! What it came to, in one line and a few facts.

use maud::{Markup, html};

use crate::diagnose::{ClosedLoop, Verdict};
use crate::identify::{Comparison, ErrorSummary, Errors, Identification, Noise};
use crate::problem::Problem;
use crate::report::errors::unpredicted;
use crate::report::quantity::{decimals, number};

/// A length [m] in mm with about three digits.
fn mm(length: f64) -> String {
    number(length * 1e3, (decimals(length * 1e3, 4) + 1).min(4))
}

/// Before → after, as large as it deserves.
fn change(before: f64, after: f64, of: &str) -> Markup {
    html! {
        p.big {
            span.was { (mm(before)) }
            span.arrow { "→" }
            span.now { (mm(after)) " " span.unit { "mm" } }
        }
        p.under { "mean position error on " (of) }
    }
}

fn fact(term: &str, value: &str) -> Markup {
    html! { div { dt { (term) } dd { (value) } } }
}

fn poses(found: &Identification) -> Markup {
    let (fitted, held_out) = (found.fitted.identification.n, found.fitted.held_out.n);
    fact("Poses", &format!("{fitted} fitted, {held_out} held out"))
}

fn parameters(found: &Identification) -> Markup {
    let rank = found.identifiability.rank;
    fact("Parameters", &format!("{} fitted, rank {rank}", found.unknowns.len()))
}

fn size(term: &str, found: &Identification) -> Markup {
    match (found.noise, found.reduced_chi2) {
        (Noise::Declared, Some(chi2)) => fact(term, &format!("χ²/ν {}", number(chi2, 2))),
        (Noise::Estimated(sigma), _) => fact(term, &format!("{} mm per coordinate", mm(sigma))),
        _ => fact(term, "not to be judged"),
    }
}

fn spread(errors: &ErrorSummary) -> String {
    format!("rms {} mm, largest {} mm", mm(errors.rms.norm), mm(errors.max.norm))
}

fn missing(arms: &[(&str, &Errors)]) -> Markup {
    html! { @if let Some(words) = unpredicted(arms) { p.note { (words) } } }
}

fn missing_of(found: &Identification) -> Markup {
    missing(&[("the nominal arm", &found.registered), ("the arm as identified", &found.fitted)])
}

fn distrust(found: &Identification) -> Markup {
    html! { @if let Some(reason) = &found.distrust { p.note { "Not to be trusted: " (reason.to_string()) } } }
}

fn before(problem: &Problem) -> String {
    let effects = if problem.effects.is_empty() { "" } else { ", with the declared effects" };
    format!(
        "Before: the nominal arm, with base and tool fitted where they are free. After: the arm as identified{effects}."
    )
}

/// Of one identification.
pub(super) fn of_identification(problem: &Problem, found: &Identification) -> Markup {
    let held_out = found.fitted.held_out;
    html! {
        (change(found.registered.held_out.mean.norm, held_out.mean.norm, &format!("{} held-out poses", held_out.n)))
        p { (before(problem)) }
        (distrust(found))
        (missing_of(found))
        dl.facts {
            (poses(found))
            (parameters(found))
            (fact("Held out, after", &spread(&held_out)))
            (size("Residual against σ", found))
            (fact("Strategy", found.strategy.as_str()))
            (fact("Solver", &format!("{}, {} steps", found.solver.as_str(), found.iterations)))
        }
    }
}

/// Of a comparison.
pub(super) fn of_comparison(problem: &Problem, comparison: &Comparison) -> Markup {
    let joint = &comparison.joint;
    let held_out = joint.fitted.held_out;
    html! {
        (change(joint.registered.held_out.mean.norm, held_out.mean.norm, &format!("{} held-out poses, everything fitted at once", held_out.n)))
        p { (before(problem)) }
        (distrust(joint))
        (missing_of(joint))
        dl.facts {
            (poses(joint))
            (parameters(joint))
            (fact("Geometry alone", &format!("{} mm", mm(comparison.rigid.fitted.held_out.mean.norm))))
            (size("Residual against σ", joint))
        }
    }
}

/// Of a closed loop: with the interval of the gain.
pub(super) fn of_closure(problem: &Problem, closure: &ClosedLoop) -> Markup {
    let (fit, after) = (&closure.before.fit, &closure.after);
    let (first, last) = (fit.fitted.held_out, after.fitted.held_out);
    let gain = closure.gain;
    let digits = decimals((gain.high - gain.low) * 1e3, 4).max(2);
    let shown = |value: f64| number(value * 1e3, digits).replace('-', "−");
    let verdict = match closure.verdict {
        Verdict::NothingFound => "nothing found",
        Verdict::Explained => "explained",
        Verdict::Unexplained => "structure is left",
    };
    let meaning = match closure.verdict {
        Verdict::NothingFound => "No effect stands out of the residual, and it has no structure.",
        Verdict::Explained => "What is left after the loop passes every check of structure.",
        Verdict::Unexplained => "What is left after the loop still has structure.",
    };
    let corrected = closure.unexplained.as_ref().and_then(|left| left.correction.as_ref());
    let (best, with) = match corrected {
        Some(correction) => (correction.held_out, "and after the loop, empirical correction included"),
        None => (last, "and after the loop"),
    };
    html! {
        (change(first.mean.norm, best.mean.norm, &format!("{} held-out poses, before {with}", last.n)))
        p {
            @if corrected.is_some() { "Without the correction " (mm(last.mean.norm)) " mm. " }
            @if !closure.effects.is_empty() && gain.value.is_finite() {
                "Gain of the effects " b { (shown(gain.value)) " mm" } ", 95 % interval " (shown(gain.low)) " to "
                (shown(gain.high)) " mm. "
            }
            "Before: the declared model as identified; the nominal arm had " (mm(fit.registered.held_out.mean.norm)) " mm. "
            (meaning)
        }
        (distrust(after))
        (missing(&[("the nominal arm", &fit.registered), ("the declared model", &fit.fitted), ("the model after the loop", &after.fitted)]))
        dl.facts {
            (fact("Verdict", verdict))
            (fact("Effects found", &closure.effects.len().to_string()))
            (poses(after))
            (parameters(after))
            (size("Residual before", fit))
            (size("Residual after", after))
            (fact("Held out, after", &spread(&last)))
            @if !problem.effects.is_empty() { (fact("Effects declared", &problem.effects.len().to_string())) }
        }
    }
}

//! What the loop found, in words and figures.

use maud::{Markup, html};

use super::figures::{self, Figure, capital, power_of_ten};
use crate::diagnose::{ClosedLoop, Found, Trace, Unexplained};
use crate::model::effect;
use crate::problem::Effect;
use crate::report::effect::Values;
use crate::report::plot_data::Picture;
use crate::report::quantity::number;

/// Alternatives that are named.
const SHOWN: usize = 8;

/// An effect as a problem file names it, with its place.
fn named(found: &Effect) -> String {
    let place = effect::place(found);
    if place.is_empty() { effect::name(found).to_owned() } else { format!("{} {place}", effect::name(found)) }
}

/// p in words of a power of ten.
fn chance(p: f64) -> String {
    if p < 1e-300 {
        "p < 10⁻³⁰⁰".to_owned()
    } else if p < 1e-3 {
        format!("p ≈ {}", power_of_ten(p.log10().floor()))
    } else {
        format!("p = {p:.3}")
    }
}

/// Every found effect with its numbers, then what no effect explains.
pub(super) fn story(closure: &ClosedLoop) -> Markup {
    html! {
        @if closure.effects.is_empty() { p { "No effect of the catalogue stands out of the residual." } }
        div.columns {
            @for found in &closure.effects { (one(found, closure)) }
        }
        @if let Some(left) = &closure.unexplained { (unexplained(left)) }
    }
}

fn one(found: &Found, closure: &ClosedLoop) -> Markup {
    let values = Values::of(&found.estimates);
    let mut others: Vec<String> = found.alternatives.iter().map(named).collect();
    let more = others.len().saturating_sub(SHOWN);
    others.truncate(SHOWN);
    if more > 0 {
        others.push(format!("and {more} more, in loop.json"));
    }
    html! {
        div.found {
            h3 { (capital(&closure.before.describe(&found.effect))) }
            p {
                code { (named(&found.effect)) } ", " (chance(found.p_value))
                @if let Some(then) = closure.held_out_once(found) {
                    "; once it was in the model, held-out poses were off by " (number(then.mean.norm * 1e3, 3)) " mm on average"
                }
            }
            table {
                @for (name, value) in &values.shown {
                    tr { td.l { code { (name) } } td { (value.replace('-', "−")) } }
                }
            }
            @if let Some(rest) = &values.rest { p { (rest) "." } }
            @if !others.is_empty() { p { "These data cannot tell it from: " (others.join("; ")) "." } }
        }
    }
}

fn unexplained(left: &Unexplained) -> Markup {
    let depends = left.depends_on.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    html! {
        p.note {
            "Structure is left that no effect explains: " (left.place)
            @if !depends.is_empty() { ", depending on " (depends) }
            " (" (chance(left.p_value)) "). "
            @match &left.correction {
                Some(correction) => {
                    "An empirical correction takes the error of poses left out in turn from "
                    (number(correction.cross_validated.0 * 1e3, 3)) " to " (number(correction.cross_validated.1 * 1e3, 3))
                    " mm rms"
                    @if correction.beyond > 0 { "; held-out poses beyond its range stay as they are: " (correction.beyond) }
                    "."
                }
                None => "No empirical correction predicts poses that were left out."
            }
        }
    }
}

/// The residual against the cause of each effect, and of structure without one.
pub(super) fn figures(closure: &ClosedLoop, picture: &Picture) -> Vec<Figure> {
    let causes = picture.causes.iter().enumerate();
    let mut all: Vec<Figure> = causes
        .map(|(k, cause)| {
            figures::cause(cause, format!("effect-{}", k + 1), "Found by the loop; the line is the fitted law.")
        })
        .collect();
    let known = closure.unexplained.is_some();
    all.extend(picture.trend.iter().filter(|_| known).map(|trend| {
        figures::cause(
            trend,
            "unexplained".to_owned(),
            "No effect explains this; the line is the empirical correction. Its mean over this range is taken off line and dots: a \
             constant is what base and geometry take up.",
        )
    }));
    all
}

/// What each round of the loop came to.
pub(super) fn rounds(closure: &ClosedLoop) -> Markup {
    let first = &closure.before.fit.fitted;
    let line = |round: usize, effects: &[Effect], fitted: f64, held_out: f64| {
        let names: Vec<String> = effects.iter().map(named).collect();
        html! {
            tr {
                td.l { (round) }
                td.l.w { (if names.is_empty() { "as declared".to_owned() } else { names.join(", ") }) }
                td { (number(fitted * 1e3, 3)) }
                td { (number(held_out * 1e3, 3)) }
            }
        }
    };
    html! {
        h3 { "Rounds" }
        table {
            thead { tr { th.l { "round" } th.l { "effects in the model" } th { "fitted [mm]" } th { "held out [mm]" } } }
            tbody {
                (line(0, &[], first.identification.mean.norm, first.held_out.mean.norm))
                @for (k, step) in closure.rounds.iter().enumerate() {
                    (line(k + 1, &step.effects, step.identification.mean.norm, step.held_out.mean.norm))
                }
            }
        }
    }
}

/// What could not be looked for.
pub(super) fn absent(trace: &Trace) -> Markup {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (effect, reason) in &trace.untestable {
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, effects)) => effects.push(named(effect)),
            None => reasons.push((reason, vec![named(effect)])),
        }
    }
    let absorbed: Vec<String> = trace.absorbed.iter().map(named).collect();
    html! {
        @if !reasons.is_empty() || !absorbed.is_empty() {
            h3 { "Not looked for" }
            ul.plain {
                @for (reason, effects) in &reasons { li.skip { (effects.join(", ")) ": " (reason) } }
                @if !absorbed.is_empty() { li.skip { (absorbed.join(", ")) ": the fitted parameters absorb it" } }
            }
        }
    }
}

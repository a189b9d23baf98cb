//! Parts of the loop's story.

use std::fmt::Write as _;

use super::super::document::{Block, Point, Table};
use super::super::effect::{self, Values};
use super::super::errors::unpredicted;
use super::super::findings;
use super::super::quantity::number;
use super::super::text::why_not_trusted;
use crate::diagnose::{ClosedLoop, Correction, Covariate, Found, HELD_FIXED, REFUSED, Unexplained, Verdict};
use crate::identify::ErrorSummary;
use crate::problem::{JointKind, Problem};

/// Where all parameters of the final fit are.
pub(super) const ALL: &str = "the estimate.json of `flexcal identify problem.closed.toml`";
/// Alternatives that are named.
const SHOWN: usize = 4;

/// The outcome in a sentence or two.
pub(super) fn verdict(closure: &ClosedLoop) -> String {
    let found = match closure.effects.as_slice() {
        [] => "No effect was found".to_owned(),
        [one] => format!("One effect was found ({})", closure.before.describe(&one.effect)),
        several => format!("{} effects were found", several.len()),
    };
    match (closure.verdict, closure.findings.is_testable()) {
        (Verdict::Unexplained, _) => format!("Unexplained: structure is left in the residual. {found}."),
        (_, false) => format!("{found}; whether structure is left could not be tested."),
        (Verdict::NothingFound, true) => "Nothing found: what the declared problem leaves looks like noise.".to_owned(),
        (Verdict::Explained, true) => format!("Explained: {}, and what is left looks like noise.", lower(&found)),
    }
}

fn lower(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// Why the final fit is not to be trusted.
pub(super) fn distrust(closure: &ClosedLoop) -> Option<Block> {
    let after = &closure.after;
    (!after.is_trusted()).then(|| Block::Text(format!("Beware: {}.", why_not_trusted(after))))
}

/// Errors of the nominal arm, the declared problem and the closed one.
pub(super) fn errors(closure: &ClosedLoop) -> Table {
    let row = |poses: &str, model: &str, of: &ErrorSummary, chi2: Option<f64>| {
        let mut row = vec![poses.to_owned(), model.to_owned()];
        row.extend([of.mean.norm, of.rms.norm, of.max.norm].map(|value| number(value * 1e3, 4)));
        row.push(chi2.map_or_else(String::new, |chi2| number(chi2, 2)));
        row
    };
    let (before, after) = (&closure.before.fit, &closure.after);
    let mut rows = vec![
        row("held out", "nominal arm, base and tool fitted", &before.registered.held_out, None),
        row("", "as declared, fitted", &before.fitted.held_out, None),
        row("", "with what was found", &after.fitted.held_out, None),
        row("identification", "nominal arm, base and tool fitted", &before.registered.identification, None),
        row("", "as declared, fitted", &before.fitted.identification, before.reduced_chi2),
        row("", "with what was found", &after.fitted.identification, after.reduced_chi2),
    ];
    if closure.effects.is_empty() {
        rows.retain(|row| row[1] != "with what was found");
    }
    Table { header: vec!["error, mm", "", "mean", "rms", "max", "χ²/ν"], rows, left: vec![0, 1] }
}

/// How the figures are to be read, with the gain and how sure it is.
pub(super) fn gain(closure: &ClosedLoop) -> String {
    let (before, after) = (&closure.before, &closure.after);
    let another = findings::another_size(&before.findings, before.fit.reduced_chi2)
        .or_else(|| findings::another_size(&closure.findings, after.reduced_chi2));
    let mut arms =
        vec![("the nominal arm", &before.fit.registered), ("the arm as declared, fitted", &before.fit.fitted)];
    arms.extend((!closure.effects.is_empty()).then_some(("what was found", &after.fitted)));
    let unknown = unpredicted(&arms);
    let chi2 = "χ²/ν is the residual's size against the declared noise: 1 where only noise is left.";
    let notes = [Some(chi2), another, unknown.as_deref()].into_iter().flatten().collect::<Vec<_>>().join(" ");
    let gain = closure.gain;
    if closure.effects.is_empty() || !gain.value.is_finite() {
        return notes;
    }
    let mm = |value: f64| number(value * 1e3, 4);
    format!(
        "What was found takes {} mm off the mean error of the {} held-out poses (95 % interval {} to {} mm). They took no \
         part in any choice. {notes}",
        mm(gain.value),
        closure.after.fitted.held_out.n,
        mm(gain.low),
        mm(gain.high),
    )
}

/// Every effect that was found.
pub(super) fn found(closure: &ClosedLoop) -> Vec<Block> {
    if closure.effects.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![
        Block::heading("What was found"),
        Block::Ranking(closure.effects.iter().map(|found| point(closure, found)).collect()),
    ];
    if let Some(sigma) = closure.harmonic_sigma {
        blocks.push(Block::Text(format!(
            "Waves of joints are many: every order up to the highest that stands out is in the model, with one prior of {} ° \
             for all. With it, poses are predicted best where whole parts of a joint's range are left out.",
            number(sigma.to_degrees(), 6)
        )));
    }
    blocks
}

fn point(closure: &ClosedLoop, found: &Found) -> Point {
    let mut details = Values::of(&found.estimates).lines();
    let mut chance = format!("{}, the probability that it is chance", effect::p(found.p_value));
    if let Some(then) = closure.held_out_once(found) {
        let mm = |value: f64| number(value * 1e3, 4);
        let (mean, rms) = (mm(then.mean.norm), mm(then.rms.norm));
        let _ = write!(chance, "; held-out error once it was in the model: mean {mean} mm, rms {rms} mm");
    }
    details.push(chance);
    if !found.alternatives.is_empty() {
        let named: Vec<String> =
            found.alternatives.iter().take(SHOWN).map(|other| closure.before.describe(other)).collect();
        let more = match found.alternatives.len().saturating_sub(SHOWN) {
            0 => String::new(),
            more => format!("; and {more} more"),
        };
        details.push(format!("these data do not tell it from: {}{more}", named.join("; ")));
    }
    Point { text: effect::both(&found.effect, &closure.before), details }
}

/// What no effect explains.
pub(super) fn unexplained(problem: &Problem, closure: &ClosedLoop) -> Vec<String> {
    let Some(unexplained) = &closure.unexplained else { return Vec::new() };
    let Unexplained { place, depends_on, p_value, correction } = unexplained;
    let on = depends_on.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let mut sentences = vec![match on.as_str() {
        "" => format!("Structure is left: {place} ({}).", effect::p(*p_value)),
        on => format!("Structure is left: {place}, depending on {on} ({}).", effect::p(*p_value)),
    }];
    let untried = |why: &str| closure.before.untestable.iter().filter(|(_, reason)| *reason == why).count();
    let mut catalogue = "No effect of the catalogue explains it".to_owned();
    for (why, words) in [(HELD_FIXED, "holds them fixed"), (REFUSED, "speaks of them in another unit")] {
        match untried(why) {
            0 => {}
            count => _ = write!(catalogue, "; {count} were not tried because [parameters] {words}"),
        }
    }
    sentences.push(catalogue + ".");
    match correction {
        None => {
            sentences.push("No correction without a cause would help on poses that it was not made from.".to_owned());
        }
        Some(Correction { covariate, range, beyond, cross_validated: (without, with), held_out, .. }) => {
            let mm = |value: &f64| number(value * 1e3, 4);
            sentences.push(format!(
                "A smooth correction there as a function of {on} would bring the held-out error to {} mm in the mean, rms \
                 {} mm, and that of identification poses left out in turn from rms {} to {} mm. It names no cause and is \
                 not part of `problem.closed.toml`.",
                mm(&held_out.mean.norm),
                mm(&held_out.rms.norm),
                mm(without),
                mm(with),
            ));
            let (factor, unit) = unit(problem, *covariate);
            sentences.push(format!(
                "It holds for {on} from {} to {}{unit}, as far as the identification poses reach; nothing is corrected beyond \
                 ({beyond} of {} held-out poses).",
                number(range.0 * factor, 2),
                number(range.1 * factor, 2),
                held_out.n
            ));
        }
    }
    sentences
}

/// Factor from SI to the unit in which people read a quantity of the poses.
fn unit(problem: &Problem, covariate: Covariate) -> (f64, &'static str) {
    match covariate {
        Covariate::Temperature => (1.0, " °C"),
        Covariate::Time => (1.0 / 3600.0, " h"),
        Covariate::Payload => (1.0, " kg"),
        Covariate::Hoist => (1.0, " N"),
        Covariate::Command(joint) if problem.joints[joint].kind == JointKind::Prismatic => (1e3, " mm"),
        Covariate::Command(_) => (180.0 / std::f64::consts::PI, " °"),
        _ => (1.0, ""),
    }
}

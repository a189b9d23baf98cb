//! Effects that a loop found: list with the evidence for each, table of statuses, and rounds.

use std::fmt::Write as _;

use super::document::{Block, Column, Point, Table, code, percent, split_at_most};
use super::errors::with_unit_of;
use super::verdict::{alternative, has_place, stand_in_sentence, title};
use super::{effect, figures, trace};
use crate::problem::Effect;
use crate::quantity::format::{number, or_dash, p_value};
use crate::results::{FoundEffect, LoopResult, Step, Witness};
use crate::select::{ClosedLoop, Status};

/// Statement on an effect whose law has no probability.
pub(super) const UNCOMPARED: &str =
    "judged by its p-value alone: its law was not compared with others";

/// Returns the heading of the list of effects, which claims nothing after a fit that is not
/// trusted.
pub(super) fn found_heading(result: &LoopResult) -> &'static str {
    if !result.trusted {
        "What the search added, and does not claim"
    } else if result.with_status(Status::Found).next().is_some() {
        "What was found"
    } else if result.with_status(Status::Probable).next().is_some() {
        "What probably acts"
    } else {
        "What may act: no effect is sure"
    }
}

/// Lists the effects that the loop added, each with its status and at most `alternatives`
/// alternatives.
pub(super) fn found_effects<'a>(result: &LoopResult, alternatives: usize) -> Vec<Block<'a>> {
    if result.effects.is_empty() {
        return Vec::new();
    }
    let points = result.effects.iter().map(|found| point(result, found, alternatives)).collect();
    let mut blocks = vec![Block::heading(found_heading(result)), Block::Ranking(points)];
    if let Some(prior) = &result.harmonic_prior {
        let sigmas = || prior.iter().map(|order| order.sigma_rad.to_degrees());
        blocks.push(Block::Text(format!(
            "Many harmonics were found. The model has every order up to the highest significant one, with one prior for all joints: \
             1 σ of {} to {} ° by order. The scale of this prior is the one that best predicts poses in parts of the joints' ranges \
             that are left out of the fit.",
            number(sigmas().fold(f64::INFINITY, f64::min), 6),
            number(sigmas().fold(0.0, f64::max), 6)
        )));
    }
    blocks
}

fn point(result: &LoopResult, found: &FoundEffect, alternatives: usize) -> Point {
    let mut details: Vec<String> = stand_in_sentence(found).into_iter().collect();
    details.extend(effect::values(&found.effect.effect, &found.parameters));
    let is_open = found.claims.is_none() && !found.is_only_with_others();
    let undetermined = || is_open.then(|| UNCOMPARED.to_owned());
    details.extend(claims(found).or_else(undetermined));
    details.extend(effect::seen_ranges(&found.ranges).map(|seen| format!("seen for {seen}")));
    let hint = found.resembles.as_ref().map(|cause| {
        let noun = cause.trim_start_matches("as ").trim_end_matches(" would");
        format!("hint: {noun} would act alike")
    });
    details.extend(hint);
    details.extend(found.stability.map(|share| {
        format!(
            "found in {} % of refits on random 80 % subsets of the poses",
            number(share * 100.0, 0)
        )
    }));
    details.extend(found.witness.as_ref().map(witness));
    let mut chance = format!("p {}", p_value(found.p_value));
    chance.push_str(if found.is_only_with_others() {
        ": not significant by itself; it is in the model together with others"
    } else {
        ": probability that noise alone does as well"
    });
    if has_own_errors(result) {
        let ([mean, rms, _], unit) = found.held_out_after.norms();
        let _ = write!(
            chance,
            "; held-out error of the first model with it whose effects all stayed: mean {} \
             {unit}, rms {} {unit}",
            number(mean, 4),
            number(rms, 4)
        );
    }
    details.push(chance);
    if !found.alternatives.is_empty() {
        let others = found.alternatives.iter().map(alternative);
        let (mut others, more) = split_at_most(others, alternatives);
        others.extend((more > 0).then(|| format!("{more} more in loop.json")));
        details.push(format!("these data do not exclude: {}", others.join("; ")));
    }
    Point { text: title(found), details, mark: None }
}

/// States what the data allow to claim about an effect; `None` without evidence. The place and the
/// inputs of an effect that only represents structure of unknown place and law are not claimed.
fn claims(found: &FoundEffect) -> Option<String> {
    let claims = found.claims.as_ref()?;
    if has_place(found) || stand_in_sentence(found).is_none() {
        return Some(trace::claims_text(claims));
    }
    let law = percent(claims.law.probability);
    Some(format!("neither place nor law is known: this effect has a probability of {law}"))
}

/// Returns true if the found effects have different errors after the first round with each whose
/// effects all stayed. Otherwise the errors say nothing about single effects.
fn has_own_errors(result: &LoopResult) -> bool {
    let mut errors = result.effects.iter().map(|found| found.held_out_after);
    errors.next().is_some_and(|first| errors.any(|other| other != first))
}

fn witness(witness: &Witness) -> String {
    format!("{} by {}, which took no part in the fit", witness.says, witness.data)
}

/// Returns the table and the figure of the rounds of the loop, with the errors after each.
pub(super) fn rounds<'a>(closure: &'a ClosedLoop, result: &LoopResult) -> Vec<Block<'a>> {
    if result.steps.is_empty() {
        return Vec::new();
    }
    let change = |(round, _): &(usize, &Step)| {
        let (added, removed) = closure.changes_of_round(round - 1);
        // The words leave out arguments that a search refines, such as a period.
        let words = |effect: &&Effect| closure.before.describe(effect);
        let named = |effect: &&Effect, others: &[&Effect]| match words(effect) {
            alike if others.iter().any(|other| words(other) == alike) => {
                format!("{alike} ({})", code(&effect.declaration()))
            }
            alone => alone,
        };
        let listed = |word: &str, effects: &[&Effect], others: &[&Effect]| {
            let words: Vec<String> = effects.iter().map(|effect| named(effect, others)).collect();
            (!words.is_empty()).then(|| format!("{word}: {}", words.join("; ")))
        };
        let parts = [listed("added", &added, &removed), listed("removed", &removed, &added)];
        let words = parts.into_iter().flatten().collect::<Vec<_>>().join(" – ");
        if words.is_empty() { "no change".to_owned() } else { words }
    };
    let error = |name: &str, of: fn(&Step) -> f64| {
        Column::number(name, move |(_, step): &(usize, &Step)| number(of(step), 4))
    };
    let rms = with_unit_of(&closure.after.fitted.held_out, "identification rms");
    let steps: Vec<(usize, &Step)> = (1..).zip(&result.steps).collect();
    let columns = [
        Column::number("round", |(round, _): &(usize, &Step)| round.to_string()),
        Column::words("change of the model", change),
        error(&rms, |step| step.errors.identification.norms().0[1]),
        error("held out mean", |step| step.errors.judged().norms().0[0]),
        error("held out rms", |step| step.errors.judged().norms().0[1]),
    ];
    vec![
        Block::heading("Rounds"),
        Block::figures([figures::draw_rounds(closure)]),
        Block::Table(Table::of(&steps, &columns)),
    ]
}

/// Returns the table of the effects with their status and the evidence for each; `None` if no
/// effect was found.
pub(super) fn status_table<'a>(closure: &ClosedLoop, result: &LoopResult) -> Option<Block<'a>> {
    let share = |part: f64| format!("{} %", number(part * 100.0, 0));
    let law = |found: &FoundEffect| {
        or_dash(found.claims.as_ref(), |claims| percent(claims.law.probability))
    };
    let status = |found: &FoundEffect| {
        let is_unknown = found.status == Status::Located && !has_place(found);
        if is_unknown { "unknown" } else { found.status.as_str() }.to_owned()
    };
    let mut columns = vec![
        Column::words("effect", |found: &FoundEffect| found.effect.description.clone()),
        Column::words("status", status),
        Column::number("p", |found: &FoundEffect| p_value(found.p_value)),
        Column::number("law", law),
        Column::number("refits", |found: &FoundEffect| or_dash(found.stability, share)),
        Column::words("data outside the fit", |found: &FoundEffect| {
            or_dash(found.witness.as_ref(), |check| format!("{} by {}", check.says, check.data))
        }),
    ];
    let mut note = "p: probability that noise alone does as well; law: probability of this law, \
                    and of no other, at its place; refits: share of refits on random 80 % subsets of \
                    the poses that find the effect"
        .to_owned();
    if has_own_errors(result) {
        let mean = with_unit_of(&closure.after.fitted.held_out, "held out mean");
        let error = |found: &FoundEffect| number(found.held_out_after.norms().0[0], 4);
        columns.push(Column::number(mean, error));
        note.push_str(
            "; held out mean: error of the first model with this effect whose effects all stayed",
        );
    }
    if result.effects.iter().any(|found| found.claims.is_none() || found.stability.is_none()) {
        note.push_str("; –: not determined");
    }
    let table = Table::of(&result.effects, &columns).noted(&[&note]);
    (!result.effects.is_empty()).then_some(Block::Table(table))
}

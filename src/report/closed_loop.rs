//! What `loop` says: what was found, before and after, and what remains.

use std::fmt::Write as _;

use super::document::{Block, Headline, Point, Table, code, named, some_of};
use super::errors::{
    NOMINAL, both_parts, held_out_rows, in_unit, mean_and_rms, measure, row, rows_of, shown, unit,
    unpredicted, with_unit,
};
use super::figures::{self, PlotData};
use super::identify::{
    BEFORE, all_told, beware, fitted_parameters, mean, poses, spread, why_not_trusted,
};
use super::noise::{carried, size};
use super::parameters::{lower_waves, parameters};
use super::quantity::{counted, decimals, number, or_dash, p_value};
use super::render::{Report, report, text};
use super::trace::percent;
use super::unexplained::{correction, not_looked_for, unexplained, wrong_limits};
use super::verdict::{called, counts, is_beside, stand_in, verdict};
use super::{effect, findings, trace};
use crate::fit::{ErrorSummary, Errors, Identification};
use crate::problem::Problem;
use crate::select::{ClosedLoop, Found, ReferenceCheck, ReferenceVerdict, Round};

/// Alternatives that are named in words; the page names twice as many.
const SHOWN_ALTERNATIVES: usize = 4;
/// Candidates that a report shows.
const SHOWN: usize = 8;
/// Rows that are named of those that took no part.
const SHOWN_ROWS: usize = 3;
/// Limits of the declared problem that are named.
const LIMITS: usize = 3;

/// What to know before one reads what was found: rows that carry the misfit, cautions, what was not
/// looked for, rows set aside.
pub(super) fn to_know<'a>(problem: &Problem, closure: &ClosedLoop) -> Vec<Block<'a>> {
    let mut blocks: Vec<Block> = carried(&closure.before.fit).into_iter().collect();
    blocks.extend(cautions(closure));
    blocks.extend(not_looked_for(problem, closure).map(Block::Text));
    blocks.extend(set_aside(problem, closure));
    blocks
}

/// Rows that took no part in the choice of effects; nothing to say without any.
fn set_aside<'a>(problem: &Problem, closure: &ClosedLoop) -> Option<Block<'a>> {
    let rows = &closure.set_aside;
    let treatment = if problem.robust.is_some() {
        "The robust loss keeps the fit from such rows"
    } else {
        "The fit counts such rows in full; a section [robust] would limit them"
    };
    let words = format!(
        "{} too far off to be noise took no part in the choice of effects: {}. {treatment}.",
        counted(rows.len(), "pose"),
        named(rows.iter().map(ToString::to_string), SHOWN_ROWS, ", ")
    );
    (!rows.is_empty()).then_some(Block::Text(words))
}

/// What the loop came to as text, ending in a line break.
pub fn loop_text(problem: &Problem, closure: &ClosedLoop) -> String {
    let mut blocks = vec![
        Block::Text(format!("{}\n{}", problem.title, both_parts(&closure.before.fit))),
        Block::Text(verdict(closure)),
    ];
    blocks.extend(to_know(problem, closure));
    blocks.extend([Block::Table(errors(closure)), Block::Text(gain(closure))]);
    let failed = findings::failed(&closure.before.findings);
    if !failed.is_empty() {
        blocks.push(Block::heading("What the declared problem leaves (checks that failed)"));
        blocks.push(Block::list(failed));
    }
    blocks.extend(found(closure, SHOWN_ALTERNATIVES));
    let failed = findings::failed(&closure.findings);
    if !closure.unexplained.is_empty() || (!failed.is_empty() && !closure.effects.is_empty()) {
        blocks.push(Block::heading("What remains"));
        let unexplained = unexplained(problem, closure).into_iter();
        // Without effects the checks are those above.
        let failed = failed.into_iter().filter(|_| !closure.effects.is_empty());
        blocks.push(Block::list(unexplained.chain(failed)));
    }
    text(&blocks)
}

/// The report of `loop`.
pub fn loop_report(problem: &Problem, closure: &ClosedLoop, plots: &PlotData) -> Report {
    report(problem, "closed loop", &blocks(problem, closure, plots))
}

fn blocks<'a>(problem: &Problem, closure: &'a ClosedLoop, plots: &'a PlotData) -> Vec<Block<'a>> {
    let (fit, after) = (&closure.before.fit, &closure.after);
    let file = format!("the estimate.json of {}", code("flexcal identify problem.closed.toml"));
    let counts = format!(
        "{} from {}; {} held out, which took no part in any choice.",
        counted(fit.unknowns.len(), "parameter"),
        rows_of(fit, |errors| errors.identification),
        rows_of(fit, |errors| errors.held_out)
    );
    let mut blocks = vec![
        Block::Headline(headline(problem, closure)),
        Block::Text(verdict(closure)),
        Block::Text(counts),
    ];
    blocks.extend(to_know(problem, closure));
    blocks.extend(beware(after, plots));
    blocks.extend([
        Block::Table(errors(closure)),
        Block::Text(gain(closure)),
        Block::figures([figures::errors(plots), figures::vectors(plots)]),
        Block::Poses(plots),
        Block::heading("What the declared problem leaves"),
    ]);
    blocks.extend(findings::blocks(&closure.before.findings));
    let every = format!("{} writes them all", code("flexcal trace"));
    let mut ranking = trace::ranking(problem, &closure.before, SHOWN, &every);
    ranking.insert(1, Block::figures([figures::ranking(&closure.before)]));
    blocks.extend(ranking);
    blocks.push(Block::Page(trace::not_seen(&closure.before)));
    blocks.extend(rounds(closure));
    blocks.extend(sureness(closure));
    blocks.push(Block::Words(found(closure, SHOWN_ALTERNATIVES)));
    blocks.push(Block::Page(found(closure, 2 * SHOWN_ALTERNATIVES)));
    let causes = plots.causes.iter().zip(1..);
    blocks.push(Block::figures(
        causes.map(|(cause, number)| Some(cause.draw_effect(number, &plots.shown))),
    ));
    blocks.push(Block::heading("What remains"));
    let unexplained = unexplained(problem, closure).into_iter().map(Point::from);
    let (tests, page) = (findings::all(&closure.findings), findings::each(&closure.findings));
    blocks.extend([
        Block::Words(vec![Block::List(unexplained.clone().chain(tests).collect())]),
        Block::Page(vec![Block::List(unexplained.chain(page).collect())]),
        Block::figures([
            plots.trend.as_ref().map(|trend| trend.draw_unexplained(&plots.shown)),
            figures::histogram(plots),
            figures::order(plots),
            figures::joint_map(plots),
        ]),
        Block::heading("Parameters of the final fit"),
    ]);
    blocks.extend(parameters(&closure.closed, after, &file));
    blocks.extend(lower_waves(&closure.closed, after, &file));
    blocks.push(Block::figures([figures::contributions(&plots.contributions)]));
    blocks.push(Block::Page(all_told(after, plots, &file)));
    blocks
}

/// What it came to at one glance: with the correction, if there is one.
fn headline(problem: &Problem, closure: &ClosedLoop) -> Headline {
    let (fit, after) = (&closure.before.fit, &closure.after);
    let (first, last) = (fit.fitted.held_out, after.fitted.held_out);
    let correction = correction(closure);
    let (best, with) = match correction {
        Some(correction) => (correction.held_out, ", empirical correction included"),
        None => (last, ""),
    };
    let gain = closure.gain;
    let digits = decimals(in_unit(&last, gain.high - gain.low), 4).max(2);
    let mut facts = vec![
        ("Verdict", closure.verdict.as_str().replace('-', " ")),
        ("Effects found", counts(closure)),
        poses(after),
        fitted_parameters(after),
        size("Residual before", fit),
        size("Residual after", after),
        ("Held out, after", spread(&last)),
    ];
    facts.extend(
        correction.map(|_| ("Without the correction", format!("{} {}", mean(&last), unit(&last)))),
    );
    facts.extend((!closure.effects.is_empty() && gain.value.is_finite()).then(|| {
        let [value, low, high] =
            [gain.value, gain.low, gain.high].map(|value| number(in_unit(&last, value), digits));
        let unit = unit(&last);
        ("Gain of the effects", format!("{value} {unit}, 95 % interval {low} to {high} {unit}"))
    }));
    facts.extend(
        (!problem.effects.is_empty())
            .then(|| ("Effects declared", problem.effects.len().to_string())),
    );
    let of = format!("{}{with}", held_out_rows(after));
    let mut states =
        vec![(BEFORE, mean(&fit.registered.held_out)), ("as declared, fitted", mean(&first))];
    if !closure.effects.is_empty() || correction.is_some() {
        states.push(("with what was found", mean(&best)));
    }
    Headline { states, unit: unit(&last), of, facts }
}

/// Why the final fit is not to be trusted, and limits of the declared problem that effects may
/// stand for.
fn cautions<'a>(closure: &ClosedLoop) -> Vec<Block<'a>> {
    let (before, after) = (&closure.before.fit, &closure.after);
    let untrusted = (!after.is_trusted()).then(|| format!("Beware: {}.", why_not_trusted(after)));
    let bounds =
        before.estimates.iter().filter(|own| own.at_bound.is_some()).map(|own| own.name.clone());
    let held = bounds.chain(before.active_constraints.iter().map(|own| own.words.clone()));
    let held = named(held, LIMITS, ", ");
    let limits = (!held.is_empty() && !closure.effects.is_empty()).then(|| {
        format!(
            "Limits hold the fit as declared ({held}): where one is wrong, an effect that was found may only stand for it. \
             flexcal identify -v shows what each costs."
        )
    });
    let wrong = wrong_limits(closure).map(|(limit, probability)| {
        format!(
            "The limit {limit}, which holds the fit, is most probably wrong, or hides a cause ({}): flexcal identify -v shows what it costs; moved out or \
             left away, it lets the loop look further.",
            percent(probability)
        )
    });
    untrusted.into_iter().chain(wrong).chain(limits).map(Block::Note).collect()
}

/// Errors of the nominal arm, the declared problem and the closed one.
pub(super) fn errors(closure: &ClosedLoop) -> Table {
    let (before, after) = (&closure.before.fit, &closure.after);
    let mut rows = Vec::new();
    for (poses, of, is_fitted) in [
        ("held out", (|errors: &Errors| errors.held_out) as fn(&Errors) -> ErrorSummary, false),
        ("identification", |errors| errors.identification, true),
    ] {
        let chi2 = |fit: &Identification| {
            fit.reduced_chi2.filter(|_| is_fitted).map_or_else(String::new, |chi2| number(chi2, 2))
        };
        rows.extend([
            [row(poses, NOMINAL, &of(&before.registered)), vec![String::new()]].concat(),
            [row("", "as declared, fitted", &of(&before.fitted)), vec![chi2(before)]].concat(),
            [row("", "with what was found", &of(&after.fitted)), vec![chi2(after)]].concat(),
        ]);
    }
    if closure.effects.is_empty() {
        rows.retain(|row| row[1] != "with what was found");
    }
    let header = [measure(&after.fitted.held_out), "", "mean", "rms", "max", "χ²/ν"];
    Table { minor: vec![3, 4], ..Table::new(&header, rows, &[0, 1]) }
}

/// How the figures are to be read, with the gain and how sure it is.
fn gain(closure: &ClosedLoop) -> String {
    let (before, after) = (&closure.before, &closure.after);
    let another = findings::another_size(&before.findings, before.fit.reduced_chi2)
        .or_else(|| findings::another_size(&closure.findings, after.reduced_chi2));
    let mut arms = vec![
        ("the nominal arm", &before.fit.registered),
        ("the arm as declared, fitted", &before.fit.fitted),
    ];
    arms.extend((!closure.effects.is_empty()).then_some(("what was found", &after.fitted)));
    let unknown = unpredicted(&arms);
    let chi2 =
        "χ²/ν is the residual's size against the declared noise: 1 where only noise is left.";
    let notes = [Some(chi2.to_owned()), another, unknown]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join(" ");
    let (gain, of) = (closure.gain, &after.fitted.held_out);
    if closure.effects.is_empty() || !gain.value.is_finite() {
        return notes;
    }
    let (takes, off, what) =
        if gain.value < 0.0 { ("adds", "to", "; below 0 it adds") } else { ("takes", "off", "") };
    format!(
        "What was found {takes} {} {off} the mean error of the {} (95 % interval of what it takes off {} to {}{what}). They took no \
         part in any choice. {notes}",
        with_unit(of, gain.value.abs()),
        held_out_rows(after),
        shown(of, gain.low),
        with_unit(of, gain.high),
    )
}

/// Every effect that was found.
fn found<'a>(closure: &ClosedLoop, alternatives: usize) -> Vec<Block<'a>> {
    if closure.effects.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![
        Block::heading("What was found"),
        Block::Ranking(
            closure.effects.iter().map(|found| point(closure, found, alternatives)).collect(),
        ),
    ];
    if let Some(prior) = &closure.harmonic_prior {
        let sigmas = || prior.by_order.iter().map(|own| own.1.to_degrees());
        blocks.push(Block::Text(format!(
            "Many harmonics were found: every order up to the highest that stands out is in the model, with one prior for all \
             joints of {} to {} ° by order, as wide as all of them are there and of the scale that predicts poses best where part \
             of a joint's range is left out.",
            number(sigmas().fold(f64::INFINITY, f64::min), 6),
            number(sigmas().fold(0.0, f64::max), 6)
        )));
    }
    blocks
}

fn point(closure: &ClosedLoop, found: &Found, alternatives: usize) -> Point {
    let mut details: Vec<String> = stand_in(closure, found).into_iter().collect();
    details.extend(effect::values(found));
    details.extend(found.claims.as_ref().map(trace::claimed));
    details.extend(found.stability.map(|share| {
        format!("named in {} % of weighings without a fifth of the poses", number(share * 100.0, 0))
    }));
    details.extend(
        found
            .reference_check
            .as_ref()
            .map(|own| format!("{} by {}, which took no part", says(own), own.data)),
    );
    let mut chance = if is_beside(found) {
        format!(
            "p-value {}: nothing speaks for it by itself; it is in the model together with others",
            p_value(found.p_value)
        )
    } else {
        format!(
            "p-value {}: chance alone would do as well with that probability",
            p_value(found.p_value)
        )
    };
    if let Some(then) = closure.held_out_once(found) {
        let _ =
            write!(chance, "; held-out error once it was in the model: {}", mean_and_rms(&then));
    }
    details.push(chance);
    if !found.alternatives.is_empty() {
        let others = found.alternatives.iter().map(|other| closure.before.describe(other));
        let (mut others, more) = some_of(others, alternatives);
        others.extend((more > 0).then(|| format!("and {more} more")));
        details.push(format!("these data do not distinguish it from: {}", others.join("; ")));
    }
    Point { text: called(closure, found), details, mark: None }
}

/// What a witness says, in a word.
pub(super) fn says(own: &ReferenceCheck) -> &'static str {
    match own.verdict {
        ReferenceVerdict::Corroborated => "corroborated",
        ReferenceVerdict::Contradicted => "contradicted",
    }
}

/// What each round of fit, trace and refit came to.
fn rounds(closure: &ClosedLoop) -> Vec<Block<'_>> {
    if closure.rounds.is_empty() {
        return Vec::new();
    }
    let row = |(k, step): (usize, &Round)| {
        let effects: Vec<String> =
            step.effects.iter().map(|effect| closure.before.describe(effect)).collect();
        let effects = if effects.is_empty() { "none".to_owned() } else { effects.join("; ") };
        let errors =
            [step.identification.rms.norm, step.held_out.mean.norm, step.held_out.rms.norm];
        [
            vec![(k + 1).to_string(), effects],
            errors.map(|error| shown(&step.held_out, error)).to_vec(),
        ]
        .concat()
    };
    let is_angle = closure.after.fitted.held_out.is_angle();
    let rms = if is_angle { "identification rms, °" } else { "identification rms, mm" };
    let header = ["round", "effects in the model", rms, "held out mean", "held out rms"];
    let rows = closure.rounds.iter().enumerate().map(row).collect();
    vec![
        Block::heading("Rounds"),
        Block::figures([figures::rounds(closure)]),
        Block::Table(Table::new(&header, rows, &[1])),
    ]
}

/// How sure each choice is: chance, its law, fits to part of the poses, and data that took no part.
fn sureness<'a>(closure: &ClosedLoop) -> Option<Block<'a>> {
    let share = |part: f64| format!("{} %", number(part * 100.0, 0));
    let row = |found: &Found| {
        let witness =
            found.reference_check.as_ref().map(|own| format!("{} by {}", says(own), own.data));
        vec![
            closure.before.describe(&found.effect),
            p_value(found.p_value),
            or_dash(found.claims.as_ref(), |claims| share(claims.law.1)),
            or_dash(found.stability, share),
            or_dash(witness, |words| words),
            shown(&found.held_out_after, found.held_out_after.mean.norm),
        ]
    };
    let is_angle = closure.after.fitted.held_out.is_angle();
    let mean = if is_angle { "held out mean, °" } else { "held out mean, mm" };
    let header = ["effect", "p by chance", "law", "resampled", "data that took no part", mean];
    let note = "law: its probability against every other at the same place; resampled: the share of weighings without a fifth of the poses \
                that name it; held out mean: once it was in the model";
    let table =
        Table::new(&header, closure.effects.iter().map(row).collect(), &[0, 4]).noted(&[note]);
    (!closure.effects.is_empty()).then_some(Block::Table(table))
}

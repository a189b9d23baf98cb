//! Texts of the command `loop`: summary for one screen, full text (`--verbose`), and report.

use super::document::{
    Block, Headline, Point, Table, code, first_of, joined, percent, split_at_most,
};
use super::errors::{
    DECLARED_ARM, EXTENDED_ARM, NOMINAL_ARM, both_parts, error_label, held_out_rows, rows_of,
    test_rows_word, unpredicted,
};
use super::found_effects::{UNCOMPARED, found_effects, found_heading, rounds, status_table};
use super::identify::{
    fit_warnings, identifiability_with_figures, mean_error, parameters_fact, rms_and_largest,
    row_counts_fact, why_not_trusted,
};
use super::noise::{expected_interval, format_chi2, influential_rows, reservations, residual_fact};
use super::parameters::{against_priors, joint_names, parameters};
use super::remainder::{PredictionAccuracy, corrected_sentence, why_no_bound};
use super::render::{Report, report, text};
use super::residual_tests::{self, other_reduced_chi2};
use super::unexplained::{structure_places, structure_sentences, to_declare};
use super::verdict::{
    alternative, causes, doubts, effect_counts, has_place, is_less_probable, stand_in_sentence,
    title, verdict,
};
use super::{effect, figures, trace};
use crate::fit::ErrorSummary;
use crate::problem::Problem;
use crate::quantity::format::{counted, decimals, number};
use crate::results::{FoundEffect, Gain, LoopResult, PlotData, Summary, TraceResult, nominal_arm};
use crate::select::{ClosedLoop, Status};

/// Maximum number of alternatives that a text names; the page names twice as many.
const MAX_SHOWN_ALTERNATIVES: usize = 4;
/// Maximum number of candidates of the ranking that a report shows.
const MAX_SHOWN_CANDIDATES: usize = 8;
/// Maximum number of excluded rows that a text names.
const MAX_SHOWN_ROWS: usize = 3;
/// Maximum number of limits of the declared problem that a text names.
const MAX_SHOWN_LIMITS: usize = 3;
/// Number of lines of the summary that fit on one screen beside file names and next steps. A longer
/// summary has only the first value of each cause.
const SCREEN_LINES: usize = 22;
/// Name of the identification rows in the table of errors.
const IDENTIFICATION: &str = "identification";

/// Returns a summary of the outcome for one screen, ending in a line break.
pub fn loop_brief(
    problem: &Problem,
    closure: &ClosedLoop,
    accuracy: Option<PredictionAccuracy>,
) -> String {
    let result = &LoopResult::new(problem, closure);
    let mut blocks = head(problem, closure, result, accuracy.as_ref());
    let corrected = accuracy.as_ref().and_then(|accuracy| accuracy.corrected);
    let mut table = errors(closure, result, corrected.as_ref());
    let held_out = table.rows.iter().take_while(|row| row[0] != IDENTIFICATION).count();
    table.rows.truncate(held_out);
    table.header.pop();
    table.rows.iter_mut().for_each(|row| _ = row.pop());
    blocks.push(Block::Table(table));
    let bound = accuracy.map_or_else(|| why_no_bound(&closure.after), |accuracy| accuracy.bound);
    let size: Vec<String> =
        gain_sentences(closure, result, corrected.is_some()).into_iter().chain(bound).collect();
    blocks.extend((!size.is_empty()).then(|| Block::lines(size.join("\n"))));
    let end = remaining_structure(closure, result)
        .map_or_else(String::new, |words| format!("\n{}", text(&[Block::Text(words)])));
    // The strongest claims come first.
    let mut listed: Vec<&FoundEffect> = causes(result).collect();
    listed.sort_by_key(|found| found.status);
    if listed.is_empty() {
        return text(&blocks) + &end;
    }
    blocks.push(Block::heading(found_heading(result)));
    let points = |max_values: usize| {
        let points = listed.iter().map(|found| cause(found, max_values)).collect();
        text(&[Block::Ranking(points)])
    };
    let head = text(&blocks);
    let room = SCREEN_LINES.saturating_sub(head.lines().count() + end.lines().count());
    // Every cause is listed; only its values are shortened.
    let whole = points(usize::MAX);
    let shown = if whole.lines().count() <= room { whole } else { points(1) };
    let words = head + &shown;
    let names = joint_names(problem, &words).map(|names| text(&[Block::Text(names)]));
    words + &names.unwrap_or_default() + &end
}

/// Returns a found effect as a list item: at most `max_values` values ± 1 σ, probability of its
/// law, and effects that the data do not exclude instead.
fn cause(found: &FoundEffect, max_values: usize) -> Point {
    let mut values = effect::values(&found.effect.effect, &found.parameters);
    if max_values < values.len() {
        effect::sort_by_significance(&mut values, &found.parameters);
    }
    // If the law only represents an unknown one, its values have no meaning.
    let stand_in = stand_in_sentence(found);
    let values = values.iter().filter(|_| stand_in.is_none());
    let values = values.map(|value| effect::without_effect(value, &found.effect.effect));
    let (mut facts, more) = split_at_most(values, max_values);
    facts.extend((more > 0).then(|| "others in loop.json".to_owned()));
    let law = match &found.claims {
        Some(claims) => {
            format!("law: {} among those tried", percent(claims.law.probability))
        }
        None => UNCOMPARED.to_owned(),
    };
    facts.extend((stand_in.is_none() && found.status == Status::Found).then_some(law));
    let label = if !has_place(found) {
        "candidates"
    } else if is_less_probable(found) {
        "more probable"
    } else {
        "not excluded"
    };
    let others = match found.alternatives.as_slice() {
        [] => String::new(),
        [first] => format!("; {label}: {}", alternative(first)),
        [first, others @ ..] => {
            format!("; {label}: {} and {} more in loop.json", alternative(first), others.len())
        }
    };
    let facts = (!facts.is_empty()).then(|| facts.join("; "));
    let details = stand_in.into_iter().chain(facts).chain(effect::legend(&found.effect.effect));
    let details = details.collect();
    Point { text: title(found) + &others, details, mark: None }
}

/// Returns the beginning of the summary and of the full text: title, counts of rows, verdict, and
/// cautions that concern the causes.
fn head<'a>(
    problem: &Problem,
    closure: &ClosedLoop,
    result: &LoopResult,
    accuracy: Option<&PredictionAccuracy>,
) -> Vec<Block<'a>> {
    let reservations = reservations(&closure.after, accuracy);
    let mut blocks = vec![
        Block::Text(format!("{}\n{}", problem.title, both_parts(&closure.before.fit))),
        Block::Text(verdict(result, closure.after.sigma_scale < 1.0, &reservations)),
    ];
    blocks.extend(
        accuracy.and_then(|accuracy| corrected_sentence(&closure.after, accuracy)).map(Block::Text),
    );
    blocks.extend(cautions_on_causes(problem, closure, result));
    blocks
}

/// Returns the cautions that concern the causes: missing declarations, influential rows, findings,
/// and excluded rows.
fn cautions_on_causes<'a>(
    problem: &Problem,
    closure: &ClosedLoop,
    result: &LoopResult,
) -> Vec<Block<'a>> {
    let declare = to_declare(problem, closure, result).into_iter().map(Block::Note);
    let blamed = result.is_misfit_of_rows().then(|| influential_rows(&closure.before.fit));
    let of_rows = blamed.flatten().into_iter().chain(cautions(closure, result));
    declare.chain(of_rows).chain(set_aside(problem, result)).collect()
}

/// Names the rows that were excluded from the choice of effects; `None` if there are none.
fn set_aside<'a>(problem: &Problem, result: &LoopResult) -> Option<Block<'a>> {
    let rows = &result.set_aside;
    let treatment = if problem.robust.is_some() {
        "The robust loss limits the influence of such poses on the fit"
    } else {
        "Such poses count in full in the fit; a section [robust] would limit them"
    };
    let location = |row: &crate::results::Row| match row.line {
        Some(line) => format!("{}:{line}", row.file),
        None => row.file.clone(),
    };
    let words = format!(
        "{} {} excluded from the choice of effects (gross errors, or the model does not hold \
         there): {}. {treatment}.",
        counted(rows.len(), "pose"),
        if rows.len() == 1 { "was" } else { "were" },
        first_of(rows.iter().map(location), MAX_SHOWN_ROWS, "loop.json").join(", ")
    );
    (!rows.is_empty()).then_some(Block::Text(words))
}

/// Returns the full outcome as text, ending in a line break.
pub fn loop_text(
    problem: &Problem,
    closure: &ClosedLoop,
    accuracy: Option<PredictionAccuracy>,
) -> String {
    let result = &LoopResult::new(problem, closure);
    let mut blocks = head(problem, closure, result, accuracy.as_ref());
    let corrected = accuracy.as_ref().and_then(|accuracy| accuracy.corrected);
    blocks.push(Block::Table(errors(closure, result, corrected.as_ref())));
    blocks.push(gain_block(closure, result, corrected.is_some()));
    blocks.extend(accuracy.and_then(|accuracy| accuracy.bound).map(Block::lines));
    let failed = residual_tests::failed(&closure.before.residual_tests);
    if !failed.is_empty() {
        blocks.push(Block::heading("Residual tests that the declared problem fails"));
        blocks.push(Block::list(failed));
    }
    blocks.extend(found_effects(result, MAX_SHOWN_ALTERNATIVES));
    let failed = residual_tests::failed(&closure.residual_tests);
    if result.unexplained.is_some() || (!failed.is_empty() && !result.effects.is_empty()) {
        blocks.push(Block::heading("Remaining residual"));
        let unexplained = structure_sentences(problem, closure, result).into_iter();
        // Without found effects, the failed tests are already listed above.
        let failed = failed.into_iter().filter(|_| !result.effects.is_empty());
        blocks.push(Block::list(unexplained.chain(failed)));
        blocks.extend(other_reduced_chi2(&closure.residual_tests, &closure.after).map(Block::Text));
    }
    text(&blocks)
}

/// Returns the report of the command `loop`.
pub fn loop_report(problem: &Problem, closure: &ClosedLoop, plots: &PlotData) -> Report {
    let result = LoopResult::new(problem, closure);
    report(problem, "search for missing effects", &blocks(problem, closure, &result, plots))
}

fn blocks<'a>(
    problem: &Problem,
    closure: &'a ClosedLoop,
    result: &LoopResult,
    plots: &'a PlotData,
) -> Vec<Block<'a>> {
    let (fit, after) = (&closure.before.fit, &closure.after);
    let file = format!("the estimate.json of {}", code("flexcal identify problem.closed.toml"));
    let held_out = if fit.fitted.is_left_out {
        "none held out: errors are those of configurations that a fit leaves out".to_owned()
    } else {
        let rows = rows_of(fit, |errors| errors.held_out);
        format!("{rows} held out, which took no part in any choice")
    };
    let added = after.unknowns.len().saturating_sub(fit.unknowns.len());
    let unknowns = if added > 0 {
        format!(
            "{} ({} as declared, {added} of what was added)",
            counted(after.unknowns.len(), "parameter"),
            fit.unknowns.len()
        )
    } else {
        counted(fit.unknowns.len(), "parameter")
    };
    let counts =
        format!("{unknowns} from {}; {held_out}.", rows_of(fit, |errors| errors.identification));
    let accuracy = PredictionAccuracy::new(after, plots);
    let mut blocks = vec![
        Block::Headline(headline(problem, closure, result, accuracy.as_ref())),
        Block::Text(verdict(
            result,
            after.sigma_scale < 1.0,
            &reservations(after, accuracy.as_ref()),
        )),
        Block::Text(counts),
    ];
    blocks.extend(cautions_on_causes(problem, closure, result));
    blocks.extend(fit_warnings(after, plots));
    let corrected = accuracy.as_ref().and_then(|accuracy| accuracy.corrected);
    blocks.extend([
        Block::Table(errors(closure, result, corrected.as_ref())),
        gain_block(closure, result, corrected.is_some()),
    ]);
    let bound = accuracy.map_or_else(|| why_no_bound(after), |accuracy| accuracy.bound);
    blocks.extend(bound.map(Block::Text));
    blocks.extend([
        Block::Words(found_effects(result, MAX_SHOWN_ALTERNATIVES)),
        Block::Page(found_effects(result, 2 * MAX_SHOWN_ALTERNATIVES)),
        Block::figures(plots.causes.iter().zip(1..).map(|(cause, k)| {
            let found = cause.found.and_then(|index| result.effects.get(index));
            Some(figures::effect(cause, k, &plots.shown, doubts(found)))
        })),
    ]);
    blocks.extend(status_table(closure, result));
    blocks.extend([
        Block::Page(vec![Block::heading("Errors of the poses")]),
        Block::figures([figures::errors(plots), figures::vectors(plots)]),
        Block::Poses(plots),
        Block::heading("Residual of the declared problem"),
    ]);
    blocks.extend(residual_tests::blocks(&closure.before.residual_tests));
    let traced = TraceResult::new(problem, &closure.before);
    let every = format!("{} writes them all", code("flexcal trace"));
    let mut ranking = trace::ranking(problem, &traced, MAX_SHOWN_CANDIDATES, &every);
    ranking.insert(1, Block::figures([figures::ranking(&closure.before)]));
    blocks.extend(ranking);
    blocks.push(Block::Page(trace::undetectable_effects(problem, &closure.before)));
    blocks.extend(rounds(closure, result));
    blocks.push(Block::heading("Remaining residual"));
    let unexplained = structure_sentences(problem, closure, result).into_iter().map(Point::from);
    blocks.extend(residual_tests::blocks_after(unexplained.collect(), &closure.residual_tests));
    blocks.push(Block::figures([
        plots.trend.as_ref().map(|trend| figures::unexplained(trend, &plots.shown)),
        figures::histogram(plots),
        figures::order(plots),
        figures::joint_map(plots),
    ]));
    blocks.extend(other_reduced_chi2(&closure.residual_tests, &closure.after).map(Block::Text));
    blocks.extend(super::remainder::uncertainty(after, plots));
    blocks.push(Block::heading("Parameters of the final fit"));
    blocks.extend(parameters(&closure.closed, after, &file));
    blocks.push(Block::figures([
        against_priors(after),
        figures::contributions(&plots.contributions),
    ]));
    blocks.push(Block::Page(identifiability_with_figures(after, plots, &file)));
    blocks
}

/// Returns the summary at the top of the report. If there is a remainder, the last error is that
/// with it.
fn headline(
    problem: &Problem,
    closure: &ClosedLoop,
    result: &LoopResult,
    accuracy: Option<&PredictionAccuracy>,
) -> Headline {
    let (fit, after) = (&closure.before.fit, &closure.after);
    let (first, last) = (fit.fitted.held_out, after.fitted.held_out);
    let corrected = accuracy.and_then(|accuracy| accuracy.corrected);
    let best = corrected.unwrap_or(last);
    let (_, unit) = result.after.errors.judged().norms();
    let mut facts = vec![
        (
            "Verdict",
            match result {
                _ if !result.trusted => "not to be trusted".to_owned(),
                _ if result.is_probably_explained() => "probably explained".to_owned(),
                _ => result.verdict.as_str().replace('-', " "),
            },
        ),
        ("Effects found", effect_counts(result)),
        row_counts_fact(after),
        parameters_fact(after),
        residual_fact("Residual before", fit),
        residual_fact("Residual after", after),
        ("Held out, after", rms_and_largest(&best)),
    ];
    facts.retain(|(name, _)| result.trusted || *name != "Effects found");
    facts.extend(known_gain(result).map(|Gain { mean, interval_95: [low, high] }| {
        let digits = decimals(high - low, 4).max(2);
        let [mean, low, high] = [mean, low, high].map(|value| number(value, digits));
        ("Gain of the effects", format!("{mean} {unit}, {low} to {high} {unit} (95 %)"))
    }));
    facts.extend(
        (!problem.effects.is_empty())
            .then(|| ("Effects declared", problem.effects.len().to_string())),
    );
    let mut states = vec![
        (NOMINAL_ARM, mean_error(&fit.registered.held_out)),
        (DECLARED_ARM, mean_error(&first)),
    ];
    if corrected.is_some() {
        states.push((corrected_arm(result), mean_error(&best)));
    } else if !result.effects.is_empty() {
        states.push((EXTENDED_ARM, mean_error(&best)));
    }
    Headline { states, unit, of: held_out_rows(after), facts, is_doubtful: !result.trusted }
}

/// Returns the warnings that the fit is not trusted, and that active limits of the declared problem
/// may be what the found effects compensate for.
fn cautions<'a>(closure: &ClosedLoop, result: &LoopResult) -> Vec<Block<'a>> {
    let (before, after) = (&closure.before.fit, &closure.after);
    let untrusted = (!result.trusted).then(|| format!("Warning: {}.", why_not_trusted(after)));
    let bounds = before
        .estimates
        .iter()
        .filter(|estimate| estimate.at_bound.is_some())
        .map(|estimate| estimate.name.clone());
    let held =
        bounds.chain(before.active_constraints.iter().map(|constraint| constraint.words.clone()));
    let held = joined(held, MAX_SHOWN_LIMITS, ", ");
    let limits = (!held.is_empty() && !result.effects.is_empty()).then(|| {
        format!(
            "Limits are active in the declared fit ({held}). If one is wrong, an effect that was found may only compensate for it. \
             flexcal identify PROBLEM -v shows how fast the error falls as each limit moves out."
        )
    });
    untrusted.into_iter().chain(limits).map(Block::Note).collect()
}

/// Returns the name of the arm whose predictions a remainder corrects.
fn corrected_arm(result: &LoopResult) -> &'static str {
    if result.effects.is_empty() { "with the remainder" } else { "with the remainder too" }
}

/// Returns the table of errors of the nominal arm, of the declared problem's fit and of the
/// extended problem's fit; `corrected` are those of held-out rows with a remainder, if there is one.
fn errors(closure: &ClosedLoop, result: &LoopResult, corrected: Option<&ErrorSummary>) -> Table {
    let LoopResult { registered, before, after, .. } = result;
    let row = |rows: &str, arm: &str, summary: &Summary, chi2: Option<f64>| {
        let (norms, _) = summary.norms();
        let chi2 = chi2.map_or_else(String::new, |chi2| number(chi2, 2));
        let norms = norms.map(|value| number(value, 4));
        [vec![rows.to_owned(), arm.to_owned()], norms.to_vec(), vec![chi2]].concat()
    };
    let (fitted, extended) = (&before.errors, &after.errors);
    let nominal = nominal_arm(&closure.before.fit);
    let mut rows = vec![
        row(test_rows_word(&closure.after.fitted), &nominal, registered.judged(), None),
        row("", DECLARED_ARM, fitted.judged(), None),
        row("", EXTENDED_ARM, extended.judged(), None),
    ];
    rows.extend(corrected.map(|errors| row("", corrected_arm(result), &Summary::of(errors), None)));
    rows.extend([
        row(IDENTIFICATION, &nominal, &registered.identification, None),
        row("", DECLARED_ARM, &fitted.identification, before.reduced_chi2),
        row("", EXTENDED_ARM, &extended.identification, after.reduced_chi2),
    ]);
    if result.effects.is_empty() {
        rows.retain(|row| row[1] != EXTENDED_ARM);
    }
    let header = [error_label(&closure.after.fitted.held_out), "", "mean", "rms", "max", "χ²/ν"];
    Table { minor: vec![3, 4], ..Table::new(&header, rows, &[0, 1]) }
}

/// Returns the gain on held-out rows; `None` unless effects were found, the fit is trusted and the
/// gain is finite.
fn known_gain(result: &LoopResult) -> Option<Gain> {
    let is_known =
        |gain: &Gain| result.trusted && !result.effects.is_empty() && gain.mean.is_finite();
    result.gain().filter(is_known)
}

/// States the gain on the held-out rows with its interval, and the size of the residual, which is
/// that without a remainder, even if one corrects predictions (`is_corrected`).
fn gain_sentences(closure: &ClosedLoop, result: &LoopResult, is_corrected: bool) -> Vec<String> {
    let after = &closure.after;
    let gain = known_gain(result).map(|Gain { mean, interval_95: [low, high] }| {
        let (_, unit) = result.after.errors.judged().norms();
        let includes_zero = low <= 0.0 && high >= 0.0;
        let is_worse = mean < 0.0 && !includes_zero;
        let (low, high) = if is_worse { (-high, -low) } else { (low, high) };
        let falls = if is_worse { "rises" } else { "falls" };
        let [gain, size, low, high] = [mean, mean.abs(), low, high].map(|value| number(value, 4));
        if includes_zero {
            return format!(
                "With what was added the mean error of the {} does not change measurably (gain \
                 {gain} {unit}, {low} to {high} {unit}, 95 %).",
                held_out_rows(after)
            );
        }
        format!(
            "With what was added the mean error of the {} {falls} by {size} {unit} ({low} to {high} \
             {unit}, 95 %).",
            held_out_rows(after)
        )
    });
    let has_effects = !result.effects.is_empty();
    let without = if is_corrected { " without the remainder" } else { "" };
    let size = match (result.before.reduced_chi2, result.after.reduced_chi2) {
        (Some(before), Some(after)) if has_effects => {
            Some(format!("{} before, {} after", format_chi2(before), format_chi2(after)))
        }
        (before, _) => before.map(format_chi2),
    };
    let is_overstated = has_effects && after.sigma_scale < 1.0;
    let overstated = if is_overstated { " The declared σ is too large." } else { "" };
    let chi2 = size.map(|size| {
        format!("Reduced χ² (χ²/ν){without}: {size}; {}.{overstated}", expected_interval(after))
    });
    gain.into_iter().chain(chi2).collect()
}

/// States what structure remains in the residual and where it is shown; `None` if no residual test
/// failed and no place is known, or if the warnings name a mistake of the input as the cause.
fn remaining_structure(closure: &ClosedLoop, result: &LoopResult) -> Option<String> {
    let failed = residual_tests::failed(&closure.residual_tests);
    let places = if result.size_alone().is_none() { structure_places(result) } else { Vec::new() };
    let structure = (!places.is_empty())
        .then(|| format!("structure without a known law ({})", places.join("; ")));
    let tests = match failed.as_slice() {
        [] => None,
        [test] => Some(format!("a residual test fails: {test}")),
        [first, others @ ..] => Some(format!(
            "{} residual tests fail: {first}, and {} more",
            failed.len(),
            others.len()
        )),
    };
    let differs = other_reduced_chi2(&closure.residual_tests, &closure.after)
        .filter(|_| !failed.is_empty())
        .map_or_else(String::new, |sentence| format!(" {sentence}"));
    let parts: Vec<String> = structure.into_iter().chain(tests).collect();
    (!parts.is_empty() && (result.trusted || !closure.after.names_mistake())).then(|| {
        format!("What remains: {}.{differs} Details: -v or report.html.", parts.join("; "))
    })
}

/// States the gain on held-out rows, and the arms that have poses without an equilibrium.
fn gain_block(closure: &ClosedLoop, result: &LoopResult, is_corrected: bool) -> Block<'static> {
    let (before, after) = (&closure.before, &closure.after);
    let mut arms = vec![
        ("the nominal arm", &before.fit.registered),
        ("the arm as declared, fitted", &before.fit.fitted),
    ];
    arms.extend((!result.effects.is_empty()).then_some(("what was added", &after.fitted)));
    let words = gain_sentences(closure, result, is_corrected).into_iter().chain(unpredicted(&arms));
    Block::Text(words.collect::<Vec<_>>().join(" "))
}

//! What `loop` says and writes: what was found, before and after, and what remains.

use std::fmt::Write as _;

use super::document::{Block, Headline, Point, Table, code, some_of};
use super::errors::{NOMINAL, mean_and_rms, row, unpredicted};
use super::figures::{Figure, PlotData};
use super::identify::{BEFORE, beware, fitted_parameters, mean, poses, short_mm, size, spread, told, why_not_trusted};
use super::json::{Both, Summary, object, to_text};
use super::parameters::{lower_waves, parameters};
use super::quantity::{counted, decimals, mm, number, or_dash, p_value};
use super::render::{Report, report, text};
use super::unexplained::{correction, place, size_alone, unexplained};
use super::{effect, findings, trace};
use crate::diagnose::{
    ClosedLoop, Correction, Found, Interval, Round, SelectionRules, Trace, Unexplained, Verdict, Witness,
    WitnessVerdict,
};
use crate::error::Location;
use crate::identify::{ErrorSummary, Errors, Estimate, Identification};
use crate::problem::{Effect, Problem};

/// Alternatives that are named in words; the page names twice as many.
const SHOWN_ALTERNATIVES: usize = 4;
/// Candidates that a report shows.
const SHOWN: usize = 8;

object! {
    Document<'a>(problem: &'a Problem, closure: &'a ClosedLoop) {
        problem: &'a str = &problem.name,
        verdict: &'static str = verdict_word(closure.verdict),
        trusted: bool = closure.after.is_trusted(),
        /// Whether structure in the residual could be tested for.
        tested: bool = closure.findings.is_testable(),
        registered: Both = Both::of(&closure.before.fit.registered),
        before: FitEntry = FitEntry::of(&closure.before.fit),
        after: FitEntry = FitEntry::of(&closure.after),
        /// Mean reduction of the error on held-out poses.
        held_out_gain_mm: IntervalEntry = IntervalEntry::of(&closure.gain),
        effects: Vec<FoundEntry<'a>> = closure.effects.iter().map(|found| FoundEntry::of(found, closure)).collect(),
        unexplained: Option<UnexplainedEntry> = closure.unexplained.first().map(|left| UnexplainedEntry::of(left, &closure.before)),
        /// Rows too far off to be noise, which took no part in the choice of effects.
        set_aside: Vec<RowEntry> = closure.set_aside.iter().map(RowEntry::of).collect(),
        /// Further structure without a known law.
        further: Vec<UnexplainedEntry> = closure.unexplained.iter().skip(1).map(|left| UnexplainedEntry::of(left, &closure.before)).collect(),
        /// 1 σ of the prior that waves of joints were given \[rad\].
        harmonic_prior_rad: Option<f64> = closure.harmonic_sigma,
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
    }
}
object! {
    RowEntry(row: &Location) {
        file: String = row.file.display().to_string(),
        line: Option<usize> = row.line,
    }
}
object! {
    IntervalEntry(gain: &Interval) {
        mean: f64 = gain.value * 1e3,
        /// 95 of 100 such intervals hold the true one.
        interval_95: [f64; 2] = [gain.low * 1e3, gain.high * 1e3],
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
        cross_validated_rms_mm: [f64; 2] = [own.cross_validated.0 * 1e3, own.cross_validated.1 * 1e3],
    }
}
object! {
    StepEntry<'a>(step: &'a Round) {
        effects: &'a [Effect] = &step.effects,
        identification: Summary = Summary::of(&step.identification),
        held_out: Summary = Summary::of(&step.held_out),
    }
}

/// What the loop came to as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn loop_json(problem: &Problem, closure: &ClosedLoop) -> String {
    to_text(&Document::of(problem, closure))
}

/// Rows that took no part in the choice of effects; nothing to say without any.
pub(super) fn set_aside<'a>(problem: &Problem, closure: &ClosedLoop) -> Option<Block<'a>> {
    const SHOWN: usize = 3;
    let rows = &closure.set_aside;
    let named: Vec<String> = rows.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = if rows.len() > SHOWN { format!(" and {} more", rows.len() - SHOWN) } else { String::new() };
    let treatment = if problem.robust.is_some() {
        "The robust loss keeps the fit from such rows"
    } else {
        "The fit counts such rows in full; a section [robust] would limit them"
    };
    let words = format!(
        "{} too far off to be noise took no part in the choice of effects: {}{more}. {treatment}.",
        counted(rows.len(), "pose"),
        named.join(", ")
    );
    (!rows.is_empty()).then_some(Block::Text(words))
}

/// What the loop came to as text, ending in a line break.
pub fn loop_text(problem: &Problem, closure: &ClosedLoop) -> String {
    let poses = &closure.before.fit.fitted;
    let (n, held_out) = (poses.identification.n, poses.held_out.n);
    let mut blocks = vec![
        Block::Text(format!("{}\n{} to identify, {held_out} held out", problem.title, counted(n, "pose"))),
        Block::Text(verdict(closure)),
    ];
    blocks.extend(quality_flag(closure));
    blocks.extend(set_aside(problem, closure));
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
        counted(fit.fitted.identification.n, "pose"),
        counted(fit.fitted.held_out.n, "pose")
    );
    let mut blocks =
        vec![Block::Headline(headline(problem, closure)), Block::Text(verdict(closure)), Block::Text(counts)];
    blocks.extend(quality_flag(closure));
    blocks.extend(set_aside(problem, closure));
    blocks.extend(beware(after, plots));
    blocks.extend([
        Block::Table(errors(closure)),
        Block::Text(gain(closure)),
        Block::Figures(vec![Figure::Errors(plots), Figure::Vectors(plots)]),
        Block::Poses(plots),
        Block::heading("What the declared problem leaves"),
    ]);
    blocks.extend(findings::blocks(&closure.before.findings));
    let every = format!("{} writes them all", code("flexcal trace"));
    let mut ranking = trace::ranking(problem, &closure.before, SHOWN, &every);
    ranking.insert(1, Block::Figures(vec![Figure::Ranking(&closure.before)]));
    blocks.extend(ranking);
    blocks.push(Block::Page(trace::not_seen(&closure.before)));
    blocks.extend(rounds(closure));
    blocks.extend(sureness(closure));
    blocks.push(Block::Words(found(closure, SHOWN_ALTERNATIVES)));
    blocks.push(Block::Page(found(closure, 2 * SHOWN_ALTERNATIVES)));
    let causes = plots.causes.iter().enumerate().map(|(k, cause)| Figure::Cause(plots, cause, k + 1));
    blocks.push(Block::Figures(causes.collect()));
    blocks.push(Block::heading("What remains"));
    let unexplained = unexplained(problem, closure).into_iter().map(Point::from);
    let (tests, page) = (findings::all(&closure.findings), findings::each(&closure.findings));
    blocks.extend([
        Block::Words(vec![Block::List(unexplained.clone().chain(tests).collect())]),
        Block::Page(vec![Block::List(unexplained.chain(page).collect())]),
        Block::Figures(
            plots
                .trend
                .iter()
                .map(|trend| Figure::Trend(plots, trend))
                .chain([Figure::Histogram(plots), Figure::Order(plots), Figure::JointMap(plots)])
                .collect(),
        ),
        Block::heading("Parameters of the final fit"),
    ]);
    blocks.extend(parameters(&closure.closed, after, &file));
    blocks.extend(lower_waves(&closure.closed, after, &file));
    blocks.push(Block::Figures(vec![Figure::Contributions(plots)]));
    let mut seen = vec![
        Block::heading("What the poses can tell"),
        Block::Figures(vec![Figure::Correlations(plots), Figure::SingularValues(&after.identifiability)]),
    ];
    seen.extend(told(after, &file));
    blocks.push(Block::Page(seen));
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
    let digits = decimals((gain.high - gain.low) * 1e3, 4).max(2);
    let mut facts = vec![
        ("Verdict", verdict_word(closure.verdict).replace('-', " ")),
        ("Effects found", closure.effects.len().to_string()),
        poses(after),
        fitted_parameters(after),
        size("Residual before", fit),
        size("Residual after", after),
        ("Held out, after", spread(&last)),
    ];
    facts.extend(correction.map(|_| ("Without the correction", format!("{} mm", short_mm(last.mean.norm)))));
    facts.extend((!closure.effects.is_empty() && gain.value.is_finite()).then(|| {
        let [value, low, high] = [gain.value, gain.low, gain.high].map(|value| mm(value, digits));
        ("Gain of the effects", format!("{value} mm, 95 % interval {low} to {high} mm"))
    }));
    facts.extend((!problem.effects.is_empty()).then(|| ("Effects declared", problem.effects.len().to_string())));
    let of = format!("{}{with}", counted(last.n, "held-out pose"));
    let mut states = vec![(BEFORE, mean(&fit.registered.held_out)), ("as declared, fitted", mean(&first))];
    if !closure.effects.is_empty() || correction.is_some() {
        states.push(("with what was found", mean(&best)));
    }
    Headline { states, of, facts }
}

/// What it came to, in a word.
fn verdict_word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingFound => "nothing-found",
        Verdict::Explained => "explained",
        Verdict::Unexplained => "unexplained",
    }
}

/// The outcome in a sentence or two.
pub(super) fn verdict(closure: &ClosedLoop) -> String {
    if !closure.after.is_trusted() {
        return "Nothing is claimed of causes: the fit is not to be trusted. Mend first what stands below.".to_owned();
    }
    let stated = SelectionRules::DEFAULT.stated;
    let (contradicted, others): (Vec<&Found>, Vec<&Found>) =
        closure.effects.iter().partition(|found| found.is_contradicted());
    let (named, such): (Vec<&Found>, Vec<&Found>) = others.into_iter().partition(|found| found.is_named(stated));
    let only_such = named.is_empty();
    let named = match named.as_slice() {
        [] => "No effect was found".to_owned(),
        [one] => format!("One effect was found ({})", closure.before.describe(&one.effect)),
        several => format!("{} effects were found", several.len()),
    };
    let found = match such.as_slice() {
        [] => named,
        [one] if only_such => format!("No effect is sure; most probable is {}", probable(closure, one)),
        [one] => format!("{named}; one more is probable: {}", probable(closure, one)),
        several => format!("{named}; {} more are probable, their laws not sure", several.len()),
    };
    let found = match contradicted.as_slice() {
        [] => found,
        [one] => format!("{found}; {} is contradicted by data that took no part", closure.before.describe(&one.effect)),
        several => format!("{found}; {} causes are contradicted by data that took no part", several.len()),
    };
    if let (Verdict::Unexplained, Some(size)) = (closure.verdict, size_alone(closure)) {
        let size = number(size, 1);
        return format!(
            "Unexplained: the residual is {size} × the declared σ, and no structure is seen in it. {found}."
        );
    }
    match (closure.verdict, closure.findings.is_testable()) {
        (Verdict::Unexplained, _) if closure.unexplained.is_empty() => format!("Unexplained: {}.", lower(&found)),
        (Verdict::Unexplained, _) => format!("Unexplained: structure is left in the residual. {found}."),
        (_, false) => format!("{found}; whether structure is left could not be tested."),
        (Verdict::NothingFound, true) => "Nothing found: what the declared problem leaves looks like noise.".to_owned(),
        (Verdict::Explained, true) => format!("Explained: {}, and what is left looks like noise.", lower(&found)),
    }
}

/// A cause whose law is not sure, how probable it is, and what it may be instead.
fn probable(closure: &ClosedLoop, found: &Found) -> String {
    let own = closure.before.describe(&found.effect);
    let sure = found.claims.as_ref().map(|claims| format!(" ({} %)", number(claims.law.1 * 100.0, 0)));
    let rival = found.alternatives.first().map(|other| format!(", or else {}", closure.before.describe(other)));
    format!("{own}{}{}", sure.unwrap_or_default(), rival.unwrap_or_default())
}

fn lower(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// Why the final fit is not to be trusted.
pub(super) fn quality_flag<'a>(closure: &ClosedLoop) -> Option<Block<'a>> {
    let after = &closure.after;
    (!after.is_trusted()).then(|| Block::Note(format!("Beware: {}.", why_not_trusted(after))))
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
    Table { minor: vec![3, 4], ..Table::new(&["error, mm", "", "mean", "rms", "max", "χ²/ν"], rows, &[0, 1]) }
}

/// How the figures are to be read, with the gain and how sure it is.
fn gain(closure: &ClosedLoop) -> String {
    let (before, after) = (&closure.before, &closure.after);
    let another = findings::another_size(&before.findings, before.fit.reduced_chi2)
        .or_else(|| findings::another_size(&closure.findings, after.reduced_chi2));
    let mut arms =
        vec![("the nominal arm", &before.fit.registered), ("the arm as declared, fitted", &before.fit.fitted)];
    arms.extend((!closure.effects.is_empty()).then_some(("what was found", &after.fitted)));
    let unknown = unpredicted(&arms);
    let chi2 = "χ²/ν is the residual's size against the declared noise: 1 where only noise is left.";
    let notes = [Some(chi2.to_owned()), another, unknown].into_iter().flatten().collect::<Vec<_>>().join(" ");
    let gain = closure.gain;
    if closure.effects.is_empty() || !gain.value.is_finite() {
        return notes;
    }
    format!(
        "What was found takes {} mm off the mean error of the {} held-out poses (95 % interval {} to {} mm). They took no \
         part in any choice. {notes}",
        mm(gain.value, 4),
        closure.after.fitted.held_out.n,
        mm(gain.low, 4),
        mm(gain.high, 4),
    )
}

/// Every effect that was found.
fn found<'a>(closure: &ClosedLoop, alternatives: usize) -> Vec<Block<'a>> {
    if closure.effects.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![
        Block::heading("What was found"),
        Block::Ranking(closure.effects.iter().map(|found| point(closure, found, alternatives)).collect()),
    ];
    if let Some(sigma) = closure.harmonic_sigma {
        blocks.push(Block::Text(format!(
            "Many harmonics were found: every order up to the highest that stands out is in the model, with one prior of {} ° for \
             all, the one that predicts poses best where part of a joint's range is left out.",
            number(sigma.to_degrees(), 6)
        )));
    }
    blocks
}

fn point(closure: &ClosedLoop, found: &Found, alternatives: usize) -> Point {
    let mut details = effect::values(found);
    details.extend(found.claims.as_ref().map(trace::claimed));
    details.extend(
        found
            .stability
            .map(|share| format!("named in {} % of weighings without a fifth of the poses", number(share * 100.0, 0))),
    );
    details.extend(found.witness.as_ref().map(|own| format!("{} by {}, which took no part", says(own), own.data)));
    let mut chance = format!("p-value {}: chance alone would do as well with that probability", p_value(found.p_value));
    if let Some(then) = closure.held_out_once(found) {
        let _ = write!(chance, "; held-out error once it was in the model: {}", mean_and_rms(&then));
    }
    details.push(chance);
    if !found.alternatives.is_empty() {
        let named = found.alternatives.iter().map(|other| closure.before.describe(other));
        let (mut named, more) = some_of(named, alternatives);
        named.extend((more > 0).then(|| format!("and {more} more")));
        details.push(format!("these data do not distinguish it from: {}", named.join("; ")));
    }
    Point { text: called(closure, found), details, mark: None }
}

/// An effect that was found, as surely as it is known.
pub(super) fn called(closure: &ClosedLoop, found: &Found) -> String {
    let own = effect::both(&found.effect, &closure.before);
    match &found.claims {
        _ if found.is_contradicted() => format!("contradicted: {own}"),
        Some(claims) if !found.is_named(SelectionRules::DEFAULT.stated) => {
            format!("{}: its law is not known, such as: {own}", claims.place.0)
        }
        _ => own,
    }
}

/// What a witness says, in a word.
fn says(own: &Witness) -> &'static str {
    match own.says {
        WitnessVerdict::Corroborated => "corroborated",
        WitnessVerdict::Contradicted => "contradicted",
    }
}

/// What each round of fit, trace and refit came to.
fn rounds(closure: &ClosedLoop) -> Vec<Block<'_>> {
    if closure.rounds.is_empty() {
        return Vec::new();
    }
    let row = |(k, step): (usize, &Round)| {
        let effects: Vec<String> = step.effects.iter().map(|effect| closure.before.describe(effect)).collect();
        let effects = if effects.is_empty() { "none".to_owned() } else { effects.join("; ") };
        let errors = [step.identification.rms.norm, step.held_out.mean.norm, step.held_out.rms.norm];
        [vec![(k + 1).to_string(), effects], errors.map(|error| mm(error, 4)).to_vec()].concat()
    };
    let header = ["round", "effects in the model", "identification rms, mm", "held out mean", "held out rms"];
    let rows = closure.rounds.iter().enumerate().map(row).collect();
    vec![
        Block::heading("Rounds"),
        Block::Figures(vec![Figure::Rounds(closure)]),
        Block::Table(Table::new(&header, rows, &[1])),
    ]
}

/// How sure each choice is: chance, its law, fits to part of the poses, and data that took no part.
fn sureness<'a>(closure: &ClosedLoop) -> Option<Block<'a>> {
    let share = |part: f64| format!("{} %", number(part * 100.0, 0));
    let row = |found: &Found| {
        let witness = found.witness.as_ref().map(|own| format!("{} by {}", says(own), own.data));
        vec![
            closure.before.describe(&found.effect),
            p_value(found.p_value),
            or_dash(found.claims.as_ref(), |claims| share(claims.law.1)),
            or_dash(found.stability, share),
            or_dash(witness, |words| words),
            mm(found.held_out_after.mean.norm, 4),
        ]
    };
    let header = ["effect", "p by chance", "law", "resampled", "data that took no part", "held out mean, mm"];
    let note = "law: its probability against every other at the same place; resampled: the share of weighings without a fifth of the poses \
                that name it; held out mean: once it was in the model";
    let table = Table::new(&header, closure.effects.iter().map(row).collect(), &[0, 4]).noted(&[note]);
    (!closure.effects.is_empty()).then_some(Block::Table(table))
}

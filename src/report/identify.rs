//! Texts of the command `identify`: full text (`--verbose`), and report on one fit, with its active
//! limits.

use super::document::{Block, Headline, Table};
use super::errors::{
    NOMINAL_ARM, axis_count, brief, error_label, format_error, held_out_rows, rows_of,
    test_rows_word, unit, unpredicted,
};
use super::noise::{influential_rows, noise, outcome, outliers, residual_fact};
use super::parameters::{
    against_priors, conditioning, correlations, more_unidentifiable, parameters, unidentifiable,
    weak,
};
use super::prior::prior;
use super::remainder::{PredictionAccuracy, why_no_bound};
use super::render::{Report, report, text};
use super::row_kinds::row_kind_tables;
use super::{figures, residual_tests};
use crate::fit::{
    ActiveConstraint, Alternation, ErrorSummary, Errors, Estimate, Finding, FindingCode,
    Identification, JointSources, OrientationErrors, ShadowPrice,
};
use crate::least_squares::solver::AtBound;
use crate::problem::Problem;
use crate::quantity::Unit;
use crate::quantity::format::{counted, decimals, mm, number, two_digits};
use crate::results::{PlotData, nominal_arm, rows_in};

/// Name of the file with the complete result.
const RESULT_FILE: &str = "estimate.json";

/// Returns the blocks with which summary and full text begin: headline, errors, size of the
/// residual, and influential rows.
pub(super) fn estimate_head<'a>(
    problem: &Problem,
    found: &Identification,
    accuracy: Option<PredictionAccuracy>,
) -> Vec<Block<'a>> {
    let outcome = outcome(found, accuracy.as_ref());
    let is_corrected = accuracy.as_ref().is_some_and(|accuracy| accuracy.corrected.is_some());
    let bound = accuracy.map_or_else(|| why_no_bound(found), |accuracy| accuracy.bound);
    let size: Vec<String> = [noise(problem, found)].into_iter().chain(bound).collect();
    let mut blocks = vec![
        Block::lines(headline(problem, found, &outcome)),
        Block::Table(errors_by_axis(found, is_corrected)),
        Block::lines(size.join("\n")),
    ];
    blocks.extend(influential_rows(found));
    blocks
}

/// Returns the full result as text, ending in a line break.
pub fn estimate_text(
    problem: &Problem,
    found: &Identification,
    accuracy: Option<PredictionAccuracy>,
) -> String {
    let mut blocks = estimate_head(problem, found, accuracy);
    blocks.extend(prior(found));
    blocks.extend(row_kind_tables(found));
    blocks.extend(orientation(found));
    blocks.extend(outliers(problem, found));
    blocks.extend(parameters(problem, found, RESULT_FILE));
    blocks.extend(limits(found));
    blocks.extend(identifiability_blocks(found, RESULT_FILE));
    text(&blocks)
}

/// Returns the report of the command `identify`.
pub fn identification_report(
    problem: &Problem,
    found: &Identification,
    plots: &PlotData,
) -> Report {
    report(problem, "identification", &blocks(problem, found, plots))
}

fn blocks<'a>(problem: &Problem, found: &'a Identification, plots: &'a PlotData) -> Vec<Block<'a>> {
    let held_out = found.fitted.held_out;
    let mut states = vec![
        (NOMINAL_ARM, mean_error(&found.registered.held_out)),
        ("identified", mean_error(&held_out)),
    ];
    let accuracy = PredictionAccuracy::new(found, plots);
    let corrected = accuracy.as_ref().and_then(|accuracy| accuracy.corrected);
    states.extend(corrected.map(|errors| ("with the remainder", mean_error(&errors))));
    let head = Headline {
        states,
        unit: unit(&held_out),
        of: held_out_rows(found),
        facts: vec![
            row_counts_fact(found),
            parameters_fact(found),
            (
                if found.fitted.is_left_out { "Left out, after" } else { "Held out, after" },
                rms_and_largest(&corrected.unwrap_or(held_out)),
            ),
            residual_fact(
                if corrected.is_some() { "Residual, no remainder" } else { "Residual against σ" },
                found,
            ),
            ("Strategy", found.strategy.as_str().to_owned()),
            ("Solver", format!("{}, {} steps", found.solver.as_str(), found.iterations)),
        ],
        is_doubtful: !found.is_trusted(),
    };
    let outcome = outcome(found, accuracy.as_ref());
    let outcome = if found.is_trusted() { Block::Text(outcome) } else { Block::Note(outcome) };
    let fit = Block::Text(format!("{}.", describe_fit(found, "; ")));
    let mut blocks = vec![Block::Headline(head), outcome, fit];
    blocks.extend(fit_warnings(found, plots));
    blocks.push(Block::Table(errors_by_axis(found, corrected.is_some())));
    let bound = accuracy.map_or_else(|| why_no_bound(found), |accuracy| accuracy.bound);
    blocks.extend(bound.map(Block::Text));
    blocks.extend(orientation(found));
    blocks.extend(prior(found));
    blocks.extend(row_kind_tables(found));
    blocks.push(Block::figures([figures::errors(plots), figures::vectors(plots)]));
    blocks.push(Block::Poses(plots));
    blocks.extend(super::remainder::uncertainty(found, plots));
    blocks.extend(fit_details(problem, found, plots, RESULT_FILE));
    blocks
}

/// States in one line why a fit is not trusted.
pub fn why_not_trusted(found: &Identification) -> String {
    match found.first_error() {
        Some(reason) => format!("the fit is not to be trusted: {reason}"),
        None => "the fit is to be trusted".to_owned(),
    }
}

/// States, in one line each, the title, the `outcome`, the numbers of parameters and rows, and how
/// the fit ended.
pub(super) fn headline(problem: &Problem, found: &Identification, outcome: &str) -> String {
    let seconds = found.seconds;
    format!("{}\n{outcome}\n{}, {seconds:.3} s", problem.title, describe_fit(found, "\n"))
}

/// States the numbers of fitted parameters and rows, strategy and solver, and how the fit ended,
/// with a warning if the fit is not trusted.
pub(super) fn fit_sentence(found: &Identification) -> String {
    let warning = if found.is_trusted() {
        String::new()
    } else {
        format!(" Warning: {}.", why_not_trusted(found))
    };
    format!("{}.{warning}", describe_fit(found, "; "))
}

/// States the numbers of parameters and rows, strategy and solver, then after `separator` how the
/// fit ended.
fn describe_fit(found: &Identification, separator: &str) -> String {
    let end = if found.termination.converged() {
        if separator == "\n" { "Converged in" } else { "converged in" }.to_owned()
    } else {
        format!("{} after", found.termination)
    };
    let reason = found.solver_reason.map(|reason| format!(" (auto: {reason})")).unwrap_or_default();
    format!(
        "{} from {}, {} held out; strategy {}, solver {}{reason}{separator}{end} {}",
        counted(found.unknowns.len(), "parameter"),
        fitted_rows(found),
        if found.fitted.is_left_out {
            "none".to_owned()
        } else {
            rows_of(found, |errors| errors.held_out)
        },
        found.strategy.as_str(),
        found.solver.as_str(),
        counted(usize::try_from(found.iterations).unwrap_or(usize::MAX), "step"),
    )
}

/// Returns what the terminal shows beside a text, for the page: why the fit is not trusted, and the
/// warnings on the measurement files (of `plots`) and on the fit.
pub(super) fn page_warnings<'a>(found: &Identification, plots: Option<&PlotData>) -> Block<'a> {
    let why = format!("Warning: {}.", why_not_trusted(found));
    let why = (!found.is_trusted()).then_some(Block::Note(why));
    let read = plots.map_or(&[][..], |plots| &plots.warnings);
    let points: Vec<String> =
        read.iter().map(ToString::to_string).chain(found.reasons_to_ask()).collect();
    let warnings = (!points.is_empty()).then(|| Block::Lines("Warnings:".to_owned(), points));
    Block::Page(why.into_iter().chain(warnings).collect())
}

/// Returns the warnings on the measurement files and on the fit that the terminal shows, except the
/// one that a fit is not trusted; `None` if there are none.
pub(super) fn fit_warnings<'a>(found: &Identification, plots: &PlotData) -> Option<Block<'a>> {
    let points: Vec<String> =
        plots.warnings.iter().map(ToString::to_string).chain(found.reasons_to_ask()).collect();
    (!points.is_empty()).then(|| Block::Lines("Warnings:".to_owned(), points))
}

/// States the number of fitted rows, and the number of different poses if some pose has several
/// targets.
fn fitted_rows(found: &Identification) -> String {
    let rows = rows_of(found, |errors| errors.identification);
    if found.several_targets {
        format!("{rows} in {}", counted(found.poses, "different pose"))
    } else {
        rows
    }
}

/// Returns the table of errors before and after the fit, along each axis and of the norm.
///
/// `is_corrected` is true if a remainder corrects predictions; the errors are those without it.
pub(super) fn errors_by_axis(found: &Identification, is_corrected: bool) -> Table {
    let row = |poses: &str, when: &str, of: &ErrorSummary| {
        let axes = &[of.mean.x, of.mean.y, of.mean.z][..axis_count(of)];
        let values = axes
            .iter()
            .chain([&of.mean.norm, &of.rms.norm, &of.max.norm])
            .map(|value| format_error(of, *value));
        [poses.to_owned(), when.to_owned()].into_iter().chain(values).collect::<Vec<String>>()
    };
    let rows = before_and_after((&found.registered, &found.fitted), row);
    let of = &found.fitted.held_out;
    let sizes = if axis_count(of) > 0 {
        ["mean norm", "rms norm", "max norm"]
    } else {
        ["mean", "rms", "max"]
    };
    let header =
        [&[error_label(of), ""], &["mean |x|", "mean |y|", "mean |z|"][..axis_count(of)], &sizes]
            .concat();
    let minor = (2..2 + axis_count(of)).collect();
    let mut table = Table { minor, ..Table::new(&header, rows, &[0, 1]) };
    table.notes.push(format!("before: {}", nominal_arm(found)));
    if is_corrected {
        table.notes.push("after: without the remainder, as χ² and σ below".to_owned());
    }
    if found.fitted.is_left_out {
        table.notes.push("left out: each configuration predicted by a fit without it".to_owned());
    }
    table.notes.extend(at_points(of));
    table.notes.extend(no_errors(found).map(|words| format!("–: {words}")));
    table
}

/// Returns four table rows: errors of identification and of held-out rows, each `before` and
/// `after` the fit.
fn before_and_after(
    (before, after): (&Errors, &Errors),
    row: impl Fn(&str, &str, &ErrorSummary) -> Vec<String>,
) -> Vec<Vec<String>> {
    vec![
        row("identification", "before", &before.identification),
        row("", "after", &after.identification),
        row(test_rows_word(after), "before", &before.held_out),
        row("", "after", &after.held_out),
    ]
}

/// Returns the table of orientation errors before and after the fit; `None` if no orientation is
/// fitted.
fn orientation<'a>(found: &Identification) -> Option<Block<'a>> {
    let OrientationErrors { registered, fitted, .. } = found.orientation.as_ref()?;
    let row = |poses: &str, when: &str, of: &ErrorSummary| {
        let values =
            [of.mean.norm, of.rms.norm, of.max.norm].map(|value| number(value.to_degrees(), 4));
        [vec![poses.to_owned(), when.to_owned()], values.to_vec()].concat()
    };
    let rows = before_and_after((registered, fitted), row);
    Some(Block::Table(Table::new(&["orientation, °", "", "mean", "rms", "max"], rows, &[0, 1])))
}

/// Largest length at an observed point that is stated for an image error: one metre \[m\].
const MAX_LENGTH_AT_POINT: f64 = 1.0;

/// States the lengths at the observed points that correspond to held-out image errors; `None` for
/// other kinds of rows.
fn at_points(held_out: &ErrorSummary) -> Option<String> {
    let at_point = held_out.at_point?;
    // Views that are far off say nothing about lengths.
    if at_point.iter().any(|sizes| sizes.norm > MAX_LENGTH_AT_POINT) {
        return None;
    }
    let [mean, max, rms] = at_point.map(|sizes| number(sizes.norm * 1e3, 4));
    Some(format!(
        "Held-out image errors correspond to {mean} mm (mean), {rms} mm (rms), {max} mm (max) at \
         the observed points."
    ))
}

/// States how many poses have no equilibrium, so that there are no mean errors; `None` if all
/// errors are finite.
pub(super) fn no_errors(found: &Identification) -> Option<String> {
    unpredicted(&[("the nominal arm", &found.registered), ("the arm as identified", &found.fitted)])
}

/// Returns the blocks on residual, parameters and identifiability. `file` names what contains the
/// omitted entries.
pub(super) fn fit_details<'a>(
    problem: &Problem,
    found: &'a Identification,
    plots: &'a PlotData,
    file: &str,
) -> Vec<Block<'a>> {
    let uncertainty = plots.uncertainty.as_ref();
    let is_corrected = uncertainty.is_some_and(|of| of.outcome.held_out.is_some());
    let title = if is_corrected { "Residual without the remainder" } else { "Residual" };
    let mut blocks = vec![Block::heading(title), Block::lines(noise(problem, found))];
    blocks.extend(influential_rows(found));
    blocks.extend(outliers(problem, found));
    blocks.push(Block::figures([
        figures::histogram(plots),
        figures::order(plots),
        figures::joint_map(plots),
    ]));
    blocks.extend(residual_tests::blocks(&plots.residual_tests));
    blocks
        .extend(residual_tests::other_reduced_chi2(&plots.residual_tests, found).map(Block::Text));
    blocks.push(Block::heading("Parameters"));
    blocks.extend(parameters(problem, found, file));
    blocks.push(Block::figures([
        against_priors(found),
        figures::contributions(&plots.contributions),
    ]));
    blocks.push(Block::Page(limits(found)));
    blocks.extend(identifiability_with_figures(found, plots, file));
    blocks
}

/// Returns the blocks on active limits and on alternating stages.
fn limits<'a>(found: &Identification) -> Vec<Block<'a>> {
    active_limits(found).into_iter().chain(alternation(found)).collect()
}

/// Returns the blocks on identifiability, with figures. `file` names what contains the omitted
/// entries.
pub(super) fn identifiability_with_figures<'a>(
    found: &Identification,
    plots: &PlotData,
    file: &str,
) -> Vec<Block<'a>> {
    let figures =
        [figures::correlation(&plots.correlations), figures::spectrum(found.identifiability())];
    let mut blocks = vec![Block::heading("Identifiability"), Block::figures(figures)];
    blocks.extend(identifiability_blocks(found, file));
    blocks
}

/// Returns the blocks on identifiability without figures. `file` names what contains the omitted
/// entries.
fn identifiability_blocks<'a>(found: &Identification, file: &str) -> Vec<Block<'a>> {
    let is_open_scale = |finding: &&Finding| {
        finding.code == FindingCode::NotToldApart && finding.word("what") == Some("scale")
    };
    let open_scale = found.findings.iter().find(is_open_scale).map(ToString::to_string);
    let mut blocks = vec![
        conditioning(found.identifiability(), found.unknowns.len(), found.coordinates),
        unidentifiable(found.identifiability(), &found.unknowns, (file, open_scale.as_deref())),
    ];
    blocks.extend(more_unidentifiable(found, file));
    blocks.extend(weak(found, file));
    blocks.push(correlations(found, file));
    blocks
}

/// States in one line whether joint commands or joint readings fit better.
pub fn joint_sources_text(sources: &JointSources) -> String {
    let JointSources { used, commanded, read } = *sources;
    let better = sources.better();
    let advice = if better == used {
        format!("which the problem takes (joints = \"{}\" in [data])", used.as_str())
    } else {
        format!("write joints = \"{}\" in [data]", better.as_str())
    };
    format!(
        "Residual of the fitted rows: {} mm rms with joint commands, {} mm with joint readings. \
         The {} coordinates fit better: {advice}.",
        mm(commanded, 4),
        mm(read, 4),
        better.as_str(),
    )
}

/// Formats the mean error for a headline.
pub(super) fn mean_error(of: &ErrorSummary) -> String {
    brief(of, of.mean.norm)
}

/// Returns the numbers of fitted and held-out rows as a fact of a headline.
pub(super) fn row_counts_fact(found: &Identification) -> (&'static str, String) {
    let (fitted, held_out) =
        (rows_in(found, |errors| errors.identification), rows_in(found, |errors| errors.held_out));
    let what = match found.fitted.identification.kind {
        "position" if found.several_targets && found.kinds.is_empty() => "Points",
        "position" => "Poses",
        _ => "Rows",
    };
    let held_out = if found.fitted.is_left_out { "none".to_owned() } else { held_out.to_string() };
    (what, format!("{fitted} fitted, {held_out} held out"))
}

/// Returns the number of fitted parameters and the rank as a fact of a headline.
pub(super) fn parameters_fact(found: &Identification) -> (&'static str, String) {
    (
        "Parameters",
        format!("{} fitted, rank {}", found.unknowns.len(), found.identifiability().rank),
    )
}

/// Formats the rms and the largest error for a headline.
pub(super) fn rms_and_largest(errors: &ErrorSummary) -> String {
    let [rms, max] = [errors.rms.norm, errors.max.norm]
        .map(|value| format!("{} {}", brief(errors, value), unit(errors)));
    format!("rms {rms}, largest {max}")
}

/// Lists active bounds and constraints with their shadow prices; `None` if there are none.
pub(super) fn active_limits<'a>(found: &Identification) -> Option<Block<'a>> {
    // The price is a slope: the step is so small that the residual could fall by so much.
    let rms = found.fitted.identification.rms.norm * 1e3;
    let line = |name: &str, price: ShadowPrice, unit: Unit| {
        let (fall, per) = price.in_mm(unit);
        let steps = [1.0, 0.1, 0.01, 0.001].into_iter();
        let step = steps.into_iter().find(|step| fall * step < 0.5 * rms).unwrap_or(0.001);
        format!("{name}: {} mm for {step} {per}", two_digits(fall * step, 6))
    };
    let bound = |estimate: &Estimate| {
        let side = if estimate.at_bound? == AtBound::Lower { "lower" } else { "upper" };
        let name = format!("{}, {side} bound", estimate.name);
        Some(line(&name, estimate.shadow_price?, estimate.unit))
    };
    let constraint = |active: &ActiveConstraint| {
        let place = active.location.line.map_or_else(String::new, |line| format!("line {line}: "));
        line(&format!("{place}{}", active.words), active.shadow_price, active.unit)
    };
    let bounds = found.estimates.iter().filter_map(bound);
    let points: Vec<String> =
        bounds.chain(found.active_constraints.iter().map(constraint)).collect();
    let except = if found.has(FindingCode::BoundInUnidentifiedDirection) {
        ", except those that a warning names"
    } else {
        ""
    };
    let words = format!(
        "Active limits and their cost: decrease of the rms residual if the limit is moved outwards \
         a little,\nby its slope at the limit (standard errors hold with these limits \
         kept{except}):"
    );
    (!points.is_empty()).then_some(Block::Lines(words, points))
}

/// States the number of sweeps of a sequential strategy, and the rate of convergence without
/// acceleration; `None` for strategies without alternating stages.
pub(super) fn alternation<'a>(found: &Identification) -> Option<Block<'a>> {
    let Alternation { sweeps, contraction } = found.alternation?;
    let slow = contraction.map_or_else(String::new, |rate| {
        format!(
            "; without acceleration each sweep would leave {} of the error",
            number(rate, decimals(1.0 - rate, 6))
        )
    });
    Some(Block::lines(format!(
        "Stiffness and geometry alternated in {sweeps} accelerated sweeps{slow}."
    )))
}

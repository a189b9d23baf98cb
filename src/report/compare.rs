//! Texts of the command `compare`: every strategy, solver and ablation, and the paper's tables 2
//! and 3.

use super::document::{Block, Column, Headline, Table, code};
use super::errors::{
    NOMINAL_ARM, both_parts, held_out_rows, row_noun, test_rows_word, unit, with_unit_of,
};
use super::figures;
use super::identify::{
    errors_by_axis, fit_details, fit_sentence, fit_warnings, mean_error, no_errors,
    parameters_fact, row_counts_fact,
};
use super::noise::residual_fact;
use super::paper_tables::{table_2, table_3, title};
use super::render::{Report, report, text};
use crate::fit::{Comparison, Identification};
use crate::model::Ablation;
use crate::problem::Problem;
use crate::quantity::format::{counted, number, or_dash};
use crate::results::{ComparedFit, PlotData, Summary};

/// Returns the comparison as text, ending in a line break.
pub fn compare_text(problem: &Problem, comparison: &Comparison) -> String {
    let joint = &comparison.joint;
    let (poses, held_out) = (joint.fitted.identification.n, joint.fitted.held_out.n);
    let parts_of = if of_positions(joint) && !joint.fitted.is_left_out {
        format!("{} to identify, {held_out} held out", counted(poses, "pose"))
    } else {
        both_parts(joint)
    };
    let mut blocks = vec![Block::lines(format!("{}\n{parts_of}", problem.title))];
    blocks.push(Block::Text(verdict(comparison)));
    blocks.extend(no_errors(joint).map(|words| Block::lines(format!("  –: {words}"))));
    blocks.push(Block::Table(grouped_strategies(comparison, true)));
    if !comparison.paper.is_empty() && !problem.effects.is_empty() {
        blocks.push(Block::lines(
            "  paper: the closed forms of [Chen2021], without the declared effects",
        ));
    }
    if is_elastic(comparison) {
        blocks.push(Block::Table(ablations(comparison, true)));
    }
    if concerns_paper(comparison) {
        blocks.extend(as_paper_tables(comparison));
    }
    text(&blocks)
}

/// Returns true if the problem declares the arm of the paper, or if the paper's procedure was run.
fn concerns_paper(comparison: &Comparison) -> bool {
    comparison.is_papers_arm || !comparison.paper.is_empty()
}

/// Returns true if the arm has elasticity, so that there are fits without parts of it.
fn is_elastic(comparison: &Comparison) -> bool {
    comparison.ablations.len() > 1
}

/// States which strategy and solver has the smallest mean held-out error, or that all agree.
fn verdict(comparison: &Comparison) -> String {
    let fits = compared_strategies(comparison);
    let mean = |fit: &&ComparedFit| fit.errors.judged().norms().0[0];
    let is_finite = |fit: &&ComparedFit| mean(fit).is_finite();
    let by_mean = |a: &&ComparedFit, b: &&ComparedFit| mean(a).total_cmp(&mean(b));
    let best = fits.iter().filter(is_finite).min_by(by_mean);
    let worst = fits.iter().filter(is_finite).max_by(by_mean);
    let (Some(best), Some(worst)) = (best, worst) else {
        return "No strategy has an error to compare.".to_owned();
    };
    let unit = best.errors.judged().norms().1;
    let size = |fit: &ComparedFit| format!("{} {unit}", number(mean(&fit), 4));
    let rows = held_out_rows(&comparison.joint);
    if size(best) == size(worst) {
        return format!(
            "All {} combinations of strategy and solver agree: mean error of the {rows} {}.",
            fits.len(),
            size(best)
        );
    }
    let mut equal: Vec<&str> = Vec::new();
    let as_good = || fits.iter().filter(|fit| size(fit) == size(best));
    for fit in as_good() {
        if !equal.contains(&fit.strategy.as_str()) {
            equal.push(&fit.strategy);
        }
    }
    let of_best = match as_good().count() {
        1 => format!("{}, {}", best.strategy, best.solver),
        count => format!("{count} fits, of {}", equal.join(" and ")),
    };
    format!(
        "Smallest mean error of the {rows}: {} ({of_best}); largest: {} ({}, {}).",
        size(best),
        size(worst),
        worst.strategy,
        worst.solver
    )
}

/// Returns the table of strategies and solvers in which fits with equal errors share a row. Notes
/// name the fits of each shared row. If `is_timed`, the table contains durations.
fn grouped_strategies(comparison: &Comparison, is_timed: bool) -> Table {
    let (mut shown, mut same) = (Vec::<ComparedFit>::new(), Vec::<Vec<ComparedFit>>::new());
    for fit in compared_strategies(comparison) {
        let is_equal = |other: &ComparedFit| errors_in_digits(other) == errors_in_digits(&fit);
        if let Some(index) = shown.iter().position(is_equal) {
            same[index].push(fit);
        } else {
            shown.push(fit);
            same.push(Vec::new());
        }
    }
    let mut table = side_by_side(comparison, "strategy", &shown, is_timed);
    for (fit, others) in shown.iter().zip(&same).filter(|(_, others)| !others.is_empty()) {
        let mut strategies: Vec<(&str, Vec<&str>)> = Vec::new();
        for other in others.chunk_by(|a, b| a.strategy == b.strategy) {
            strategies.push((&other[0].strategy, other.iter().map(|fit| fit.solver).collect()));
        }
        let words =
            strategies.iter().map(|(name, solvers)| format!("{name} ({})", solvers.join(", ")));
        let unit = fit.errors.judged().norms().1;
        table.notes.push(format!(
            "within 0.0001 {unit} of {} ({}): {}",
            fit.strategy,
            fit.solver,
            words.collect::<Vec<_>>().join("; ")
        ));
    }
    table
}

/// Returns the errors of a fit, rounded to the digits that the table shows.
fn errors_in_digits(fit: &ComparedFit) -> Vec<String> {
    let summaries = [fit.errors.judged(), &fit.errors.identification];
    summaries.iter().flat_map(|summary| summary.norms().0).map(|value| number(value, 4)).collect()
}

/// Returns true if every row of the data measures a position.
fn of_positions(found: &Identification) -> bool {
    row_noun(found) == "pose"
}

/// Returns the results of each procedure in the form of tables 2 and 3 of the paper.
fn as_paper_tables(comparison: &Comparison) -> Vec<Block<'_>> {
    let tables = |procedure| {
        [
            Block::heading(&title(procedure)),
            Block::Table(table_2(procedure)),
            Block::Table(table_3(comparison, procedure)),
        ]
    };
    comparison.procedures.iter().flat_map(tables).collect()
}

/// Returns the report of the command `compare`.
pub fn comparison_report(problem: &Problem, comparison: &Comparison, plots: &PlotData) -> Report {
    report(problem, "comparison", &blocks(problem, comparison, plots))
}

fn blocks<'a>(
    problem: &Problem,
    comparison: &'a Comparison,
    plots: &'a PlotData,
) -> Vec<Block<'a>> {
    let joint = &comparison.joint;
    let held_out = joint.fitted.held_out;
    let mut head = Headline {
        states: vec![
            (NOMINAL_ARM, mean_error(&joint.registered.held_out)),
            ("identified", mean_error(&held_out)),
        ],
        unit: unit(&held_out),
        of: format!(
            "{}, everything fitted at once",
            if of_positions(joint) {
                format!("{} held-out poses", held_out.n)
            } else {
                held_out_rows(joint)
            }
        ),
        facts: vec![
            row_counts_fact(joint),
            parameters_fact(joint),
            residual_fact("Residual against σ", joint),
        ],
        is_doubtful: !joint.is_trusted(),
    };
    if is_elastic(comparison) {
        let error = mean_error(&comparison.rigid.fitted.held_out);
        head.facts.push(("Elasticity ignored", format!("{error} {}", unit(&held_out))));
    }
    let mut blocks = vec![
        Block::Headline(head),
        Block::Text(verdict(comparison)),
        Block::Text(fit_sentence(joint)),
    ];
    blocks.extend(fit_warnings(joint, plots));
    blocks.extend([
        Block::heading("Strategies and solvers side by side"),
        Block::Figures(vec![figures::strategies(comparison)]),
        Block::Words(vec![Block::Table(every_strategy(comparison))]),
        Block::Page(vec![
            Block::Table(grouped_strategies(comparison, false)),
            Block::Folded(
                "Every strategy and solver".to_owned(),
                vec![Block::Table(every_strategy(comparison))],
                "compare.json holds every strategy and solver.".to_owned(),
            ),
        ]),
    ]);
    if is_elastic(comparison) {
        blocks.extend([
            Block::heading("Gain of each part of the elasticity"),
            Block::figures([figures::ablations(comparison)]),
            Block::Table(ablations(comparison, false)),
        ]);
    }
    let procedures = comparison.procedures.iter().filter(|_| concerns_paper(comparison));
    if concerns_paper(comparison) && !comparison.procedures.is_empty() {
        blocks.push(Block::heading(
            "From each procedure, as in tables 2 and 3 and figure 13 of the paper",
        ));
    }
    for procedure in procedures {
        blocks.push(Block::Text(format!("{}.", title(procedure))));
        blocks.extend([
            Block::Table(table_2(procedure)),
            Block::Table(table_3(comparison, procedure)),
        ]);
        // The errors of the joint fit follow below.
        blocks.extend(
            procedure.paper.map(|_| {
                Block::Figures(vec![figures::of_procedure(&comparison.before, procedure)])
            }),
        );
    }
    blocks.push(Block::heading("Everything fitted at once"));
    blocks.push(Block::Table(errors_by_axis(joint, false)));
    blocks.push(Block::figures([figures::errors(plots), figures::vectors(plots)]));
    blocks.push(Block::Poses(plots));
    blocks.extend(fit_details(
        problem,
        joint,
        plots,
        &format!("the estimate.json of {}", code("flexcal identify")),
    ));
    blocks
}

/// Returns the fits of every strategy and solver, those of the paper last.
fn compared_strategies(comparison: &Comparison) -> Vec<ComparedFit> {
    let strategies = comparison.strategies.iter().map(ComparedFit::from);
    strategies.chain(comparison.paper.iter().map(ComparedFit::from)).collect()
}

/// Returns the table with one row for every strategy and solver.
fn every_strategy(comparison: &Comparison) -> Table {
    side_by_side(comparison, "strategy", &compared_strategies(comparison), false)
}

/// Returns the table of the fits with only a part of the elasticity, one row for each part.
fn ablations(comparison: &Comparison, is_timed: bool) -> Table {
    let named = |(part, found): &(Ablation, Identification)| ComparedFit {
        strategy: part.as_str().to_owned(),
        ..found.into()
    };
    let fits: Vec<ComparedFit> = comparison.ablations.iter().map(named).collect();
    side_by_side(comparison, "elasticity", &fits, is_timed)
}

/// Returns the table of `fits`; `first` is the header of the column of their names. If `is_timed`,
/// the table contains durations, which differ from run to run; otherwise it contains more errors.
fn side_by_side(
    comparison: &Comparison,
    first: &str,
    fits: &[ComparedFit],
    is_timed: bool,
) -> Table {
    let norm = |summary: &Summary, which: usize| number(summary.norms().0[which], 4);
    let held_out_errors = &comparison.joint.fitted.held_out;
    let held_out = |words: &str, which: usize| {
        let cell = move |fit: &ComparedFit| norm(fit.errors.judged(), which);
        Column::number(with_unit_of(held_out_errors, words), cell)
    };
    let fitted = |words: &str, which: usize| {
        let cell = move |fit: &ComparedFit| norm(&fit.errors.identification, which);
        Column::number(with_unit_of(held_out_errors, words), cell)
    };
    let test_rows = test_rows_word(&comparison.joint.fitted);
    let mut columns = vec![
        Column::words(first, |fit: &ComparedFit| fit.strategy.clone()),
        Column::words("solver", |fit: &ComparedFit| fit.solver.to_owned()).minor(),
        held_out(&format!("{test_rows} mean"), 0),
        held_out("rms", 1),
        fitted("fitted rms", 1).minor(),
        Column::number("steps", |fit: &ComparedFit| fit.iterations.to_string()).minor(),
        Column::number("evaluations", |fit: &ComparedFit| fit.evaluations.to_string()).minor(),
    ];
    if is_timed {
        columns.push(Column::number("ms", |fit: &ComparedFit| number(fit.seconds * 1e3, 1)));
    }
    let condition =
        |fit: &ComparedFit| or_dash(fit.condition_number, |value| format!("{value:.1e}"));
    columns.push(Column::number("condition", condition).minor());
    let termination = |fit: &ComparedFit| fit.termination.to_owned();
    columns.push(Column::words("termination", termination).minor());
    if !is_timed {
        columns.extend([fitted("fitted mean", 0), held_out(&format!("{test_rows} max"), 2)]);
    }
    Table::of(fits, &columns)
}

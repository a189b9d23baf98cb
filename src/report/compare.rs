//! Texts of `compare`: every strategy, solver and ablation, and the paper's tables 2 and 3.

use super::document::{Block, Headline, Table, code};
use super::errors::{both_parts, header, held_out_rows, noun, shown, unit};
use super::figures;
use super::identify::{
    BEFORE, beware, counts, errors_by_axis, fitted_parameters, mean, no_errors, poses, remainder,
};
use super::noise::size;
use super::paper_tables::{table_2, table_3, title};
use super::render::{Report, report, text};
use crate::fit::{Comparison, Errors, Identification};
use crate::model::Ablation;
use crate::problem::Problem;
use crate::quantity::format::{counted, number, or_dash};
use crate::results::ComparedFit;
use crate::results::PlotData;

/// Columns of a comparison after the first; only the time differs from run to run.
const ROWS: [&str; 9] = [
    "solver",
    "held out mean",
    "rms, mm",
    "fitted rms",
    "steps",
    "evaluations",
    "ms",
    "condition",
    "termination",
];
/// Index of the column with the time.
const TIME: usize = 7;

/// Returns every strategy and solver, those of the paper last.
fn fits(comparison: &Comparison) -> impl Iterator<Item = (ComparedFit, &Errors)> {
    let strategies = comparison.strategies.iter().map(|found| (found.into(), &found.fitted));
    strategies.chain(comparison.paper.iter().map(|paper| (paper.into(), &paper.errors)))
}

/// Returns the comparison as text, ending in a line break.
pub fn compare_text(problem: &Problem, comparison: &Comparison) -> String {
    let joint = &comparison.joint;
    let (poses, held_out) = (joint.fitted.identification.n, joint.fitted.held_out.n);
    let parts_of = if of_positions(joint) {
        format!("{} to identify, {held_out} held out", counted(poses, "pose"))
    } else {
        both_parts(joint)
    };
    let mut blocks = vec![Block::lines(format!("{}\n{parts_of}", problem.title))];
    blocks.extend(in_the_papers_shape(comparison));
    blocks.extend(no_errors(joint).map(|words| Block::lines(format!("  –: {words}"))));
    blocks.push(Block::Table(strategies(comparison)));
    if !comparison.paper.is_empty() && !problem.effects.is_empty() {
        blocks.push(Block::lines(
            "  paper: the closed forms of [Chen2021], without the declared effects",
        ));
    }
    blocks.push(Block::Table(parts(comparison)));
    text(&blocks)
}

/// Returns true if every row measures a position.
fn of_positions(found: &Identification) -> bool {
    noun(found) == "pose"
}

/// Returns tables 2 and 3 of the paper from each procedure.
fn in_the_papers_shape(comparison: &Comparison) -> Vec<Block<'_>> {
    let tables = |procedure| {
        [
            Block::heading(&title(procedure)),
            Block::Table(table_2(procedure)),
            Block::Table(table_3(comparison, procedure)),
        ]
    };
    comparison.procedures.iter().flat_map(tables).collect()
}

/// Returns the report of `compare`.
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
    let head = Headline {
        states: vec![(BEFORE, mean(&joint.registered.held_out)), ("identified", mean(&held_out))],
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
            poses(joint),
            fitted_parameters(joint),
            (
                "Elasticity ignored",
                format!("{} {}", mean(&comparison.rigid.fitted.held_out), unit(&held_out)),
            ),
            size("Residual against σ", joint),
        ],
    };
    let mut blocks = vec![Block::Headline(head), Block::Text(counts(joint))];
    blocks.extend(beware(joint, plots));
    blocks.extend([
        Block::heading("Strategies and solvers side by side"),
        Block::Figures(vec![figures::strategies(comparison)]),
        Block::Words(vec![Block::Table(untimed(strategies(comparison)))]),
        Block::Page(vec![Block::Table(in_full(comparison))]),
        Block::heading("Gain of each part of the elasticity"),
        Block::figures([figures::ablations(comparison)]),
        Block::Table(untimed(parts(comparison))),
    ]);
    if !comparison.procedures.is_empty() {
        blocks.push(Block::heading(
            "From each procedure, as in tables 2 and 3 and figure 13 of the paper",
        ));
    }
    for procedure in &comparison.procedures {
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
    blocks.push(Block::Table(errors_by_axis(joint)));
    blocks.push(Block::figures([figures::errors(plots), figures::vectors(plots)]));
    blocks.push(Block::Poses(plots));
    blocks.extend(remainder(
        problem,
        joint,
        plots,
        &format!("the estimate.json of {}", code("flexcal identify")),
    ));
    blocks
}

/// Returns the table with a row for each strategy and solver.
fn strategies(comparison: &Comparison) -> Table {
    side_by_side(
        comparison,
        "strategy",
        fits(comparison).map(|(fit, errors)| cells(&fit.strategy, &fit, errors)).collect(),
    )
}

/// Returns the table of strategies without times, with two more errors.
fn in_full(comparison: &Comparison) -> Table {
    let mut table = untimed(strategies(comparison));
    table.header.extend(["fitted mean", "held out, largest"]);
    for (row, (_, errors)) in table.rows.iter_mut().zip(fits(comparison)) {
        row.extend([
            shown(&errors.identification, errors.identification.mean.norm),
            shown(&errors.held_out, errors.held_out.max.norm),
        ]);
    }
    table
}

/// Returns the table with a row for each part of the elasticity.
fn parts(comparison: &Comparison) -> Table {
    let row = |(part, found): &(Ablation, Identification)| {
        cells(part.as_str(), &found.into(), &found.fitted)
    };
    side_by_side(comparison, "elasticity", comparison.ablations.iter().map(row).collect())
}

fn side_by_side(comparison: &Comparison, first: &'static str, rows: Vec<Vec<String>>) -> Table {
    let rms = header(&comparison.joint.fitted.held_out, ["rms, mm", "rms, °", "rms, px"]);
    let columns = ROWS.map(|name| if name == "rms, mm" { rms } else { name });
    let header: Vec<&str> = std::iter::once(first).chain(columns).collect();
    Table { minor: vec![1, 4, 5, 6, 7, 8], ..Table::new(&header, rows, &[0, 1, 9]) }
}

/// Removes the column with the time, so that the same input gives the same page.
fn untimed(mut table: Table) -> Table {
    table.header.remove(TIME);
    table.rows.iter_mut().for_each(|row| _ = row.remove(TIME));
    Table { left: vec![0, 1, 8], ..table }
}

fn cells(name: &str, fit: &ComparedFit, errors: &Errors) -> Vec<String> {
    vec![
        name.to_owned(),
        fit.solver.to_owned(),
        shown(&errors.held_out, errors.held_out.mean.norm),
        shown(&errors.held_out, errors.held_out.rms.norm),
        shown(&errors.identification, errors.identification.rms.norm),
        fit.iterations.to_string(),
        fit.evaluations.to_string(),
        number(fit.seconds * 1e3, 1),
        or_dash(fit.condition_number, |condition| format!("{condition:.1e}")),
        fit.termination.to_owned(),
    ]
}

//! Text of `study`, and its tables for other programs.

use super::document::{Block, Table};
use super::render::text;
use crate::quantity::format::{number, or_dash};
use crate::results::{Cell, StudyResult};
use crate::study::{CellResult, Results, Source, Study};

/// Returns the study as text, ending in a line break.
pub fn study_text(study: &Study, results: &Results) -> String {
    let by = match study.source {
        Source::Model => "the model itself",
        Source::Rig => "the virtual test rig",
    };
    let head = format!(
        "{}\n{} cells of {} fits, {} parameters, measured by {by}; {} poses held out in each",
        study.title,
        study.cells.len(),
        study.repetitions,
        study.parameters.len(),
        study.held_out
    );
    let header = "noise mm|poses|strategy|solver|failed|held out mean|rms, mm|± sd|covered|largest bias|of|steps|ms";
    let header: Vec<&str> = header.split('|').collect();
    let cells = StudyResult::new(study, results).cells;
    let rows = cells.iter().zip(&results.cells).map(|(cell, timed)| line(cell, timed)).collect();
    let shown = Table::new(&header, rows, &[2, 3, 10]).noted(&[
        "held out: measured − predicted, noise included; covered: share of estimates within 1.96 standard errors, 95 % if these are right;",
        "largest bias: of any parameter, over the spread of its estimates; ms: median time of a fit",
    ]);
    text(&[Block::lines(head), Block::Table(shown)])
}

fn line(cell: &Cell, timed: &CellResult) -> Vec<String> {
    let shown = |value: Option<f64>, decimals| or_dash(value, |value| number(value, decimals));
    let percent = |share: Option<f64>| or_dash(share, |share| format!("{:.1} %", 100.0 * share));
    let (held_out, bias) = (&cell.held_out_mm, cell.largest_bias.as_ref());
    vec![
        cell.position_sigma_mm.to_string(),
        cell.identification_poses.to_string(),
        cell.strategy.to_owned(),
        cell.solver.to_owned(),
        percent(Some(cell.failure_rate)),
        shown(held_out.mean, 4),
        shown(held_out.rms, 4),
        shown(held_out.rms_sd, 4),
        percent(cell.coverage),
        shown(bias.map(|bias| bias.bias_sd), 2),
        or_dash(bias, |bias| bias.parameter.clone()),
        shown(cell.iterations_mean, 1),
        number(timed.timing().median * 1e3, 1),
    ]
}

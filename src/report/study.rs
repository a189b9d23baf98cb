//! Text and page of the command `study`.

use std::fmt::Write as _;

use super::document::{Block, Column, Table, opening};
use super::figures::{Drawing, Forest, INK};
use super::render::Story;
use crate::quantity::format::{number, or_dash};
use crate::results::{Cell, StudyResult};
use crate::study::{Results, Source, Study};

/// Cell of a study with the median duration of a fit \[s\].
type TimedCell = (Cell, f64);

/// Returns the study, with a figure of the error of each cell.
pub fn study(study: &Study, results: &Results) -> Story {
    let by = match study.source {
        Source::Model => "simulated with the model itself",
        Source::Rig => "measured by the virtual test rig",
    };
    let head = format!(
        "{} cells of {} fits, {} parameters, {by}; {} poses held out in each",
        study.cells.len(),
        study.repetitions,
        study.parameters.len(),
        study.held_out
    );
    let cells: Vec<TimedCell> = StudyResult::new(study, results)
        .cells
        .into_iter()
        .zip(results.cells.iter().map(|timed| timed.timing().median))
        .collect();
    let shown = |value: Option<f64>, decimals| or_dash(value, |value| number(value, decimals));
    let percent = |share: Option<f64>| or_dash(share, |share| format!("{:.1} %", 100.0 * share));
    let bias = |(cell, _): &TimedCell| cell.largest_bias.as_ref().map(|bias| bias.bias_sd);
    let biased =
        |(cell, _): &TimedCell| or_dash(cell.largest_bias.as_ref(), |bias| bias.parameter.clone());
    let table = Table::of(
        &cells,
        &[
            Column::number("noise, mm", |(cell, _): &TimedCell| cell.position_sigma_mm.to_string()),
            Column::number("poses", |(cell, _): &TimedCell| cell.identification_poses.to_string()),
            Column::words("strategy", |(cell, _): &TimedCell| cell.strategy.to_owned()),
            Column::words("solver", |(cell, _): &TimedCell| cell.solver.to_owned()).minor(),
            Column::number("not trusted", |(cell, _): &TimedCell| percent(Some(cell.failure_rate))),
            Column::number("held out mean, mm", |(cell, _): &TimedCell| {
                shown(cell.held_out_mm.mean, 4)
            }),
            Column::number("rms, mm", |(cell, _): &TimedCell| shown(cell.held_out_mm.rms, 4)),
            Column::number("± sd, mm", |(cell, _): &TimedCell| shown(cell.held_out_mm.rms_sd, 4))
                .minor(),
            Column::number("covered", |(cell, _): &TimedCell| percent(cell.coverage)),
            Column::number("largest bias", |cell| shown(bias(cell), 2)).minor(),
            Column::words("of", biased).minor(),
            Column::number("steps", |(cell, _): &TimedCell| shown(cell.iterations_mean, 1)).minor(),
            Column::number("ms", |(_, median): &TimedCell| number(median * 1e3, 1)).minor(),
        ],
    );
    let table = table.noted(&[
        "not trusted: share of fits that failed or are not to be trusted; errors, coverage and bias \
         leave them out; held out: measured − predicted, noise included; covered: \
         share of estimates within 1.96 standard errors of the truth, 95 % if the standard \
         errors are right",
        "largest bias: largest ratio of bias to standard deviation of the errors, over all \
         parameters, those that stay nominal included; ms: median time of a fit",
    ]);
    let [titled, untitled] = opening(&study.title, head);
    let conclusion = Block::lines(conclusion(&cells));
    let blocks = vec![
        titled,
        untitled,
        conclusion,
        Block::Table(table),
        Block::figures([draw_errors(&cells)]),
    ];
    Story::new(&study.title, "study", blocks)
}

/// States the cell with the smallest rms error of held-out poses, and the cells without a fit that
/// is trusted.
fn conclusion(cells: &[TimedCell]) -> String {
    let rms = |cell: &&TimedCell| cell.0.held_out_mm.rms.unwrap_or(f64::INFINITY);
    let best = cells.iter().filter(|cell| cell.0.held_out_mm.rms.is_some());
    let best = best.min_by(|a, b| rms(a).total_cmp(&rms(b)));
    let mut words = match best {
        Some(cell) => {
            let distrusted = match cell.0.failure_rate {
                rate if rate > 0.0 => {
                    format!("; {} % of its fits are not to be trusted", number(100.0 * rate, 1))
                }
                _ => String::new(),
            };
            format!(
                "Smallest error at held-out poses: {} mm rms ({}{distrusted})",
                number(rms(&cell), 4),
                name(&cell.0)
            )
        }
        None => "No fit succeeded".to_owned(),
    };
    let is_lost = |(cell, _): &&TimedCell| cell.failure_rate >= 1.0;
    let lost: Vec<String> = cells.iter().filter(is_lost).map(|cell| name(&cell.0)).collect();
    if !lost.is_empty() {
        let _ = write!(words, ". In these cells no fit is to be trusted: {}.", lost.join("; "));
    }
    words
}

/// Returns the conditions of a cell in words.
fn name(cell: &Cell) -> String {
    format!("{} {}", name_without_solver(cell), cell.solver)
}

/// Returns noise, number of poses and strategy of a cell in words.
fn name_without_solver(cell: &Cell) -> String {
    format!("{} mm, {} poses, {}", cell.position_sigma_mm, cell.identification_poses, cell.strategy)
}

/// Draws the rms error of held-out poses of each cell.
fn draw_errors(cells: &[TimedCell]) -> Option<Drawing> {
    let has_one_solver = cells.windows(2).all(|pair| pair[0].0.solver == pair[1].0.solver);
    let name = if has_one_solver { name_without_solver } else { name };
    let row = |(cell, _): &TimedCell| {
        let rms = cell.held_out_mm.rms?;
        Some((name(cell), vec![Some((rms, cell.held_out_mm.rms_sd.unwrap_or_default()))]))
    };
    let caption = "Root mean square error at held-out poses, noise included, with the standard deviation over the fits of the \
                   cell, on a logarithmic scale. A cell is one combination of noise level (1 σ), number of poses, strategy \
                   and solver.";
    Forest {
        names: ("study-errors", "Held-out error of each cell"),
        caption: caption.to_owned(),
        label: "held-out error, rms [mm]",
        legend: vec![("rms", INK)],
        references: Vec::new(),
        rows: cells.iter().filter_map(row).collect(),
        is_logarithmic: true,
    }
    .drawing()
}

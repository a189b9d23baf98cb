//! Text of `study`, and its tables for other programs.

use super::document::{Block, Table};
use super::quantity::{number, or_dash};
use super::render::text;
use crate::files;
use crate::study::{CellResult, Results, Source, Study};

/// Header of the first columns of every table.
const CELL: &str = "cell,position_sigma_mm,identification_poses,strategy,solver";

fn in_mm(metres: Option<f64>) -> Option<f64> {
    metres.map(|value| value * 1e3)
}

/// Converts a noise level to mm as it was written: 0.1 and not 0.10000000000000001.
fn millimetres(metres: f64) -> f64 {
    (metres * 1e15).round() / 1e12
}

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
    let rows = results.cells.iter().map(|cell| line(study, cell)).collect();
    let shown = Table::new(&header, rows, &[2, 3, 10]).noted(&[
        "held out: measured − predicted, noise included; covered: share of estimates within 1.96 standard errors, 95 % if these are right;",
        "largest bias: of any parameter, over the spread of its estimates; ms: median time of a fit",
    ]);
    text(&[Block::lines(head), Block::Table(shown)])
}

fn line(study: &Study, result: &CellResult) -> Vec<String> {
    let CellResult { cell, tally, .. } = result;
    let shown = |value: Option<f64>, decimals| or_dash(value, |value| number(value, decimals));
    let length = |metres: Option<f64>| shown(in_mm(metres), 4);
    let percent = |share: Option<f64>| or_dash(share, |share| format!("{:.1} %", 100.0 * share));
    let bias = result.largest_bias(study);
    vec![
        millimetres(cell.sigma).to_string(),
        cell.poses.to_string(),
        cell.strategy.as_str().to_owned(),
        cell.solver.as_str().to_owned(),
        percent(Some(result.failure_rate())),
        length(tally.held_out_mean.mean()),
        length(tally.held_out_rms.rms()),
        length(tally.held_out_rms.deviation()),
        percent(result.coverage()),
        shown(bias.map(|(_, ratio)| ratio), 2),
        or_dash(bias, |(parameter, _)| parameter.name.clone()),
        shown(tally.iterations.mean(), 1),
        number(result.timing().median * 1e3, 1),
    ]
}

/// Returns `study.csv` with a line for each cell.
pub fn study_csv(study: &Study, results: &Results) -> String {
    let header = "fits,failed,failure_rate,held_out_mean_mm,held_out_rms_mm,held_out_rms_sd_mm,held_out_rms_max_mm,\
                  reduced_chi2,coverage,largest_bias_sd,largest_bias_of,iterations_mean,iterations_max";
    let line = |(index, cell): (usize, &CellResult)| {
        let tally = &cell.tally;
        let bias = cell.largest_bias(study);
        let length = |metres: Option<f64>| plain(in_mm(metres));
        let cells = vec![
            tally.fits.to_string(),
            tally.failed().to_string(),
            cell.failure_rate().to_string(),
            length(tally.held_out_mean.mean()),
            length(tally.held_out_rms.rms()),
            length(tally.held_out_rms.deviation()),
            length(tally.held_out_rms.largest()),
            plain(tally.reduced_chi2.mean()),
            plain(cell.coverage()),
            plain(bias.map(|(_, ratio)| ratio)),
            bias.map(|(parameter, _)| parameter.name.clone()).unwrap_or_default(),
            plain(tally.iterations.mean()),
            plain(tally.iterations.largest()),
        ];
        [leading(index, cell), cells].concat()
    };
    csv(header, results.cells.iter().enumerate().map(line))
}

/// Returns `parameters.csv` with a line for each parameter of each cell; the unit `relative` stands
/// for ln(value).
pub fn study_parameters_csv(study: &Study, results: &Results) -> String {
    let header = "parameter,unit,fits,bias,spread,rms_error,with_std_error,std_error,coverage";
    let lines = results.cells.iter().enumerate().flat_map(|(index, cell)| {
        cell.parameters(study).map(move |result| {
            let cells = vec![
                result.parameter.name.clone(),
                result.unit().to_owned(),
                result.fits.to_string(),
                plain(result.bias),
                plain(result.spread),
                plain(result.rms_error),
                result.with_std_error.to_string(),
                plain(result.std_error),
                plain(result.coverage),
            ];
            [leading(index, cell), cells].concat()
        })
    });
    csv(header, lines)
}

/// Returns `timing.csv` with a line for each cell, the only result that differs from run to run.
pub fn study_timing_csv(results: &Results) -> String {
    let line = |(index, cell): (usize, &CellResult)| {
        let timing = cell.timing();
        let [median, slowest] =
            [timing.median, timing.slowest].map(|seconds| format!("{:.3}", seconds * 1e3));
        let cells =
            vec![cell.seconds.len().to_string(), median, slowest, format!("{:.3}", timing.total)];
        [leading(index, cell), cells].concat()
    };
    csv("fits,median_ms,slowest_ms,total_s", results.cells.iter().enumerate().map(line))
}

/// Returns the first columns, which name the cell, numbered from 1.
fn leading(index: usize, result: &CellResult) -> Vec<String> {
    let cell = &result.cell;
    let sigma = millimetres(cell.sigma).to_string();
    let words = [cell.strategy.as_str(), cell.solver.as_str()].map(str::to_owned);
    [vec![(index + 1).to_string(), sigma, cell.poses.to_string()], words.to_vec()].concat()
}

/// Formats a number by the shortest text that is read back as the same; empty for `None`.
fn plain(value: Option<f64>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

fn csv(header: &str, lines: impl Iterator<Item = Vec<String>>) -> String {
    files::csv(CELL.split(',').chain(header.split(',')).map(str::to_owned).collect(), lines)
}

//! `study.csv`, `parameters.csv`, `timing.csv`: tables for other programs, SI units except where a column says otherwise.

use super::cells::quoted;
use crate::monte_carlo::{Campaign, CellResult, Results};

const CELL: &str = "cell,position_sigma_mm,identification_poses,strategy,solver";

/// `study.csv`: one line a cell.
pub fn study_csv(campaign: &Campaign, results: &Results) -> String {
    let header = "fits,failed,failure_rate,held_out_mean_mm,held_out_rms_mm,held_out_rms_sd_mm,held_out_rms_max_mm,\
                  reduced_chi2,coverage,largest_bias_sd,largest_bias_of,iterations_mean,iterations_max";
    let line = |(index, cell): (usize, &CellResult)| {
        let tally = &cell.tally;
        let bias = cell.largest_bias(campaign);
        let millimetres = |value: Option<f64>| number(value.map(|value| value * 1e3));
        let cells = [
            leading(index, cell),
            tally.fits.to_string(),
            tally.failed().to_string(),
            cell.failure_rate().to_string(),
            millimetres(tally.held_out_mean.mean()),
            millimetres(tally.held_out_rms.rms()),
            millimetres(tally.held_out_rms.deviation()),
            millimetres(tally.held_out_rms.largest()),
            number(tally.reduced_chi2.mean()),
            number(cell.coverage()),
            number(bias.map(|(_, ratio)| ratio)),
            bias.map(|(parameter, _)| quoted(&parameter.name)).unwrap_or_default(),
            number(tally.iterations.mean()),
            number(tally.iterations.largest()),
        ];
        cells.join(",")
    };
    text(header, results.cells.iter().enumerate().map(line))
}

/// `parameters.csv`: one line a cell and parameter; relative: of ln(value).
pub fn study_parameters_csv(campaign: &Campaign, results: &Results) -> String {
    let header = "parameter,unit,fits,bias,spread,rms_error,with_std_error,std_error,coverage";
    let lines = results.cells.iter().enumerate().flat_map(|(index, cell)| {
        cell.parameters(campaign).map(move |result| {
            let cells = [
                leading(index, cell),
                quoted(&result.parameter.name),
                result.unit().to_owned(),
                result.fits.to_string(),
                number(result.bias),
                number(result.spread),
                number(result.rms_error),
                result.with_std_error.to_string(),
                number(result.std_error),
                number(result.coverage),
            ];
            cells.join(",")
        })
    });
    text(header, lines)
}

/// `timing.csv`: one line a cell; the only result that differs from run to run.
pub fn study_timing_csv(results: &Results) -> String {
    let line = |(index, cell): (usize, &CellResult)| {
        let timing = cell.timing();
        let milliseconds = [timing.median, timing.slowest].map(|seconds| format!("{:.3}", seconds * 1e3));
        format!("{},{},{},{:.3}", leading(index, cell), cell.seconds.len(), milliseconds.join(","), timing.total)
    };
    text("fits,median_ms,slowest_ms,total_s", results.cells.iter().enumerate().map(line))
}

/// Which cell, counted from 1.
fn leading(index: usize, result: &CellResult) -> String {
    let cell = &result.cell;
    let (strategy, solver) = (cell.strategy.as_str(), cell.solver.as_str());
    format!("{},{},{},{strategy},{solver}", index + 1, super::study_json::millimetres(cell.sigma), cell.poses)
}

/// The shortest text that is read back as the same number; empty where there is none.
fn number(value: Option<f64>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

fn text(header: &str, lines: impl Iterator<Item = String>) -> String {
    std::iter::once(format!("{CELL},{header}")).chain(lines).flat_map(|line| [line, "\n".to_owned()]).collect()
}

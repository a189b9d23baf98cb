//! Tables of studies.

use crate::files;
use crate::results::{Cell, StudyResult};
use crate::study::{CellResult, ParameterResult, Results, Study};

/// Names of the first columns of every table of a study, which identify the cell.
const CELL_COLUMNS: &str = "cell,position_sigma_mm,identification_poses,strategy,solver";

/// Returns `study.csv` with a line for each cell.
pub fn study_csv(study: &Study, results: &Results) -> String {
    let header = "fits,failed,failure_rate,held_out_mean_mm,held_out_rms_mm,held_out_rms_sd_mm,held_out_rms_max_mm,\
                  reduced_chi2,coverage,largest_bias_sd,largest_bias_of,iterations_mean,iterations_max";
    let line = |cell: &Cell| {
        let (held_out, bias) = (&cell.held_out_mm, cell.largest_bias.as_ref());
        vec![vec![
            cell.fits.to_string(),
            cell.failed.to_string(),
            cell.failure_rate.to_string(),
            number_or_empty(held_out.mean),
            number_or_empty(held_out.rms),
            number_or_empty(held_out.rms_sd),
            number_or_empty(held_out.rms_max),
            number_or_empty(cell.reduced_chi2),
            number_or_empty(cell.coverage),
            number_or_empty(bias.map(|bias| bias.bias_sd)),
            bias.map(|bias| bias.parameter.clone()).unwrap_or_default(),
            number_or_empty(cell.iterations_mean),
            number_or_empty(cell.iterations_max),
        ]]
    };
    csv(study, results, header, |cell, _| line(cell))
}

/// Returns `parameters.csv` with a line for each parameter of each cell; the unit `relative` means
/// ln(value).
pub fn study_parameters_csv(study: &Study, results: &Results) -> String {
    let header = "parameter,unit,fits,bias,spread,rms_error,with_std_error,std_error,coverage";
    csv(study, results, header, |cell, _| {
        let line = |parameter: &ParameterResult| {
            vec![
                parameter.name.clone(),
                parameter.unit.clone().into_owned(),
                parameter.fits.to_string(),
                number_or_empty(parameter.bias),
                number_or_empty(parameter.spread),
                number_or_empty(parameter.rms_error),
                parameter.with_std_error.to_string(),
                number_or_empty(parameter.std_error),
                number_or_empty(parameter.coverage),
            ]
        };
        cell.parameters.iter().map(line).collect()
    })
}

/// Returns `timing.csv` with a line for each cell. It is the only result of a study that differs
/// from run to run.
pub fn study_timing_csv(study: &Study, results: &Results) -> String {
    csv(study, results, "fits,median_ms,slowest_ms,total_s", |_, timed| {
        let timing = timed.timing();
        let [median, slowest] =
            [timing.median, timing.slowest].map(|seconds| format!("{:.3}", seconds * 1e3));
        let total = format!("{:.3}", timing.total);
        vec![vec![timed.seconds.len().to_string(), median, slowest, total]]
    })
}

/// Formats a number as the shortest text that reads back as the same number; empty for `None`.
fn number_or_empty(value: Option<f64>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// Returns a table as CSV with the columns that identify the cell, followed by those of `header`.
/// `lines` returns the cells of the table for one cell of the study; these are numbered from 1.
fn csv(
    study: &Study,
    results: &Results,
    header: &str,
    lines: impl Fn(&Cell, &CellResult) -> Vec<Vec<String>>,
) -> String {
    let cells = StudyResult::new(study, results).cells;
    let named = |(index, (cell, timed)): (usize, (&Cell, &CellResult))| {
        let first = vec![
            (index + 1).to_string(),
            cell.position_sigma_mm.to_string(),
            cell.identification_poses.to_string(),
            cell.strategy.to_owned(),
            cell.solver.to_owned(),
        ];
        let join = |line| [first.clone(), line].concat();
        lines(cell, timed).into_iter().map(join).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> =
        cells.iter().zip(&results.cells).enumerate().flat_map(named).collect();
    files::csv(CELL_COLUMNS.split(',').chain(header.split(',')).map(str::to_owned).collect(), rows)
}

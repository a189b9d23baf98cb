//! What a fit leaves, as the columns of a table.

use flexcal::fit::Residual;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::results::{Column, residual_columns};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{integers, numbers};
use crate::pool::detached;

/// The columns of residuals.csv, in their order: numbers, or codes and words.
pub fn table<'py>(
    py: Python<'py>,
    problem: &Problem,
    data: &Dataset,
    residuals: &[Residual],
) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    let found = detached(py, || residual_columns(problem, &data.measurements, residuals))?;
    for (name, column) in found {
        match column {
            Column::Words(labels) => {
                columns.set_item(name, (integers(py, labels.of_row.into_iter()), labels.names))?;
            }
            Column::Counts(values) => columns.set_item(name, integers(py, values.into_iter()))?,
            Column::Flags(values) => {
                columns.set_item(name, integers(py, values.into_iter().map(usize::from)))?;
            }
            Column::Numbers(values, _) => {
                columns.set_item(name, numbers(py, values.into_iter()))?;
            }
            _ => {}
        }
    }
    Ok(columns)
}

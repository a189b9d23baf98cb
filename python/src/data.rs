//! Measurements and poses from Python.

use std::path::PathBuf;
use std::sync::Arc;

use flexcal::error::{InputError, Warning};
use flexcal::measurement::{ColumnTable, ColumnValues, Dataset, Labels, Measurements};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;

use crate::error::{of_argument, raised};

/// Measured poses, divided into fitted and held-out rows.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Data {
    pub data: Arc<Dataset>,
    /// What was passed over.
    #[pyo3(get)]
    warnings: Vec<String>,
}

/// Poses that may still be to measure.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Poses {
    pub rows: Arc<Measurements>,
    /// What was passed over.
    #[pyo3(get)]
    pub warnings: Vec<String>,
}

/// Where a table comes from.
#[derive(FromPyObject)]
pub enum Source {
    /// Files of one table.
    Files(Vec<PathBuf>),
    /// What messages call the table, and its columns.
    Columns(String, Vec<(String, Column)>),
}

/// A column in memory.
#[derive(FromPyObject)]
pub enum Column {
    /// The bytes of an array of 64-bit numbers.
    Numbers(PyBackedBytes),
    /// For each row the number of its word, the bytes of an array of 64-bit integers; and the
    /// words.
    Words(PyBackedBytes, Vec<String>),
}

/// What is read once Python's lock is released.
pub enum Input {
    Files(Vec<PathBuf>),
    Columns(ColumnTable),
}

impl Source {
    /// The same in memory of its own.
    pub fn owned(self) -> PyResult<Input> {
        let (name, columns) = match self {
            Source::Files(files) => return Ok(Input::Files(files)),
            Source::Columns(name, columns) => (name, columns),
        };
        let columns =
            columns.into_iter().map(|(name, column)| Ok((name.clone(), column.values(&name)?)));
        let columns = columns.collect::<PyResult<Vec<_>>>()?;
        ColumnTable::new(name, columns).map(Input::Columns).map_err(|error| raised(&error))
    }
}

impl Column {
    fn values(self, name: &str) -> PyResult<ColumnValues> {
        match self {
            Column::Numbers(bytes) => {
                let (values, _) = bytes.as_chunks();
                Ok(ColumnValues::Numbers(
                    values.iter().map(|value| f64::from_ne_bytes(*value)).collect(),
                ))
            }
            Column::Words(bytes, names) => {
                let (codes, _) = bytes.as_chunks();
                let codes = codes.iter().map(|code| i64::from_ne_bytes(*code));
                let label =
                    |code: i64| usize::try_from(code).ok().filter(|label| *label < names.len());
                let of_row: Option<Vec<usize>> = codes.map(label).collect();
                let of_row =
                    of_row.ok_or_else(|| of_argument(name, "a code without a word".to_owned()))?;
                Ok(ColumnValues::Words(Labels { names, of_row }))
            }
        }
    }
}

impl Data {
    pub fn read(input: Input, problem: &flexcal::problem::Problem) -> Result<Self, InputError> {
        let (data, warnings) = match input {
            Input::Files(files) => Dataset::read_files(&files, problem)?,
            Input::Columns(table) => Dataset::read_columns(table, problem)?,
        };
        Ok(Self { data: Arc::new(data), warnings: texts(&warnings) })
    }
}

impl Poses {
    pub fn read(input: Input, problem: &flexcal::problem::Problem) -> Result<Self, InputError> {
        let (rows, warnings) = match input {
            Input::Files(files) => Measurements::read_poses(&files, problem)?,
            Input::Columns(table) => Measurements::read_pose_columns(table, problem)?,
        };
        Ok(Self { rows: Arc::new(rows), warnings: texts(&warnings) })
    }
}

fn texts(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(ToString::to_string).collect()
}

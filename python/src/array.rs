//! Arrays on their way to numpy, which views their bytes: row after row.

use flexcal::nalgebra::{DMatrix, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

/// The bytes of an array.
pub type Array<'py> = Bound<'py, PyByteArray>;

/// 64-bit numbers.
pub fn numbers(py: Python<'_>, values: impl Iterator<Item = f64>) -> Array<'_> {
    PyByteArray::new(py, &values.flat_map(f64::to_ne_bytes).collect::<Vec<u8>>())
}

/// 64-bit integers.
pub fn integers(py: Python<'_>, values: impl Iterator<Item = usize>) -> Array<'_> {
    PyByteArray::new(
        py,
        &values.flat_map(|value| (value as u64).to_ne_bytes()).collect::<Vec<u8>>(),
    )
}

/// Rows of three coordinates, shape = (rows, 3).
pub fn points<'py>(py: Python<'py>, points: &[Vector3<f64>]) -> Array<'py> {
    numbers(py, points.iter().flat_map(|point| [point.x, point.y, point.z]))
}

/// Matrices of one shape one after the other, shape = (matrices, rows, columns).
pub fn derivatives<'py>(py: Python<'py>, all: &[DMatrix<f64>]) -> Array<'py> {
    numbers(
        py,
        all.iter().flat_map(|matrix| {
            matrix.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>())
        }),
    )
}

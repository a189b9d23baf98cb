//! What a fit leaves, as the columns of a table.

use flexcal::identify::Residual;
use flexcal::measurement::{Dataset, Labels};
use flexcal::nalgebra::{UnitQuaternion, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{integers, numbers};

/// The columns of residuals.csv, in their order: numbers, or codes and words.
pub fn table<'py>(py: Python<'py>, data: &Dataset, residuals: &[Residual]) -> PyResult<Bound<'py, PyDict>> {
    let rows = &data.measurements;
    let columns = PyDict::new(py);
    let words = |of_row: &mut dyn Iterator<Item = usize>, names: Vec<String>| (integers(py, of_row), names);
    let labels = |labels: &Labels| words(&mut labels.of_row.iter().copied(), labels.names.clone());
    let files = rows.files.iter().map(|file| file.display().to_string()).collect();
    columns.set_item("file", words(&mut rows.origin.iter().map(|&(file, _)| file as usize), files))?;
    columns.set_item("line", integers(py, rows.origin.iter().map(|&(_, line)| line as usize)))?;
    if let Some(pose) = &rows.pose {
        columns.set_item("pose", numbers(py, pose.iter().copied()))?;
    }
    if rows.session.names.iter().any(|name| !name.is_empty()) {
        columns.set_item("session", labels(&rows.session))?;
    }
    if let Some(target) = &rows.target {
        columns.set_item("target", labels(target))?;
    }
    let vectors = |name: &str, unit: &str, of: &dyn Fn(&Residual) -> Vector3<f64>| {
        let values: Vec<Vector3<f64>> = residuals.iter().map(of).collect();
        let axes = [("x", 0), ("y", 1), ("z", 2)];
        axes.into_iter().try_for_each(|(axis, k)| {
            let values = values.iter().map(|value| value.as_slice().get(k).copied().unwrap_or(f64::NAN));
            columns.set_item(format!("{name}{axis}_{unit}"), numbers(py, values))
        })
    };
    let measured = |own: &Residual| rows.positions.get(own.row).copied().unwrap_or_default();
    let turn = |own: &Residual| own.orientation.unwrap_or_default();
    let predicted_turn = |own: &Residual| {
        let measured = rows.orientations.as_ref().and_then(|all| all.get(own.row)).copied().unwrap_or_default();
        (UnitQuaternion::from_scaled_axis(-turn(own)) * measured).scaled_axis().map(f64::to_degrees)
    };
    let turned = residuals.iter().any(|own| own.orientation.is_some());
    vectors("predicted_", "mm", &|own| 1e3 * (measured(own) - own.position))?;
    if turned {
        vectors("predicted_r", "deg", &predicted_turn)?;
    }
    vectors("residual_", "mm", &|own| 1e3 * own.position)?;
    if turned {
        vectors("residual_r", "deg", &|own| turn(own).map(f64::to_degrees))?;
    }
    columns.set_item("whitened", numbers(py, residuals.iter().map(Residual::length)))?;
    columns.set_item("outlier", integers(py, residuals.iter().map(|own| usize::from(own.outlier))))?;
    columns.set_item("held_out", integers(py, residuals.iter().map(|own| usize::from(own.held_out))))?;
    Ok(columns)
}

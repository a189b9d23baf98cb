//! Residuals and their Jacobian by parameters, for solvers of Python.

use std::sync::Arc;

use flexcal::fit::{ResidualFunction, ResidualOrigin};
use flexcal::measurement::Dataset;
use flexcal::model::parameter::Parameter;
use flexcal::nalgebra::DVector;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;

use crate::array::{Array, numbers};
use crate::error::of_argument;
use crate::pool::detached;

/// Whitened residuals of the fitted rows as a function of the unknowns.
#[pyclass(frozen, module = "flexcal._core")]
pub struct LeastSquares {
    pub data: Arc<Dataset>,
    pub function: ResidualFunction,
}

/// Name, unit of the value, nominal value \[SI\], unit of x; start, 1 σ of the prior, lower and
/// upper bound of x.
type Unknown = (String, String, f64, String, f64, Option<f64>, f64, f64);

#[pymethods]
impl LeastSquares {
    /// Returns the unknowns, in the order of x.
    fn unknowns(&self) -> Vec<Unknown> {
        let start = self.function.start();
        let unknown = |(parameter, start): (&Parameter, &f64)| {
            let unit = parameter.unit();
            let of_x = if unit.is_relative() { "1".into() } else { unit.symbol().into_owned() };
            let Parameter { name, nominal, sigma, lower, upper, .. } = parameter;
            (
                name.clone(),
                unit.symbol().into_owned(),
                *nominal,
                of_x,
                *start,
                *sigma,
                *lower,
                *upper,
            )
        };
        self.function.parameters().zip(start.iter()).map(unknown).collect()
    }

    /// Returns for each residual the row of the data, from 0, or `None` for a prior; and the name
    /// of the number or of the parameter.
    fn origins(&self) -> Vec<(Option<usize>, String)> {
        let names: Vec<&String> = self.function.parameters().map(|known| &known.name).collect();
        let name = |origin| match origin {
            ResidualOrigin::Measured { row, coordinate } => {
                let (_, axes) = self.data.measurements.observation(row).description().residuals;
                let turns = ["rx", "ry", "rz"];
                let turn = || turns.get(coordinate.checked_sub(turns.len())?);
                let component = axes.get(coordinate).or_else(turn).copied().unwrap_or_default();
                (Some(row), component.to_owned())
            }
            ResidualOrigin::Prior(unknown) => {
                (None, names.get(unknown).map_or_else(String::new, |name| (*name).clone()))
            }
        };
        self.function.origins().into_iter().map(name).collect()
    }

    /// Returns r(x), shape = (residuals).
    fn residuals<'py>(&self, py: Python<'py>, x: PyBackedBytes) -> PyResult<Array<'py>> {
        let x = self.vector(&x)?;
        let found = detached(py, || self.function.residuals(&x))?;
        Ok(numbers(py, found.iter().copied()))
    }

    /// Returns ∂r/∂x, shape = (residuals, unknowns).
    fn jacobian<'py>(&self, py: Python<'py>, x: PyBackedBytes) -> PyResult<Array<'py>> {
        let x = self.vector(&x)?;
        let found = detached(py, || self.function.jacobian(&x).transpose())?;
        Ok(numbers(py, found.iter().copied()))
    }

    /// Returns the values of the parameters at x, SI.
    fn values<'py>(&self, py: Python<'py>, x: PyBackedBytes) -> PyResult<Array<'py>> {
        let x = self.vector(&x)?;
        let pairs = self.function.parameters().zip(x.iter());
        Ok(numbers(py, pairs.map(|(parameter, x)| parameter.value(*x))))
    }

    /// Returns x at which the parameters have these values, SI.
    fn deviations<'py>(&self, py: Python<'py>, values: PyBackedBytes) -> PyResult<Array<'py>> {
        let values = self.vector(&values)?;
        let pairs = self.function.parameters().zip(values.iter());
        Ok(numbers(py, pairs.map(|(parameter, value)| parameter.deviation(*value))))
    }
}

impl LeastSquares {
    fn vector(&self, bytes: &[u8]) -> PyResult<DVector<f64>> {
        let (values, _) = bytes.as_chunks();
        let unknowns = self.function.parameters().count();
        if values.len() != unknowns {
            let message = format!("x: {} values for {unknowns} unknowns", values.len());
            return Err(of_argument("x", message));
        }
        let values = values.iter().map(|value| f64::from_ne_bytes(*value));
        Ok(DVector::from_iterator(unknowns, values))
    }
}

//! flexcal in Python: the extension module `flexcal._core` behind the package `flexcal`.
//!
//! It passes arrays and words through; what Python users see (tables, documentation, types) is
//! written in Python.

mod array;
mod comparison;
mod compensation;
mod data;
mod design;
mod error;
mod least_squares;
mod life;
mod outcome;
mod pool;
mod problem;
mod residuals;
mod simulation;
mod supervise;
mod urdf;

use std::ffi::OsString;

use pyo3::prelude::*;

/// The module.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::command_line;
    #[pymodule_export]
    use super::comparison::Comparison;
    #[pymodule_export]
    use super::compensation::Compensation;
    #[pymodule_export]
    use super::data::{Data, Poses};
    #[pymodule_export]
    use super::design::{Check, Next, Plan, check, next, plan};
    #[pymodule_export]
    use super::least_squares::LeastSquares;
    #[pymodule_export]
    use super::life::fleet;
    #[pymodule_export]
    use super::outcome::{ClosedLoop, Identification, Trace};
    #[pymodule_export]
    use super::problem::Problem;
    #[pymodule_export]
    use super::simulation::{Simulation, Study, simulated, studied};
    #[pymodule_export]
    use super::urdf::Export;
}

/// Runs the command line: the program's name and its arguments; the exit status.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<u8> {
    pool::detached(py, || flexcal::cli::run(arguments))
}

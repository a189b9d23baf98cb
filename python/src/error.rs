//! Errors as Python raises them.

use std::error::Error;

use flexcal::error::{message_with_causes, mistake};
use pyo3::PyErr;

/// The classes of Python.
mod python {
    pyo3::import_exception!(flexcal.errors, InputError);
}

/// What every mistake in the input is raised as: the message, and where it is known file, line and
/// key.
pub fn raised(error: &(dyn Error + 'static)) -> PyErr {
    let (file, line, key) = match mistake(error) {
        Some(input) => {
            (Some(input.location.file.clone()), input.location.line, input.location.key.clone())
        }
        None => (None, None, None),
    };
    python::InputError::new_err((message_with_causes(error), file, line, key))
}

/// A mistake in an argument.
pub fn of_argument(argument: &str, message: String) -> PyErr {
    python::InputError::new_err((message, None::<String>, None::<usize>, Some(argument.to_owned())))
}

//! Errors as Python raises them.

use std::error::Error;

use flexcal::design::DesignError;
use flexcal::error::{InputError, Location};
use flexcal::identify::IdentifyError;
use pyo3::PyErr;

/// The classes of Python.
mod python {
    pyo3::import_exception!(flexcal.errors, InputError);
}

/// What every mistake in the input is raised as: the message, and where it is known file, line and key.
pub fn raised(error: &(dyn Error + 'static)) -> PyErr {
    let (file, line, key) = match location(error) {
        Some(place) => (Some(place.file.clone()), place.line, place.key.clone()),
        None => (None, None, None),
    };
    python::InputError::new_err((with_causes(error), file, line, key))
}

/// A mistake in an argument.
pub fn of_argument(argument: &str, message: String) -> PyErr {
    python::InputError::new_err((message, None::<String>, None::<usize>, Some(argument.to_owned())))
}

fn location<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a Location> {
    let input = error
        .downcast_ref::<InputError>()
        .or(match error.downcast_ref() {
            Some(IdentifyError::Input(input)) => Some(input),
            _ => None,
        })
        .or(match error.downcast_ref() {
            Some(DesignError::Input(input)) => Some(input),
            _ => None,
        });
    match error.downcast_ref() {
        Some(DesignError::NoRange { location, .. }) => Some(location),
        _ => input.map(|input| &*input.location),
    }
}

fn with_causes(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(next) = cause {
        let next_text = next.to_string();
        if !text.contains(&next_text) {
            text = format!("{text}: {next_text}");
        }
        cause = next.source();
    }
    text
}

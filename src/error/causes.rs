//! Causes of an error.

use std::error::Error;
use std::iter::successors;

use super::InputError;

/// Iterates over an error and its causes, nearest cause first.
fn error_chain<'a>(
    error: &'a (dyn Error + 'static),
) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    successors(Some(error), |&error| error.source())
}

/// Returns the [`InputError`] that caused an error, if there is one.
pub fn mistake<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a InputError> {
    error_chain(error).find_map(|error| error.downcast_ref())
}

/// Returns the message of an error, followed by each cause that the message does not already
/// contain.
pub fn message_with_causes(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    for cause in error_chain(error).skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

//! What an error comes of.

use std::error::Error;
use std::iter::successors;

use super::InputError;

/// An error and what it comes of, the nearest cause first.
fn chain<'a>(error: &'a (dyn Error + 'static)) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    successors(Some(error), |&error| error.source())
}

/// The mistake in the input that an error is or comes of, with its place.
pub fn mistake<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a InputError> {
    chain(error).find_map(|error| error.downcast_ref())
}

/// The message of an error, and of each of its causes what is not said before.
pub fn with_causes(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    for cause in chain(error).skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

//! What is read and written: mistakes in the input, dialects, formats, files, limits, names.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod bad_input;
mod dialects;
mod files;
mod formats;
mod limits;
mod names;

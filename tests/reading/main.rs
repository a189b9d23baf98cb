//! Reading and writing: input errors, dialects, formats, files, limits, names.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod dialects;
mod doubtful;
mod exchange;
mod files;
mod first_hour;
mod formats;
mod joined;
mod limits;
mod names;
mod sheet;
mod stops;

//! Mistakes in the input: each message names file, line and key; `tests/fuzz` has those changed at random.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that fails may panic")]

#[path = "bad_input/files.rs"]
mod files;
#[path = "bad_input/reading.rs"]
mod reading;
#[path = "bad_input/sections.rs"]
mod sections;
#[path = "bad_input/tables.rs"]
mod tables;

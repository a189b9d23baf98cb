//! Input errors: each message names file, line and key; `tests/fuzz` has random mutations.

#![expect(clippy::expect_used, reason = "a test that fails may panic")]

mod files;
mod reading;
mod sections;
mod tables;

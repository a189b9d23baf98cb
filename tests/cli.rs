//! Tests of the command line.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

#[path = "cli/bounds.rs"]
mod bounds;
#[path = "cli/compensate.rs"]
mod compensate;
#[path = "cli/example.rs"]
mod example;
#[path = "cli/gross.rs"]
mod gross;
#[path = "cli/input.rs"]
mod input;
#[cfg(target_os = "linux")]
#[path = "cli/interrupt.rs"]
mod interrupt;
#[path = "cli/mistaken.rs"]
mod mistaken;
#[path = "cli/printed.rs"]
mod printed;
#[path = "cli/results.rs"]
mod results;
#[path = "cli/strategies.rs"]
mod strategies;
#[path = "cli/two_tables.rs"]
mod two_tables;

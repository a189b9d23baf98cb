//! Randomly mutated inputs for readers and commands.
//!
//! `targets` gives each reader of the library mutations of the files in `tests/corpus`, `commands`
//! runs the program. Both have a short run here; the long one is
//!
//!     FLEXCAL_MUTATIONS=50000 cargo test --test fuzz -- --ignored --nocapture
//!
//! Input k depends on k only: `FLEXCAL_MUTATIONS_FROM=k` starts there. Failed inputs are kept and
//! their location is printed.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stderr, clippy::print_stdout, reason = "a long run says how far it is")]

mod arms;
mod commands;
mod mutation;
mod readers;
mod run;
mod targets;

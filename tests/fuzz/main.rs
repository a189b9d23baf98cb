//! Inputs changed at random: readers and commands stand them all.
//!
//! `targets` feeds each reader of the library with mutations of the files in `tests/corpus`,
//! `commands` runs the program itself. Both make a short run here; the long one is
//!
//!     FLEXCAL_MUTATIONS=50000 cargo test --test fuzz -- --ignored --nocapture
//!
//! Input k is made from k alone: `FLEXCAL_MUTATIONS_FROM=k` begins there. What fails is kept and
//! said where.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stderr, clippy::print_stdout, reason = "a long run says how far it is")]

mod arms;
mod commands;
mod mutation;
mod run;
mod targets;

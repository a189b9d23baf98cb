//! Whole problems with tables, made from a number, and an oracle that knows what is true of them.
//!
//! Case k depends on k alone. The long run is
//!
//!     FLEXCAL_STRUCTURED=100000 cargo test --release --test structured -- --ignored --nocapture
//!
//! `FLEXCAL_STRUCTURED_FROM=k` starts at case k. The files of a case that disagrees are kept and
//! their place is printed.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stderr, clippy::print_stdout, reason = "a long run says how far it is")]

mod arm;
mod case;
mod checks;
mod commands;
mod dialect;
mod draw;
mod effect;
mod elastic;
mod exports;
mod fitted;
mod freedom;
mod geometry;
mod mistakes;
mod noise;
mod program;
mod repeats;
mod row;
mod run;
mod setup;
mod sight;
mod table;
mod world;

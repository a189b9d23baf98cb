//! Residual tests: no false alarms on noise, and detection of structure.
//!
//! `cargo test --release --test loop checks -- --ignored --nocapture` prints rates over many more
//! problems, and times.

#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

mod alarms;
mod edges;
mod linear;
mod outliers;
mod structure;

//! Checks of what a fit leaves: no false alarms on noise, and structure found and named.
//!
//! `cargo test --release --test checks -- --ignored --nocapture` prints rates over many more problems, and times.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

#[path = "checks/alarms.rs"]
mod alarms;
#[path = "checks/edges.rs"]
mod edges;
#[path = "checks/linear.rs"]
mod linear;
#[path = "checks/outliers.rs"]
mod outliers;
#[path = "checks/structure.rs"]
mod structure;

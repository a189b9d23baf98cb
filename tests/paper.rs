//! Closed forms of the paper on the lunar sampler: each group of equations, each misprint, and the
//! iteration.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that fails may panic; sizes are shown"
)]

mod common;

#[path = "paper/arm.rs"]
mod arm;
#[path = "paper/elastic.rs"]
mod elastic;
#[path = "paper/fingerprint.rs"]
mod fingerprint;
#[path = "paper/geometry.rs"]
mod geometry;
#[path = "paper/identification.rs"]
mod identification;
#[path = "paper/iteration.rs"]
mod iteration;
#[path = "paper/misprints.rs"]
mod misprints;

//! Results of fits, their reported accuracy, and warnings on implausible data.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

#[path = "../common/mod.rs"]
mod common;

mod auto_solver;
mod blind;
mod constraints;
mod coverage;
mod dataset;
mod doubted;
mod face;
mod findings;
mod held;
mod identified;
mod judged;
mod masses;
mod misread;
mod mistaken_rows;
mod orientation;
mod recovery;
mod remainder;
mod robust;
mod runaway;
mod second_solution;
mod sigma;
mod told;
mod tolerance;
mod tree;
mod trust;
mod trusted;

//! What a fit's residual says about effects that the model lacks, and the loop that adds them.

mod candidates;
mod checks;
mod closing;
mod data;
mod fitted;
mod trace;

pub use checks::{Check, Driver, Findings, Outcome, Remainder, Sequence, Test, Untestable, check};
pub use closing::{Closure, Found, Verdict, close};

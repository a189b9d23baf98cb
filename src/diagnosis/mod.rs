//! What a fit's residual says about effects that the model lacks.

mod checks;

pub use checks::{Check, Driver, Findings, Outcome, Remainder, Sequence, Test, Untestable, check};

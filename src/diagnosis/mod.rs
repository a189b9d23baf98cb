//! What a fit's residual says about effects that the model lacks, and the loop that adds them.
//!
//! - [`checks`]: whether structure is left at all.
//! - `trace`: every candidate of the catalogue scored in the linear neighbourhood of a fit; [`trace()`] ranks them.
//! - `closing`: rounds of fit, trace, add, test again; [`close`] tells the whole story.
//! - `unexplained`: structure that no effect explains, its place, and a correction without a cause.

mod apart;
mod candidates;
mod checks;
mod closing;
mod data;
mod fitted;
mod generic;
mod trace;
mod tracing;
mod unexplained;

pub use apart::Apart;
pub use checks::{Check, Driver, Findings, Outcome, Remainder, Sequence, Test, Untestable, check};
pub use closing::{Closure, Found, Interval, Step, Verdict, WAVES, close};
pub use tracing::{Ranked, Trace, trace};
pub use unexplained::{Correction, Unexplained};

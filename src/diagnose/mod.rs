//! What a fit's residual says about effects that the model lacks, and the loop that adds them.
//!
//! - [`check`]: whether structure is left at all.
//! - `trace`: every candidate of the catalogue scored in the linear neighbourhood of a fit; [`trace()`] ranks them.
//! - [`detectable`]: the same scan before anything is measured: from what size on it would find each effect.
//! - `closing`: rounds of fit, trace, add, test again; [`close`] tells the whole story.
//! - `unexplained`: structure that no effect explains, its place, and a correction without a cause.

mod apart;
mod candidates;
mod data;
mod detection;
mod fitted;
mod generic;
mod neighbourhood;
mod power;
mod residual_tests;
mod selection;
mod separation;
mod tracing;
mod unexplained;

pub use apart::Apart;
pub use candidates::{HELD_FIXED, REFUSED};
pub use detection::{Detectable, Detection, Size, detectable};
pub use residual_tests::{Check, Driver, Findings, Outcome, Remainder, Sequence, Test, Untestable, check};
pub use selection::{Closure, Found, Interval, Step, Verdict, WAVES, close};
pub use separation::{Separation, Side, separation};
pub use tracing::{Ranked, Trace, examine, trace};
pub use unexplained::{Correction, Unexplained};

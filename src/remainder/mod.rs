//! Remainder: what no law explains, as Gaussian processes at the joints, and the uncertainty of
//! predictions.
//!
//! [`fit`] conditions the processes on the rows of an identification, beside its parameters, and
//! keeps them if configurations left out gain. A [`Correction`] is what comes of it: it is saved as
//! `remainder.json`, and [`predict`] and [`compensate`] apply it to other poses.

mod apply;
mod blocks;
mod bounds;
mod correction;
mod fit;
mod kernel;
mod likelihood;
mod linearise;
mod posterior;
mod prior;
mod residuals;
mod rows;
mod saved;
mod scores;
mod search;
#[cfg(test)]
mod tests;

pub use apply::{CorrectedPrediction, compensate, predict};
pub use bounds::Bounds;
pub use correction::{CorrectedPose, Correction};
pub use fit::{Fitted, fit, uncertainty};
pub use residuals::{CorrectedResiduals, residuals};
pub use saved::SavedRemainderError;
pub use scores::{Gain, Scores};

//! What to fit, in which order, and what came of it.

mod active;
mod baseline;
mod compare;
mod compensate;
mod constraints;
mod covariance;
mod errors;
mod fitting;
mod identification;
mod outcome;
mod outliers;
mod placement;
mod predict;
mod progress;
mod quality;
mod registration;
mod solver_choice;
mod stage;
mod statistics;
mod strategy;

pub use active::ActiveConstraint;
pub use baseline::Baseline;
pub use compare::{Comparison, compare};
pub use compensate::{Command, compensate};
pub use covariance::{Correlations, Covariance};
pub use errors::{AxisValues, ErrorSummary, Errors};
pub use identification::{IdentifyError, Options, identify, identify_model};
pub use outcome::{Estimate, Identification, Noise, STRONG_CORRELATION};
pub use outliers::Outlier;
pub use placement::Placement;
pub use predict::Residual;
pub use progress::{Progress, ProgressSink};
pub use quality::{QualityFlag, TooFewPoses};
pub use solver_choice::SolverChoice;
pub use stage::StageError;
pub use strategy::Strategy;

//! Data of the figures of reports: errors of each pose, partial residuals of effects, contributions
//! and coverage.

mod arm;
mod cause;
mod contribution;
mod coverage;
mod data;
mod pose;
mod script;
mod uncertainty;

pub use cause::{Cause, Point, Quantity};
pub use contribution::Contribution;
pub(crate) use data::procedure_stages;
pub use data::{PlotData, Stage, StageErrors};
pub use pose::PoseError;
pub(crate) use pose::sample;
pub(crate) use script::ScriptData;
pub(crate) use uncertainty::BoundAt;

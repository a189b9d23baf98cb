//! Results as tables: columns and CSV files that other programs read.

mod columns;
mod commanded;
mod poses;
mod predictions;
mod study;

pub use columns::{Column, residual_columns, residuals_csv};
pub use commanded::CommandedJoint;
pub(crate) use commanded::commanded_joints;
pub(crate) use poses::pose_columns;
pub use poses::poses_csv;
pub use predictions::{commands_csv, predictions_csv};
pub use study::{study_csv, study_parameters_csv, study_timing_csv};

//! Application of an identified arm: predictions with their covariance, compensated commands,
//! acceptance test, and saved estimates.

pub(super) mod acceptance;
pub(super) mod command_jacobian;
pub(super) mod compensate;
pub(super) mod joint_source;
pub(super) mod missing_loads;
mod nearest_command;
pub(super) mod predict;
pub(super) mod predict_saved;
pub(super) mod predicted_covariance;
mod saved_document;
pub(super) mod saved_estimate;
pub(super) mod saved_estimate_error;
mod saved_posterior;
pub(super) mod tolerance;

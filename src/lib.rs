//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.

pub mod arm;
pub mod error;
pub mod fit;
pub mod measurement;
pub mod model;
pub mod paper;
pub mod parameter;
pub mod problem;
pub mod report;
pub mod rig;
pub mod scalar;
pub mod solver;
pub mod spatial;
pub mod study;
mod units;

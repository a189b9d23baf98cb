//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.

pub mod error;
pub mod fit;
pub mod measurement;
pub mod problem;

mod units;

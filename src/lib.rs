//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.

pub mod fit;
pub mod solver;

//! Frames and rotations in three dimensions, generic over the scalar and differentiable everywhere they are used.

mod frame;
mod placement;
mod rotation;

pub use frame::Frame;
pub use rotation::{logarithm_slope, rotate, rotation_axes, turn_between, turn_x, turn_y, turn_z};

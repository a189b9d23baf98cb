//! Frames and rotations in three dimensions, generic over the scalar and differentiable everywhere
//! they are used.

mod frame;
mod placement;
mod plane;
mod rotation;

pub use frame::Frame;
pub use plane::{TOLD_BY_OPPOSITE, plane_normal};
pub use rotation::{logarithm_slope, rotate, rotation_axes, turn_between, turn_x, turn_y, turn_z};

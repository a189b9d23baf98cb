//! Frames and rotations in three dimensions, generic over the scalar and differentiable everywhere they are used.

mod frame;
mod motion;
mod rotation;

pub use frame::Frame;
pub use motion::Motion;
pub use rotation::{rotate, rotation_axes};

//! Frames and rotations in three dimensions; most functions also accept dual numbers.

mod frame;
mod placement;
mod plane;
mod rotation;

pub use frame::Frame;
pub(crate) use plane::MAX_NORMAL_TILT;
pub use plane::plane_normal;
pub(crate) use rotation::{
    inverse_right_jacobian, rotate, rotated_about_x, rotated_about_y, rotated_about_z,
    rotation_axes, rotation_between,
};

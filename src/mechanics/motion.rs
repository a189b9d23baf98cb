//! Small motions of a joint's frame: before the joint's rotation, and behind it.

/// Number of scalars of a motion: translation x, y, z \[m\], then rotation vector x, y, z \[rad\].
pub(crate) const MOTION_LEN: usize = 6;
/// Index of the first scalar of the motion before the joint's rotation, and of the motion behind
/// it.
pub(crate) const MOTION_STARTS: [usize; 2] = [0, MOTION_LEN];

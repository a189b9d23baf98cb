//! Small motions of a joint's frame: before the joint turns, and behind it.

/// Numbers of a motion: translation x, y, z \[m\], then rotation vector x, y, z \[rad\].
pub(crate) const MOTION: usize = 6;
/// First number of the motion before the joint turns, and of the one behind it.
pub(crate) const SIDES: [usize; 2] = [0, MOTION];

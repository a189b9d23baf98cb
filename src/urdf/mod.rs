//! Import of arms from URDF and export of identified origins to the same file.
//!
//! A URDF joint is a fixed transform, its origin, followed by a motion about or along any axis. The
//! transform between two axes is converted to our five joint parameters where possible, which is
//! always so except at the ends of the chain. The frames of a URDF and of its problem therefore
//! differ by a rotation about and a shift along each joint's axis, called the gauge of that axis.

mod chain;
mod describe;
mod export;
mod free;
mod lines;
mod notes;
mod number;
mod read;
mod universal_robots;
mod weights;
mod yaml;

pub use chain::Chain;
pub use describe::{Description, HELD_OUT, SIGMA_MM, describe};
pub use export::{Export, MovedOrigin, export};
pub use read::Robot;
pub use yaml::{JointOrigin, YamlFormat, joint_origins, yaml};

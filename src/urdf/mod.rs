//! Arms from URDF, and back: a chain of its joints as a problem, and identified origins written
//! into the same file.
//!
//! A URDF joint is a fixed transform, its origin, and then a turn about or a slide along any axis.
//! What lies between two axes is told in the five numbers of our joints where that is possible
//! (always but at both ends of the chain), so that the frames of a URDF and of its problem differ
//! by a turn about and a shift along each joint's axis: its gauge.

mod chain;
mod describe;
mod export;
mod free;
mod lines;
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

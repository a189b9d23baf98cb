//! Physics of the arm, generic over the scalar: frames, elastic links and joints, static
//! equilibrium.

mod adjoint;
mod anderson;
mod arm;
mod beam;
mod centre_line;
mod compensator;
mod element;
mod forward;
mod frames;
mod imperfection;
mod joint;
mod linearise;
mod link;
mod segment;
mod sensitivity;

mod linearised_arm;
mod statics;
mod workspace;

pub use arm::Arm;
pub use beam::{Cantilever, Deflection, Flexibility, Wrench};
pub use centre_line::CentreLine;
pub use compensator::Compensator;
pub use imperfection::{AddedMass, HoistError, Nonlinear, Strain};
pub use joint::{Angle, Coordinates, Joint, Placement};
pub use link::{Beam, Hoist, PointMass};
pub use segment::Segment;
pub use sensitivity::Sensitivity;
pub use statics::{AdjointSolver, StaticState, StaticsError, Workspace};

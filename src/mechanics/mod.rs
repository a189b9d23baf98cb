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
mod moments;
mod motion;
mod segment;
mod sensitivity;

mod linearised_arm;
mod statics;
mod workspace;

pub use arm::Arm;
pub use beam::Flexibility;
pub(crate) use beam::{Cantilever, Deflection, Wrench};
pub(crate) use centre_line::CentreLine;
pub use compensator::Compensator;
pub(crate) use imperfection::{AddedMass, HoistError, Nonlinear, Strain};
pub(crate) use joint::Coordinates;
pub use joint::{Angle, Joint, Placement};
pub use link::{Beam, Hoist, PointMass};
pub(crate) use moments::AxisMoments;
pub(crate) use motion::{MOTION_LEN, MOTION_STARTS};
pub(crate) use segment::Segment;
pub use sensitivity::Sensitivity;
pub(crate) use statics::AdjointSolver;
pub use statics::{StaticState, StaticsError, Workspace};

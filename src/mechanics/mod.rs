//! The arm's physics, generic over the scalar: frames, elastic links and joints, static
//! equilibrium.

mod adjoint;
mod anderson;
mod arm;
mod beam;
mod compensator;
mod element;
mod forward;
mod frames;
mod imperfection;
mod joint;
mod link;
mod record;
mod segment;
mod sensitivity;
mod shape;
mod statics;
mod tape;
mod workspace;

pub use arm::Arm;
pub use beam::{Cantilever, Deflection, Flexibility, Wrench};
pub use compensator::Compensator;
pub use imperfection::{AddedMass, Nonlinear, Rope, Strain};
pub use joint::{Angle, Coordinates, Joint, Placement};
pub use link::{Beam, Hoist, PointMass};
pub use segment::Segment;
pub use sensitivity::Sensitivity;
pub use shape::Shape;
pub use statics::{Equilibrated, Response, StaticsError, Workspace};

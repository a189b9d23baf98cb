//! The arm's physics, generic over the scalar: frames, elastic links and joints, static equilibrium.

mod beam;
mod element;
mod imperfection;
mod link;
mod place;
mod statics;

pub use beam::{Cantilever, Deflection, Flexibility, Wrench};
pub use imperfection::{AddedMass, Nonlinear, Rope, Strain, Thermal};
pub use link::{Angle, Arm, Beam, Hoist, Joint, PointMass, Setup};
pub use statics::{Equilibrated, Response, StaticsError, Workspace};

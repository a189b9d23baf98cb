//! The arm's physics, generic over the scalar: frames, elastic links and joints, static equilibrium.

mod anderson;
mod apart;
mod beam;
mod element;
mod imperfection;
mod joint;
mod link;
mod place;
mod sensitivity;
mod statics;
mod trail;
mod virtual_work;
mod workspace;

pub use apart::Part;
pub use beam::{Cantilever, Deflection, Flexibility, Wrench};
pub use imperfection::{AddedMass, Nonlinear, Rope, Strain, Thermal};
pub use joint::{Angle, Coordinates, Joint};
pub use link::{Arm, Beam, Hoist, PointMass};
pub use sensitivity::Sensitivity;
pub use statics::{Equilibrated, Response, StaticsError, Workspace};

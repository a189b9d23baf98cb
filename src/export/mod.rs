//! Export of an identified arm: C code that predicts poses and corrects commands, and tables of its
//! best rigid geometry.
//!
//! Hand-written C templates (`c/`) contain the physics and follow [`crate::mechanics`],
//! [`crate::model`] and [`crate::remainder`] equation by equation. Tables and formulas of laws are
//! generated. The exported test program compares the C code with this library.

mod answers;
mod camera;
mod error;
mod formula;
mod geometries;
mod numbers;
mod remainder;
mod rigid;
mod source;
mod standard;

pub use answers::{Answers, answers};
#[doc(hidden)]
pub use camera::{CameraFormat, camera_yaml};
pub use error::ExportError;
pub use geometries::{Geometry, GeometryChoice};
pub use rigid::RigidFit;
pub use source::{Sources, sources};
pub use standard::StandardTable;
pub use standard::modified_dh;

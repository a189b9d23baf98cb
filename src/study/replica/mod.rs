//! Replicas of the experiment of \[Chen2021\] with known truth: the cost of each misprint, and
//! possible causes of the reported 2.14 mm.
//!
//! A [`MisprintStudy`] (`MISPRINTS.toml`, see `docs/paper.md`) draws specimens of the arm on the
//! virtual test rig. The flexibility of a specimen is scaled until the rigid fit leaves the error
//! that the paper reports for it. Each specimen is identified by the procedure of the paper in
//! every reading and with every source of stiffness, with every [`AlternativeModel`], and by the
//! joint fit. Errors at held-out poses are compared.

mod alternative;
mod fit;
mod read;
mod reading;
mod results;
mod run;
mod simulated_arm;
mod study;

pub use alternative::AlternativeModel;
pub use reading::NamedReading;
pub use results::{HeldOutError, Replica, ReplicaResults, Spread};
pub use run::replicate;
pub use study::{Case, MisprintStudy};

//! Replicas of the paper's experiment whose truth is known: what each misprint costs, and what may
//! explain its 2.14 mm.
//!
//! A [`MisprintStudy`] (`MISPRINTS.toml`, see `docs/paper.md`) draws specimens of the arm on the
//! virtual test rig, as elastic as the paper's: their flexibility is scaled until the rigid fit
//! leaves what the paper's left. Each is identified by the paper's procedure in every reading and
//! with every first stage, by arms that it might have been taken for ([`AlternativeModel`]), and by
//! the joint fit; held-out poses judge.

mod alternative;
mod fit;
mod measured_pose;
mod read;
mod reading;
mod results;
mod run;
mod simulated_arm;
mod size;
mod study;

pub use alternative::AlternativeModel;
pub use fit::ReplicaError;
pub use reading::{NamedReading, readings};
pub use results::{Left, Replica, ReplicaResults, Spread};
pub use run::replicate;
pub use study::{Case, Load, MisprintStudy};

//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.
//!
//! A problem declares an arm, what is free in it, and measured poses. A fit estimates the free
//! parameters with their uncertainty; a search names the effects that the model lacks.
//!
//! # Entry points
//!
//! | task | call | result |
//! |---|---|---|
//! | declare an arm, from a file or from text | [`problem::Problem::read`], [`problem::Problem::parse`] | [`problem::Problem`] |
//! | read poses, or take them from arrays | [`measurement::Dataset::read`], [`measurement::Dataset::builder`] | [`measurement::Dataset`] |
//! | fit the free parameters | [`fit::identify`] | [`fit::Identification`] |
//! | rank effects that the residual points to | [`select::trace`] | [`select::Trace`] |
//! | find effects and add them to the model | [`select::close`] | [`select::ClosedLoop`] |
//! | predict positions, with covariance | [`fit::Identification::predict_with_covariance`] | [`fit::PredictedPosition`] |
//! | correct commands | [`fit::compensate`] | [`fit::Command`] |
//! | fit smooth errors that no law explains | [`remainder::fit`] | [`remainder::Correction`] |
//! | choose poses to measure, judge given ones | [`design::plan`], [`design::check`] | [`design::Plan`], [`design::Check`] |
//! | simulate measurements with known truth | [`rig::simulate`] | [`rig::Simulation`] |
//! | read and write URDF | [`urdf::describe`], [`urdf::export`] | [`urdf::Description`], [`urdf::Export`] |
//! | write results as JSON | [`results::Document::to_json`] | documented in `docs/results.md` |
//! | write text and HTML reports with figures | [`report`] | [`report::Report`] |
//!
//! The caller may supply a law ([`problem::Problem::effect`]) and a solver ([`fit::CustomSolver`]).
//! `examples/custom.rs` does both in 40 lines. Quantities are in SI units: m, rad, kg, N, s.
//!
//! Modules that this page does not list are public for the tests, the benches and the Python module
//! of this repository. They may change in every release.
//!
//! # Example
//!
//! ```
//! use std::path::Path;
//!
//! use flexcal::select::{Verdict, close};
//! use flexcal::measurement::Dataset;
//! use flexcal::problem::Problem;
//! use flexcal::fit::{Options, identify};
//!
//! // The arm as declared, and the poses: 28 to identify, 50 held out.
//! let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
//! let (data, _warnings) = Dataset::read(&problem)?;
//!
//! // Fit what is free. Held-out poses only judge.
//! let found = identify(&problem, &data, &Options::default())?;
//! let stiffness = found.estimate("joint2.stiffness");
//! assert!(stiffness.is_some_and(|estimate| estimate.std_error.is_some()));
//!
//! // The residual is larger than noise: find what the model lacks.
//! assert!(found.reduced_chi2.is_some_and(|chi2| chi2 > 5.0));
//! let closure = close(&problem, &data, &Options::default())?;
//! assert_eq!(closure.verdict, Verdict::Explained);
//! assert_eq!(closure.effects[0].effect.describe(), "link A bows with temperature");
//! assert!(closure.after.fitted.held_out.mean.norm < 0.12e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Errors and panics
//!
//! A mistake in a file is an [`error::InputError`] with file, line and column. Modules that read
//! input do not index (`clippy::indexing_slicing` is denied there). Numerical code indexes arrays
//! whose lengths one constructor has made from checked input.

// The command line names this library as any other program does.
extern crate self as flexcal;

#[macro_use]
mod words;

#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod cli;
pub mod design;
#[deny(clippy::indexing_slicing)]
pub mod error;
#[doc(hidden)]
pub mod export;
#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod files;
pub mod fit;
#[doc(hidden)]
pub mod laws;
pub mod least_squares;
#[doc(hidden)]
pub mod life;
pub mod measurement;
#[doc(hidden)]
pub mod mechanics;
pub mod model;
mod numeric;
#[doc(hidden)]
pub mod observation;
#[doc(hidden)]
pub mod paper;
#[deny(clippy::indexing_slicing)]
pub mod problem;
#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod quantity;
mod random;
pub mod remainder;
pub mod report;
#[doc(hidden)]
pub mod residual_tests;
pub mod results;
pub mod rig;
#[doc(hidden)]
pub mod scalar;
pub mod select;
#[doc(hidden)]
pub mod spatial;
#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod study;
#[deny(clippy::indexing_slicing)]
pub mod urdf;

/// Vectors and matrices in the interface are of this version of nalgebra.
pub use nalgebra;

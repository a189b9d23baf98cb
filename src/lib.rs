//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.
//!
//! # A walk through the house
//!
//! From input to result, each room uses only those before it:
//!
//! 1. [`problem`] and [`measurement`]: the arm as declared and the poses as measured, in SI units.
//!    A mistake in a file is an [`error`] that says where.
//! 2. [`spatial`], [`scalar`], [`mechanics`]: frames, and the arm's physics written once for real
//!    and dual numbers.
//! 3. [`model`]: what is free ([`model::parameter`]), the catalogue of what an arm may do besides
//!    ([`model::effect`]), and positions with their derivatives as a function of both.
//! 4. [`least_squares`]: residuals of many small items and the solvers for them, which know no
//!    arms.
//! 5. [`fit`]: what to fit in which order, identifiability, standard errors, comparison,
//!    compensation.
//! 6. [`remainder`]: what no law explains as smooth errors of the joints, and the uncertainty of
//!    predictions and commands.
//! 7. [`residual_tests`]: statistical tests of what a fit leaves, whether structure is left at all.
//! 8. [`select`]: which effects the residual points to ([`select::trace`]), and the loop that adds
//!    them ([`select::close`]).
//! 9. [`report`]: text, JSON, Markdown, HTML and figures.
//!
//! Beside this way stand [`design`] (which poses to measure, and what they will tell),
//! [`study`] (many fits where the truth is known), [`urdf`] (arms from URDF, and identified
//! ones back into it), [`paper`] (the closed forms of \[Chen2021\], a baseline), and [`rig`],
//! a rig that shares no physics with the model.
//!
//! # The same walk in code
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
//! `examples/` has an arm of one's own from text to estimate, an effect of one's own, and a report;
//! `docs/` explains files, effects, plans and results.
//!
//! # Indices
//!
//! What reads input indexes nothing (`clippy::indexing_slicing` is denied there: [`error`],
//! [`files`], [`problem`], [`quantity`], [`study`], [`urdf`], the readers of [`measurement`]
//! and [`rig`], the command line). What reckons does: its indices are those of arrays that one
//! constructor made of one length from what was read.

// The command line names this library as any other program does.
extern crate self as flexcal;

#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod cli;
pub mod design;
#[deny(clippy::indexing_slicing)]
pub mod error;
#[deny(clippy::indexing_slicing)]
#[doc(hidden)]
pub mod files;
pub mod fit;
#[doc(hidden)]
pub mod laws;
pub mod least_squares;
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

//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.
//!
//! # A walk through the house
//!
//! From input to result, each room uses only those before it:
//!
//! 1. [`problem`] and [`measurement`]: the arm as declared and the poses as measured, in SI units. A mistake in a file is an
//!    [`error`] that says where.
//! 2. [`spatial`], [`scalar`], [`arm`]: frames, and the arm's physics written once for real and dual numbers.
//! 3. [`parameter`], [`effect`], [`model`]: what is free, the catalogue of what an arm may do besides, and positions with their
//!    derivatives as a function of both.
//! 4. [`fit`], [`solver`]: least squares over many small items, which know no arms.
//! 5. [`study`]: what to fit in which order, identifiability, standard errors, comparison, compensation.
//! 6. [`diagnosis`]: what structure the residual still has, which effects it points to ([`diagnosis::trace`]), and the loop that
//!    adds them ([`diagnosis::close`]).
//! 7. [`picture`] gathers what figures show; [`report`] writes text, JSON, Markdown and HTML.
//!
//! Beside this way stand [`design`] (which poses to measure, and what they will tell), [`campaign`] (many fits where the
//! truth is known), [`paper`] (the closed forms of [Chen2021], a baseline), and [`rig`], a simulator that shares no physics
//! with the model.
//!
//! # The same walk in code
//!
//! ```
//! use std::path::Path;
//!
//! use flexcal::diagnosis::{Verdict, close};
//! use flexcal::measurement::{Measurements, Split};
//! use flexcal::problem::Problem;
//! use flexcal::study::{Options, identify};
//!
//! // The arm as declared, and the poses: 28 to identify, 50 held out.
//! let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
//! let (measurements, _warnings) = Measurements::read(&problem.data.files, &problem)?;
//! let split = Split::new(&problem, &measurements)?;
//!
//! // Fit what is free. Held-out poses only judge.
//! let found = identify(&problem, &measurements, &split, &Options::default())?;
//! let stiffness = found.estimates.iter().find(|estimate| estimate.name == "joint2.stiffness");
//! assert!(stiffness.is_some_and(|estimate| estimate.std_error.is_some()));
//!
//! // The residual is larger than noise: find what the model lacks.
//! assert!(found.reduced_chi2.is_some_and(|chi2| chi2 > 5.0));
//! let closure = close(&problem, &measurements, &split, &Options::default())?;
//! assert_eq!(closure.verdict, Verdict::Explained);
//! assert_eq!(flexcal::effect::describe(&closure.effects[0].effect), "link A bows with temperature");
//! assert!(closure.after.fitted.held_out.mean.norm < 0.1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/` has an arm of one's own from text to estimate, an effect of one's own, and a report; `docs/` explains files,
//! effects, plans and results.

pub mod arm;
pub mod campaign;
pub mod design;
pub mod diagnosis;
pub mod effect;
pub mod error;
pub mod fit;
pub mod measurement;
pub mod model;
pub mod paper;
pub mod parameter;
pub mod picture;
pub mod problem;
pub mod report;
pub mod rig;
pub mod scalar;
pub mod solver;
pub mod spatial;
pub mod study;
mod units;

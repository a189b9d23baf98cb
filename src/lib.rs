//! Identifies the geometric and elastic parameters of robot arms from measured end-point positions.
//!
//! From input to result, each room uses only those before it:
//!
//! - [`problem`] and [`measurement`]: the arm as declared and the poses as measured, in SI units; [`error`] says what is wrong
//!   with a file, where.
//! - [`spatial`], [`scalar`], [`arm`]: frames, and the arm's physics written once for real and dual numbers.
//! - [`parameter`], [`model`]: free parameters, and positions with their derivatives as a function of them.
//! - [`fit`], [`solver`]: least squares over many small items, which know no arms.
//! - [`study`]: what to fit in which order, identifiability, errors, comparison, compensation; [`diagnosis`]: what structure
//!   the residual still has, and the loop that adds what it points to; [`campaign`]: many fits where the truth is known;
//!   [`picture`] gathers what its figures show; [`report`] writes it down.
//! - [`design`]: which poses to measure, and what they will tell.
//! - [`paper`]: the closed forms of [Chen2021], a baseline; [`rig`]: an independent simulator that shares no physics with
//!   the model.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use flexcal::measurement::{Measurements, Split};
//! use flexcal::problem::Problem;
//! use flexcal::study::{Options, identify};
//!
//! let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
//! let (measurements, _warnings) = Measurements::read(&problem.data.files, &problem)?;
//! let split = Split::new(&problem, &measurements)?;
//! let found = identify(&problem, &measurements, &split, &Options::default())?;
//! for estimate in &found.estimates {
//!     println!("{} {} ± {:?} {}", estimate.name, estimate.estimate, estimate.std_error, estimate.unit.symbol());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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

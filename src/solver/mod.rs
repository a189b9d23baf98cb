//! Solvers of nonlinear least-squares problems, run by argmin's executor; one file a solver.
//!
//! Every solver sees the problem through [`Objective`](crate::fit::Objective) only: a cost and an n × n triangular linearisation.

mod bounded;
mod box_step;
mod factor;
mod levenberg_marquardt;
mod pivoted;
mod run;
mod settings;
mod spectrum;
mod termination;
mod trust_region;

pub use bounded::{AtBound, Bounds, BoundsError, BoxConstrained, bounded_levenberg_marquardt};
pub use factor::Factor;
pub use levenberg_marquardt::{Unconstrained, levenberg_marquardt};
pub use run::{Solution, minimise, minimise_bounded, minimise_bounded_observed, minimise_observed};
pub use settings::Settings;
pub use termination::Termination;
pub use trust_region::{State, Step, Subproblem, TrustRegion};

//! Solvers of nonlinear least-squares problems, run by argmin's executor; one file a solver.
//!
//! Every solver sees the problem through [`Objective`](crate::fit::Objective) only: a cost and an n × n triangular linearisation.

mod bounded;
mod box_step;
mod divergence;
mod factor;
mod gauss_newton;
mod levenberg_marquardt;
mod pivoted;
mod pseudo_inverse;
mod run;
mod settings;
mod spectrum;
mod termination;
mod trust_region;

pub use bounded::{AtBound, Bounds, BoundsError, BoxConstrained, bounded_levenberg_marquardt};
pub use divergence::Divergence;
pub use factor::Factor;
pub use gauss_newton::{GaussNewtonSettings, minimise_gauss_newton};
pub use levenberg_marquardt::{Unconstrained, levenberg_marquardt};
pub use pseudo_inverse::{
    PseudoInverse, PseudoInverseSettings, minimise_pseudo_inverse, minimise_pseudo_inverse_observed, minimum_norm_step,
};
pub use run::{Solution, minimise, minimise_bounded, minimise_bounded_observed, minimise_observed};
pub use settings::Settings;
pub use termination::Termination;
pub use trust_region::{State, Step, Subproblem, TrustRegion};

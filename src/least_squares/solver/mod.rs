//! Solvers of nonlinear least-squares problems, run by argmin's executor; one file a solver.
//!
//! Every solver sees the problem through [`Objective`](crate::least_squares::Objective) only: a cost and an n × n triangular linearisation.

mod bounded;
mod bounds;
mod divergence;
mod execute;
mod factor;
mod gauss_newton;
mod inequalities;
mod interior;
mod levenberg_marquardt;
mod pivoted;
mod polyhedron;
mod polyhedron_step;
mod pseudo_inverse;
mod run;
mod settings;
mod solution;
mod spectrum;
mod termination;
mod trust_region;

pub use bounded::{Constrained, bounded_levenberg_marquardt, constrained_levenberg_marquardt, nearest};
pub use bounds::{AtBound, Bounds, BoundsError};
pub use divergence::Divergence;
pub use factor::Factor;
pub use gauss_newton::{GaussNewtonSettings, minimise_gauss_newton};
pub use inequalities::{Inequalities, InequalitiesError};
pub use levenberg_marquardt::{Unconstrained, levenberg_marquardt};
pub use pseudo_inverse::{
    PseudoInverse, PseudoInverseSettings, minimise_pseudo_inverse, minimise_pseudo_inverse_observed, minimum_norm_step,
};
pub use run::{
    minimise, minimise_bounded, minimise_bounded_observed, minimise_constrained, minimise_constrained_observed,
    minimise_observed,
};
pub use settings::Settings;
pub use solution::Solution;
pub use termination::Termination;
pub use trust_region::{State, Step, Subproblem, TrustRegion};

//! Solvers of nonlinear least-squares problems, run by argmin's executor; one file per solver.
//!
//! Every solver sees the problem through [`Objective`](crate::least_squares::Objective) only: a
//! cost and an n × n triangular linearisation.

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
mod reduced;
mod reflective;
mod run;
mod second_order;
mod settings;
mod solution;
mod spectrum;
mod step;
mod termination;
mod trial;
mod trust_region;

pub use bounded::{
    Constrained, bounded_levenberg_marquardt, clamped_levenberg_marquardt,
    constrained_levenberg_marquardt, interior_point_levenberg_marquardt, nearest,
};
pub use bounds::{AtBound, Bounds, BoundsError};
pub use divergence::Divergence;
pub use factor::Factor;
pub use gauss_newton::{GaussNewtonSettings, minimise_gauss_newton};
pub use inequalities::{Inequalities, InequalitiesError};
pub use levenberg_marquardt::{Unconstrained, levenberg_marquardt};
pub use pseudo_inverse::{
    PseudoInverse, PseudoInverseSettings, minimise_pseudo_inverse,
    minimise_pseudo_inverse_observed, minimum_norm_step,
};
pub use reflective::{Reflective, reflective_levenberg_marquardt};
pub use run::{
    BoundMethod, minimise, minimise_bounded, minimise_constrained, minimise_constrained_by,
    minimise_observed,
};
pub use settings::Settings;
pub use solution::Solution;
pub use step::Step;
pub use termination::Termination;
pub use trust_region::{State, Subproblem, TrustRegion};

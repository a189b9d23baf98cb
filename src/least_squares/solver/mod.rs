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

pub use bounds::{AtBound, Bounds, BoundsError};
pub(crate) use inequalities::InequalitiesError;
pub(crate) use pseudo_inverse::{minimise_pseudo_inverse_observed, minimum_norm_step};
pub use run::{minimise, minimise_bounded};
pub use settings::Settings;
pub use solution::Solution;
pub(crate) use step::Step;
pub use termination::Termination;
pub(crate) use trust_region::{Subproblem, TrustRegion};
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    bounded::nearest,
    divergence::Divergence,
    execute::State,
    factor::Factor,
    gauss_newton::{GaussNewtonSettings, minimise_gauss_newton},
    inequalities::Inequalities,
    pseudo_inverse::{PseudoInverseSettings, minimise_pseudo_inverse},
    run::{BoundMethod, minimise_constrained, minimise_constrained_by, minimise_observed},
};

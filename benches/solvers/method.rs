//! The compared solvers, each called through its public interface.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use argmin::core::observers::Observe;
use flexcal::fit::SolverChoice;
use flexcal::least_squares::solver::{
    BoundMethod, Bounds, GaussNewtonSettings, Inequalities, PseudoInverseSettings, Solution, State,
    minimise, minimise_constrained_by, minimise_gauss_newton, minimise_pseudo_inverse,
};
use flexcal::least_squares::{LeastSquares as _, Loss};
use nalgebra::DVector;

use crate::case::Case;
use crate::common::minpack::Minpack;
use crate::smooth::{lbfgs, trust_region};
use crate::watched::Watched;

/// A solver; those offered by `identify --solver` have their names there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    LevenbergMarquardt,
    Bounded(BoundMethod),
    GaussNewton,
    PseudoInverse,
    TrustRegion,
    Lbfgs,
    Minpack,
    MinpackClamped,
}

/// Observer that does nothing.
struct NoObserver;

impl Observe<State> for NoObserver {}

/// Result of a run of a solver on a problem.
pub struct Run {
    /// ½Σρ evaluated by the problem, not by the solver; infinite outside the limits.
    pub cost: f64,
    /// Number of steps tried.
    pub iterations: u64,
    pub residuals: usize,
    pub jacobians: usize,
    pub seconds: f64,
    /// Reason of termination, unless the solver reports convergence.
    pub complaint: Option<String>,
}

/// Final state as the solver reports it.
pub struct End {
    pub x: DVector<f64>,
    pub iterations: u64,
    pub complaint: Option<String>,
}

impl From<Solution> for End {
    fn from(solution: Solution) -> Self {
        let Solution { x, iterations, termination, .. } = solution;
        Self {
            x,
            iterations,
            complaint: (!termination.converged()).then(|| termination.as_str().to_owned()),
        }
    }
}

impl Method {
    pub const EACH: [Self; 11] = [
        Self::LevenbergMarquardt,
        Self::Bounded(BoundMethod::ActiveSet),
        Self::Bounded(BoundMethod::InteriorPoint),
        Self::Bounded(BoundMethod::Reflective),
        Self::Bounded(BoundMethod::Clamped),
        Self::GaussNewton,
        Self::PseudoInverse,
        Self::TrustRegion,
        Self::Lbfgs,
        Self::Minpack,
        Self::MinpackClamped,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::LevenbergMarquardt => "levenberg-marquardt",
            Self::Bounded(bound_method) => {
                let choice = SolverChoice::SOLVERS
                    .iter()
                    .copied()
                    .find(|solver| solver.within() == Some(bound_method));
                choice.map_or("bounded", SolverChoice::as_str)
            }
            Self::GaussNewton => "gauss-newton",
            Self::PseudoInverse => "pseudo-inverse",
            Self::TrustRegion => "argmin trust region",
            Self::Lbfgs => "argmin L-BFGS",
            Self::Minpack => "MINPACK port",
            Self::MinpackClamped => "MINPACK port, clamped",
        }
    }

    /// True if the solver takes part in the problem. Without bounds the solvers for bounds are the
    /// same method, so only one takes part.
    pub fn takes_part(self, case: &Case) -> bool {
        let (bounded, boxed) = (case.bounds.is_some(), case.rows.is_none());
        match self {
            Self::Bounded(BoundMethod::ActiveSet) => true,
            Self::Bounded(BoundMethod::Reflective | BoundMethod::Clamped)
            | Self::MinpackClamped => bounded && boxed,
            Self::Bounded(_) => bounded,
            Self::Minpack => case.loss == Loss::Squares,
            _ => true,
        }
    }

    /// Solves the problem from its start; the result of a solver that panics is the start.
    pub fn run(self, case: &Case) -> Run {
        let watched = Watched::new(case.data.as_ref(), case.limit());
        let begin = Instant::now();
        let end = catch_unwind(AssertUnwindSafe(|| self.end(case, &watched)));
        let seconds = begin.elapsed().as_secs_f64();
        let start = case.start.clone();
        let End { x, iterations, complaint } = end.unwrap_or_else(|_| End {
            x: start,
            iterations: 0,
            complaint: Some("it panics".to_owned()),
        });
        let (residuals, jacobians) = watched.evaluations();
        let late =
            watched.is_late().then(|| format!("not done within {} s", case.limit().as_secs()));
        Run {
            cost: case.cost(&x),
            iterations,
            residuals,
            jacobians,
            seconds,
            complaint: late.or(complaint),
        }
    }

    /// Calls the solver on `data`, the problem of `case` with counted evaluations.
    fn end(self, case: &Case, data: &Watched) -> End {
        let (start, settings) = (case.start.clone(), case.settings());
        let fit = case.fit(data);
        match self {
            Self::LevenbergMarquardt => minimise(fit, start, &settings).into(),
            Self::Bounded(bound_method) => {
                let bounds = case.bounds.clone().unwrap_or_else(|| Bounds::none(data.parameters()));
                let rows =
                    case.rows.clone().unwrap_or_else(|| Inequalities::none(data.parameters()));
                minimise_constrained_by(
                    bound_method,
                    fit,
                    start,
                    (&bounds, &rows),
                    &settings,
                    None::<NoObserver>,
                )
                .into()
            }
            Self::GaussNewton => {
                let tolerance =
                    settings.cost_tolerance.sqrt().min(GaussNewtonSettings::default().tolerance);
                let settings = GaussNewtonSettings {
                    tolerance,
                    max_iterations: settings.max_iterations,
                    ..Default::default()
                };
                minimise_gauss_newton(fit, start, &settings).into()
            }
            Self::PseudoInverse => {
                let settings = PseudoInverseSettings {
                    step_tolerance: settings.step_tolerance,
                    max_iterations: settings.max_iterations,
                    ..PseudoInverseSettings::default()
                };
                minimise_pseudo_inverse(fit, start, &settings).into()
            }
            Self::TrustRegion => trust_region(fit, &start, &settings),
            Self::Lbfgs => lbfgs(fit, &start, &settings),
            Self::Minpack | Self::MinpackClamped => {
                let problem = Minpack::new(data, start).with_rows(case.priors.as_ref());
                let bounds = case.bounds.as_ref().filter(|_| self == Self::MinpackClamped);
                let (x, report) = problem.clamped(bounds).solve(&settings);
                let complaint = (!report.termination.was_successful())
                    .then(|| format!("{:?}", report.termination));
                End {
                    x,
                    iterations: report.number_of_evaluations.saturating_sub(1) as u64,
                    complaint,
                }
            }
        }
    }
}

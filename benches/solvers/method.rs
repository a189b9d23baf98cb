//! The solvers, each as it would be called.

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

/// A solver; names of those that `identify --solver` offers are theirs there.
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

struct Silent;

impl Observe<State> for Silent {}

/// What a solver left behind.
pub struct Run {
    /// ½‖r‖² by the problem itself; infinite outside its limits.
    pub cost: f64,
    /// Steps tried.
    pub iterations: u64,
    pub residuals: usize,
    pub jacobians: usize,
    pub seconds: f64,
    /// Why it ended, unless it says that it has converged.
    pub complaint: Option<String>,
}

/// Where a solver ended, by its own word.
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
            Self::Bounded(within) => {
                let own =
                    SolverChoice::EACH.into_iter().find(|solver| solver.within() == Some(within));
                own.map_or("bounded", SolverChoice::as_str)
            }
            Self::GaussNewton => "gauss-newton",
            Self::PseudoInverse => "pseudo-inverse",
            Self::TrustRegion => "argmin trust region",
            Self::Lbfgs => "argmin L-BFGS",
            Self::Minpack => "MINPACK port",
            Self::MinpackClamped => "MINPACK port, clamped",
        }
    }

    /// Whether its row tells something of this problem. Without bounds those that keep them all do
    /// the same: one is enough.
    pub fn tells(self, case: &Case) -> bool {
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

    /// Solves from the start; a solver that panics gives up where it began.
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

    fn end(self, case: &Case, data: &Watched) -> End {
        let (start, settings) = (case.start.clone(), case.settings());
        let fit = case.fit(data);
        match self {
            Self::LevenbergMarquardt => minimise(fit, start, &settings).into(),
            Self::Bounded(within) => {
                let bounds = case.bounds.clone().unwrap_or_else(|| Bounds::none(data.parameters()));
                let rows =
                    case.rows.clone().unwrap_or_else(|| Inequalities::none(data.parameters()));
                minimise_constrained_by(
                    within,
                    fit,
                    start,
                    (&bounds, &rows),
                    &settings,
                    None::<Silent>,
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

//! The test problems and their classes.

use std::time::Duration;

use flexcal::least_squares::solver::{Bounds, Inequalities, Settings};
use flexcal::least_squares::{Fit, LeastSquares, LinearRows, Loss, Objective as _};
use nalgebra::DVector;

use crate::collections::{more_garbow_hillstrom, nist};
use crate::watched::Watched;

/// Class of problems; each has a section in the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    Identifiable,
    Redundant,
    Elastic,
    Bounded,
    Robust,
    Sequential,
    Nist,
    MoreGarbowHillstrom,
}

impl Class {
    pub const EACH: [Self; 8] = [
        Self::Identifiable,
        Self::Redundant,
        Self::Elastic,
        Self::Bounded,
        Self::Robust,
        Self::Sequential,
        Self::Nist,
        Self::MoreGarbowHillstrom,
    ];

    /// Heading of the section in the table, which `tests/fit/auto_solver.rs` reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identifiable => "rigid, identifiable",
            Self::Redundant => "rigid, redundant",
            Self::Elastic => "elastic",
            Self::Bounded => "bounded",
            Self::Robust => "robust",
            Self::Sequential => "sequential",
            Self::Nist => "NIST",
            Self::MoreGarbowHillstrom => "Moré–Garbow–Hillstrom",
        }
    }

    /// Description of the problems in a few sentences.
    pub fn about(self) -> &'static str {
        match self {
            Self::Identifiable => {
                "UR10, the 25 geometric parameters that positions identify, from nominal values; positions with 0.05 mm noise."
            }
            Self::Redundant => {
                "The same with all 33 geometric parameters, 8 of them redundant: the Jacobian is rank-deficient at every point."
            }
            Self::Elastic => {
                "Lunar sampler, loads on the bent arm, all 32 parameters with their priors, from nominal values (errors are \
                 drawn from 0.3 of the priors) and from 5 σ of the prior off the true value of every parameter, up or down at random."
            }
            Self::Bounded => {
                "The lunar sampler within bounds as wide as 1 σ of the true errors: a third of the true values lie beyond. The arm of \
                 `tests/cases/bounded` within its five sets of bounds and constraints, two of them against the truth; \
                 `problems/service-arm`; and the 25 parameters of the UR10 within 1.5 σ of their errors. What ends outside its limits has not \
                 reached the optimum. Solvers that keep bounds alone take no part where there are constraints."
            }
            Self::Robust => {
                "The UR10 with a gross error of millimetres in every tenth pose, and the arm of `tests/cases/bounded` without its limits and \
                 with 5 mm in every seventh, under Huber's loss and the smoothed length of `[robust]`. The MINPACK port knows no \
                 losses."
            }
            Self::Sequential => {
                "Lunar sampler by the strategy `sequential`: stiffness, then geometry, repeated until it settles. Only solvers \
                 of `identify --solver` take part; time is that of `identify`, evaluations of residual and Jacobian are \
                 counted together, and the optimum is that of the joint fit, to 1e-4: the strategy stops when a sweep gains less than 1e-6."
            }
            Self::Nist => {
                "The eight problems of higher difficulty of the NIST Statistical Reference Datasets, from both starts; the optimum \
                 is the certified one. Tolerances as tight as each solver can."
            }
            Self::MoreGarbowHillstrom => {
                "The least-squares problems of Moré, Garbow & Hillstrom (1981) from their standard starts; any listed minimum \
                 counts. Tolerances as tight as each solver can."
            }
        }
    }
}

/// A least-squares problem with a starting point.
pub struct Case<'a> {
    pub class: Class,
    pub name: String,
    pub data: Box<dyn LeastSquares + 'a>,
    pub priors: Option<LinearRows>,
    pub start: DVector<f64>,
    pub bounds: Option<Bounds>,
    /// Linear constraints in addition to the bounds.
    pub rows: Option<Inequalities>,
    pub loss: Loss,
    /// ½‖r‖² at the known minima; empty if the best result of all solvers serves as the optimum.
    pub minima: Vec<f64>,
    /// Relative accuracy of the known minima.
    pub accuracy: f64,
}

impl<'a> Case<'a> {
    /// Problem without priors, limits and known minima.
    pub fn new(
        class: Class,
        name: String,
        data: impl LeastSquares + 'a,
        start: DVector<f64>,
    ) -> Self {
        Self {
            class,
            name,
            data: Box::new(data),
            priors: None,
            start,
            bounds: None,
            rows: None,
            loss: Loss::Squares,
            minima: Vec::new(),
            accuracy: 0.0,
        }
    }

    /// Convergence tolerances that all solvers are given.
    pub fn settings(&self) -> Settings {
        match self.class {
            Class::Nist | Class::MoreGarbowHillstrom => Settings {
                gradient_tolerance: 1e-14,
                cost_tolerance: 1e-15,
                step_tolerance: 1e-14,
                max_iterations: 3000,
                ..Settings::default()
            },
            _ => Settings::default(),
        }
    }

    /// Time limit of one run.
    pub fn limit(&self) -> Duration {
        match self.class {
            Class::Nist | Class::MoreGarbowHillstrom => Duration::from_secs(1),
            _ => Duration::from_secs(20),
        }
    }

    /// Returns the objective with the priors; `data` is the problem's `data` or a wrapper of it.
    pub fn fit<'b, P: LeastSquares>(&self, data: &'b P) -> Fit<'b, P> {
        let fit = Fit::new(data).with_loss(self.loss);
        match &self.priors {
            Some(priors) => fit.with_rows(priors.clone()).unwrap(),
            None => fit,
        }
    }

    /// Returns ½Σρ, infinite outside the limits.
    pub fn cost(&self, x: &DVector<f64>) -> f64 {
        let inside = |bounds: &Bounds| {
            let is_within = |j| (bounds.lower()[j]..=bounds.upper()[j]).contains(&x[j]);
            (0..x.len()).all(is_within)
        };
        if !self.bounds.as_ref().is_none_or(inside)
            || !self.rows.as_ref().is_none_or(|rows| rows.contain(x))
        {
            return f64::INFINITY;
        }
        self.fit(&Watched::new(self.data.as_ref(), self.limit())).cost(x)
    }
}

/// Returns the NIST problems of higher difficulty and those of Moré, Garbow & Hillstrom.
pub fn collections() -> Vec<Case<'static>> {
    let mut cases = Vec::new();
    for start in 0..2 {
        for dataset in nist::datasets()
            .into_iter()
            .filter(|dataset| nist::HIGHER_DIFFICULTY.contains(&dataset.name))
        {
            let (name, begin) =
                (format!("{}, start {}", dataset.name, start + 1), dataset.starts[start].clone());
            let minima = vec![0.5 * dataset.rss];
            cases.push(Case {
                minima,
                accuracy: 1e-9,
                ..Case::new(Class::Nist, name, dataset, begin)
            });
        }
    }
    for problem in more_garbow_hillstrom::problems() {
        let minima = problem.minima.iter().map(|squares| 0.5 * squares).collect();
        let start = DVector::from_vec(problem.start);
        let case =
            Case::new(Class::MoreGarbowHillstrom, problem.name.to_owned(), problem.analytic, start);
        cases.push(Case { minima, accuracy: 1e-5, ..case });
    }
    cases.sort_by(|a, b| (a.class, a.name.as_str()).cmp(&(b.class, b.name.as_str())));
    cases
}

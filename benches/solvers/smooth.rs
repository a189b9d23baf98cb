//! argmin's solvers of smooth functions applied to f = ½‖r‖², with the gradient Jᵀr and the
//! Gauss–Newton Hessian JᵀJ.
//!
//! These solvers do not scale the unknowns, so each is scaled by the norm of its column of J at the
//! start. argmin's trust region has no convergence test, and its L-BFGS one in absolute units, so
//! the adapter ends both by the tests of gradient and step of the other solvers.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{
    CostFunction, Error, Executor, Gradient, Hessian, IterState, KV, Solver, State as _,
};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use argmin::solver::trustregion::{Steihaug, TrustRegion};
use flexcal::least_squares::solver::Settings;
use flexcal::least_squares::{Linearisation, Objective};
use nalgebra::{DMatrix, DVector};

use crate::method::End;

/// Number of pairs of steps and gradients that L-BFGS stores.
const STORED_PAIRS: usize = 10;
/// Number of iterations allowed to L-BFGS for each one of the other solvers, since its iterations
/// are cheaper.
const ITERATIONS_PER_STEP: u64 = 10;
/// Number of evaluations at the last point after which a solver counts as stuck.
const STUCK: usize = 20;

type Vector = DVector<f64>;
type Matrix = DMatrix<f64>;
type State<G, H> = IterState<Vector, G, (), H, (), f64>;

/// Trust region with Steihaug's conjugate gradients. The first radius is ‖r‖, the length of the
/// Gauss–Newton step for orthogonal columns of J.
pub fn trust_region(objective: impl Objective, start: &Vector, settings: &Settings) -> End {
    let smooth = Smooth::new(objective, start, settings);
    let radius = smooth.residual.max(f64::MIN_POSITIVE);
    let inner = Steihaug::new().with_max_iters(10 * start.len() as u64);
    let solver =
        TrustRegion::new(inner).with_max_radius(1e6 * radius).unwrap().with_radius(radius).unwrap();
    smooth.run(|state: State<Vector, Matrix>| state, solver, settings.max_iterations)
}

/// Limited-memory BFGS with the line search of Moré and Thuente.
pub fn lbfgs(objective: impl Objective, start: &Vector, settings: &Settings) -> End {
    let smooth = Smooth::new(objective, start, settings);
    let solver =
        LBFGS::new(MoreThuenteLineSearch::new(), STORED_PAIRS).with_tolerance_grad(0.0).unwrap();
    smooth.run(
        |state: State<Vector, ()>| state,
        solver,
        ITERATIONS_PER_STEP * settings.max_iterations,
    )
}

/// The objective as a function of the scaled unknowns q = D x, for argmin.
struct Smooth<'a, O> {
    objective: O,
    settings: &'a Settings,
    scale: Vector,
    /// ‖r‖ at the start.
    residual: f64,
    history: RefCell<History>,
}

/// State of a run kept outside argmin, which returns no state if a solver fails.
struct History {
    /// Last point x with derivatives.
    last: (Vector, Linearisation),
    best: (Vector, f64),
    /// Number of evaluations of the cost at the last point.
    idle: usize,
    /// Whether and why the adapter ended the run.
    ended: Ended,
}

/// Reason for which the adapter ends a run.
#[derive(Clone, Copy)]
enum Ended {
    Not,
    Converged,
    Failed(&'static str),
}

/// Error by which the adapter makes argmin end a run.
#[derive(Debug, thiserror::Error)]
#[error("ended by the adapter")]
struct Stop;

/// Observer that counts iterations.
struct Counter(Rc<Cell<u64>>);

impl<I> Observe<I> for Counter {
    fn observe_iter(&mut self, _state: &I, _kv: &KV) -> Result<(), Error> {
        self.0.set(self.0.get() + 1);
        Ok(())
    }
}

impl<'a, O: Objective> Smooth<'a, O> {
    fn new(objective: O, start: &Vector, settings: &'a Settings) -> Self {
        let linearisation = objective.linearise(start);
        let norms = linearisation.triangle.column_iter().map(|column| column.norm());
        Self {
            scale: Vector::from_iterator(
                start.len(),
                norms.map(|norm| if norm > 0.0 { norm } else { 1.0 }),
            ),
            residual: (2.0 * linearisation.cost).sqrt(),
            history: RefCell::new(History {
                best: (start.clone(), linearisation.cost),
                last: (start.clone(), linearisation),
                idle: 0,
                ended: Ended::Not,
            }),
            objective,
            settings,
        }
    }

    /// Runs `solver` from the start; `typed` fixes the type of argmin's state.
    fn run<G, H, S>(
        &self,
        typed: fn(State<G, H>) -> State<G, H>,
        solver: S,
        max_iterations: u64,
    ) -> End
    where
        S: for<'b> Solver<&'b Self, State<G, H>>,
        State<G, H>: argmin::core::State<Param = Vector, Float = f64>,
        G: Clone,
        H: Clone,
    {
        let iterations = Rc::new(Cell::new(0));
        let begin = self.history.borrow().last.0.component_mul(&self.scale);
        let result = Executor::new(self, solver)
            .configure(|state| typed(state).param(begin).max_iters(max_iterations))
            .add_observer(Counter(Rc::clone(&iterations)), ObserverMode::Always)
            .ctrlc(false)
            .timer(false)
            .run();
        let complaint = match (self.history.borrow().ended, result) {
            (Ended::Failed(why), _) => Some(why.to_owned()),
            (Ended::Not, Ok(result)) if result.state.get_iter() >= max_iterations => {
                Some("iteration-limit".to_owned())
            }
            (Ended::Not, Err(error)) => Some(error.to_string()),
            (Ended::Not | Ended::Converged, _) => None,
        };
        End { x: self.history.borrow().best.0.clone(), iterations: iterations.get(), complaint }
    }

    /// Records why the run ends and returns the error that ends it.
    fn stop<T>(&self, ended: Ended) -> Result<T, Error> {
        self.history.borrow_mut().ended = ended;
        Err(Stop.into())
    }

    /// Applies `read` to the linearisation at q, which is computed unless q is the last point; ends
    /// the run if the gradient is small enough.
    fn at<T>(&self, q: &Vector, read: impl Fn(&Linearisation) -> T) -> Result<T, Error> {
        let x = q.component_div(&self.scale);
        if self.history.borrow().last.0 != x {
            let linearisation = self.objective.linearise(&x);
            let mut history = self.history.borrow_mut();
            if linearisation.cost < history.best.1 {
                history.best = (x.clone(), linearisation.cost);
            }
            history.last = (x, linearisation);
        }
        let Linearisation { cost, triangle, projected } = &self.history.borrow().last.1.clone();
        if !triangle.iter().chain(projected).all(|value| value.is_finite()) {
            return self.stop(Ended::Failed("derivatives-not-finite"));
        }
        let size = |j: usize| triangle.column(j).norm() * (2.0 * cost).sqrt();
        let cosine =
            |j: usize| triangle.column(j).dot(projected).abs() / size(j).max(f64::MIN_POSITIVE);
        if *cost == 0.0 || (0..q.len()).all(|j| cosine(j) <= self.settings.gradient_tolerance) {
            return self.stop(Ended::Converged);
        }
        Ok(read(&self.history.borrow().last.1))
    }
}

impl<O: Objective> CostFunction for &Smooth<'_, O> {
    type Param = Vector;
    type Output = f64;

    fn cost(&self, q: &Vector) -> Result<f64, Error> {
        let x = q.component_div(&self.scale);
        let moved = (q - self.history.borrow().last.0.component_mul(&self.scale)).norm();
        if moved == 0.0 && self.history.borrow().idle < STUCK {
            self.history.borrow_mut().idle += 1;
            return Ok(self.history.borrow().last.1.cost);
        }
        if !moved.is_finite() || moved <= self.settings.step_tolerance * q.norm() {
            let failed = Ended::Failed("steps are not finite");
            return self.stop(if moved.is_finite() { Ended::Converged } else { failed });
        }
        let cost = self.objective.cost(&x);
        let mut history = self.history.borrow_mut();
        if cost < history.best.1 {
            history.best = (x, cost);
        }
        Ok(cost)
    }
}

impl<O: Objective> Gradient for &Smooth<'_, O> {
    type Param = Vector;
    type Gradient = Vector;

    fn gradient(&self, q: &Vector) -> Result<Vector, Error> {
        self.at(q, |linearisation| {
            linearisation.triangle.tr_mul(&linearisation.projected).component_div(&self.scale)
        })
    }
}

impl<O: Objective> Hessian for &Smooth<'_, O> {
    type Param = Vector;
    type Hessian = Matrix;

    fn hessian(&self, q: &Vector) -> Result<Matrix, Error> {
        self.at(q, |linearisation| {
            let mut scaled = linearisation.triangle.clone();
            scaled.column_iter_mut().zip(&self.scale).for_each(|(mut column, d)| column /= *d);
            scaled.tr_mul(&scaled)
        })
    }
}

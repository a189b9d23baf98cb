//! Progress of a fit or a loop, and requests to stop early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, State as _};

use crate::least_squares::solver::State;
use crate::problem::Effect;

/// Report on the progress of a fit or a loop.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// The solver of a fit tried a step.
    Step {
        /// Number of steps tried in the current fit.
        iteration: u64,
        /// Number of unknowns of the current fit.
        unknowns: usize,
        /// Number of poses of the current fit.
        poses: usize,
        /// Cost after the step: ½‖r‖² of whitened residuals and priors; with a robust loss ρ, ½Σρ.
        cost: f64,
    },
    /// A round of a loop evaluates candidate effects, or starts another fit.
    Round {
        /// Number of the round, from 1.
        round: usize,
        /// Effects that earlier rounds added to the model.
        effects: Vec<Effect>,
        /// Number of the fit that starts, from 1; 0 while candidates are evaluated.
        fit: usize,
        /// Number of fits of the round that are planned so far.
        fits: usize,
    },
    /// The loop adds no more effects and computes the claims about those that it has added.
    Finishing,
}

/// Function that receives progress reports; the library itself prints nothing.
pub type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// Request from another thread or a signal handler to stop the work early. Clones share the
/// request.
///
/// A fit checks for a request between the steps of its solver.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Requests the stop; returns true if it had been requested before.
    pub fn request(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    /// Returns true if the stop was requested.
    #[doc(hidden)]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Error by which [`Reporter`] ends a solver on request.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
struct Stopped;

/// Observer of a solver that reports every step and stops the solver on request.
pub(in crate::fit) struct Reporter {
    pub sink: Option<ProgressSink>,
    pub stop: Option<Stop>,
    pub unknowns: usize,
    pub poses: usize,
}

impl Observe<State> for Reporter {
    fn observe_iter(&mut self, state: &State, _kv: &KV) -> Result<(), Error> {
        if let Some(sink) = &self.sink {
            sink(Progress::Step {
                iteration: state.get_iter(),
                unknowns: self.unknowns,
                poses: self.poses,
                cost: state.get_cost(),
            });
        }
        if self.stop.as_ref().is_some_and(Stop::is_requested) {
            Err(Stopped.into())
        } else {
            Ok(())
        }
    }
}

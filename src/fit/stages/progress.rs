//! Progress of a fit or a loop, and requests to stop early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, State as _};

use crate::least_squares::solver::State;
use crate::problem::Effect;

/// Progress of a fit or a loop.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// A fit tried a step.
    Step {
        /// Number of steps tried in the current fit.
        iteration: u64,
        /// Number of unknowns of the current fit.
        unknowns: usize,
        /// Number of poses of the current fit.
        poses: usize,
        /// Cost ½‖r‖² after the step.
        cost: f64,
    },
    /// A round of a loop evaluates candidates, or starts another of its fits.
    Round {
        /// Number of the round, from 1.
        round: usize,
        /// Effects that earlier rounds added.
        effects: Vec<Effect>,
        /// Number of the fit that starts, from 1; 0 while candidates are evaluated.
        fit: usize,
        /// Number of fits of the round that are planned so far.
        fits: usize,
    },
    /// The loop adds no more effects and computes the claims about those that it has.
    Finishing,
}

/// Receiver of progress; the library itself prints nothing.
pub type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// Request from another thread or a signal handler to stop early. Clones share the request.
///
/// A fit checks it between the steps of its solver.
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

/// Error of a solver that was stopped.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
struct Stopped;

/// Observer of a solver: reports every step, and stops it on request.
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

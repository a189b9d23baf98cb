//! How far a fit or a loop has come, and the wish that it end early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, State as _};

use crate::least_squares::solver::State;
use crate::problem::Effect;

/// How far a fit or a loop has come.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// A step of a fit was tried.
    Step {
        /// Steps tried in the fit at hand.
        iteration: u64,
        /// Number of unknowns of the fit at hand.
        unknowns: usize,
        /// Number of poses of the fit at hand.
        poses: usize,
        /// ½‖r‖².
        cost: f64,
    },
    /// A round of a loop weighs candidates, or begins another of its fits.
    Round {
        /// Its number, from 1.
        round: usize,
        /// Effects that earlier rounds added.
        effects: Vec<Effect>,
        /// The fit that begins, from 1; 0 while candidates are weighed.
        fit: usize,
        /// Fits that the round makes, as far as it is known.
        fits: usize,
    },
    /// A loop adds no more effects and works out what it says of those that it has.
    Finishing,
}

/// Where progress goes; the library itself prints nothing.
pub type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// The wish, from another thread or a handler of signals, that work end early. Clones share it.
///
/// A fit looks at it between the steps of its solver.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks for the end; whether it had been asked for before.
    pub fn request(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    /// Whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A fit was stopped.
#[derive(Debug, thiserror::Error)]
#[error("stopped")]
struct Stopped;

/// Tells of every step of one fit, and stops it.
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

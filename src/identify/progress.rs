//! How far a fit has come.

use std::sync::Arc;

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, State as _};

use crate::least_squares::solver::State;

/// How far a fit has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Steps tried in the fit at hand.
    pub iteration: u64,
    /// Number of unknowns of the fit at hand.
    pub unknowns: usize,
    /// Number of poses of the fit at hand.
    pub poses: usize,
    /// ½‖r‖².
    pub cost: f64,
}

/// Where progress goes; the library itself prints nothing.
pub type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// Tells of every step of one fit.
pub(super) struct Reporter {
    pub sink: ProgressSink,
    pub unknowns: usize,
    pub poses: usize,
}

impl Observe<State> for Reporter {
    fn observe_iter(&mut self, state: &State, _kv: &KV) -> Result<(), Error> {
        (self.sink)(Progress {
            iteration: state.get_iter(),
            unknowns: self.unknowns,
            poses: self.poses,
            cost: state.get_cost(),
        });
        Ok(())
    }
}

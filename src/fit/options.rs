//! Options of an identification.

use std::sync::Arc;

use nalgebra::DVector;

use super::stages::earlier_data::EarlierData;
use super::warm_start::WarmStart;
use super::{CustomSolver, Progress, ProgressSink, SolverChoice, Stop, Strategy};
use crate::model::Model;
use crate::model::parameter::Parameter;
use crate::problem::Effect;

/// Options of an identification: [`Options::default()`], changed by the `with_…` methods.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Options {
    /// Strategy: which parameters are fitted together.
    pub strategy: Strategy,
    /// Solver of the fits.
    pub solver: SolverChoice,
    /// Solver of the caller, used if `solver` is [`SolverChoice::Custom`].
    pub custom_solver: Option<Arc<dyn CustomSolver>>,
    /// Receiver of progress reports; `None` to report nothing.
    pub progress: Option<ProgressSink>,
    /// Request by which the caller can stop the work early. A stopped fit returns
    /// [`StageError::Interrupted`](super::StageError::Interrupted); a stopped loop returns its
    /// results up to then.
    pub stop: Option<Stop>,
    /// Names and values \[SI\] of parameters that start the fit at these values; all others start
    /// at the registered nominal arm.
    pub start: Vec<(String, f64)>,
    /// Maximum number of steps of a fit; `None` for the solver's default.
    pub max_steps: Option<u64>,
    /// Effects of the caller (from [`Problem::effect`](crate::problem::Problem::effect)) that trace
    /// and loop search for in addition to the catalogue. A fit alone does not use them.
    pub candidates: Vec<Effect>,
    /// State of an earlier fit of the same data with other effects, from which the fit starts;
    /// `None` for a cold start.
    pub(crate) warm_start: Option<Arc<WarmStart>>,
    /// Earlier data that are fitted together with the new rows; `None` for none.
    pub(crate) earlier: Option<Arc<EarlierData>>,
    /// True if the fit is provisional: another fit follows, so the fit stops at a larger tolerance
    /// and its result is only checked for convergence.
    pub(crate) provisional: bool,
    /// True to search by further fits for influential rows, and for masses and limits that cause a
    /// misfit.
    pub(crate) influential_rows: bool,
}

impl Options {
    /// Sets the strategy.
    #[must_use]
    pub fn with_strategy(self, strategy: Strategy) -> Self {
        Self { strategy, ..self }
    }

    /// Sets the solver of the least-squares problems.
    #[must_use]
    pub fn with_solver(self, solver: SolverChoice) -> Self {
        Self { solver, ..self }
    }

    /// Sets a solver of the caller for the stages of the strategy; bases and targets are registered
    /// by the solver that `auto` chooses.
    #[must_use]
    pub fn with_custom_solver(self, solver: Arc<dyn CustomSolver>) -> Self {
        Self { solver: SolverChoice::Custom, custom_solver: Some(solver), ..self }
    }

    /// Enables the search for influential rows
    /// ([`Identification::influential_rows`](super::Identification::influential_rows)), and for
    /// masses and limits that cause a misfit, by further fits. A loop searches for them in the
    /// problem as declared.
    #[must_use]
    pub fn with_influential_rows(self) -> Self {
        Self { influential_rows: true, ..self }
    }

    /// Sets the receiver of progress; `None` for none.
    #[must_use]
    pub fn with_progress(self, progress: impl Into<Option<ProgressSink>>) -> Self {
        Self { progress: progress.into(), ..self }
    }

    /// Sets the request that stops the work early; `None` for none.
    #[must_use]
    pub fn with_stop(self, stop: impl Into<Option<Stop>>) -> Self {
        Self { stop: stop.into(), ..self }
    }

    /// Sets earlier data that are fitted together with the new rows.
    #[must_use]
    pub(crate) fn with_earlier(self, earlier: Arc<EarlierData>) -> Self {
        Self { earlier: Some(earlier), ..self }
    }

    /// Reports progress, if there is a receiver.
    pub(crate) fn report_progress(&self, progress: impl FnOnce() -> Progress) {
        if let Some(sink) = &self.progress {
            sink(progress());
        }
    }

    /// Sets names and values \[SI\] of parameters that start the fit at these values.
    #[must_use]
    pub fn with_start(self, start: Vec<(String, f64)>) -> Self {
        Self { start, ..self }
    }

    /// Sets the effects that trace and loop search for in addition to the catalogue.
    #[must_use]
    pub fn with_candidates(self, candidates: Vec<Effect>) -> Self {
        Self { candidates, ..self }
    }

    /// Sets the maximum number of steps of a fit; `None` for the solver's default.
    #[must_use]
    pub fn with_max_steps(self, max_steps: impl Into<Option<u64>>) -> Self {
        Self { max_steps: max_steps.into(), ..self }
    }

    /// Returns the full parameter vector from which the fit starts: the deviations `x`, with those
    /// of the parameters in `start` replaced.
    pub(super) fn begin(&self, model: &Model, x: &DVector<f64>) -> DVector<f64> {
        let given =
            |parameter: &Parameter| self.start.iter().find(|(name, _)| *name == parameter.name);
        let parameters = model.parameters.iter().zip(x);
        let value = |(parameter, x): (&Parameter, &f64)| {
            given(parameter).map_or(*x, |(_, value)| parameter.deviation(*value))
        };
        DVector::from_iterator(x.len(), parameters.map(value))
    }
}

//! Stage: one least-squares fit of some parameters to some poses.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::custom_solver::CustomSolver;
use super::gauge::{Gauge, factor_of_stacked};
use crate::fit::SolverChoice;
use crate::fit::stages::active_limits::ActiveLimit;
use crate::fit::stages::earlier_data::EarlierData;
use crate::fit::stages::parameter_size::plausible_size;
use crate::fit::stages::progress::{ProgressSink, Reporter, Stop};
use crate::least_squares::solver::{
    self, Bounds, BoundsError, GaussNewtonSettings, Inequalities, InequalitiesError,
    PseudoInverseSettings, Settings, Solution, Termination,
};
use crate::least_squares::{
    Fit, LinearRows, Linearisation, LinearisationCache, Loss, Objective as _, RowsError,
    StabilisedObjective,
};
use crate::model::parameter::Parameter;
use crate::model::{LinearModel, Model, Pose, PoseResiduals};
use crate::problem::PoseView;

/// Relative reduction of the cost by a step below which a stage has converged. It is above the
/// rounding errors of the cost, and far below a noticeable change of an estimate.
pub const COST_TOLERANCE: f64 = 1e-11;

/// Error of a stage that cannot be set up, or was stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StageError {
    /// The bounds of a parameter exclude every value.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// A constraint cannot be satisfied or is not finite.
    #[error(transparent)]
    Inequalities(#[from] InequalitiesError),
    /// No parameter vector satisfies all bounds and constraints.
    #[error(
        "no values of the parameters satisfy all bounds of [parameters] and all of [[constraint]]"
    )]
    Infeasible,
    /// The rows of the priors do not match the unknowns.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// The fit was interrupted.
    #[error("interrupted before there was a result")]
    Interrupted,
}

/// Input of one least-squares fit: some parameters of a model are fitted to some poses.
pub(in crate::fit) struct Stage<'a> {
    pub model: &'a Model,
    /// Poses with the σ that the fit assumes.
    pub poses: Arc<Vec<Pose<'a>>>,
    /// Declared 1 σ of a coordinate of each pose, in the unit of its kind.
    pub declared: Vec<f64>,
    /// Declared 1 σ of an orientation about each axis \[rad\]; `None` if orientations are not
    /// fitted.
    pub declared_turn: Option<f64>,
    /// Indices, among all parameters of the model, of the unknowns: those that the stage varies.
    pub unknowns: Vec<usize>,
    pub solver: SolverChoice,
    /// Solver of the caller, required by [`SolverChoice::Custom`].
    pub custom_solver: Option<&'a dyn CustomSolver>,
    /// Maximum number of steps of the solver.
    pub max_steps: u64,
    /// Relative reduction of the cost below which the solver has converged.
    pub cost_tolerance: f64,
    /// Loss of the residual of a pose.
    pub loss: Loss,
    /// True if a constraint also applies when it involves parameters that this stage does not vary;
    /// these then have the values at which the stage starts.
    pub counts_fixed: bool,
    /// Linearisations shared by fits of the same data.
    pub cache: &'a LinearisationCache,
    /// Jacobian at the optimum of an earlier fit of the identification rows, reused if this stage
    /// starts there.
    pub linear_model: Option<&'a LinearModel>,
    /// Earlier data that are fitted together with the poses; `None` without an earlier estimate.
    pub earlier: Option<&'a EarlierData>,
    pub progress: Option<&'a ProgressSink>,
    pub stop: Option<&'a Stop>,
}

/// Result of one least-squares fit (stage).
pub(in crate::fit) struct StageEnd {
    /// Full parameter vector at the end of the stage.
    pub x: DVector<f64>,
    pub solution: Solution,
    pub gauge: Gauge,
}

impl<'a> Stage<'a> {
    /// Creates a stage with squared loss and the default limits of the solver. The σ of the poses
    /// count as declared.
    pub fn new(
        model: &'a Model,
        poses: Vec<Pose<'a>>,
        unknowns: Vec<usize>,
        solver: SolverChoice,
        cache: &'a LinearisationCache,
    ) -> Self {
        Self {
            model,
            declared: poses.iter().map(|pose| pose.sigma).collect(),
            declared_turn: poses.iter().find_map(|pose| pose.orientation).map(|turn| turn.sigma),
            poses: Arc::new(poses),
            unknowns,
            solver,
            custom_solver: None,
            max_steps: Settings::default().max_iterations,
            cost_tolerance: COST_TOLERANCE,
            loss: Loss::Squares,
            counts_fixed: false,
            cache,
            linear_model: None,
            earlier: None,
            progress: None,
            stop: None,
        }
    }

    /// Returns the parameters that the stage varies.
    pub fn parameters(&self) -> impl Iterator<Item = &'a Parameter> + '_ {
        self.unknowns.iter().map(|&k| &self.model.parameters[k])
    }

    /// Returns the places of the unknowns in the order of the parameters of the model.
    pub fn model_order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.unknowns.len()).collect();
        order.sort_by_key(|&place| self.unknowns[place]);
        order
    }

    /// Returns the prior σ of each unknown; `None` without a prior.
    pub fn prior_sigmas(&self) -> Vec<Option<f64>> {
        self.parameters().map(|parameter| parameter.sigma).collect()
    }

    /// Returns the number of measured coordinates of all poses.
    pub fn count(&self) -> usize {
        self.poses.iter().map(Pose::coordinates).sum()
    }

    /// Returns the number of residual rows that each pose has: three, or six if orientations are
    /// fitted. Rows that a pose does not need are 0.
    pub fn coordinates(&self) -> usize {
        if self.declared_turn.is_some() { 6 } else { 3 }
    }

    /// Returns the whitened residuals of the stage as a function of the unknowns; all other
    /// parameters are as in `at`.
    pub fn residuals(&self, at: &DVector<f64>) -> PoseResiduals<'a> {
        self.residuals_of(Arc::clone(&self.poses), at)
    }

    /// Returns the whitened residuals of `poses` as a function of the unknowns; all other
    /// parameters are as in `at`.
    pub fn residuals_of(
        &self,
        poses: impl Into<Arc<Vec<Pose<'a>>>>,
        at: &DVector<f64>,
    ) -> PoseResiduals<'a> {
        PoseResiduals::new(self.model, poses, self.unknowns.clone(), at.clone())
            .with_linear_model(self.linear_model)
    }

    /// Linearises the whitened data at `at`, each pose weighted by `loss`, without priors.
    pub fn linearised(&self, at: &DVector<f64>, loss: Loss) -> Linearisation {
        let residuals = self.residuals(at);
        self.cached(&residuals, at, loss).linearise(&residuals.unknowns_in(at))
    }

    /// Creates the objective of `residuals` with this loss. Fits with the same cache and equal data
    /// share its linearisations.
    fn cached<'b>(
        &'b self,
        residuals: &'b PoseResiduals<'a>,
        at: &DVector<f64>,
        loss: Loss,
    ) -> Fit<'b, PoseResiduals<'a>> {
        Fit::new(residuals).with_loss(loss).with_cache(self.cache, self.digest(at), self.unit())
    }

    /// Returns 1 σ of a coordinate of the first pose \[m\]: the unit in which cached linearisations
    /// are stored.
    fn unit(&self) -> f64 {
        self.poses.first().map_or(1.0, |pose| pose.sigma)
    }

    /// Returns a hash of the data, the unknowns, and the values in `at` of all other parameters. It
    /// does not change if the σ of all poses are multiplied by one factor.
    fn digest(&self, at: &DVector<f64>) -> u64 {
        let (mut digest, unit) = (DefaultHasher::new(), self.unit());
        let mut others = at.clone();
        self.unknowns.iter().for_each(|&k| others[k] = 0.0);
        self.unknowns.hash(&mut digest);
        let mut put = |value: f64| digest.write_u64(value.to_bits());
        others.iter().copied().for_each(&mut put);
        for pose in self.poses.iter() {
            let PoseView {
                configuration,
                payload,
                hoist,
                temperature,
                time,
                elapsed,
                approach,
                covariates,
                past,
                offsets: _,
            } = &pose.setup;
            let columns =
                configuration.iter().chain(approach.iter().copied().flatten()).chain(*covariates);
            columns.chain(pose.measured).copied().for_each(&mut put);
            [*payload, *hoist, *temperature]
                .map(|value| value.copied().unwrap_or(f64::NAN))
                .into_iter()
                .for_each(&mut put);
            [*time, *elapsed, pose.sigma / unit].into_iter().for_each(&mut put);
            put(pose.orientation.map_or(0.0, |orientation| orientation.sigma / unit));
            put(pose.base as f64);
            put(pose.target as f64);
            // All fits with the same cache share the table, so the row identifies the earlier poses
            // of the session.
            put(past.place().map_or(f64::NAN, f64::from));
        }
        self.poses.iter().for_each(|pose| pose.observation.hash(&mut digest));
        digest.finish()
    }

    /// Returns the triangular factor R of the whitened Jacobian at `at`, with the rows of earlier
    /// data, without priors.
    pub fn data_triangle(&self, at: &DVector<f64>) -> DMatrix<f64> {
        self.with_earlier(self.linearised(at, Loss::Squares).triangle, at)
    }

    /// Returns the triangular factor of `triangle` with the rows of earlier data appended below.
    pub fn with_earlier(&self, triangle: DMatrix<f64>, at: &DVector<f64>) -> DMatrix<f64> {
        match self.earlier {
            Some(_) => factor_of_stacked(&triangle, &self.earlier_rows(at).matrix),
            None => triangle,
        }
    }

    /// Returns the plausible size of each unknown \[SI\]; `None` for unknowns that have a prior or
    /// no plausible size.
    fn sizes(&self) -> Vec<Option<f64>> {
        self.parameters().map(|parameter| plausible_size(self.model, parameter)).collect()
    }

    /// Returns the triangular factor R of the whitened Jacobian at `at` with each pose weighted by
    /// the loss, with the rows of earlier data, without priors.
    pub fn weighted_triangle(&self, at: &DVector<f64>) -> DMatrix<f64> {
        self.with_earlier(self.linearised(at, self.loss).triangle, at)
    }

    /// Returns the triangular factor R of [`weighted_triangle`](Self::weighted_triangle) and the
    /// priors.
    pub fn triangle_with_priors(&self, at: &DVector<f64>) -> DMatrix<f64> {
        factor_of_stacked(&self.weighted_triangle(at), &self.priors())
    }

    /// Returns the values of the unknowns in the full parameter vector `at`.
    pub fn unknowns_in(&self, at: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&k| at[k]))
    }

    /// Returns the full parameter vector `at` with the unknowns replaced by `x`.
    pub fn full_vector(&self, at: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
        let mut full = at.clone();
        self.unknowns.iter().zip(x.iter()).for_each(|(&k, value)| full[k] = *value);
        full
    }

    /// Returns true if the full parameter vector `at` satisfies bounds and constraints.
    ///
    /// # Errors
    /// Returns an error if a constraint is not finite.
    pub fn allows(&self, at: &DVector<f64>) -> Result<bool, StageError> {
        let inside = self
            .unknowns
            .iter()
            .zip(self.parameters())
            .all(|(&k, parameter)| parameter.lower <= at[k] && at[k] <= parameter.upper);
        Ok(inside && self.constraints(at)?.1.contain(&self.unknowns_in(at)))
    }

    /// Finds the combinations of the unknowns that data, priors and `active` constraints do not
    /// determine at `at`; unknowns marked in `held` are left out.
    pub fn gauge(&self, at: &DVector<f64>, held: &[bool], active: &[ActiveLimit]) -> Gauge {
        let n = self.unknowns.len();
        if self.parameters().all(|parameter| parameter.sigma.is_some()) {
            let (rows, visible) = (DMatrix::zeros(0, n), vec![1.0; n]);
            return Gauge { rows, visible, moves: vec![0.0; n], weak: Vec::new() };
        }
        Gauge::new(&self.data_triangle(at), &self.priors(), &self.sizes(), held, active)
    }

    /// Minimises the cost over the unknowns, starting from the full parameter vector `start`.
    ///
    /// Combinations that are unidentifiable or weak at the start keep their start values; one that
    /// becomes weak later keeps the value that it has then. If a combination that is unidentifiable
    /// at the start is determined at the end, also by a bound or a constraint, the fit continues
    /// with it free.
    ///
    /// # Errors
    /// Returns an error if no values satisfy bounds and constraints, or if the fit was interrupted.
    pub fn run(&self, start: &DVector<f64>) -> Result<StageEnd, StageError> {
        let residuals = self.residuals(start);
        let mut begin = residuals.unknowns_in(start);
        let lower = DVector::from_iterator(begin.len(), self.parameters().map(|p| p.lower));
        let upper = DVector::from_iterator(begin.len(), self.parameters().map(|p| p.upper));
        let bounds = Bounds::new(lower, upper)?;
        let (_, rows) = self.constraints(start)?;
        if self.solver.within().is_some() || self.custom().is_some() {
            begin = solver::nearest(&begin, &bounds, &rows).ok_or(StageError::Infeasible)?;
        }
        let hold = begin.clone();
        let mut gauge = self.gauge(start, &vec![false; begin.len()], &[]);
        let (mut iterations, mut cost_evaluations, mut linearisations) = (0, 0, 0);
        loop {
            if self.stop.is_some_and(Stop::is_requested) {
                return Err(StageError::Interrupted);
            }
            let mut solution = self.solve(&residuals, begin, &hold, &gauge, (&bounds, &rows))?;
            if solution.termination == Termination::Interrupted {
                return Err(StageError::Interrupted);
            }
            iterations += solution.iterations;
            cost_evaluations += solution.cost_evaluations;
            linearisations += solution.linearisations;
            let x = residuals.full_vector(&solution.x);
            let held: Vec<bool> = solution.at_bound.iter().map(Option::is_some).collect();
            let now = self.gauge(&x, &held, &self.held(&x)?);
            if now.rows.nrows() >= gauge.rows.nrows() || !solution.termination.converged() {
                (solution.iterations, solution.cost_evaluations) = (iterations, cost_evaluations);
                solution.linearisations = linearisations;
                let weak = now.weak.clone();
                let held = if now.rows.nrows() > gauge.rows.nrows() { now } else { gauge };
                return Ok(StageEnd { x, solution, gauge: Gauge { weak, ..held } });
            }
            gauge = now;
            begin = solution.x;
        }
    }

    /// Minimises the cost from the unknowns `begin`. The combinations of `gauge` keep the values
    /// that they have in `hold`.
    fn solve(
        &self,
        residuals: &PoseResiduals<'a>,
        begin: DVector<f64>,
        hold: &DVector<f64>,
        gauge: &Gauge,
        (bounds, rows): (&Bounds, &Inequalities),
    ) -> Result<Solution, StageError> {
        let priors = self.priors();
        let none = DVector::zeros(priors.nrows());
        let fit = self
            .cached(residuals, &residuals.full_vector(&begin), self.loss)
            .with_rows(LinearRows { matrix: priors, constant: none })?
            .with_rows(LinearRows { matrix: gauge.rows.clone(), constant: -(&gauge.rows * hold) })?
            .with_rows(self.earlier_rows(&residuals.full_vector(hold)))?;
        let sizes = self.sizes();
        let fit = StabilisedObjective { objective: fit, sizes: &sizes };
        let settings = Settings {
            max_iterations: self.max_steps,
            cost_tolerance: self.cost_tolerance,
            ..Settings::default()
        };
        if let Some(custom) = self.custom() {
            return Ok(custom.minimise(&fit, begin, bounds, self.max_steps));
        }
        let watched = self.progress.is_some() || self.stop.is_some();
        let reporter = watched.then(|| Reporter {
            sink: self.progress.map(Arc::clone),
            stop: self.stop.cloned(),
            unknowns: self.unknowns.len(),
            poses: self.poses.len(),
        });
        if let Some(within) = self.solver.within() {
            return Ok(solver::minimise_constrained_by(
                within,
                fit,
                begin,
                (bounds, rows),
                &settings,
                reporter,
            ));
        }
        Ok(match self.solver {
            SolverChoice::GaussNewton => {
                let max_iterations =
                    self.max_steps.min(GaussNewtonSettings::default().max_iterations);
                let settings =
                    GaussNewtonSettings { max_iterations, ..GaussNewtonSettings::default() };
                solver::minimise_gauss_newton(fit, begin, &settings)
            }
            SolverChoice::PseudoInverse => {
                let max_iterations =
                    self.max_steps.min(PseudoInverseSettings::default().max_iterations);
                let settings =
                    PseudoInverseSettings { max_iterations, ..PseudoInverseSettings::default() };
                solver::minimise_pseudo_inverse_observed(fit, begin, &settings, reporter)
            }
            _ => solver::minimise_observed(fit, begin, &settings, reporter),
        })
    }

    /// Returns the solver of the caller if [`SolverChoice::Custom`] is chosen, else `None`.
    fn custom(&self) -> Option<&'a dyn CustomSolver> {
        self.custom_solver.filter(|_| self.solver == SolverChoice::Custom)
    }

    /// Returns the cost at the full parameter vector `at`: ½Σρ of the data, and ½‖r‖² of priors and
    /// earlier data.
    pub fn cost(&self, at: &DVector<f64>) -> f64 {
        let residuals = self.residuals(at);
        let x = residuals.unknowns_in(at);
        Fit::new(&residuals).with_loss(self.loss).cost(&x)
            + 0.5 * (self.priors() * &x).norm_squared()
            + 0.5 * self.earlier_squares(at, &x)
    }

    /// Returns the rows of earlier data as linear functions of the unknowns, with all other
    /// parameters as in `at`; no rows without earlier data.
    pub fn earlier_rows(&self, at: &DVector<f64>) -> LinearRows {
        let n = self.unknowns.len();
        match self.earlier {
            Some(earlier) => earlier.on(self.model, &self.unknowns, at),
            None => LinearRows { matrix: DMatrix::zeros(0, n), constant: DVector::zeros(0) },
        }
    }

    /// Returns the squared length of the rows of earlier data at the unknowns `x`.
    fn earlier_squares(&self, at: &DVector<f64>, x: &DVector<f64>) -> f64 {
        let rows = self.earlier_rows(at);
        (rows.matrix * x + rows.constant).norm_squared()
    }

    /// Returns the matrix of the rows x / σ of the priors, shape = (priors, unknowns).
    pub fn priors(&self) -> DMatrix<f64> {
        let sigmas: Vec<(usize, f64)> = self
            .parameters()
            .enumerate()
            .filter_map(|(j, parameter)| Some((j, parameter.sigma?)))
            .collect();
        let mut rows = DMatrix::zeros(sigmas.len(), self.unknowns.len());
        for (i, &(j, sigma)) in sigmas.iter().enumerate() {
            rows[(i, j)] = sigma.recip();
        }
        rows
    }
}

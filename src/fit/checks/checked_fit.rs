//! Input of the checks: a fit with the data that they examine.

use std::cell::OnceCell;

use nalgebra::{DMatrix, DVector, Vector3};

use super::finding::Finding;
use super::misreading::Explanations;
use super::outliers::Outlier;
use super::point_spread::PointSpread;
use super::pose_sufficiency::PoseSufficiency;
use super::row_kind::{RowKind, spread};
use crate::fit::SolverChoice;
use crate::fit::errors::Errors;
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::stage::Stage;
use crate::fit::stages::strategy::Strategy;
use crate::fit::uncertainty::noise::{Noise, together};
use crate::fit::uncertainty::prior_sizes::PriorSize;
use crate::fit::uncertainty::refuted_priors::RefutedPrior;
use crate::fit::uncertainty::second_solution::SecondSolution;
use crate::fit::uncertainty::statistics::Statistics;
use crate::least_squares::{LinearisationCache, Loss};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::numeric::root_mean;
use crate::problem::{JointKind, Observation, Problem};

/// Maximum number of solver steps of a further fit with another problem.
const MAX_FURTHER_STEPS: u64 = 60;

/// Fit to which the checks are applied, with the data that they need.
pub(in crate::fit) struct CheckedFit<'a> {
    pub fitting: &'a Fitting<'a>,
    pub problem: &'a Problem,
    /// Full parameter vector of the registered nominal arm.
    pub registered_x: &'a DVector<f64>,
    /// Result of the fit: parameters and active bounds at its end.
    pub end: &'a FitEnd,
    /// Errors of the registered nominal arm (base and target fitted where they are free).
    pub registered: &'a Errors,
    /// Errors of the arm with all parameters fitted.
    pub fitted: &'a Errors,
    /// Identification rows whose residual is too large to be noise.
    pub outliers: &'a [Outlier],
    /// Held-out rows whose prediction error is too large for its uncertainty.
    pub held_out_outliers: &'a [Outlier],
    /// Stage that fits all unknowns to the identification rows. It holds both the declared σ and
    /// those that the fit assumed.
    pub whole: &'a Stage<'a>,
    /// Triangular factor of the whitened Jacobian of the unknowns of `whole`, without priors, at
    /// the registered nominal arm.
    pub triangle: &'a DMatrix<f64>,
    /// True if the problem or the table declares the σ of positions.
    pub has_declared_noise: bool,
    /// Source of the σ of the measurements: declared, estimated or unknown.
    pub noise: Noise,
    /// Noise variance that the fit assumed, relative to the declared one.
    pub noise_factor: f64,
    /// 1 σ that the fit assumed for a coordinate of positions, or of the first kind of rows if none
    /// measures a position \[m\] or \[rad\].
    pub sigma_taken: f64,
    /// Covariance of all unknowns of the fit, shape = (unknowns, unknowns); 0 in rows and columns
    /// of held unknowns.
    pub covariance: &'a DMatrix<f64>,
    /// Statistics of all unknowns of the fit.
    pub statistics: &'a Statistics,
    /// True if further fits may search for the cause of a misfit. Fits that are only compared with
    /// one another do without.
    pub has_further_fits: bool,
    /// Second optimum that the measurements do not exclude; `None` if none was found.
    pub second: Option<&'a SecondSolution>,
    /// Rules of `[parameters]` whose σ the data refute.
    pub refuted_priors: &'a [RefutedPrior],
    /// Number of different poses and of independent coordinates, with findings if they are too few
    /// for the unknowns.
    pub poses: &'a PoseSufficiency,
    /// Finding that the fit did not converge; `None` if it converged.
    pub not_converged: Option<&'a Finding>,
    /// Prior widths that the fitted deviations contradict.
    pub prior_sizes: &'a [PriorSize],
    /// Scatter of the predicted target at each touched point: with the registered nominal arm and
    /// with the fitted arm. The flag is true if all rows of the point are held out.
    pub spreads: &'a [(PointSpread, PointSpread, bool)],
    /// Misreadings of the input that would explain the misfit; the search for them runs at first
    /// use.
    pub explanations: OnceCell<Explanations>,
}

impl<'a> CheckedFit<'a> {
    /// Returns true if the strategy fits a rigid arm although the problem declares elasticity.
    pub fn ignores_elasticity(&self) -> bool {
        self.fitting.strategy == Strategy::Rigid && self.problem.is_elastic()
    }

    /// Returns the table of measurements.
    pub fn table(&self) -> &'a Measurements {
        self.fitting.measurements
    }

    /// Returns the identification rows.
    pub fn rows(&self) -> &'a [usize] {
        &self.fitting.split.identification
    }

    /// Returns the model of the arm.
    pub fn model(&self) -> &'a Model {
        self.fitting.model
    }

    /// Returns the errors measured − predicted of some rows with the full parameter vector `x`.
    pub fn errors_at(&self, rows: &[usize], x: &DVector<f64>) -> Vec<Vector3<f64>> {
        self.fitting.position_errors(rows, x)
    }

    /// Returns the identification rows grouped by their kind, positions first; rows that do not
    /// involve the arm are left out.
    pub fn kinds(&self) -> Vec<RowKind> {
        let kinds = self.fitting.measurements.kinds().into_iter().filter(|kind| kind.is_of_arm());
        kinds.map(|kind| self.kind(kind)).filter(|kind| !kind.rows.is_empty()).collect()
    }

    /// Returns the identification rows of the leading kind (positions, if there are any).
    pub fn leading(&self) -> RowKind {
        self.kind(self.fitting.measurements.leading())
    }

    /// Collects the identification rows of the same kind as `observation`, with their spread and σ.
    pub fn kind(&self, observation: Observation) -> RowKind {
        let Fitting { measurements, placement, split, .. } = self.fitting;
        let is_of_kind = |row: usize| measurements.observation(row).kind() == observation.kind();
        let (places, rows): (Vec<usize>, Vec<usize>) = split
            .identification
            .iter()
            .copied()
            .enumerate()
            .filter(|&(_, row)| is_of_kind(row))
            .unzip();
        let is_measured_directly = observation.is_measured_directly();
        let target_places = if is_measured_directly {
            Vec::new()
        } else {
            let poses = self.fitting.poses(&rows);
            self.fitting.model.predicted_targets(&poses, self.registered_x.as_slice())
        };
        let point = |place: usize| {
            if is_measured_directly {
                measurements.positions[rows[place]]
            } else {
                target_places[place]
            }
        };
        let declared = together(places.iter().map(|&place| self.whole.declared[place]));
        let assumed = together(places.iter().map(|&place| self.whole.poses[place].sigma));
        RowKind {
            observation,
            spread: spread(placement, &rows, point),
            declared_sigma: self.has_declared_noise.then_some(declared),
            taken_sigma: assumed,
            rows,
        }
    }

    /// Returns what `result` returns for the same rows and options with another problem, at the
    /// declared σ. `None` if the model of this problem cannot be built.
    pub fn with_problem<R>(
        &self,
        problem: &Problem,
        result: impl FnOnce(&Fitting) -> R,
    ) -> Option<R> {
        self.with_strategy(self.fitting.strategy.without_sweeps(), problem, result)
    }

    /// Returns the rms residual of the rows of `kind` with strategy joint; `None` if that is the
    /// strategy of the fit.
    pub fn joint_rms(&self, kind: &RowKind) -> Option<f64> {
        let is_joint = self.fitting.strategy == Strategy::Joint;
        let refit = || {
            self.with_strategy(Strategy::Joint, self.problem, |fitting| {
                let end = fitting.refitted()?;
                Some(self.rms(&kind.rows, &fitting.position_errors(&kind.rows, &end.x)))
            })
        };
        if is_joint { None } else { refit()? }
    }

    /// Does the work of [`with_problem`](Self::with_problem) with another strategy.
    fn with_strategy<R>(
        &self,
        strategy: Strategy,
        problem: &Problem,
        result: impl FnOnce(&Fitting) -> R,
    ) -> Option<R> {
        let Fitting { placement, measurements, split, .. } = *self.fitting;
        let declared = Model::new(problem, &placement.bases, &placement.targets).ok()?;
        let model = &strategy.model(declared);
        // The other model needs a new cache, because its linearisations differ.
        let cache = &LinearisationCache::default();
        Some(result(&Fitting {
            model,
            held_out_only: placement.held_out_only(model, measurements, split),
            strategy,
            solver: SolverChoice::Auto.decide(model),
            custom_solver: None,
            progress: None,
            max_steps: Some(MAX_FURTHER_STEPS),
            cache,
            linear_model: None,
            ..self.fitting.with_declared_noise()
        }))
    }

    /// Returns true if further fits may show which declaration causes that the measurements contradict
    /// the declared σ.
    pub fn contradicts_noise(&self) -> bool {
        self.noise == Noise::Declared
            && self.noise_factor > 1.0
            && self.has_further_fits
            && self.fitting.earlier.is_none()
    }

    /// Returns true if the joint at index `joint` takes an angle as its command.
    pub fn turns(&self, joint: usize) -> bool {
        self.problem.joints[joint].command_kind() == JointKind::Revolute
    }

    /// Calls `evaluate` with the fit of the identification rows `rows` of `table` alone, which has the
    /// rows of the table of this fit, to their positions.
    pub fn with_rows<R>(
        &self,
        table: &Measurements,
        rows: &[usize],
        evaluate: impl FnOnce(&Fitting) -> R,
    ) -> R {
        let Fitting { placement, model, .. } = *self.fitting;
        let split = &Split { identification: rows.to_vec(), held_out: Vec::new() };
        let held_out_only = placement.held_out_only(model, table, split);
        let declared = self.fitting.with_declared_noise();
        evaluate(&Fitting {
            split,
            measurements: table,
            turn_sigma: None,
            held_out_only,
            ..declared
        })
    }

    /// Returns the rms error of the nominal arm after its registration to the `rows` of `table`
    /// alone \[m\].
    pub fn registration_error(&self, table: &Measurements, rows: &[usize]) -> Option<f64> {
        self.with_rows(table, rows, |fitting| {
            let x = fitting.registered().ok()?;
            Some(self.rms(rows, &fitting.position_errors(rows, &x)))
        })
    }

    /// Returns the root mean squared error of some identification rows with the full parameter vector
    /// `x`, in their unit ([`rms`](Self::rms)).
    pub fn rms_at(&self, rows: &[usize], x: &DVector<f64>) -> f64 {
        self.rms(rows, &self.fitting.position_errors(rows, x))
    }

    /// Returns the root mean squared length of the `errors` of some identification rows, in their
    /// unit. Rows that a robust loss treats as outliers are left out.
    pub fn rms(&self, rows: &[usize], errors: &[Vector3<f64>]) -> f64 {
        let is_robust = self.fitting.loss != Loss::Squares;
        let is_set_aside =
            |row: usize| is_robust && self.outliers.iter().any(|outlier| outlier.row == row);
        let kept = rows
            .iter()
            .zip(errors)
            .filter(|(row, _)| !is_set_aside(**row))
            .map(|(_, error)| error.norm_squared());
        root_mean(kept)
    }
}

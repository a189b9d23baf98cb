//! Corrections of an identified arm's predictions, with their uncertainty.

use std::collections::{HashMap, HashSet};

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::judge::Conditioned;
use super::linearise::Linearisation;
use super::placement_fit::PlacementFit;
use super::posterior::{Posterior, RowFactors, RowPosterior};
use super::rows::{AXES, Layout, Rows, SiteKind};
use super::scores::{Scores, applied_share, expected_size};
use super::training_rows::TrainingRows;
use crate::fit::Identification;
use crate::model::parameter::Parameter;
use crate::model::{Model, Pose};
use crate::problem::{Observation, PoseView, Problem};

/// Smallest part of the correction that is applied at a pose, 0 to 1, at which the pose does not
/// count as extrapolated.
const MIN_SHARE: f64 = 0.5;
/// Margin on either side of an input's measured range, as a fraction of the range, within which a
/// pose is not extrapolated.
const RANGE_MARGIN: f64 = 0.02;
/// Number of poses corrected at a time, which limits the matrix of features to about 10 MB.
const POSES_PER_CHUNK: usize = 400;

/// Correction of the positions that an identified arm predicts, with their uncertainty.
///
/// At a pose with inputs q, the correction is w(q) (J δ + Σⱼ Aⱼ eⱼ(q)). δ is the change of the
/// parameters when they are fitted together with the remainder, and J the Jacobian of the position.
/// eⱼ is the error of joint j, and Aⱼ the derivative of the position with respect to it. The share
/// w falls to 0 far from all measured poses. Without a remainder the correction is 0.
#[derive(Debug, Clone)]
pub struct Correction {
    /// Name of the problem, and digest of the declared arm, that the correction was fitted to.
    pub(super) problem: String,
    pub(super) arm_digest: String,
    /// 1 σ of the noise of rows for which the table gives none \[m\].
    pub(super) sigma: f64,
    pub(super) layout: Layout,
    /// Free parameters, in the order of the posterior's parameter columns.
    pub(super) parameters: Vec<LinearisedParameter>,
    pub(super) posterior: Posterior,
    /// Ratios of error to expected error of training rows that were left out.
    pub(crate) scores: Scores,
}

/// Free parameter, with its value at the point where the arm was linearised: the identified one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearisedParameter {
    pub name: String,
    /// Deviation of the estimate from the nominal value, SI.
    pub deviation: f64,
    /// Estimated value, SI.
    pub estimate: f64,
}

/// Parameters of a correction that a model contains, too.
struct SharedParameters {
    /// For each shared parameter, its column in the posterior and its index in the model.
    indices: Vec<(usize, usize)>,
    /// Deviation of each parameter of the correction in the model, minus the one at which the
    /// correction was linearised; 0 for a parameter that the model lacks.
    moved: DVector<f64>,
}

/// Correction of one predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectedPose {
    /// Vector that is added to the predicted position, measuring frame \[m\].
    pub shift: Vector3<f64>,
    /// Covariance of measured − predicted, measuring frame \[m²\]. It adds the covariances of
    /// parameters and remainder, of the noise, and of the part of the correction that is not
    /// applied.
    pub covariance: Matrix3<f64>,
    /// Expected root mean square of the error length ‖measured − predicted‖ \[m\]. Multiplied by
    /// `Scores::quantile`, it is an error bound.
    pub size: f64,
    /// Distance \[m\] by which unknown directions of approach may move the position, to either side.
    pub aside: f64,
    /// True if an input of the pose is outside its measured range. Also true if less than half of
    /// the correction is applied, because measured poses are far away.
    pub is_extrapolated: bool,
}

impl CorrectedPose {
    /// Returns 1 σ of measured − predicted along each axis \[m\].
    pub fn error_sigma(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(f64::sqrt)
    }
}

impl Correction {
    /// Creates the correction of the arm identified in `found`, which was conditioned on the
    /// training rows.
    pub(super) fn new(
        (found, problem): (&Identification, &Problem),
        TrainingRows { layout, unknowns, sigma, .. }: &TrainingRows,
        Conditioned { posterior, scores }: Conditioned,
    ) -> Self {
        let mut layout = layout.clone();
        if posterior.hyper.sites() == 0 {
            layout.sites.clear();
            layout.inputs.sites.clear();
        }
        let parameter = |&k: &usize| LinearisedParameter {
            name: found.estimates[k].name.clone(),
            deviation: found.x[k],
            estimate: found.estimates[k].estimate,
        };
        Self {
            problem: problem.name.clone(),
            arm_digest: problem.digest(),
            sigma: *sigma,
            layout,
            parameters: unknowns.iter().map(parameter).collect(),
            posterior,
            scores,
        }
    }

    /// Returns true if the correction contains a remainder, so that positions change.
    pub(crate) fn has_remainder(&self) -> bool {
        self.posterior.hyper.sites() > 0
    }

    /// Returns the root mean square ratio of the errors of left-out configurations to their
    /// expected lengths; 1 is expected. `None` if no configuration was left out.
    pub(crate) fn left_out_scale(&self) -> Option<f64> {
        self.scores.scale()
    }

    /// Returns the expected length of the noise of one position \[m\]. It contains the misfit that
    /// the correction does not describe.
    pub(crate) fn noise_length(&self) -> f64 {
        (AXES as f64 * self.posterior.hyper.noise_variance_of(1.0)).sqrt()
    }

    /// Returns the length \[m\] that errors do not exceed with probability `level`, over all poses
    /// with the expected error lengths `sizes` \[m\] together. `certainty` holds the confidence in
    /// the bound and the degrees of freedom of the scores, as for [`Scores::pooled_bound`].
    pub(crate) fn pooled_bound(
        &self,
        sizes: &[f64],
        level: f64,
        certainty: (f64, f64),
    ) -> Option<f64> {
        self.scores.pooled_bound(sizes, level, certainty)
    }

    /// Returns the names of the free parameters of those bases and tools of `model` that the
    /// correction lacks: no row of their session or target was fitted.
    pub(super) fn unseen_placements<'a>(&self, model: &'a Model) -> HashSet<&'a str> {
        let owner = |name: &str| name.split('.').next().unwrap_or_default().to_owned();
        let seen: HashSet<String> =
            self.parameters.iter().map(|parameter| owner(&parameter.name)).collect();
        let is_unseen = |parameter: &&Parameter| {
            parameter.site.is_placement() && !seen.contains(&owner(&parameter.name))
        };
        let unseen = model.parameters.iter().filter(is_unseen);
        unseen.map(|parameter| parameter.name.as_str()).collect()
    }

    /// Returns the indices of the joints whose coordinate errors the remainder describes, counted
    /// from 0.
    pub(crate) fn joints(&self) -> Vec<usize> {
        let coordinates = self.layout.sites.iter().filter(|of| of.kind == SiteKind::Coordinate);
        coordinates.map(|site| site.joint).collect()
    }

    /// Returns the names of the quantities on which the joints' errors depend: `q1`, …,
    /// `temperature`, `payload`, `hoist`.
    pub(crate) fn inputs(&self) -> Vec<String> {
        self.layout.inputs.sources.iter().map(|source| source.name()).collect()
    }

    /// Returns the names of the free parameters, and the posterior covariance of their deviations
    /// from nominal, shape = (parameters, parameters).
    pub(crate) fn parameter_covariance(&self) -> (Vec<&str>, DMatrix<f64>) {
        let names = self.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        (names, self.posterior.parameter_covariance())
    }

    /// Returns the corrections of `poses`, with the arm at the full parameter vector `x` of
    /// `model`. They are NaN for poses without equilibrium.
    ///
    /// A pose of the arm that measures less than a position gets the correction of the position,
    /// too. The parameters `placed` of bases and tools are fitted to the corrected positions that
    /// use them. The part of the correction that this fit reproduces is removed from mean and
    /// covariance.
    pub(crate) fn at(
        &self,
        (problem, model, x): (&Problem, &Model, &DVector<f64>),
        placed: &[usize],
        poses: &[Pose],
    ) -> Vec<CorrectedPose> {
        let shared = self.shared_parameters(model, x);
        let placed = PlacementFit::new((problem, model, x), placed, poses);
        let mut poses = poses.to_vec();
        for pose in &mut poses {
            if pose.observation.is_of_arm() && !pose.observation.is_of_position() {
                (pose.observation, pose.sigma) = (Observation::Position, self.sigma);
            }
        }
        let of_chunk = |poses: &[Pose]| self.factors(&shared, (problem, model, x), poses);
        let chunks = || {
            poses.chunks(POSES_PER_CHUNK).enumerate().map(|(k, poses)| (POSES_PER_CHUNK * k, poses))
        };
        let mut sums = None;
        for (first, poses) in chunks().filter(|_| placed.has_columns()) {
            placed.add_to(&mut sums, first, &of_chunk(poses).1);
        }
        let corrected = |(first, poses): (usize, &[Pose])| {
            let (rows, mut factors) = of_chunk(poses);
            let mut noise_shares = vec![Vector3::repeat(1.0); poses.len()];
            if let Some(taken) = &sums {
                placed.subtract(taken, first, &mut factors);
                for (k, share) in noise_shares.iter_mut().enumerate() {
                    *share = placed.remaining_noise_shares(first + k);
                }
            }
            self.corrected(&rows, (&factors, &noise_shares), poses)
        };
        chunks().flat_map(corrected).collect()
    }

    /// Finds the parameters of the correction in `model`, and how far `x` moved them from the point
    /// where the correction was linearised.
    fn shared_parameters(&self, model: &Model, x: &DVector<f64>) -> SharedParameters {
        let indices: HashMap<&str, usize> = model
            .parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| (parameter.name.as_str(), k))
            .collect();
        let index = |parameter: &LinearisedParameter| indices.get(parameter.name.as_str()).copied();
        let shared = self.parameters.iter().enumerate();
        let shared = shared.filter_map(|(column, parameter)| Some((column, index(parameter)?)));
        let indices: Vec<(usize, usize)> = shared.collect();
        let mut moved = DVector::zeros(self.parameters.len());
        for &(column, k) in &indices {
            moved[column] = x[k] - self.parameters[column].deviation;
        }
        SharedParameters { indices, moved }
    }

    /// Returns the linearised rows of some poses and the posterior of their corrections. The change
    /// of the parameters that `x` already contains is subtracted. For poses without equilibrium,
    /// the residual is NaN and all else is 0.
    fn factors(
        &self,
        SharedParameters { indices, moved }: &SharedParameters,
        (problem, model, x): (&Problem, &Model, &DVector<f64>),
        poses: &[Pose],
    ) -> (Rows, RowFactors) {
        let unknowns = indices.iter().map(|&(_, k)| k).collect();
        let linearisation = Linearisation { problem, model, x, unknowns, sigma: self.sigma };
        let mut rows = linearisation.rows(&self.layout, poses.to_vec());
        let mut jacobian = DMatrix::zeros(AXES * poses.len(), self.parameters.len());
        for (from, &(column, _)) in indices.iter().enumerate() {
            jacobian.set_column(column, &rows.jacobian.column(from));
        }
        rows.jacobian = jacobian;
        for coordinate in (0..AXES * poses.len()).filter(|&k| rows.residual[k].is_nan()) {
            rows.jacobian.row_mut(coordinate).fill(0.0);
            rows.sites.column_mut(coordinate).fill(0.0);
        }
        let mut factors = self.posterior.factors(&rows);
        factors.mean -= &rows.jacobian * moved;
        (rows, factors)
    }

    /// Returns the part of each correction that is applied, with its uncertainty. `noise_shares`
    /// are the fractions of the noise variance that remain in the coordinates after bases and tools
    /// are fitted.
    fn corrected(
        &self,
        rows: &Rows,
        (factors, noise_shares): (&RowFactors, &[Vector3<f64>]),
        poses: &[Pose],
    ) -> Vec<CorrectedPose> {
        let hyper = &self.posterior.hyper;
        let of_row = |(row, RowPosterior { mean, covariance, prior }): (usize, RowPosterior)| {
            let lost = rows.residual[AXES * row].is_nan();
            let share = applied_share(covariance.trace(), prior);
            let has_remainder = self.has_remainder();
            let missed = if has_remainder { (1.0 - share) * mean.norm() } else { 0.0 };
            let noise = noise_shares[row] * hyper.noise_variance_of(rows.relative_sigma[row]);
            let variance = covariance.diagonal().map(|value| value.max(0.0)) + noise;
            let added = variance.add_scalar(missed * missed / AXES as f64) - covariance.diagonal();
            let blank = if lost { f64::NAN } else { 0.0 };
            CorrectedPose {
                shift: (if has_remainder { mean * share } else { Vector3::zeros() })
                    .add_scalar(blank),
                covariance: (covariance + Matrix3::from_diagonal(&added)).add_scalar(blank),
                size: expected_size(variance.sum(), missed) + blank,
                aside: 0.0,
                is_extrapolated: (has_remainder && share < MIN_SHARE)
                    || self.is_outside(&poses[row].setup),
            }
        };
        factors.rows().into_iter().enumerate().map(of_row).collect()
    }

    /// Returns true if an input lies outside its measured range by more than the margin. An input
    /// that the pose does not state counts as inside.
    fn is_outside(&self, setup: &PoseView) -> bool {
        let inputs = &self.layout.inputs;
        inputs.sources.iter().zip(&inputs.ranges).any(|(source, &(low, high))| {
            let margin = RANGE_MARGIN * (high - low);
            source
                .value(setup)
                .is_some_and(|value| !(low - margin..=high + margin).contains(&value))
        })
    }
}

//! Corrections of an identified arm's predictions, with their uncertainty.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Vector3};

use super::judge::Conditioned;
use super::linearise::Linearisation;
use super::posterior::{Posterior, RowPosterior};
use super::rows::{AXES, Layout, Rows, SiteKind};
use super::scores::{Scores, expected_size, fade};
use crate::fit::Identification;
use crate::model::{Model, Pose};
use crate::problem::{PoseView, Problem};

/// Share of the correction that is applied, 0 to 1, below which a pose counts as extrapolated.
const MIN_SHARE: f64 = 0.5;
/// Margin on either side of an input's measured range, as a fraction of the range, within which a
/// pose is not extrapolated.
const RANGE_MARGIN: f64 = 0.02;
/// Number of poses corrected at a time, which limits the matrix of features to about 10 MB.
const CHUNK: usize = 400;

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
    pub(super) parameters: Vec<Linearised>,
    pub(super) posterior: Posterior,
    /// Ratios of error to expected error of training rows that were left out.
    pub(crate) scores: Scores,
}

/// Free parameter, with the value about which the arm was linearised.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linearised {
    pub name: String,
    /// Deviation of the estimate from the nominal value, SI.
    pub deviation: f64,
    /// Estimated value, SI.
    pub estimate: f64,
}

/// Correction of one predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectedPose {
    /// Vector that is added to the predicted position, measuring frame \[m\].
    pub shift: Vector3<f64>,
    /// 1 σ of measured − predicted along each axis \[m\], including the noise of the measurement.
    pub sigma: Vector3<f64>,
    /// Expected root mean square of the error length ‖measured − predicted‖ \[m\]. Its product with
    /// [`Scores::quantile`] is an error bound.
    pub size: f64,
    /// True if the pose lies outside the measured range, or too far from measured poses to apply
    /// half of the correction.
    pub is_extrapolated: bool,
}

impl Correction {
    /// Creates the correction of the arm identified in `found`, whose free parameters have the
    /// indices `unknowns`.
    pub(super) fn new(
        found: &Identification,
        problem: &Problem,
        (layout, unknowns): (&Layout, &[usize]),
        Conditioned { posterior, scores }: Conditioned,
    ) -> Self {
        let mut layout = layout.clone();
        if posterior.hyper.sites() == 0 {
            layout.sites.clear();
            layout.inputs.sites.clear();
        }
        let parameter = |&k: &usize| Linearised {
            name: found.estimates[k].name.clone(),
            deviation: found.x[k],
            estimate: found.estimates[k].estimate,
        };
        Self {
            problem: problem.name.clone(),
            arm_digest: problem.digest(),
            sigma: found.sigma,
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
    pub(crate) fn at(
        &self,
        problem: &Problem,
        model: &Model,
        x: &DVector<f64>,
        poses: &[Pose],
    ) -> Vec<CorrectedPose> {
        let places: HashMap<&str, usize> = model
            .parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| (parameter.name.as_str(), k))
            .collect();
        let place = |parameter: &Linearised| places.get(parameter.name.as_str()).copied();
        let known: Vec<(usize, usize)> = self
            .parameters
            .iter()
            .enumerate()
            .filter_map(|(column, parameter)| Some((column, place(parameter)?)))
            .collect();
        let mut moved = DVector::zeros(self.parameters.len());
        for &(column, k) in &known {
            moved[column] = x[k] - self.parameters[column].deviation;
        }
        let unknowns = known.iter().map(|&(_, k)| k).collect();
        let linearisation = Linearisation { problem, model, x, unknowns, sigma: self.sigma };
        let of_chunk = |poses: &[Pose]| {
            let mut rows = linearisation.rows(&self.layout, poses.to_vec());
            let mut jacobian =
                rows.jacobian.clone().resize_horizontally(self.parameters.len(), 0.0);
            jacobian.fill(0.0);
            for (from, &(column, _)) in known.iter().enumerate() {
                jacobian.set_column(column, &rows.jacobian.column(from));
            }
            rows.jacobian = jacobian;
            self.corrected(&rows, &moved, poses)
        };
        poses.chunks(CHUNK).flat_map(of_chunk).collect()
    }

    fn corrected(&self, rows: &Rows, moved: &DVector<f64>, poses: &[Pose]) -> Vec<CorrectedPose> {
        let change = &rows.jacobian * moved;
        let hyper = &self.posterior.hyper;
        let one = |(row, posterior): (usize, RowPosterior)| {
            let lost = rows.residual[AXES * row].is_nan();
            let share = fade(posterior.covariance.trace(), posterior.prior);
            let mean = posterior.mean - Vector3::from_fn(|axis, _| change[AXES * row + axis]);
            let has_remainder = self.has_remainder();
            let missed = if has_remainder { (1.0 - share) * mean.norm() } else { 0.0 };
            let noise = hyper.noise_variance_of(rows.relative_sigma[row]);
            let variance = posterior.covariance.diagonal().map(|value| value.max(0.0) + noise);
            let sigma = variance.map(|value| (value + missed * missed / AXES as f64).sqrt());
            let blank = if lost { f64::NAN } else { 0.0 };
            CorrectedPose {
                shift: (if has_remainder { mean * share } else { Vector3::zeros() })
                    .add_scalar(blank),
                sigma: sigma.add_scalar(blank),
                size: expected_size(variance.sum(), missed) + blank,
                is_extrapolated: (has_remainder && share < MIN_SHARE)
                    || self.is_outside(&poses[row].setup),
            }
        };
        self.posterior.at(rows).into_iter().enumerate().map(one).collect()
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

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

/// Share of a remainder below which a pose counts as extrapolated.
const MIN_SHARE: f64 = 0.5;
/// Part of the range of a command by which a pose may lie outside of it.
const RANGE_MARGIN: f64 = 0.02;
/// Poses that are corrected together: their features take some 10 MB.
const CHUNK: usize = 400;

/// Correction of the positions that an identified arm predicts, with the uncertainty of what is
/// predicted.
///
/// At a pose it is w(q) (J δ + Σⱼ Aⱼ eⱼ(q)): the parameters' change δ beside the remainder, and an
/// error eⱼ of each joint, carried by the columns Aⱼ of the arm's Jacobian. The share w falls to 0
/// where no measured pose is near. Without a remainder the correction is 0.
#[derive(Debug, Clone)]
pub struct Correction {
    /// Name of the problem and digest of the declared arm.
    pub(super) problem: String,
    pub(super) arm_digest: String,
    /// 1 σ of rows for which the table has none \[m\].
    pub(super) sigma: f64,
    pub(super) layout: Layout,
    /// Free parameters, in the order of the posterior's columns.
    pub(super) parameters: Vec<Linearised>,
    pub(super) posterior: Posterior,
    /// Scores of the rows fitted, left out.
    pub(crate) scores: Scores,
}

/// A free parameter that a correction was linearised about.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linearised {
    pub name: String,
    /// Deviation from nominal at the fit.
    pub deviation: f64,
    /// Estimated value \[SI\].
    pub estimate: f64,
}

/// Correction of one predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectedPose {
    /// What is added to the position that the identified arm predicts, measuring frame \[m\].
    pub shift: Vector3<f64>,
    /// 1 σ of measured − predicted along each axis \[m\].
    pub sigma: Vector3<f64>,
    /// Expected root mean square length of measured − predicted \[m\]; [`Scores::quantile`] times
    /// this is a bound.
    pub size: f64,
    /// True where the pose lies outside of what was measured.
    pub is_extrapolated: bool,
}

impl Correction {
    /// Correction of the arm identified in `found`, whose free parameters are `unknowns`.
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

    /// True if joints are corrected: if a remainder is applied.
    pub(crate) fn has_remainder(&self) -> bool {
        self.posterior.hyper.sites() > 0
    }

    /// Joints whose errors the remainder describes, counted from 0.
    pub(crate) fn joints(&self) -> Vec<usize> {
        let coordinates = self.layout.sites.iter().filter(|of| of.kind == SiteKind::Coordinate);
        coordinates.map(|site| site.joint).collect()
    }

    /// Names of the quantities on which the joints' errors depend: `q1`, …, `temperature`,
    /// `payload`, `hoist`.
    pub(crate) fn inputs(&self) -> Vec<String> {
        self.layout.inputs.sources.iter().map(|source| source.name()).collect()
    }

    /// Names of the free parameters and the posterior covariance of their deviations from nominal,
    /// shape = (parameters, parameters).
    pub(crate) fn parameter_covariance(&self) -> (Vec<&str>, DMatrix<f64>) {
        let names = self.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        (names, self.posterior.parameter_covariance())
    }

    /// Corrections of `poses`, with the arm at the full parameter vector `x` of `model`; NaN where
    /// a pose has no equilibrium.
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

    /// True if an input lies outside of the range that was measured, or is not stated.
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

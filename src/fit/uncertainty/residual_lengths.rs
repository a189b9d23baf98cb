//! Lengths of whitened residuals, and outliers among them.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::fit::stages::stage::Stage;
use crate::fit::stages::unmoved::Unmoved;
use crate::least_squares::residual_vector;
use crate::model::Pose;
use crate::numeric::median;

/// Probability that at least one of all poses is reported as an outlier although there is only
/// noise.
const FALSE_ALARM_PROBABILITY: f64 = 0.01;

/// Returns two lengths \[σ\] of normal residuals with `coordinates` coordinates: the median length
/// √χ², and the length that at least one of `count` residuals exceeds with probability 0.01
/// \[Bonferroni\]. `None` if `coordinates` is 0.
fn noise_lengths(count: usize, coordinates: usize) -> Option<(f64, f64)> {
    let squares = ChiSquared::new(coordinates as f64).ok()?;
    Some((
        squares.inverse_cdf(0.5).sqrt(),
        squares.inverse_cdf(1.0 - FALSE_ALARM_PROBABILITY / count.max(1) as f64).sqrt(),
    ))
}

/// Returns two lengths \[σ\] for each residual, given the numbers of `coordinates` of all
/// residuals: the median length of noise, and the length above which the residual is an outlier.
pub(in crate::fit) fn noise_lengths_of_all(coordinates: &[usize]) -> Vec<(f64, f64)> {
    let mut by_count: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    let of = |&count: &usize| {
        *by_count.entry(count).or_insert_with(|| {
            noise_lengths(coordinates.len(), count).unwrap_or((1.0, f64::INFINITY))
        })
    };
    coordinates.iter().map(of).collect()
}

/// Returns the scatter (1 σ) of whitened residuals with these `lengths`: the median of the ratios
/// of each length to the median length of noise, the first number of `noise_lengths`. Lengths that
/// are not finite are left out; without any other, the scatter is 0.
pub(in crate::fit) fn scatter(lengths: &[f64], noise_lengths: &[(f64, f64)]) -> f64 {
    let ratios = lengths.iter().zip(noise_lengths).map(|(length, (median, _))| length / median);
    median(ratios.filter(|ratio| ratio.is_finite())).unwrap_or(0.0)
}

/// Returns true for each whitened residual that is an outlier, given the `lengths` \[σ\] and
/// numbers of `coordinates` of all residuals. Lengths are compared with the scatter of the
/// residuals, or with 1 σ if that is larger.
pub(in crate::fit) fn are_outliers(lengths: &[f64], coordinates: &[usize]) -> Vec<bool> {
    let noise_lengths = noise_lengths_of_all(coordinates);
    let scatter = scatter(lengths, &noise_lengths).max(1.0);
    let pairs = lengths.iter().zip(&noise_lengths);
    pairs.map(|(length, (_, limit))| *length > limit * scatter).collect()
}

/// Typical scatter (1 σ) of a measured coordinate of a row \[m\], for tilts \[rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TypicalScatter {
    /// Median scatter of the residuals of all rows.
    Median(f64),
    /// Declared σ, which exceeds the median scatter.
    Declared(f64),
}

/// Lengths of the whitened residuals of all poses of a stage, with the scatter of a coordinate and
/// the limits above which a pose is an outlier.
#[derive(Debug, Clone)]
pub(in crate::fit) struct Lengths {
    /// Length ‖r‖ of the residual of each pose, in units of the declared σ.
    pub values: Vec<f64>,
    /// Length ‖r‖ of the residual of each pose, in units of the σ that the fit assumed.
    pub weighed: Vec<f64>,
    /// Scatter (1 σ) of a coordinate of the residuals, in units of the declared σ.
    pub scatter: f64,
    /// True if the median scatter is smaller than the declared σ times the factor of the noise
    /// model; `scatter` is then that factor.
    is_limited: bool,
    /// Declared 1 σ of a coordinate of each pose \[m\], for tilts \[rad\].
    declared: Vec<f64>,
    /// Length of the residual of each pose, relative to the scatter, above which the pose is an
    /// outlier.
    limits: Vec<f64>,
}

impl Lengths {
    /// Computes the lengths of a stage's residuals at the full parameter vector `x`.
    ///
    /// `freedom` is the number of degrees of freedom divided by that of coordinates, 0…1.
    /// `declared` is the factor by which the noise model multiplies the declared σ; `None` if none
    /// is declared. Components of residuals along `unmoved` directions are left out.
    ///
    /// A pose is an outlier if P(χ²ₖ > s²) < 0.01 / N, with s = ‖r‖ / scatter, k measured numbers
    /// and N poses \[Bonferroni\]. The scatter is the median of ‖r‖ / √(median of χ²ₖ), divided by
    /// √`freedom`; gross errors hardly change it. √(median of χ²₃) is 1.538. With a declared σ the
    /// scatter is at least `declared`. If the model lacks an effect that acts in all poses, the
    /// scatter grows with the residuals, so that not every pose becomes an outlier.
    pub fn new(
        stage: &Stage,
        at: &DVector<f64>,
        unmoved: &Unmoved,
        freedom: f64,
        declared: Option<f64>,
    ) -> Self {
        let residuals = stage.residuals(at);
        let whitened = residual_vector(&residuals, &residuals.unknowns_in(at));
        let length = |r: &[f64]| match unmoved.count() {
            0 => r[0].hypot(r[1]).hypot(r[2]),
            _ => unmoved.moved_part(Vector3::new(r[0], r[1], r[2])).norm(),
        };
        let items = || whitened.as_slice().chunks_exact(stage.coordinates());
        let with_orientation = |r: &[f64], position: f64| {
            if r.len() > 3 { position.hypot(length(&r[3..])) } else { position }
        };
        let weighed: Vec<f64> = items().map(|r| with_orientation(r, length(r))).collect();
        let in_declared = |(r, (pose, declared)): (&[f64], (&Pose, &f64))| {
            let position = length(r) * (pose.sigma / declared);
            match (pose.orientation, stage.declared_turn) {
                (Some(orientation), Some(sigma)) => {
                    position.hypot(length(&r[3..]) * (orientation.sigma / sigma))
                }
                _ => position,
            }
        };
        let values: Vec<f64> =
            items().zip(stage.poses.iter().zip(&stage.declared)).map(in_declared).collect();
        let min_scatter = declared.unwrap_or(0.0);
        let moved = |pose: &Pose| pose.coordinates().saturating_sub(unmoved.count()).max(1);
        let noise_lengths =
            noise_lengths_of_all(&stage.poses.iter().map(moved).collect::<Vec<_>>());
        let scatter = scatter(&values, &noise_lengths) / freedom.clamp(0.01, 1.0).sqrt();
        let limits = noise_lengths.into_iter().map(|(_, limit)| limit).collect();
        let is_limited = scatter < min_scatter;
        let scatter = scatter.max(min_scatter);
        Self { values, weighed, scatter, is_limited, declared: stage.declared.clone(), limits }
    }

    /// Returns the typical scatter (1 σ) of a coordinate of the pose with index `place`, in its
    /// unit.
    pub fn typical_scatter(&self, place: usize) -> TypicalScatter {
        let size = self.scatter * self.declared[place];
        if self.is_limited { TypicalScatter::Declared(size) } else { TypicalScatter::Median(size) }
    }

    /// Returns the length of the residual of the pose with index `place`, relative to the scatter;
    /// `None` if the pose is no outlier.
    pub fn outlying(&self, place: usize) -> Option<f64> {
        let (length, limit) = (self.values[place], self.limits[place]);
        (self.scatter > 0.0 && length > limit * self.scatter).then(|| length / self.scatter)
    }
}

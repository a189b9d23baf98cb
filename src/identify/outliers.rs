//! Poses whose residual is too long to be noise.

use nalgebra::{DVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::stage::Stage;
use crate::error::Location;
use crate::least_squares::residual_vector;
use crate::measurement::Measurements;
use crate::numeric::median;

/// Probability that noise alone makes any pose an outlier.
pub(super) const BY_CHANCE: f64 = 0.01;

/// A pose whose residual is too long to be noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Row of the measurements, counted from 0 over all files.
    pub row: usize,
    /// File and line.
    pub location: Location,
    /// Length of the whitened residual in units of the scatter \[σ\].
    pub distance: f64,
    /// Residual measured − predicted, measuring frame \[m\].
    pub error: Vector3<f64>,
}

/// Lengths of the whitened residuals of some poses, and what counts as too long.
#[derive(Debug, Clone)]
pub(super) struct Lengths {
    /// ‖r‖ of each pose in units of its declared σ.
    pub values: Vec<f64>,
    /// The same in units of the σ that the fit took.
    pub weighed: Vec<f64>,
    /// 1 σ of the scatter in units of the assumed one.
    pub scatter: f64,
    limit: f64,
}

impl Lengths {
    /// Of a stage at the full parameter vector `at`; `freedom` is the part of its coordinates that is left to scatter, 0…1, and
    /// `declared` the part of the declared σ that the fit took to be noise, where any σ was declared.
    ///
    /// A pose is an outlier where P(χ²₃ > s²) < 0.01 / N, with s = ‖r‖ / scatter and N poses \[Bonferroni\]. The scatter is
    /// median ‖r‖ / 1.538 (√ of the median of χ²₃), which gross errors hardly move, over √`freedom`; under a declared σ it
    /// is no less than that part of it. So a model that misses some effect everywhere does not turn every pose into an outlier.
    pub fn of(stage: &Stage, at: &DVector<f64>, freedom: f64, declared: Option<f64>) -> Self {
        let residuals = stage.residuals(at);
        let whitened = residual_vector(&residuals, &residuals.reduced(at));
        let weighed: Vec<f64> = whitened.as_slice().chunks_exact(3).map(|r| r[0].hypot(r[1]).hypot(r[2])).collect();
        let taken = stage.poses.iter().zip(&stage.declared).map(|(pose, declared)| pose.sigma / declared);
        let values: Vec<f64> = weighed.iter().zip(taken).map(|(length, taken)| length * taken).collect();
        let least = declared.unwrap_or(0.0);
        // Three degrees of freedom are a distribution.
        let Ok(squares) = ChiSquared::new(3.0) else {
            return Self { values, weighed, scatter: 1.0, limit: f64::INFINITY };
        };
        let scatter = median(values.iter().copied()).unwrap_or(0.0)
            / squares.inverse_cdf(0.5).sqrt()
            / freedom.clamp(0.01, 1.0).sqrt();
        let limit = squares.inverse_cdf(1.0 - BY_CHANCE / values.len().max(1) as f64).sqrt();
        Self { values, weighed, scatter: scatter.max(least), limit }
    }

    /// Length of a residual in units of the scatter, if it is an outlier.
    pub fn outlying(&self, length: f64) -> Option<f64> {
        (self.scatter > 0.0 && length > self.limit * self.scatter).then(|| length / self.scatter)
    }

    /// Number of outliers.
    pub fn outliers(&self) -> usize {
        self.values.iter().filter(|&&length| self.outlying(length).is_some()).count()
    }

    /// The outliers among `rows`, whose residuals these are, in the order of the rows.
    pub fn list(&self, rows: &[usize], errors: &[Vector3<f64>], measurements: &Measurements) -> Vec<Outlier> {
        let outlier = |((&row, &length), &error)| {
            let distance = self.outlying(length)?;
            Some(Outlier { row, location: measurements.location(row), distance, error })
        };
        rows.iter().zip(&self.values).zip(errors).filter_map(outlier).collect()
    }
}

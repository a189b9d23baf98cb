//! Position errors, summed up.

use nalgebra::Vector3;

use crate::measurement::Measurements;
use crate::observation::{Observation, kind_named};
use crate::quantity::Unit;

/// A value per axis of the measuring frame and for the Euclidean norm \[m\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxisValues {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
    /// Of the norm.
    pub norm: f64,
}

/// Size of the position errors of some poses \[m\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorSummary {
    /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)); of others
    /// than positions the errors are the rows' own residuals, along x where that is one number.
    pub kind: &'static str,
    /// Number of poses.
    pub n: usize,
    /// How many of them have no equilibrium: their errors, and with them mean, max and rms, are
    /// NaN.
    pub unpredicted: usize,
    /// Mean absolute value per axis, mean norm.
    pub mean: AxisValues,
    /// Largest absolute value per axis, largest norm.
    pub max: AxisValues,
    /// Root mean square per axis, root of the mean squared norm.
    pub rms: AxisValues,
}

/// Errors on both parts of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// On the poses that are fitted.
    pub identification: ErrorSummary,
    /// On the poses that decide nothing.
    pub held_out: ErrorSummary,
}

/// Errors of orientation \[rad\]: lengths and components of the rotation vectors from predicted to
/// measured, measuring frame.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationErrors {
    /// Of the nominal arm, with base and target fitted where they are free.
    pub registered: Errors,
    /// Of the identified arm.
    pub fitted: Errors,
    /// 1 σ about each axis that the fit took \[rad\].
    pub sigma_taken: f64,
}

/// The errors of those of some `rows` that measure the same kind of thing.
pub(super) fn of_kind(
    measurements: &Measurements,
    rows: impl IntoIterator<Item = usize>,
    errors: &[Vector3<f64>],
    observation: Observation,
) -> ErrorSummary {
    let is_of_kind = |row: usize| measurements.observation(row).kind() == observation.kind();
    let own: Vec<Vector3<f64>> = rows
        .into_iter()
        .zip(errors)
        .filter(|(row, _)| is_of_kind(*row))
        .map(|(_, error)| *error)
        .collect();
    ErrorSummary::of_kind(observation, &own)
}

impl ErrorSummary {
    /// Whether the errors are angles \[rad\], as those of tilts are.
    pub fn is_angle(&self) -> bool {
        kind_named(self.kind).unit == Unit::Angle
    }

    /// Of the errors measured − predicted of positions \[m\].
    pub fn of(errors: &[Vector3<f64>]) -> Self {
        Self::of_kind(Observation::Position, errors)
    }

    /// Of some rows' residuals, measured − predicted: of those of the first kind that the table
    /// has.
    pub fn of_rows(
        table: &Measurements,
        rows: impl IntoIterator<Item = usize>,
        errors: &[Vector3<f64>],
    ) -> Self {
        of_kind(table, rows, errors, table.leading())
    }

    /// Of the residuals of rows of one kind \[m\].
    pub fn of_kind(observation: Observation, errors: &[Vector3<f64>]) -> Self {
        let values: Vec<[f64; 4]> =
            errors.iter().map(|e| [e.x.abs(), e.y.abs(), e.z.abs(), e.norm()]).collect();
        let n = values.len().max(1) as f64;
        let over = |fold: &dyn Fn(f64, f64) -> f64, finish: &dyn Fn(f64) -> f64| {
            let axis = |k: usize| finish(values.iter().fold(0.0, |sum, value| fold(sum, value[k])));
            AxisValues { x: axis(0), y: axis(1), z: axis(2), norm: axis(3) }
        };
        Self {
            kind: observation.kind(),
            n: errors.len(),
            unpredicted: errors.iter().filter(|error| error.iter().any(|x| x.is_nan())).count(),
            mean: over(&|sum, v| sum + v, &|sum| sum / n),
            max: over(&|max, v| if v > max || v.is_nan() { v } else { max }, &|max| max),
            rms: over(&|sum, v| v.mul_add(v, sum), &|sum| (sum / n).sqrt()),
        }
    }
}

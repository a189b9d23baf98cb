//! Summaries of errors over the rows of a table.

use nalgebra::Vector3;

use crate::measurement::Measurements;
use crate::observation::{Observation, kind_named};
use crate::quantity::Unit;

/// Values per axis of the measuring frame and for the Euclidean norm \[m\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxisValues {
    /// Value along the x axis \[m\].
    pub x: f64,
    /// Value along the y axis \[m\].
    pub y: f64,
    /// Value along the z axis \[m\].
    pub z: f64,
    /// Value for the Euclidean norm of the error vector, in the unit of its axes.
    pub norm: f64,
}

/// Summary of the position errors of some poses \[m\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorSummary {
    /// Kind of the rows ([`Observation::kind`](crate::problem::Observation::kind)). Errors of other
    /// kinds than positions are residuals of the measured quantity; a single number counts along x.
    pub kind: &'static str,
    /// Number of rows whose errors are summarised.
    pub n: usize,
    /// Number of poses without an equilibrium; their errors, and so mean, max and rms, are NaN.
    pub unpredicted: usize,
    /// Mean absolute value per axis, and mean norm.
    pub mean: AxisValues,
    /// Largest absolute value per axis, and largest norm.
    pub max: AxisValues,
    /// Root mean square per axis, and root of the mean squared norm.
    pub rms: AxisValues,
    /// Image errors converted to lengths at the observed points \[m\]: mean, largest and root mean
    /// square; `None` for other kinds of rows.
    pub at_point: Option<[AxisValues; 3]>,
}

/// Errors on identification rows and on held-out rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Errors on the identification rows, which are fitted.
    pub identification: ErrorSummary,
    /// Errors on the held-out rows, which were not fitted. If no row is held out: errors of all
    /// rows in fits without their configuration.
    pub held_out: ErrorSummary,
    /// True if no row is held out: `held_out` then summarises all rows, each configuration
    /// predicted by a fit without it.
    pub is_left_out: bool,
}

/// Errors of orientation \[rad\]: lengths and components of the rotation vectors from predicted to
/// measured, measuring frame.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationErrors {
    /// Errors of the registered nominal arm (base and target fitted where they are free).
    pub registered: Errors,
    /// Errors of the arm with all parameters fitted.
    pub fitted: Errors,
    /// Standard deviation (1 σ) of orientations about each axis that the fit assumed \[rad\].
    pub sigma_taken: f64,
}

/// Summarises the errors of the rows that measure the same kind of quantity as `observation`.
pub(super) fn of_kind(
    measurements: &Measurements,
    rows: impl IntoIterator<Item = usize>,
    errors: &[Vector3<f64>],
    observation: Observation,
) -> ErrorSummary {
    let is_of_kind = |row: usize| measurements.observation(row).kind() == observation.kind();
    let of_kind: Vec<Vector3<f64>> = rows
        .into_iter()
        .zip(errors)
        .filter(|(row, _)| is_of_kind(*row))
        .map(|(_, error)| *error)
        .collect();
    ErrorSummary::of_kind(observation, &of_kind)
}

impl ErrorSummary {
    /// Returns the unit of the errors: length for positions, angle for tilts, pixels for images.
    pub(crate) fn unit(&self) -> Unit {
        kind_named(self.kind).unit
    }

    /// Converts an error from \[m\], \[rad\] or \[px\] to the unit in which errors of this kind are
    /// shown: mm, ° or px.
    pub(crate) fn in_unit(&self, value: f64) -> f64 {
        value * self.unit().in_tables().factor
    }

    /// Summarises errors measured − predicted of positions \[m\].
    #[doc(hidden)]
    pub fn of(errors: &[Vector3<f64>]) -> Self {
        Self::of_kind(Observation::Position, errors)
    }

    /// Summarises the residuals measured − predicted of the rows that are of the leading kind of
    /// the table.
    pub(crate) fn of_rows(
        table: &Measurements,
        rows: impl IntoIterator<Item = usize>,
        errors: &[Vector3<f64>],
    ) -> Self {
        of_kind(table, rows, errors, table.leading())
    }

    /// Adds the image errors converted to `lengths` at the observed points \[m\].
    pub(in crate::fit) fn with_lengths(self, lengths: &[Vector3<f64>]) -> Self {
        let Self { mean, max, rms, .. } = Self::of(lengths);
        Self { at_point: Some([mean, max, rms]), ..self }
    }

    /// Summarises the residuals of rows of one kind \[m\] or \[rad\].
    pub(crate) fn of_kind(observation: Observation, errors: &[Vector3<f64>]) -> Self {
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
            at_point: None,
        }
    }
}

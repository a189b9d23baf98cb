//! Summaries of the residuals measured − predicted over the rows of a table.

use nalgebra::Vector3;

use crate::measurement::Measurements;
use crate::observation::{Observation, kind_named};
use crate::quantity::Unit;

/// Statistic of error vectors: its values for each axis of the measuring frame and for the
/// Euclidean norm \[m\]. Errors of other kinds of rows are in the unit of their kind.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxisValues {
    /// Value along the x axis \[m\]; for rows that measure a single number, the value of that
    /// number.
    pub x: f64,
    /// Value along the y axis \[m\].
    pub y: f64,
    /// Value along the z axis \[m\].
    pub z: f64,
    /// Value for the Euclidean norm of the error vector, in the unit of its axes.
    pub norm: f64,
}

/// Summary of the errors measured − predicted of some rows of one kind, in the unit of the kind:
/// positions, distances and contacts \[m\], tilts \[rad\], images \[px\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorSummary {
    /// Kind of the rows ([`Observation::kind`](crate::problem::Observation::kind)). The error of a
    /// row that measures a single number is along x.
    pub kind: &'static str,
    /// Number of rows whose errors are summarised.
    pub n: usize,
    /// Number of rows that the arm cannot predict, because their pose has no equilibrium. If there
    /// are any, `mean`, `max` and `rms` are NaN.
    pub unpredicted: usize,
    /// Mean of the absolute error along each axis, and mean norm of the error.
    pub mean: AxisValues,
    /// Largest absolute error along each axis, and largest norm of the error.
    pub max: AxisValues,
    /// Root mean square error along each axis, and root of the mean squared norm.
    pub rms: AxisValues,
    /// Image errors converted to lengths at the observed points \[m\]: mean, largest and root mean
    /// square; `None` for other kinds of rows.
    pub at_point: Option<[AxisValues; 3]>,
}

/// Errors of one arm on identification rows and on held-out rows, for one kind of rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Errors on the identification rows, which are fitted.
    pub identification: ErrorSummary,
    /// Errors on the held-out rows, which were not fitted. If `is_left_out` is true: errors on the
    /// identification rows, each predicted by a fit without its configuration.
    pub held_out: ErrorSummary,
    /// True if the problem holds out no row, so that `held_out` summarises a cross-validation that
    /// leaves out one configuration at a time.
    pub is_left_out: bool,
}

/// Errors of orientation \[rad\]: statistics of the rotation vectors from the predicted to the
/// measured orientation, measuring frame.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationErrors {
    /// Errors of the registered nominal arm (base and target fitted where they are free).
    pub registered: Errors,
    /// Errors of the arm with all parameters fitted.
    pub fitted: Errors,
    /// Standard deviation (1 σ) of measured orientations about each axis that the fit assumed
    /// \[rad\].
    pub sigma_taken: f64,
}

/// Summarises the `errors` of those `rows` that measure the same kind of quantity as `observation`.
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
    /// Returns the kind of unit of the errors: length for positions, angle for tilts, pixel for
    /// images.
    pub(crate) fn unit(&self) -> Unit {
        kind_named(self.kind).unit
    }

    /// Converts an error of this kind of rows from m, rad or px to the unit in which it is shown:
    /// mm, ° or px.
    pub(crate) fn in_unit(&self, value: f64) -> f64 {
        value * self.unit().in_tables().factor
    }

    /// Summarises position errors measured − predicted \[m\].
    #[doc(hidden)]
    pub fn of(errors: &[Vector3<f64>]) -> Self {
        Self::of_kind(Observation::Position, errors)
    }

    /// Summarises the `errors` measured − predicted of those `rows` that are of the leading kind of
    /// `table` (positions, if there are any).
    pub(crate) fn of_rows(
        table: &Measurements,
        rows: impl IntoIterator<Item = usize>,
        errors: &[Vector3<f64>],
    ) -> Self {
        of_kind(table, rows, errors, table.leading())
    }

    /// Returns the summary with statistics of `lengths`, the image errors converted to lengths at
    /// the observed points \[m\].
    pub(in crate::fit) fn with_lengths(self, lengths: &[Vector3<f64>]) -> Self {
        let Self { mean, max, rms, .. } = Self::of(lengths);
        Self { at_point: Some([mean, max, rms]), ..self }
    }

    /// Summarises the errors measured − predicted of rows that are all of the kind of
    /// `observation`, in the unit of the kind.
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

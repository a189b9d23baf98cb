//! Rows whose residual is too long to be noise.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::error::Location;
use crate::fit::uncertainty::residual_lengths::Lengths;
use crate::measurement::Measurements;

/// Row whose residual is too long to be noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Row of the measurements, counted from 0 over all files.
    pub row: usize,
    /// File and line of the row.
    pub location: Location,
    /// Kind of the row ([`Observation::kind`](crate::problem::Observation::kind)).
    pub kind: &'static str,
    /// Length of the whitened residual in units of the scatter \[σ\].
    pub distance: f64,
    /// Residual measured − predicted, measuring frame \[m\], for tilts \[rad\]; a single number is
    /// along x.
    pub error: Vector3<f64>,
}

impl Outlier {
    pub(in crate::fit) fn of(
        measurements: &Measurements,
        row: usize,
        distance: f64,
        error: Vector3<f64>,
    ) -> Self {
        let kind = measurements.observation(row).kind();
        Self { row, location: measurements.location(row), kind, distance, error }
    }
}

/// Few rows without which the fit would explain the others far better.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct InfluentialRows {
    /// Influential rows, in the order of the table.
    pub rows: Vec<Outlier>,
    /// χ² over its degrees of freedom of the fit without these rows; `None` if the noise is
    /// estimated.
    pub reduced_chi2: Option<f64>,
    /// 1 σ of a coordinate that the fit without these rows takes \[m\], for tilts \[rad\].
    pub sigma_taken: f64,
}

/// Returns the outliers among `rows`, whose residuals have these lengths and \[m\] `errors`, in the
/// order of the rows.
pub(in crate::fit) fn outliers(
    lengths: &Lengths,
    rows: &[usize],
    errors: &[Vector3<f64>],
    measurements: &Measurements,
) -> Vec<Outlier> {
    let outlier = |((place, &row), &error): ((usize, &usize), &Vector3<f64>)| {
        let distance = lengths.outlying(place)?;
        Some(Outlier::of(measurements, row, distance, error))
    };
    rows.iter().enumerate().zip(errors).filter_map(outlier).collect()
}

/// Returns the places of rows in their files as numbers of a finding: file, line and \[σ\]
/// distance.
pub(super) fn places(rows: &[Outlier]) -> Value {
    let place = |row: &Outlier| {
        let Location { file, line, .. } = &row.location;
        json!({ "file": file.display().to_string(), "line": line, "sigmas": row.distance })
    };
    rows.iter().map(place).collect()
}

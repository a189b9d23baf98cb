//! Rows whose residual is too large to be noise.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::error::Location;
use crate::fit::uncertainty::residual_lengths::{Lengths, TypicalScatter};
use crate::measurement::Measurements;

/// Row whose residual is too large to be noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Row of the measurements, counted from 0 over all files.
    pub row: usize,
    /// File and line of the row.
    pub location: Location,
    /// Kind of the row ([`Observation::kind`](crate::problem::Observation::kind)).
    pub kind: &'static str,
    /// Length of the whitened residual, as a multiple of the typical scatter (1 σ) of all rows; for
    /// a held-out row, of the σ of its prediction.
    pub distance: f64,
    /// Typical scatter that `distance` refers to; `None` for held-out rows, whose distance refers
    /// to the uncertainty of their prediction.
    pub(crate) scatter: Option<TypicalScatter>,
    /// Residual measured − predicted, measuring frame \[m\], for tilts \[rad\]; a single number is
    /// along x.
    pub error: Vector3<f64>,
}

impl Outlier {
    pub(in crate::fit) fn new(
        measurements: &Measurements,
        row: usize,
        distance: f64,
        error: Vector3<f64>,
    ) -> Self {
        let kind = measurements.observation(row).kind();
        let location = measurements.location(row);
        Self { row, location, kind, distance, scatter: None, error }
    }
}

/// Few rows that cause most of the misfit: without them, the fit explains the other rows much
/// better.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct InfluentialRows {
    /// Influential rows, in the order of the table.
    pub rows: Vec<Outlier>,
    /// Reduced χ² (χ² over its degrees of freedom) of the fit without the influential rows; `None`
    /// if the noise is estimated.
    pub reduced_chi2: Option<f64>,
    /// Standard deviation (1 σ) of a coordinate that the fit without the influential rows assumes
    /// \[m\], for tilts \[rad\].
    pub sigma_taken: f64,
}

/// Returns the outliers among `rows`, in the order of the rows. `lengths` are their whitened
/// residual lengths, `errors` their residuals \[m\].
pub(in crate::fit) fn outliers(
    lengths: &Lengths,
    rows: &[usize],
    errors: &[Vector3<f64>],
    measurements: &Measurements,
) -> Vec<Outlier> {
    let outlier = |((place, &row), &error): ((usize, &usize), &Vector3<f64>)| {
        let distance = lengths.outlying(place)?;
        let scatter = Some(lengths.typical_scatter(place));
        Some(Outlier { scatter, ..Outlier::new(measurements, row, distance, error) })
    };
    rows.iter().enumerate().zip(errors).filter_map(outlier).collect()
}

/// Returns rows as a JSON value of a finding: file, line and distance \[σ\] of each.
pub(super) fn places(rows: &[Outlier]) -> Value {
    let place = |row: &Outlier| {
        let Location { file, line, .. } = &row.location;
        json!({ "file": file.display().to_string(), "line": line, "sigmas": row.distance })
    };
    rows.iter().map(place).collect()
}

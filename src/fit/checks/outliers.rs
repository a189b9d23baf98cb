//! Outliers: rows whose residual is too large to be noise.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::error::Location;
use crate::fit::uncertainty::residual_lengths::{Lengths, TypicalScatter};
use crate::measurement::Measurements;
use crate::quantity::format::counted;

/// Row whose residual is too large to be noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Index of the row in the measurements, from 0 over all files.
    pub row: usize,
    /// File and line of the row.
    pub location: Location,
    /// Kind of the row ([`Observation::kind`](crate::problem::Observation::kind)).
    pub kind: &'static str,
    /// Length of the residual vector as a multiple of its scale, 1 σ of a coordinate: `scatter`, or
    /// for a held-out row the uncertainty of its prediction.
    pub distance: f64,
    /// Typical scatter (1 σ) of a coordinate to which `distance` refers; `None` for held-out rows.
    pub(crate) scatter: Option<TypicalScatter>,
    /// Residual measured − predicted, measuring frame \[m\], for tilts \[rad\]; a single number is
    /// along x.
    pub error: Vector3<f64>,
}

impl Outlier {
    /// Creates the outlier of a row with its `distance` and `error`, without a scatter.
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

/// Few rows that cause most of the misfit: a fit without them explains the other rows much better.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct InfluentialRows {
    /// Influential rows, in the order of the table.
    pub rows: Vec<Outlier>,
    /// First and last row of each view to which the rows belong, if whole views of a camera are
    /// influential; empty otherwise.
    pub views: Vec<String>,
    /// Reduced χ² (χ² over its degrees of freedom) of the fit without the influential rows; `None`
    /// if the noise is estimated.
    pub reduced_chi2: Option<f64>,
    /// Standard deviation (1 σ) of a coordinate that the fit without the influential rows assumes
    /// \[m\], for tilts \[rad\].
    pub sigma_taken: f64,
}

impl InfluentialRows {
    /// Returns what is influential, such as "1 row" or "2 views".
    pub fn counted(&self, row: &str) -> String {
        match self.views.len() {
            0 => counted(self.rows.len(), row),
            views => counted(views, "view"),
        }
    }

    /// Returns true if one row or one view is influential.
    pub fn is_one(&self) -> bool {
        self.places().len() == 1
    }

    /// Returns the places of the views, or of the rows if single rows are influential.
    pub fn places(&self) -> Vec<String> {
        if self.views.is_empty() {
            self.rows.iter().map(|row| row.location.to_string()).collect()
        } else {
            self.views.clone()
        }
    }
}

/// Returns the outliers among `rows`, in the order of the rows. `lengths` and `errors` hold the
/// lengths of the whitened residuals and the residuals measured − predicted of all `rows`.
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

/// Returns outliers as the JSON list of a finding: file, line and distance \[σ\] of each row.
pub(super) fn outliers_as_json(rows: &[Outlier]) -> Value {
    let place = |row: &Outlier| {
        let Location { file, line, .. } = &row.location;
        json!({ "file": file.display().to_string(), "line": line, "sigmas": row.distance })
    };
    rows.iter().map(place).collect()
}

//! Results of the replicas.

use super::alternative::AlternativeModel;
use super::reading::NamedReading;
use super::study::Case;
use crate::fit::ErrorSummary;

/// Position errors of a procedure at the held-out poses; `None` if the procedure's iteration did
/// not converge.
pub type HeldOutError = Option<ErrorSummary>;

/// Errors at the held-out poses of one specimen, by each procedure.
#[derive(Debug, Clone, PartialEq)]
pub struct Replica {
    /// Case that the specimen belongs to.
    pub case: Case,
    /// Factor by which the flexibilities that the problem declares are multiplied for the specimen.
    pub scale: f64,
    /// Errors of the nominal arm without elasticity, before any identification.
    pub before: ErrorSummary,
    /// Errors after the iteration of eq. 45 with elasticity ignored.
    pub rigid: HeldOutError,
    /// Errors of each reading with the four sources of stiffness: true, as declared, identified
    /// from positions, identified from load differences.
    pub by_reading: Vec<[HeldOutError; 4]>,
    /// Errors of each alternative model, with correct formulas, in the order of
    /// [`AlternativeModel::EACH`].
    pub by_alternative: Vec<HeldOutError>,
    /// Errors of a fit of the geometry alone, with the declared stiffness, by the model of this
    /// library.
    pub geometry_only: ErrorSummary,
    /// Errors of the fit of geometry and stiffness together, by the model of this library.
    pub joint: ErrorSummary,
    /// Errors of the fit of geometry and stiffness together to the poses under both loads.
    pub joint_twice: ErrorSummary,
}

/// Results of a study of the misprints.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplicaResults {
    /// Largest displacement of the end point by each misprint \[m\], in the order of
    /// [`Misprint::EACH`](crate::paper::Misprint::EACH).
    pub sizes: Vec<f64>,
    /// Readings of the paper's formulas (printed or corrected) that were compared.
    pub readings: Vec<NamedReading>,
    /// Specimens, case by case.
    pub replicas: Vec<Replica>,
}

/// Mean and standard deviation of a quantity over specimens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Mean over the available values.
    pub mean: f64,
    /// Standard deviation with n − 1 degrees of freedom; 0 for one value.
    pub deviation: f64,
    /// Number of available values, and of specimens.
    pub count: (usize, usize),
}

impl Spread {
    /// Returns the statistics of the available values; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Option<Self> {
        let values: Vec<Option<f64>> = values.into_iter().collect();
        let available: Vec<f64> = values.iter().flatten().copied().collect();
        let n = available.len() as f64;
        if available.is_empty() {
            return None;
        }
        let mean = available.iter().sum::<f64>() / n;
        let squares: f64 = available.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = if available.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        Some(Self { mean, deviation, count: (available.len(), values.len()) })
    }
}

impl ReplicaResults {
    /// Returns the specimens of one case.
    pub fn of_case(&self, case: &Case) -> impl Iterator<Item = &Replica> {
        self.replicas.iter().filter(move |replica| replica.case == *case)
    }
}

impl Replica {
    /// Returns the errors of a reading, given by its index in `by_reading`, and `stage`, the index
    /// of the source of stiffness there; `None` if the iteration did not converge.
    pub fn reading_error(&self, reading: usize, stage: usize) -> HeldOutError {
        *self.by_reading.get(reading)?.get(stage)?
    }

    /// Returns the errors of an alternative model; `None` if the iteration did not converge.
    pub fn alternative_error(&self, alternative: AlternativeModel) -> HeldOutError {
        let index = AlternativeModel::EACH.iter().position(|model| *model == alternative)?;
        *self.by_alternative.get(index)?
    }

    /// Returns the ratio of the mean error of a procedure to that of the rigid fit; `None` if one
    /// of them did not converge.
    pub fn ratio(&self, error: HeldOutError) -> Option<f64> {
        Some(error?.mean.norm / self.rigid?.mean.norm)
    }

    /// Returns the ratio of the largest error of a procedure to that of the rigid fit; `None` if
    /// one of them did not converge.
    pub fn largest_ratio(&self, error: HeldOutError) -> Option<f64> {
        Some(error?.max.norm / self.rigid?.max.norm)
    }
}

//! What the replicas showed.

use super::alternative::AlternativeModel;
use super::reading::NamedReading;
use super::study::Case;
use crate::fit::ErrorSummary;

/// What a procedure left of the held-out poses; `None` where its iteration did not converge.
pub type Left = Option<ErrorSummary>;

/// One specimen, identified in every way: what is left of its held-out poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Replica {
    /// What it has in common with others.
    pub case: Case,
    /// By what the declared flexibilities were multiplied.
    pub scale: f64,
    /// By the nominal arm without elasticity.
    pub before: ErrorSummary,
    /// By eq. 45 with elasticity ignored.
    pub rigid: Left,
    /// By each reading of the paper: stiffness known, as declared, from positions, from load
    /// differences.
    pub by_reading: Vec<[Left; 4]>,
    /// By each rival, formulas corrected, in the order of [`AlternativeModel::EACH`].
    pub by_rival: Vec<Left>,
    /// By geometry alone, stiffness as declared, with the model of this library.
    pub geometry_only: ErrorSummary,
    /// By the joint fit.
    pub joint: ErrorSummary,
    /// By the joint fit that also has the poses under the second load.
    pub joint_twice: ErrorSummary,
}

/// Everything that a study of the misprints gives.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplicaResults {
    /// How far each misprint moves the end point \[m\], in the order of
    /// [`Misprint::ALL`](crate::paper::Misprint::ALL).
    pub sizes: Vec<f64>,
    /// The readings.
    pub readings: Vec<NamedReading>,
    /// The specimens, case by case.
    pub replicas: Vec<Replica>,
}

/// Mean and standard deviation of some values over specimens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, with n − 1; 0 for one value.
    pub deviation: f64,
    /// Values there are, of how many.
    pub count: (usize, usize),
}

impl Spread {
    /// Of the values there are; `None` without any.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Option<Self> {
        let all: Vec<Option<f64>> = values.into_iter().collect();
        let there: Vec<f64> = all.iter().flatten().copied().collect();
        let n = there.len() as f64;
        if there.is_empty() {
            return None;
        }
        let mean = there.iter().sum::<f64>() / n;
        let squares: f64 = there.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = if there.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        Some(Self { mean, deviation, count: (there.len(), all.len()) })
    }
}

impl ReplicaResults {
    /// Specimens of one case.
    pub fn of_case(&self, case: &Case) -> impl Iterator<Item = &Replica> {
        self.replicas.iter().filter(move |own| own.case == *case)
    }
}

impl Replica {
    /// What a reading leaves: its place among the readings, and the stage: stiffness known, as
    /// declared, from positions, from load differences.
    pub fn left(&self, reading: usize, stage: usize) -> Left {
        *self.by_reading.get(reading)?.get(stage)?
    }

    /// What a rival leaves.
    pub fn rival(&self, rival: AlternativeModel) -> Left {
        let place = AlternativeModel::EACH.iter().position(|own| *own == rival)?;
        *self.by_rival.get(place)?
    }

    /// Mean error over that of the rigid fit.
    pub fn ratio(&self, left: Left) -> Option<f64> {
        Some(left?.mean.norm / self.rigid?.mean.norm)
    }

    /// Largest error over that of the rigid fit.
    pub fn largest_ratio(&self, left: Left) -> Option<f64> {
        Some(left?.max.norm / self.rigid?.max.norm)
    }
}

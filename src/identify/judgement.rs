//! Whether a fit is to be trusted, and what to ask about it.

use nalgebra::{DMatrix, DVector, Vector3};

use super::cautions::{Caution, far_off};
use super::fitting::{FitEnd, Fitting};
use super::misread::misreadings;
use super::quality::{BEYOND_NOISE, QualityFlag, beyond_arm, beyond_prior, misses, other_size, spread};
use super::{Errors, Outlier, held_out};
use crate::least_squares::Loss;
use crate::problem::Problem;

/// Poses below which the size of the cloud of points says nothing.
const LEAST_POSES: usize = 4;

/// What a fit is judged by.
pub(super) struct Judgement<'a> {
    pub fitting: &'a Fitting<'a>,
    /// Full parameter vector of the registered nominal arm.
    pub start: &'a DVector<f64>,
    pub end: &'a FitEnd,
    /// Of the registered nominal arm and of the fitted one.
    pub errors: (&'a Errors, &'a Errors),
    /// Of the identification rows.
    pub outliers: &'a [Outlier],
    /// 1 σ of a coordinate: as declared, if it was, and as the fit took it \[m\].
    pub sigma: (Option<f64>, f64),
}

impl Judgement<'_> {
    /// Why the fit is not to be trusted: `enough` says for what the poses are too few, `not_converged` which fit did not end,
    /// `poses` how many of the arm's there are.
    pub fn flag(
        &self,
        enough: Option<QualityFlag>,
        not_converged: Option<QualityFlag>,
        poses: usize,
    ) -> Option<QualityFlag> {
        let Fitting { model, measurements, placement, split, .. } = self.fitting;
        let rows = &self.positions();
        let nominal = self.fitting.position_errors(rows, self.start);
        let measured = self.measured();
        let predicted = spread(placement, rows, |place| measurements.positions[rows[place]] - nominal[place]);
        let far = |errors: &[Vector3<f64>]| misses(self.rms(errors), measured, self.sigma.0);
        let fitted = self.fitting.position_errors(rows, &self.end.x);
        // An arm that was near before the fit was driven away by a solver that did not converge.
        let misses = far(&fitted).filter(|_| self.end.termination.converged() || far(&nominal).is_some());
        let other_size = (poses.min(rows.len()) >= LEAST_POSES).then(|| other_size(measured, predicted)).flatten();
        let least = self.sigma.0.map_or(0.0, |sigma| BEYOND_NOISE * sigma);
        enough
            .or(misses)
            .or(other_size)
            .or(not_converged)
            .or_else(|| beyond_prior(model, &self.end.x))
            .or_else(|| beyond_arm(model, &self.end.x))
            .or_else(|| {
                (!split.held_out.is_empty() && self.copies() == split.held_out.len())
                    .then_some(QualityFlag::HeldOutCopied)
            })
            .or_else(|| held_out::contradict(self.fitting, &self.end.x, self.errors, (measured, self.sigma.1, least)))
    }

    /// What to ask about the input; `covariance` is that of the fit's `unknowns`.
    pub fn cautions(&self, problem: &Problem, unknowns: &[usize], covariance: &DMatrix<f64>) -> Vec<Caution> {
        let of = self.fitting.split.held_out.len();
        let rows = held_out::outliers(self.fitting, &self.end.x, unknowns, covariance);
        let outliers = (!rows.is_empty()).then_some(Caution::HeldOutOutliers { rows, of });
        let copies = self.copies();
        let copies = (0 < copies && copies < of).then_some(Caution::HeldOutCopies { copies, of });
        let rms = self.errors.0.identification.rms.norm;
        let far_off = far_off(rms, self.measured(), || misreadings(self.fitting, problem, rms));
        far_off.into_iter().chain(copies).chain(outliers).collect()
    }

    /// Identification rows that measure positions.
    fn positions(&self) -> Vec<usize> {
        let Fitting { measurements, split, .. } = self.fitting;
        let is_position = |row: &usize| measurements.observation(*row).is_position();
        split.identification.iter().copied().filter(is_position).collect()
    }

    /// Their spread \[m\].
    fn measured(&self) -> f64 {
        let Fitting { measurements, placement, .. } = self.fitting;
        let rows = &self.positions();
        spread(placement, rows, |place| measurements.positions[rows[place]])
    }

    /// Root mean squared length of errors of the identification positions, those left out that a robust loss sets aside \[m\].
    fn rms(&self, errors: &[Vector3<f64>]) -> f64 {
        let robust = self.fitting.loss != Loss::Squares;
        let aside = |row: &usize| robust && self.outliers.iter().any(|outlier| outlier.row == *row);
        let rows = self.positions();
        let kept: Vec<f64> =
            rows.iter().zip(errors).filter(|(row, _)| !aside(row)).map(|(_, error)| error.norm_squared()).collect();
        (kept.iter().sum::<f64>() / kept.len().max(1) as f64).sqrt()
    }

    fn copies(&self) -> usize {
        let Fitting { measurements, split, .. } = self.fitting;
        held_out::copies(measurements, &split.identification, &split.held_out)
    }
}

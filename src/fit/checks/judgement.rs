//! Whether a fit is to be trusted, and what to ask about it.

use nalgebra::{DMatrix, DVector, Vector3};

use super::held_out;
use crate::fit::checks::cautions::{Caution, far_off};
use crate::fit::checks::kind::Kind;
use crate::fit::checks::misread::misreadings;
use crate::fit::checks::quality::{
    QualityFlag, beyond_arm, beyond_prior, misses, no_better, other_size, spread,
};
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::stage::Stage;
use crate::fit::uncertainty::noise::together;
use crate::fit::{Errors, Outlier};
use crate::least_squares::Loss;
use crate::problem::{Observation, Problem};

/// Poses below which the size of the cloud of points says nothing.
const LEAST_POSES: usize = 4;

/// What a fit is judged by.
pub(in crate::fit) struct Judgement<'a> {
    pub fitting: &'a Fitting<'a>,
    /// Full parameter vector of the registered nominal arm.
    pub start: &'a DVector<f64>,
    pub end: &'a FitEnd,
    /// Of the registered nominal arm and of the fitted one.
    pub errors: (&'a Errors, &'a Errors),
    /// Of the identification rows.
    pub outliers: &'a [Outlier],
    /// The identification rows, with the σ that were declared, if they were, and those that the fit
    /// took.
    pub whole: &'a Stage<'a>,
    pub has_declared_noise: bool,
}

impl Judgement<'_> {
    /// Why the fit is not to be trusted: `enough` says for what the poses are too few,
    /// `not_converged` which fit did not end, `poses` how many of the arm's there are.
    pub fn flag(
        &self,
        enough: Option<QualityFlag>,
        not_converged: Option<QualityFlag>,
        poses: usize,
    ) -> Option<QualityFlag> {
        let Fitting { model, split, .. } = self.fitting;
        let kinds = self.kinds();
        enough
            .or_else(|| kinds.iter().find_map(|own| self.misses(own)))
            .or_else(|| kinds.iter().find_map(|own| self.other_size(own, poses)))
            .or(not_converged)
            .or_else(|| beyond_prior(model, &self.end.x))
            .or_else(|| beyond_arm(model, &self.end.x))
            .or_else(|| {
                (!split.held_out.is_empty() && self.copies() == split.held_out.len())
                    .then_some(QualityFlag::HeldOutCopied)
            })
            .or_else(|| held_out::contradict(self.fitting, &self.end.x, self.errors, &kinds))
    }

    /// What to ask about the input; `covariance` is that of the fit's `unknowns`.
    pub fn cautions(
        &self,
        problem: &Problem,
        unknowns: &[usize],
        covariance: &DMatrix<f64>,
    ) -> Vec<Caution> {
        let Fitting { model, split, .. } = self.fitting;
        let of = split.held_out.len();
        let rows = held_out::outliers(self.fitting, &self.end.x, unknowns, covariance);
        let outliers = (!rows.is_empty()).then_some(Caution::HeldOutOutliers { rows, of });
        let copies = self.copies();
        let copies = (0 < copies && copies < of).then_some(Caution::HeldOutCopies { copies, of });
        let rms = self.errors.0.identification.rms.norm;
        let leading = self.kind(self.fitting.measurements.leading());
        let far_off =
            far_off(&leading, (rms, model.reach()), || misreadings(self.fitting, problem, rms));
        far_off.into_iter().chain(copies).chain(outliers).collect()
    }

    /// Whether the fit is far from the rows of a kind, or met them no better than the nominal arm
    /// did.
    fn misses(&self, kind: &Kind) -> Option<QualityFlag> {
        let errors = |x| self.rms(&kind.rows, &self.fitting.position_errors(&kind.rows, x));
        let (nominal, fitted) = (errors(self.start), errors(&self.end.x));
        // An arm that was near before the fit was driven away by a solver that did not converge.
        let far = misses(kind, fitted)
            .filter(|_| self.end.termination.converged() || misses(kind, nominal).is_some());
        far.or_else(|| no_better(kind, nominal, fitted))
    }

    /// Whether positions are of an arm of another size.
    fn other_size(&self, kind: &Kind, poses: usize) -> Option<QualityFlag> {
        let Fitting { measurements, placement, .. } = self.fitting;
        let Kind { observation, rows, .. } = kind;
        if !observation.is_position() || poses.min(rows.len()) < LEAST_POSES {
            return None;
        }
        let nominal = self.fitting.position_errors(rows, self.start);
        let predicted =
            spread(placement, rows, |place| measurements.positions[rows[place]] - nominal[place]);
        other_size(kind.spread, predicted)
    }

    /// Each kind of rows that the arm takes part in, positions first.
    fn kinds(&self) -> Vec<Kind> {
        let kinds = self.fitting.measurements.kinds().into_iter().filter(|kind| kind.is_of_arm());
        kinds.map(|kind| self.kind(kind)).filter(|own| !own.rows.is_empty()).collect()
    }

    fn kind(&self, observation: Observation) -> Kind {
        let Fitting { measurements, placement, split, .. } = self.fitting;
        let is_own = |row: usize| measurements.observation(row).kind() == observation.kind();
        let (places, rows): (Vec<usize>, Vec<usize>) = split
            .identification
            .iter()
            .copied()
            .enumerate()
            .filter(|&(_, row)| is_own(row))
            .unzip();
        let measured = observation.is_position() || observation.is_angle();
        let places_of = || {
            self.fitting.model.predicted_targets(&self.fitting.poses(&rows), self.start.as_slice())
        };
        let at = if measured { Vec::new() } else { places_of() };
        let point =
            |place: usize| if measured { measurements.positions[rows[place]] } else { at[place] };
        let declared = together(places.iter().map(|&place| self.whole.declared[place]));
        let taken = together(places.iter().map(|&place| self.whole.poses[place].sigma));
        Kind {
            observation,
            spread: spread(placement, &rows, point),
            sigma: (self.has_declared_noise.then_some(declared), taken),
            rows,
        }
    }

    /// Root mean squared length of errors of some identification rows, those left out that a robust
    /// loss sets aside.
    fn rms(&self, rows: &[usize], errors: &[Vector3<f64>]) -> f64 {
        let robust = self.fitting.loss != Loss::Squares;
        let aside = |row: &usize| robust && self.outliers.iter().any(|outlier| outlier.row == *row);
        let kept: Vec<f64> = rows
            .iter()
            .zip(errors)
            .filter(|(row, _)| !aside(row))
            .map(|(_, error)| error.norm_squared())
            .collect();
        (kept.iter().sum::<f64>() / kept.len().max(1) as f64).sqrt()
    }

    fn copies(&self) -> usize {
        let Fitting { measurements, split, .. } = self.fitting;
        held_out::copies(measurements, &split.identification, &split.held_out)
    }
}

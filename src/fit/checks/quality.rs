//! Quality flags of a fit: why it is not to be trusted, and whether priors decide most of it.

use std::fmt;

use nalgebra::{DVector, Vector3};

use crate::fit::Placement;
use crate::fit::checks::kind::{Kind, measured, named, rows, size};
use crate::fit::stages::parameter_size::largest;
use crate::least_squares::solver::Termination;
use crate::model::Model;
use crate::model::parameter::{JointField, Parameter, ParameterSite};
use crate::quantity::Unit;

/// A fitted arm that misses the measurements by this part of their spread describes another arm.
pub(in crate::fit) const MISSES: f64 = 0.02;
/// … unless the declared noise is of that size: in units of 1 σ of a position.
pub(in crate::fit) const BEYOND_NOISE: f64 = 100.0;

/// A fit that leaves more than this part of what the nominal arm misses by …
const NO_BETTER: f64 = 0.9;
/// … and so many σ has not fitted what was measured.
const FAR_BEYOND_NOISE: f64 = 1000.0;

/// Parameters of an arm that describes the measured one stay within so many σ of their priors:
/// chance takes one in two million beyond.
const OUT_OF_PROPORTION: f64 = 5.0;

/// Sizes of what was measured and of what the nominal arm predicts that differ by more than this
/// factor are of two arms.
const OTHER_SIZE: f64 = 2.0;

/// Points this close together say nothing about the size of an arm \[m\], and tilts this close
/// together nothing of it \[rad\].
pub(in crate::fit) const LEAST_SPREAD: f64 = 0.01;

/// Why a fit is not to be trusted.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum QualityFlag {
    /// Fewer equations than unknowns without a prior.
    TooFewEquations {
        /// What the unknowns belong to: the whole fit, or a base or tool.
        of: String,
        /// Coordinates measured in different poses: a pose measured again adds none.
        coordinates: usize,
        /// Unknowns without a prior.
        unknowns: usize,
    },
    /// The fit did not converge.
    NotConverged(Termination),
    /// The fit of bases and targets of held-out sessions did not converge.
    HeldOutNotConverged(Termination),
    /// A parameter of the arm is far beyond its prior.
    BeyondPrior {
        /// Which.
        name: String,
        /// Its change in units of the prior's σ.
        sigmas: f64,
    },
    /// A parameter is beyond what an arm of this size can have.
    BeyondArm {
        /// Which.
        name: String,
        /// Its change in units of the arm's size, of half a turn, or of a factor of 100.
        sizes: f64,
        /// What it is measured by, in words.
        size: &'static str,
    },
    /// The measured points lie wider apart or closer together than any arm like the nominal one
    /// reaches.
    OtherSize {
        /// Root mean squared distance of the measured points from their centre \[m\].
        measured: f64,
        /// The same of the nominal arm's points \[m\].
        expected: f64,
    },
    /// The poses of a base leave its place open, as points on a line do.
    Undetermined {
        /// Which base.
        of: String,
        /// Its different poses.
        poses: usize,
    },
    /// Held-out rows are identification rows again, all of them.
    HeldOutCopied,
    /// Most held-out poses are missed as if they were of another arm.
    HeldOutMisses {
        /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)).
        kind: &'static str,
        /// Median error \[m\]; of tilts \[rad\].
        median: f64,
        /// Root mean squared distance of the identification points from their centre \[m\]; of
        /// tilts \[rad\].
        spread: f64,
    },
    /// The fitted arm meets held-out poses worse than the registered nominal one.
    HeldOutWorse {
        /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)).
        kind: &'static str,
        /// Root mean squared error of the nominal arm \[m\]; of tilts \[rad\].
        before: f64,
        /// The same of the fitted arm.
        after: f64,
    },
    /// The fitted arm is far from the measurements.
    Misses {
        /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)).
        kind: &'static str,
        /// Root mean squared error on the identification rows \[m\]; of tilts \[rad\].
        rms: f64,
        /// Root mean squared distance of the measured points, or of the places where others than
        /// positions were measured, from their centre \[m\]; of tilts \[rad\].
        spread: f64,
    },
    /// The fit is as far from what was touched or measured against as the nominal arm is, and far
    /// beyond the noise.
    NoBetter {
        /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)).
        kind: &'static str,
        /// Root mean squared error of the nominal arm on the identification rows \[m\]; of tilts
        /// \[rad\].
        before: f64,
        /// The same of the fitted arm.
        after: f64,
    },
}

impl fmt::Display for QualityFlag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewEquations { of, coordinates, unknowns } => {
                write!(
                    f,
                    "{of}: {coordinates} measured coordinates for {unknowns} parameters without a prior (a pose measured \
                     again adds none)"
                )
            }
            Self::NotConverged(termination @ Termination::DomainEdge) => {
                write!(
                    f,
                    "{termination}; units, signs of joints, or sessions are wrong, or the table's columns"
                )
            }
            Self::NotConverged(termination) => write!(f, "{termination}"),
            Self::BeyondPrior { name, sigmas } => write!(
                f,
                "{name} moved by {sigmas:.0} times the σ of its prior; check axes of the measuring frame, signs of joints, \
                 units, and the prior"
            ),
            Self::BeyondArm { name, sizes, size } => write!(
                f,
                "{name} moved by {sizes:.1} times {size}: more than an arm can be off; give it a prior, or check units and the \
                 table's columns"
            ),
            Self::OtherSize { measured, expected } => write!(
                f,
                "the measured points lie {:.1} mm from their centre, those of the nominal arm {:.1} mm; check units, and what \
                 the columns hold",
                measured * 1e3,
                expected * 1e3
            ),
            Self::Undetermined { of, poses } => write!(
                f,
                "{of}: its points, of {poses} different poses, are too few or lie on a line, which leaves a turn about it open"
            ),
            Self::HeldOutCopied => {
                write!(
                    f,
                    "all held-out rows are identification rows again: their errors judge nothing"
                )
            }
            Self::HeldOutMisses { kind, median, spread } => {
                let rows = rows(kind);
                write!(
                    f,
                    "half of the held-out {rows} are missed by more than {}, {:.0} % of the spread of the fitted ones; check \
                     whether these rows belong together, and whether the fitted poses cover them",
                    size(kind, *median, 1),
                    100.0 * median / spread
                )
            }
            Self::HeldOutWorse { kind, before, after } => write!(
                f,
                "held-out {} are met worse than by the nominal arm ({} rms before, {} after); more poses, fewer free \
                 parameters or smaller priors are needed",
                rows(kind),
                size(kind, *before, 3),
                size(kind, *after, 3)
            ),
            Self::HeldOutNotConverged(termination) => {
                write!(f, "the bases of held-out sessions: {termination}")
            }
            Self::Misses { rms, .. } if !rms.is_finite() => {
                write!(
                    f,
                    "the fitted arm misses the measurements by more than numbers hold; check their units"
                )
            }
            Self::Misses { kind, rms, spread } => write!(
                f,
                "the fitted arm misses the {} by {}, {:.0} % of their spread; check units, signs of joints, and {}",
                measured(kind),
                size(kind, *rms, 1),
                100.0 * rms / spread,
                named(kind)
            ),
            Self::NoBetter { kind, before, after } => write!(
                f,
                "the fitted arm misses the {} by {}, the nominal one by {}, both far beyond the declared σ; check units, signs of \
                 joints, and {}",
                measured(kind),
                size(kind, *after, 1),
                size(kind, *before, 1),
                named(kind)
            ),
        }
    }
}

/// Fewer coordinates measured in different poses than parameters: priors decide what measurements
/// do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooFewPoses {
    /// Different poses of the arm; several targets in one pose make one.
    pub poses: usize,
    /// What they measure: no pose of the arm has more than six coordinates, however many targets it
    /// shows.
    pub coordinates: usize,
    /// Parameters that are fitted.
    pub parameters: usize,
}

impl fmt::Display for TooFewPoses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { poses, coordinates, parameters } = self;
        let noun = if *poses == 1 { "pose measures" } else { "different poses measure" };
        write!(
            f,
            "{poses} {noun} {coordinates} coordinates, fewer than the {parameters} parameters that are fitted: priors decide \
             most of it"
        )
    }
}

/// The parameter of the arm that lies furthest beyond its prior, if that is out of all proportion;
/// those of effects may.
pub(in crate::fit) fn beyond_prior(model: &Model, x: &DVector<f64>) -> Option<QualityFlag> {
    let declared = |site: ParameterSite| match site {
        ParameterSite::Joint { field, .. } => field.is_geometry() || field == JointField::Stiffness,
        ParameterSite::Beam { .. } => site.unit().is_relative(),
        ParameterSite::Base { .. } | ParameterSite::Target { .. } => true,
        _ => false,
    };
    let ratio = |(k, parameter): (usize, &Parameter)| {
        let of_arm = declared(parameter.site) && parameter.regressor.is_constant();
        Some((k, x[k].abs() / parameter.sigma.filter(|_| of_arm)?))
    };
    let ratios = model.parameters.iter().enumerate().filter_map(ratio);
    let (k, sigmas) = ratios.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (sigmas > OUT_OF_PROPORTION)
        .then(|| QualityFlag::BeyondPrior { name: model.parameters[k].name.clone(), sigmas })
}

/// The parameter that moved furthest beyond what any arm of this size can have, if one did.
pub(in crate::fit) fn beyond_arm(model: &Model, x: &DVector<f64>) -> Option<QualityFlag> {
    let ratio =
        |(k, parameter): (usize, &Parameter)| Some((k, x[k].abs() / largest(model, parameter)?));
    let ratios = model.parameters.iter().enumerate().filter_map(ratio);
    let (k, sizes) = ratios.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let parameter = &model.parameters[k];
    let size = match parameter.unit() {
        Unit::Length => "the arm's own size",
        Unit::Angle => "half a turn",
        _ => "a factor of 100",
    };
    (sizes > 1.0).then(|| QualityFlag::BeyondArm { name: parameter.name.clone(), sizes, size })
}

/// Root mean squared distance \[m\] of some points of `rows` from the centre of those of the same
/// base.
pub(in crate::fit) fn spread(
    placement: &Placement,
    rows: &[usize],
    point: impl Fn(usize) -> Vector3<f64>,
) -> f64 {
    let points: Vec<(usize, Vector3<f64>)> = rows
        .iter()
        .enumerate()
        .map(|(place, &row)| (placement.base_of(row), point(place)))
        .collect();
    let mut squares = 0.0;
    for base in 0..placement.bases.len() {
        let own = || points.iter().filter(|(of, _)| *of == base).map(|(_, point)| point);
        let centre = own().sum::<Vector3<f64>>() / own().count().max(1) as f64;
        squares += own().map(|point| (point - centre).norm_squared()).sum::<f64>();
    }
    (squares / rows.len().max(1) as f64).sqrt()
}

/// Whether the fitted arm is far from what rows of a kind measured, of which `rms` is the error.
pub(in crate::fit) fn misses(kind: &Kind, rms: f64) -> Option<QualityFlag> {
    let Kind { observation, spread, sigma, .. } = *kind;
    let noise = sigma.0.map_or(0.0, |sigma| BEYOND_NOISE * sigma);
    let far = spread > LEAST_SPREAD && rms > MISSES * spread && rms > noise;
    far.then_some(QualityFlag::Misses { kind: observation.kind(), rms, spread })
}

/// Whether the fit met rows that are no positions no better than the nominal arm, whose errors are
/// `before` and `after`: how far apart such rows lie may say nothing.
pub(in crate::fit) fn no_better(kind: &Kind, before: f64, after: f64) -> Option<QualityFlag> {
    let Kind { observation, sigma, .. } = *kind;
    let far = sigma.0.is_some_and(|sigma| after > FAR_BEYOND_NOISE * sigma);
    (!observation.is_position() && far && after > NO_BETTER * before)
        .then_some(QualityFlag::NoBetter { kind: observation.kind(), before, after })
}

/// Whether the points that were measured are of an arm of another size than the nominal one.
pub(in crate::fit) fn other_size(measured: f64, expected: f64) -> Option<QualityFlag> {
    let same = (expected / OTHER_SIZE..=expected * OTHER_SIZE).contains(&measured);
    (expected > LEAST_SPREAD && !same).then_some(QualityFlag::OtherSize { measured, expected })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Observation;

    #[test]
    fn a_fit_that_changes_nothing_far_beyond_the_noise_fits_nothing() {
        let sigma = Some(5e-5);
        for (observation, sigma, after, is_flagged) in [
            (Observation::Point(0), sigma, 0.058, true),
            (Observation::Point(0), sigma, 0.051, false),
            (Observation::Point(0), Some(1e-3), 0.058, false),
            (Observation::Point(0), None, 0.058, false),
            (Observation::Position, sigma, 0.058, false),
        ] {
            let kind = Kind { observation, rows: Vec::new(), spread: 0.0, sigma: (sigma, 1e-3) };
            assert_eq!(
                no_better(&kind, 0.06, after).is_some(),
                is_flagged,
                "{observation:?} {sigma:?} {after}"
            );
        }
    }
}

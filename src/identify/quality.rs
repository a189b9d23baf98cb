//! Quality flags of a fit: why it is not to be trusted, and whether priors decide most of it.

use std::fmt;

use nalgebra::{DVector, Vector3};

use super::{ErrorSummary, Placement};
use crate::least_squares::solver::Termination;
use crate::measurement::{Measurements, different};
use crate::model::Model;
use crate::model::parameter::{JointField, Parameter, Slot};

/// A fitted arm that misses the measurements by this part of their spread describes another arm.
const MISSES: f64 = 0.02;
/// … unless the declared noise is of that size: in units of 1 σ of a position.
const BEYOND_NOISE: f64 = 100.0;

/// Parameters of an arm that describes the measured one stay within so many σ of their priors.
const OUT_OF_PROPORTION: f64 = 20.0;

/// Points this close together say nothing about the size of an arm \[m\].
const LEAST_SPREAD: f64 = 0.01;

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
    /// A parameter of the arm's geometry is far beyond its prior.
    BeyondPrior {
        /// Which.
        name: String,
        /// Its change in units of the prior's σ.
        sigmas: f64,
    },
    /// The fitted arm is far from the measurements.
    Misses {
        /// Root mean squared error on the identification poses \[m\].
        rms: f64,
        /// Root mean squared distance of the measured points from their centre \[m\].
        spread: f64,
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
                write!(f, "{termination}; units, signs of joints, or sessions are wrong, or the table's columns")
            }
            Self::NotConverged(termination) => write!(f, "{termination}"),
            Self::BeyondPrior { name, sigmas } => write!(
                f,
                "{name} moved by {sigmas:.0} times the σ of its prior; check axes of the measuring frame, signs of joints, \
                 units, and the prior"
            ),
            Self::HeldOutNotConverged(termination) => write!(f, "the bases of held-out sessions: {termination}"),
            Self::Misses { rms, spread } => write!(
                f,
                "the fitted arm misses the measurements by {:.1} mm, {:.0} % of their spread; check units, signs of \
                 joints, and whether base and session are declared",
                rms * 1e3,
                100.0 * rms / spread
            ),
        }
    }
}

/// Fewer coordinates measured in different poses than parameters: priors decide what measurements do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooFewPoses {
    /// Different poses.
    pub poses: usize,
    /// Parameters that are fitted.
    pub parameters: usize,
}

impl fmt::Display for TooFewPoses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { poses, parameters } = self;
        let noun = if *poses == 1 { "pose measures" } else { "different poses measure" };
        write!(
            f,
            "{poses} {noun} {} coordinates, fewer than the {parameters} parameters that are fitted: priors decide most of it",
            3 * poses
        )
    }
}

/// The parameter of the arm's geometry that lies furthest beyond its prior, if that is out of all proportion.
pub(super) fn beyond_prior(model: &Model, x: &DVector<f64>) -> Option<QualityFlag> {
    let ratio = |(k, parameter): (usize, &Parameter)| match parameter.slot {
        Slot::Joint { field, .. } if JointField::GEOMETRY.contains(&field) && parameter.driver.is_constant() => {
            parameter.sigma.map(|sigma| (k, x[k].abs() / sigma))
        }
        _ => None,
    };
    let ratios = model.parameters.iter().enumerate().filter_map(ratio);
    let (k, sigmas) = ratios.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (sigmas > OUT_OF_PROPORTION).then(|| QualityFlag::BeyondPrior { name: model.parameters[k].name.clone(), sigmas })
}

/// A base, with the targets that no other base of `rows` uses, or a target with fewer coordinates measured in different
/// poses of `rows` than parameters of its own without a prior; of the parameters that are `varied` there. `numbers` are those
/// of the poses of all rows.
pub(super) fn underdetermined(
    model: &Model,
    placement: &Placement,
    numbers: &[usize],
    rows: &[usize],
    varied: impl Fn(usize) -> bool,
) -> Option<QualityFlag> {
    let check = |of: String, used: &dyn Fn(usize) -> bool, own: &dyn Fn(Slot) -> bool| {
        let coordinates = 3 * different(numbers, rows.iter().copied().filter(|&row| used(row)));
        let counts = |k: usize| varied(k) && model.parameters[k].sigma.is_none() && own(model.parameters[k].slot);
        let unknowns = (0..model.parameters.len()).filter(|&k| counts(k)).count();
        (0 < coordinates && coordinates < unknowns).then_some(QualityFlag::TooFewEquations {
            of,
            coordinates,
            unknowns,
        })
    };
    let base = |b: usize| {
        let alone = |t: usize| rows.iter().all(|&row| placement.target_of(row) != t || placement.base_of(row) == b);
        let own = |slot| match slot {
            Slot::Base { base, .. } => base == b,
            Slot::Target { target, .. } => alone(target) && rows.iter().any(|&row| placement.target_of(row) == target),
            _ => false,
        };
        check(format!("base[{}]", placement.bases[b]), &|row| placement.base_of(row) == b, &own)
    };
    let target = |t: usize| {
        let own = |slot| matches!(slot, Slot::Target { target, .. } if target == t);
        check(format!("tool[{}]", placement.targets[t]), &|row| placement.target_of(row) == t, &own)
    };
    let bases = (0..placement.bases.len()).find_map(base);
    bases.or_else(|| (0..placement.targets.len()).find_map(target))
}

/// Whether the fitted arm is far from what was measured in `rows`; `sigma` \[m\] is that of a coordinate, if it was declared.
pub(super) fn misses(
    measurements: &Measurements,
    placement: &Placement,
    rows: &[usize],
    fitted: &ErrorSummary,
    sigma: Option<f64>,
) -> Option<QualityFlag> {
    let mut squares = 0.0;
    for base in 0..placement.bases.len() {
        let own = || rows.iter().filter(|&&row| placement.base_of(row) == base).map(|&row| measurements.positions[row]);
        let centre = own().sum::<Vector3<f64>>() / own().count().max(1) as f64;
        squares += own().map(|position| (position - centre).norm_squared()).sum::<f64>();
    }
    let spread = (squares / rows.len().max(1) as f64).sqrt();
    let rms = fitted.rms.norm;
    let noise = sigma.map_or(0.0, |sigma| BEYOND_NOISE * sigma);
    (spread > LEAST_SPREAD && rms > MISSES * spread && rms > noise).then_some(QualityFlag::Misses { rms, spread })
}

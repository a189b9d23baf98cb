//! The paper's procedure: stiffness by linear least squares, then geometry by the iterated
//! pseudo-inverse, eq. 42-45.

use nalgebra::DVector;

use super::Parameters;
use super::form::{Misprint, Reading};
use super::residuals::{GeometryResiduals, Measured};
use super::stiffness::{StiffnessStage, stiffness};
use crate::least_squares::solver::{PseudoInverseSettings, Solution, minimise_pseudo_inverse};
use crate::least_squares::{Fit, Identifiability, Objective as _};
use crate::problem::Problem;

/// How to identify.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Which formulas.
    pub reading: Reading,
    /// The first stage.
    pub stiffness: StiffnessStage,
    /// The iteration of eq. 45; by default truncated at 1e-6.
    pub iteration: PseudoInverseSettings,
}

impl Options {
    /// By these formulas, the stiffness from there.
    pub fn new(reading: impl Into<Reading>, stiffness: StiffnessStage) -> Self {
        let iteration =
            PseudoInverseSettings { tolerance: 1e-6, ..PseudoInverseSettings::default() };
        Self { reading: reading.into(), stiffness, iteration }
    }
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// E and S; flexibilities come out as the data have them, even below zero.
    pub parameters: Parameters,
    /// The iteration of eq. 45: why it stopped, after how many steps; its x are the errors e from
    /// nominal.
    pub iteration: Solution,
    /// Part of each entry of e = [e₁ … e_n] that the poses see by itself at nominal geometry, 0…1,
    /// shape = (5n); the rest is a choice, of least length, among combinations that move no
    /// position. 0 for what is not identified.
    pub seen: Vec<f64>,
}

/// Poses that the procedure cannot use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Three coordinates a pose are fewer equations than the 5n unknowns of eq. 42.
    #[error(
        "identifying {unknowns} geometric parameters takes at least {needed} poses, there are {poses}"
    )]
    TooFewPoses {
        /// Unknowns of eq. 42.
        unknowns: usize,
        /// Poses needed.
        needed: usize,
        /// Poses given.
        poses: usize,
    },
    /// A configuration of another arm.
    #[error("pose {pose} has {found} joints, the arm {expected}")]
    Joints {
        /// Number of the pose, from 1.
        pose: usize,
        /// Joints of the pose.
        found: usize,
        /// Joints of the arm.
        expected: usize,
    },
    /// Residuals of the stiffness stage are not finite.
    #[error("a measured position or a deflection at nominal geometry is not finite")]
    NotFinite,
    /// Load differences take configurations that were measured under several loads.
    #[error("no configuration was measured under several loads")]
    NoLoadDifferences,
}

/// Identifies stiffness, then geometry, from measured positions; one sweep.
///
/// 1. Stiffness by the [`StiffnessStage`] (§3.3: it comes first; the paper does not print its
///    equations).
/// 2. With these fixed, e_{j+1} = `J_g(E_j)`⁺ [`PE_meas` − `PE_nom(E_j)` − `D_f(E_j)`], E_{j+1} =
///    E_j + e_{j+1}, until e is negligible
///    [Chen2021, eq. 45]
///
/// Geometric errors that look like deflections mislead stage 1 from positions: it explains them by
/// flexibilities many times the true ones, or negative, and stage 2 cannot take that back. From
/// load differences it does not see them. Eq. 41, which drops the coupling, matters less;
/// `docs/paper.md` has figures for all.
///
/// All flexibilities that the problem gives and all 5n geometric parameters are unknown, whatever
/// `[parameters]` says; base and target are known. Printed differently: `BetaLeftOut`, the text to
/// eq. 45 has E_j = [α a θ d]ᵀ, so that β stays nominal, though e has it and table 2 identifies it.
///
/// # Errors
/// The poses do not fit the arm, are too few for eq. 42, or are not finite. A diverging iteration
/// is not an error: it is told in [`Identified::iteration`].
pub fn identify(
    problem: &Problem,
    poses: &[Measured],
    options: &Options,
) -> Result<Identified, IdentifyError> {
    let expected = problem.joints.len();
    for (pose, measured) in poses.iter().enumerate() {
        let found = measured.setup.configuration.len();
        if found != expected {
            return Err(IdentifyError::Joints { pose: pose + 1, found, expected });
        }
    }
    let unknowns = geometric_unknowns(expected, &options.reading);
    let needed = unknowns.len().div_ceil(3);
    if poses.len() < needed {
        return Err(IdentifyError::TooFewPoses {
            unknowns: unknowns.len(),
            needed,
            poses: poses.len(),
        });
    }
    let finite = poses.iter().all(|pose| pose.position.iter().all(|x| x.is_finite()));
    let mut parameters = match stiffness(problem, poses, &options.reading, options.stiffness) {
        Some(parameters) => parameters,
        None if finite && options.stiffness == StiffnessStage::LoadDifferences => {
            return Err(IdentifyError::NoLoadDifferences);
        }
        None => return Err(IdentifyError::NotFinite),
    };
    let start = DVector::zeros(unknowns.len());
    let geometry =
        GeometryResiduals::new(problem, poses, &parameters, unknowns.clone(), options.reading);
    let sight = Identifiability::of(&Fit::new(&geometry).linearise(&start).triangle);
    let mut seen = vec![0.0; 5 * expected];
    unknowns.iter().zip(sight.visible).for_each(|(&place, visible)| seen[place] = visible);
    let iteration = minimise_pseudo_inverse(Fit::new(&geometry), start, &options.iteration);
    let identified = geometry.at(&iteration.x);
    parameters.geometry = identified.geometry;
    Ok(Identified { parameters, iteration, seen })
}

/// The geometric parameters that eq. 45 corrects, as places in e = [e₁ … e_n].
fn geometric_unknowns(joints: usize, reading: &Reading) -> Vec<usize> {
    let beta = 4;
    (0..5 * joints).filter(|k| k % 5 != beta || !reading.keeps(Misprint::BetaLeftOut)).collect()
}

//! Identification procedure of the paper: stiffness by linear least squares, then geometry by the
//! iterated pseudo-inverse, eq. 42-45.

use nalgebra::DVector;

use super::Parameters;
use super::form::{Misprint, Reading};
use super::residuals::{GeometryResiduals, Measured};
use super::stiffness::{StiffnessStage, stiffness};
use crate::least_squares::solver::{PseudoInverseSettings, Solution, minimise_pseudo_inverse};
use crate::least_squares::{Fit, Identifiability, Objective as _};
use crate::problem::Problem;

/// Options of the paper's identification procedure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Form (printed or corrected) in which each misprinted formula is evaluated.
    pub reading: Reading,
    /// Source of the stiffness, which the first stage determines.
    pub stiffness: StiffnessStage,
    /// Settings of the iteration of eq. 45; by default, singular values up to 1e-6 of the largest
    /// are dropped.
    pub iteration: PseudoInverseSettings,
}

impl Options {
    /// Creates options with the default settings of the iteration.
    pub fn new(reading: impl Into<Reading>, stiffness: StiffnessStage) -> Self {
        let iteration =
            PseudoInverseSettings { tolerance: 1e-6, ..PseudoInverseSettings::default() };
        Self { reading: reading.into(), stiffness, iteration }
    }
}

/// Result of the paper's identification procedure.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// Identified geometry E and flexibilities S; estimated flexibilities may be negative.
    pub parameters: Parameters,
    /// End of the iteration of eq. 45; its x holds the deviations e of the unknowns from nominal.
    pub iteration: Solution,
    /// Part of each entry of e = [e₁ … e_n] that the positions determine at nominal geometry, 0…1,
    /// shape = (5n). The rest lies in combinations that move no position, for which the minimum
    /// norm decides. 0 for entries that are not unknowns.
    pub identified_share: Vec<f64>,
}

/// Error of poses from which the procedure cannot identify the arm.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The poses have fewer equations, three each, than eq. 42 has unknowns: 5n, or 4n without β.
    #[error(
        "identifying {unknowns} geometric parameters takes at least {needed} poses, there are \
         {poses}"
    )]
    TooFewPoses {
        /// Number of unknowns of eq. 42.
        unknowns: usize,
        /// Number of poses needed.
        needed: usize,
        /// Number of poses given.
        poses: usize,
    },
    /// A configuration has another number of joints than the arm.
    #[error("pose {pose} has {found} joints, the arm {expected}")]
    Joints {
        /// Number of the pose, from 1.
        pose: usize,
        /// Number of joints of the pose.
        found: usize,
        /// Number of joints of the arm.
        expected: usize,
    },
    /// The stiffness stage met a number that is not finite.
    #[error("a measured position or a deflection at nominal geometry is not finite")]
    NotFinite,
    /// Load differences were requested, but no configuration was measured under several loads.
    #[error("no configuration was measured under several loads")]
    NoLoadDifferences,
}

/// Identifies stiffness, then geometry, from measured positions; the stiffness is not identified
/// again with the new geometry.
///
/// 1. Stiffness by the [`StiffnessStage`] (§3.3 puts it first; the paper does not print its
///    equations).
/// 2. With fixed stiffness, e_{j+1} = `J_g(E_j)`⁺ [`PE_meas` − `PE_nom(E_j)` − `D_f(E_j)`],
///    E_{j+1} = E_j + e_{j+1}, until e is negligible [Chen2021, eq. 45].
///
/// Geometric errors that resemble deflections bias stage 1 if it uses positions. Stage 1 explains
/// them by flexibilities many times the true ones, or negative, and stage 2 cannot correct that.
/// Load differences are not biased. That eq. 41 neglects the effect of e on the deflections matters
/// less; `docs/paper.md` has figures.
///
/// All flexibilities of the problem and all 5n geometric parameters are unknown, whatever
/// `[parameters]` declares; base and target are known. Printed differently (`BetaLeftOut`): the
/// text to eq. 45 has E_j = [α a θ d]ᵀ, so that β stays nominal, although e contains it and table 2
/// identifies it.
///
/// # Errors
/// Returns an error if the poses do not match the arm, are too few for eq. 42, or are not finite. A
/// diverging iteration is no error but is reported in [`Identified::iteration`].
pub fn identify(
    problem: &Problem,
    poses: &[Measured],
    options: &Options,
) -> Result<Identified, IdentifyError> {
    let expected = problem.joints.len();
    for (pose, measured) in poses.iter().enumerate() {
        let joints = measured.setup.configuration.len();
        if joints != expected {
            return Err(IdentifyError::Joints { pose: pose + 1, found: joints, expected });
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
    let is_finite = poses.iter().all(|pose| pose.position.iter().all(|x| x.is_finite()));
    let mut parameters = match stiffness(problem, poses, &options.reading, options.stiffness) {
        Some(parameters) => parameters,
        None if is_finite && options.stiffness == StiffnessStage::LoadDifferences => {
            return Err(IdentifyError::NoLoadDifferences);
        }
        None => return Err(IdentifyError::NotFinite),
    };
    let start = DVector::zeros(unknowns.len());
    let geometry =
        GeometryResiduals::new(problem, poses, &parameters, unknowns.clone(), options.reading);
    let identifiability = Identifiability::of(&Fit::new(&geometry).linearise(&start).triangle);
    let mut identified_share = vec![0.0; 5 * expected];
    for (&index, visible) in unknowns.iter().zip(identifiability.visible) {
        identified_share[index] = visible;
    }
    let iteration = minimise_pseudo_inverse(Fit::new(&geometry), start, &options.iteration);
    let identified = geometry.at(&iteration.x);
    parameters.geometry = identified.geometry;
    Ok(Identified { parameters, iteration, identified_share })
}

/// Returns the indices into e = [e₁ … e_n] of the geometric parameters that eq. 45 corrects, for an
/// arm of `joints` joints.
fn geometric_unknowns(joints: usize, reading: &Reading) -> Vec<usize> {
    let beta = 4;
    (0..5 * joints).filter(|k| k % 5 != beta || !reading.keeps(Misprint::BetaLeftOut)).collect()
}

//! The paper's procedure: stiffness by linear least squares, then geometry by the iterated pseudo-inverse, eq. 42-45.

use nalgebra::{DMatrix, DVector};

use super::form::{Form, Misprint, Reading};
use super::residuals::{GeometryResiduals, Measured};
use super::{EndPoint, Parameters};
use crate::least_squares::solver::{PseudoInverseSettings, Solution, minimise_pseudo_inverse, minimum_norm_step};
use crate::least_squares::{Block, Fit, Triangle};
use crate::problem::Problem;

/// Where the stiffness comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StiffnessStage {
    /// It is known: as the problem declares it. Table 2 of the paper lists geometry only.
    Nominal,
    /// Identified from the same poses, before the geometry.
    LeastSquares {
        /// Singular values of the elastic Jacobian, its columns multiplied by the nominal flexibilities, up to this
        /// fraction of the largest are dropped: those combinations keep their nominal value.
        tolerance: f64,
    },
}

/// How to identify.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Which formulas.
    pub reading: Reading,
    /// The first stage; by default least squares with tolerance 0.01.
    pub stiffness: StiffnessStage,
    /// The iteration of eq. 45; by default truncated at 1e-6.
    pub iteration: PseudoInverseSettings,
}

impl From<Form> for Options {
    fn from(form: Form) -> Self {
        let iteration = PseudoInverseSettings { tolerance: 1e-6, ..PseudoInverseSettings::default() };
        Self { reading: form.into(), stiffness: StiffnessStage::LeastSquares { tolerance: 1e-2 }, iteration }
    }
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// E and S; flexibilities come out as the data have them, even below zero.
    pub parameters: Parameters,
    /// The iteration of eq. 45: why it stopped, after how many steps; its x are the errors e from nominal.
    pub iteration: Solution,
}

/// Poses that the procedure cannot use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Three coordinates a pose are fewer equations than the 5n unknowns of eq. 42.
    #[error("identifying {unknowns} geometric parameters takes at least {needed} poses, there are {poses}")]
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
}

/// x = A⁺ b with singular values up to `tolerance`·σ₁ dropped                             [Chen2021, eq. 43, 44]
///
/// `None` where A or b is not finite, or they differ in rows.
pub fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>, tolerance: f64) -> Option<DVector<f64>> {
    if a.nrows() != b.len() || !a.iter().chain(b.iter()).all(|value| value.is_finite()) {
        return None;
    }
    let mut block = Block::zeros(a.nrows(), a.ncols());
    for (j, column) in a.column_iter().enumerate() {
        block.column_mut(j).iter_mut().zip(&column).for_each(|(to, from)| *to = *from);
    }
    block.column_mut(a.ncols()).iter_mut().zip(b).for_each(|(to, from)| *to = -from);
    let mut triangle = Triangle::new(a.ncols());
    triangle.absorb(&mut block);
    Some(minimum_norm_step(&triangle.into_linearisation(), tolerance))
}

/// Identifies stiffness, then geometry, from measured positions; one sweep.
///
/// 1. At nominal geometry `D_f` is linear in the flexibilities: c = c₀ + C⁺ [`PE_meas` − `PE_nom` − C c₀] (§3.3: stiffness
///    comes first; the paper does not print its equations).
/// 2. With these fixed, e_{j+1} = `J_g(E_j)`⁺ [`PE_meas` − `PE_nom(E_j)` − `D_f(E_j)`], E_{j+1} = E_j + e_{j+1}, until e
///    is negligible                                                                     [Chen2021, eq. 45]
///
/// One sweep of this order works as far as the geometric errors do not look like deflections. On the lunar sampler with the
/// errors of table 2 (43 mm) they do: stage 1 explains them by flexibilities many times the true ones, or negative, and
/// 9.6 mm are left on other poses, against 0.07 mm with the stiffness known. Eq. 41, which drops the coupling (1.8 mm there),
/// is the smaller part of it; that stage 1 holds the geometry at nominal is the larger.
///
/// All flexibilities that the problem gives and all 5n geometric parameters are unknown, whatever `[parameters]` says; base
/// and target are known. Printed differently: `BetaLeftOut`, the text to eq. 45 has E_j = [α a θ d]ᵀ, so that β stays
/// nominal, though e has it and table 2 identifies it.
///
/// # Errors
/// The poses do not fit the arm, are too few for eq. 42, or are not finite. A diverging iteration is not an error: it is
/// told in [`Identified::iteration`].
pub fn identify(problem: &Problem, poses: &[Measured], options: &Options) -> Result<Identified, IdentifyError> {
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
        return Err(IdentifyError::TooFewPoses { unknowns: unknowns.len(), needed, poses: poses.len() });
    }
    let mut parameters = match options.stiffness {
        StiffnessStage::Nominal => Parameters::nominal(problem),
        StiffnessStage::LeastSquares { tolerance } => {
            stiffness(problem, poses, &options.reading, tolerance).ok_or(IdentifyError::NotFinite)?
        }
    };
    let start = DVector::zeros(unknowns.len());
    let geometry = GeometryResiduals::new(problem, poses, &parameters, unknowns, options.reading);
    let iteration = minimise_pseudo_inverse(Fit::new(&geometry), start, &options.iteration);
    let identified = geometry.at(&iteration.x);
    parameters.geometry = identified.geometry;
    Ok(Identified { parameters, iteration })
}

/// Flexibilities by linear least squares at nominal geometry; `None` where something is not finite.
pub fn stiffness(problem: &Problem, poses: &[Measured], reading: &Reading, tolerance: f64) -> Option<Parameters> {
    let mut parameters = Parameters::nominal(problem);
    let unknowns = parameters.flexibilities();
    let mut columns = DMatrix::zeros(3 * poses.len(), unknowns.len());
    let mut rest = DVector::zeros(3 * poses.len());
    for (row, pose) in poses.iter().enumerate() {
        let end = EndPoint::new(problem, &parameters, &pose.setup, reading);
        rest.fixed_rows_mut::<3>(3 * row).copy_from(&(pose.position - end.position(&parameters)));
        for (column, &which) in unknowns.iter().enumerate() {
            let derivative = end.displacement(&end.elastic.derivative(which)) * parameters.get(which);
            columns.fixed_view_mut::<3, 1>(3 * row, column).copy_from(&derivative);
        }
    }
    let relative = least_squares(&columns, &rest, tolerance)?;
    for (&which, change) in unknowns.iter().zip(&relative) {
        parameters.set(which, parameters.get(which) * (1.0 + change));
    }
    Some(parameters)
}

/// The geometric parameters that eq. 45 corrects, as places in e = [e₁ … e_n].
fn geometric_unknowns(joints: usize, reading: &Reading) -> Vec<usize> {
    let beta = 4;
    (0..5 * joints).filter(|k| k % 5 != beta || !reading.keeps(Misprint::BetaLeftOut)).collect()
}

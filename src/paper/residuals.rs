//! Least-squares problem that the iteration of the paper's eq. 45 solves.

use std::ops::Range;

use nalgebra::{DVector, Vector3};

use super::form::Reading;
use super::{EndPoint, Parameters};
use crate::least_squares::{Block, LeastSquares};
use crate::problem::{PoseView, Problem};

/// Pose with its measured position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured<'a> {
    /// Configuration and loads of the pose.
    pub setup: PoseView<'a>,
    /// Measured position `PE_meas`, measuring frame \[m\].
    pub position: Vector3<f64>,
}

/// Residuals `PE_meas` − `PE_nom(E)` − `D_f(E)` \[m\] as a function of the geometry E, with the
/// derivative −`J_g(E)` of the paper.
///
/// The derivative neglects ∂`D_f`/∂E (eq. 41). The iteration therefore stops at `J_g`ᵀ r = 0, near
/// the minimum of ‖r‖ but not at it.
pub struct GeometryResiduals<'a> {
    problem: &'a Problem,
    poses: &'a [Measured<'a>],
    parameters: &'a Parameters,
    unknowns: Vec<usize>,
    reading: Reading,
}

impl<'a> GeometryResiduals<'a> {
    /// Creates the residuals of `poses` about the geometry and with the flexibilities of
    /// `parameters`. `unknowns` are the indices into e = [e₁ … e_n] of the geometric errors to
    /// find. Every pose must have as many joints as the arm.
    pub fn new(
        problem: &'a Problem,
        poses: &'a [Measured<'a>],
        parameters: &'a Parameters,
        unknowns: Vec<usize>,
        reading: Reading,
    ) -> Self {
        Self { problem, poses, parameters, unknowns, reading }
    }

    /// Returns the parameters with the deviations `x` added to those geometric parameters that are
    /// unknowns.
    pub fn at(&self, x: &DVector<f64>) -> Parameters {
        let mut parameters = self.parameters.clone();
        for (&index, x) in self.unknowns.iter().zip(x) {
            *parameters.geometry[index / 5].fields_mut()[index % 5] += x;
        }
        parameters
    }
}

impl LeastSquares for GeometryResiduals<'_> {
    fn parameters(&self) -> usize {
        self.unknowns.len()
    }

    fn items(&self) -> usize {
        self.poses.len()
    }

    fn rows_per_item(&self) -> usize {
        3
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        let parameters = self.at(x);
        for (pose, out) in self.poses[items].iter().zip(out.chunks_exact_mut(3)) {
            let end = EndPoint::new(self.problem, &parameters, &pose.setup, &self.reading);
            out.copy_from_slice((pose.position - end.position(&parameters)).as_slice());
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let parameters = self.at(x);
        for (item, pose) in self.poses[items].iter().enumerate() {
            let end = EndPoint::new(self.problem, &parameters, &pose.setup, &self.reading);
            let rows = 3 * item..3 * item + 3;
            let jacobian = end.jacobian();
            for (column, &index) in self.unknowns.iter().enumerate() {
                let derivative = -jacobian.column(index);
                block.column_mut(column)[rows.clone()].copy_from_slice(derivative.as_slice());
            }
            let residual = pose.position - end.position(&parameters);
            block.column_mut(self.unknowns.len())[rows].copy_from_slice(residual.as_slice());
        }
    }
}

//! Position and error of the end point, eq. 39-41 of the paper.

use nalgebra::{DVector, Matrix3xX, Vector3, Vector6};

use super::form::{Misprint, Reading};
use super::kinematics::{Chain, split};
use super::loads::Loads;
use super::parameters::Parameters;
use super::{Elastic, geometric};
use crate::problem::{PoseView, Problem};

/// Arm in one pose in the notation of the paper: frames of the rigid arm with geometry E, and its
/// deflections. The position of the end point follows from both.
#[derive(Debug, Clone)]
pub struct EndPoint {
    /// Frames of the rigid arm.
    pub chain: Chain,
    /// Deflections of joints and links under the loads of the pose, for any flexibilities.
    pub elastic: Elastic,
    reading: Reading,
}

impl EndPoint {
    /// Computes the arm of `problem` with the geometry of `parameters`, in the configuration and
    /// under the loads of `setup`. `reading` selects the form of the misprinted formulas.
    ///
    /// `parameters` has an entry for each joint; coordinates missing in the configuration are 0.
    pub fn new(
        problem: &Problem,
        parameters: &Parameters,
        setup: &PoseView,
        reading: &Reading,
    ) -> Self {
        let chain = Chain::new(problem, &parameters.geometry, setup.configuration);
        let loads = Loads::new(problem, &chain, setup);
        Self { elastic: Elastic::new(&chain, &loads, reading), chain, reading: *reading }
    }

    /// Returns the displacement R [I 0] D of the end point, measuring frame \[m\], for a
    /// differential motion D of the end frame in its axes. R is the rotation of the end frame.
    ///
    /// Printed differently (`EndFrame`): D of eq. 27 and 37 is in the end frame, but eq. 39 sets it
    /// equal to `PE_meas` − `PE_nom` in the measuring frame, [I 0] D.
    pub fn displacement(&self, motion: &Vector6<f64>) -> Vector3<f64> {
        let translation: Vector3<f64> = motion.fixed_rows::<3>(0).into_owned();
        if self.reading.keeps(Misprint::EndFrame) {
            translation
        } else {
            split(&self.chain.end()).0 * translation
        }
    }

    /// Returns the deflection `D_f` = `J_f` `d_f` as a displacement, measuring frame \[m\]
    /// [Chen2021, eq. 27, 39].
    pub fn deflection(&self, parameters: &Parameters) -> Vector3<f64> {
        self.displacement(&self.elastic.motion(parameters))
    }

    /// Returns the position rows of `J_g`, the derivatives of the end point with respect to the
    /// geometric parameters, shape = (3, 5n), measuring frame [Chen2021, eq. 38, 39, 42].
    pub fn jacobian(&self) -> Matrix3xX<f64> {
        let motions = geometric::jacobian(&self.chain, &self.reading);
        let columns: Vec<Vector3<f64>> = motions
            .column_iter()
            .map(|column| self.displacement(&column.fixed_rows::<6>(0).into_owned()))
            .collect();
        Matrix3xX::from_columns(&columns)
    }

    /// Returns the end-point error `D_End` = `J_f` `d_f` + `J_g` e by deflections `d_f` and
    /// geometric errors e, first order in both, measuring frame \[m\] [Chen2021, eq. 39, 41].
    ///
    /// e = [e₁ … e_n] has 5n entries. Eq. 40 evaluates `d_f` at the true parameters. Eq. 41
    /// evaluates it at E and S and so neglects the effect of e on the deflection.
    pub fn error(&self, parameters: &Parameters, e: &DVector<f64>) -> Vector3<f64> {
        self.deflection(parameters) + self.jacobian() * e
    }

    /// Returns the predicted position `PE_nom` + `D_f` of the end point, measuring frame \[m\].
    pub fn position(&self, parameters: &Parameters) -> Vector3<f64> {
        self.chain.position() + self.deflection(parameters)
    }
}

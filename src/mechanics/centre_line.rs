//! Centre line of the arm, for drawings.

use nalgebra::Vector3;

use super::arm::Arm;
use super::forward::DeflectionMode;
use super::statics::{StaticState, StaticsError, Workspace};
use crate::problem::PoseView;

/// Minimum number of straight pieces by which a beam is drawn, so that its curvature shows.
const MIN_DRAWN_ELEMENTS: usize = 4;

/// Arm as a line from its base to the frame of its target: each joint before and after its
/// rotation, and points along its beams.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CentreLine {
    /// Points of the undeflected arm, arm base frame \[m\].
    pub rigid: Vec<Vector3<f64>>,
    /// Same points at equilibrium under the loads \[m\].
    pub bent: Vec<Vector3<f64>>,
}

impl Arm<f64> {
    /// Returns the line of the arm to the frame of the joint `tip` in a pose, arm base frame.
    ///
    /// # Errors
    /// Returns an error if the arm is too soft for its loads.
    pub fn centre_line(&self, setup: &PoseView, tip: usize) -> Result<CentreLine, StaticsError> {
        let drawn =
            Self { beam_elements: self.beam_elements.max(MIN_DRAWN_ELEMENTS), ..self.clone() };
        let (mut ws, mut state) = (Workspace::default(), StaticState::default());
        drawn.gather_forces(setup, &[], &mut ws);
        drawn.walk(setup, DeflectionMode::Rigid, tip, &mut ws);
        let mut rigid = vec![Vector3::zeros()];
        rigid.append(&mut ws.trail);
        if !drawn.is_elastic() {
            return Ok(CentreLine { bent: rigid.clone(), rigid });
        }
        drawn.equilibrate_at(setup, tip, &mut ws, &mut state)?;
        let mut bent = vec![Vector3::zeros()];
        bent.append(&mut ws.trail);
        Ok(CentreLine { rigid, bent })
    }
}

//! Deviations of an arm from its declared parameters; every term vanishes at zero.

use nalgebra::Vector3;

use crate::scalar::Scalar;

/// Moment scale of the tanh by which a load takes up play [N·m]: at this moment 76 % is taken up.
const PLAY_MOMENT: f64 = 1.0;
/// Argument from which on tanh is 1 to rounding: 2 exp(−2x) is below half a unit in the last place.
const SATURATED_TANH: f64 = 20.0;

/// Rotation of a joint about its axis that is not proportional to the moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nonlinear<S> {
    /// Angle per cube of the moment [rad/(N·m)³].
    pub cubic: S,
    /// Play \[rad\], of a prismatic joint \[m\]. The direction of approach takes it up; if that is
    /// unknown, the moment does, except in a prismatic joint.
    pub play: S,
}

/// Undeclared point mass on a link's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass<S> {
    /// Size of the mass \[kg\].
    pub mass: S,
    /// Distance of the added mass from the root of the link \[m\].
    pub at: S,
}

/// Errors of the declared force and direction of hoists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoistError<S> {
    /// Relative error of the force.
    pub force: S,
    /// Error added to the x and y components of the unit direction, arm base frame.
    pub lean: [S; 2],
    /// Derivative of that error with respect to the hook's x and y [1/m].
    pub trolley: S,
}

impl<S: Scalar> Nonlinear<S> {
    /// Returns the angle \[rad\] under a moment [N·m]. `takes_up_play` is true if the moment takes
    /// up the play, because the direction of approach is unknown; otherwise play is left out.
    pub(super) fn twist(&self, moment: S, takes_up_play: bool) -> S {
        let cubic = self.cubic * moment * moment * moment;
        if takes_up_play { cubic + self.play * tanh(moment / PLAY_MOMENT) * 0.5 } else { cubic }
    }
}

/// Returns tanh x with its derivative 1 − tanh² x, finite at any x. From [`SATURATED_TANH`] on they
/// are 1 and 0 to rounding, where sinh x / cosh x of dual numbers overflows.
fn tanh<S: Scalar>(x: S) -> S {
    if x.re().abs() < SATURATED_TANH { x.tanh() } else { S::from(x.re().signum()) }
}

/// Strain of a beam without load, for example of a warm beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain<S> {
    /// Elongation per unit of length.
    pub axial: S,
    /// Curvatures about y and z along +x [1/m].
    pub curvature: [S; 2],
}

impl<S: Scalar> Strain<S> {
    /// Returns the strain with that of one pose added: elongation, then curvatures about y and z
    /// [1/m].
    pub(super) fn plus(&self, [axial, y, z]: [f64; 3]) -> Self {
        Self {
            axial: self.axial + axial,
            curvature: [self.curvature[0] + y, self.curvature[1] + z],
        }
    }
}

impl<S: Scalar> HoistError<S> {
    /// Returns the force \[N\] of a rope, arm base frame, with the errors of force and lean
    /// included. `tension` \[N\] and unit `direction` are declared; x and y are the hook's position
    /// \[m\].
    pub(super) fn pull(
        &self,
        direction: &Vector3<f64>,
        tension: f64,
        [x, y]: [S; 2],
    ) -> Vector3<S> {
        let mut direction = direction.map(S::from);
        direction.x += self.lean[0] + self.trolley * x;
        direction.y += self.lean[1] + self.trolley * y;
        let length = direction.dot(&direction).sqrt();
        direction * ((self.force + 1.0) * tension / length)
    }
}

impl Nonlinear<f64> {
    /// Converts to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> Nonlinear<S> {
        Nonlinear { cubic: S::from(self.cubic), play: S::from(self.play) }
    }
}

impl Strain<f64> {
    /// Converts to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> Strain<S> {
        Strain { axial: S::from(self.axial), curvature: self.curvature.map(S::from) }
    }
}

impl AddedMass<f64> {
    /// Converts to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> AddedMass<S> {
        AddedMass { mass: S::from(self.mass), at: S::from(self.at) }
    }
}

impl HoistError<f64> {
    /// Converts to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> HoistError<S> {
        HoistError {
            force: S::from(self.force),
            lean: self.lean.map(S::from),
            trolley: S::from(self.trolley),
        }
    }
}

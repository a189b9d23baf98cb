//! What an arm may do beyond its declared parameters; every term is inert at zero.

use nalgebra::Vector3;

use crate::scalar::Scalar;

/// Moment at which play is taken up to three quarters [N·m].
const PLAY_MOMENT: f64 = 1.0;
/// tanh does not differ from 1 from here on: 2 exp(−2x) is below half a unit in the last place.
const FLAT: f64 = 20.0;

/// How a joint turns about its axis other than in proportion to the moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nonlinear<S> {
    /// Angle per cube of the moment [rad/(N·m)³].
    pub cubic: S,
    /// Play \[rad\], \[m\] where the joint slides: taken up by the direction of approach; where
    /// that is not known by the moment, which moves no joint along its slide.
    pub play: S,
}

/// A mass on a link's axis that nobody declared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass<S> {
    /// Mass \[kg\].
    pub mass: S,
    /// Distance from the link's root \[m\].
    pub at: S,
}

/// How ropes pull other than declared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoistError<S> {
    /// Relative error of the force.
    pub force: S,
    /// Lean of the direction, x and y of the base frame.
    pub lean: [S; 2],
    /// Change of the lean with the hook's x and y [1/m].
    pub trolley: S,
}

impl<S: Scalar> Nonlinear<S> {
    /// Angle under a moment [N·m]; its play counts where the moment `takes_up_play`.
    pub(super) fn twist(&self, moment: S, takes_up_play: bool) -> S {
        let cubic = self.cubic * moment * moment * moment;
        if takes_up_play { cubic + self.play * tanh(moment / PLAY_MOMENT) * 0.5 } else { cubic }
    }
}

/// tanh x with its derivative 1 − tanh² x, finite at any x: from [`FLAT`] on they are 1 and 0 to
/// rounding, where sinh x / cosh x of dual numbers overflows.
fn tanh<S: Scalar>(x: S) -> S {
    if x.re().abs() < FLAT { x.tanh() } else { S::from(x.re().signum()) }
}

/// Strain of a beam without load, as of one that is warm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain<S> {
    /// Elongation per length.
    pub axial: S,
    /// Curvature about y and z, turning per metre of +x [1/m].
    pub curvature: [S; 2],
}

impl<S: Scalar> Strain<S> {
    /// With that of one pose: elongation, then curvatures.
    pub(super) fn and(&self, [axial, y, z]: [f64; 3]) -> Self {
        Self {
            axial: self.axial + axial,
            curvature: [self.curvature[0] + y, self.curvature[1] + z],
        }
    }
}

impl<S: Scalar> HoistError<S> {
    /// Force \[N\] of a tension \[N\] in a declared direction, with the hook at these x and y
    /// \[m\], base frame.
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
    /// The same as constants of another scalar.
    pub(super) fn lift<S: Scalar>(&self) -> Nonlinear<S> {
        Nonlinear { cubic: S::from(self.cubic), play: S::from(self.play) }
    }
}

impl Strain<f64> {
    /// The same as constants of another scalar.
    pub(super) fn lift<S: Scalar>(&self) -> Strain<S> {
        Strain { axial: S::from(self.axial), curvature: self.curvature.map(S::from) }
    }
}

impl AddedMass<f64> {
    /// The same as constants of another scalar.
    pub(super) fn lift<S: Scalar>(&self) -> AddedMass<S> {
        AddedMass { mass: S::from(self.mass), at: S::from(self.at) }
    }
}

impl HoistError<f64> {
    /// The same as constants of another scalar.
    pub(super) fn lift<S: Scalar>(&self) -> HoistError<S> {
        HoistError {
            force: S::from(self.force),
            lean: self.lean.map(S::from),
            trolley: S::from(self.trolley),
        }
    }
}

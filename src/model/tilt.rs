//! Tilts of frames of the arm against gravity, and their derivatives.

use nalgebra::{DVector, Vector3};
use num_dual::Dual64;

use super::Model;
use super::elastic::seed_arm;
use super::inputs::Input;
use super::rows::Rows;
use crate::mechanics::{Arm, StaticState, Workspace};
use crate::problem::PoseView;
use crate::scalar::Scalar;

/// Least squared cosine of a tilt, so that one of a right angle has a derivative.
const UPRIGHT: f64 = 1e-18;

/// An arm of which frames are tilted, with each of its inputs seeded in turn.
pub(super) struct Tilts {
    arm: Arm<f64>,
    plain: Arm<Dual64>,
    inputs: Vec<(Input, Arm<Dual64>)>,
    rest: StaticState,
    real: Workspace<f64>,
    ws: Workspace<Dual64>,
}

impl Tilts {
    /// Of `arm`, which is the model's at the full parameter vector `x`.
    pub fn new(model: &Model, x: &DVector<f64>, arm: Arm<f64>, inputs: Vec<Input>) -> Self {
        let seeded = |input: Input| {
            let arm = seed_arm(model, x, &[&input]);
            (input, arm)
        };
        Self {
            plain: arm.lift(),
            arm,
            inputs: inputs.into_iter().map(seeded).collect(),
            rest: StaticState::default(),
            real: Workspace::default(),
            ws: Workspace::default(),
        }
    }

    /// The tilts of a frame \[rad\], 0 behind them; `None` where the pose has no equilibrium.
    pub fn at(&mut self, setup: &PoseView, frame: usize) -> Option<Vector3<f64>> {
        let Self { arm, plain, rest, real, ws, .. } = self;
        arm.equilibrate(setup, real, rest).ok()?;
        Some(tilts(plain, setup, frame, rest, ws).map(|tilt| tilt.re))
    }

    /// The same, with the derivatives written into `rows`.
    pub fn write(
        &mut self,
        commanded: &PoseView,
        setup: &PoseView,
        frame: usize,
        rows: &mut Rows,
    ) -> Option<Vector3<f64>> {
        let at = self.at(setup, frame)?;
        let Self { inputs, rest, ws, .. } = self;
        for (input, arm) in inputs {
            let derivative = tilts(arm, setup, frame, rest, ws).map(|tilt| tilt.eps);
            rows.put_input(input, commanded, &derivative);
        }
        Some(at)
    }
}

/// The tilts of a frame of the arm that does not deflect \[rad\], 0 behind them.
pub(super) fn rigid_tilts(arm: &Arm<f64>, setup: &PoseView, frame: usize) -> Vector3<f64> {
    above(&arm.rigid_frame(setup, frame.min(arm.last())).axes, &arm.gravity)
}

fn tilts(
    arm: &Arm<Dual64>,
    setup: &PoseView,
    frame: usize,
    rest: &StaticState,
    ws: &mut Workspace<Dual64>,
) -> Vector3<Dual64> {
    let frames = arm.frames(setup, rest, ws);
    let Some(frame) = frames.get(frame).or(frames.last()) else {
        return Vector3::from_element(Dual64::from(0.0));
    };
    above(&frame.axes, &arm.gravity)
}

/// How far the x and the y axis of a frame lie above the horizontal: sin τ = a·u with u up, against
/// gravity.
fn above<S: Scalar>(axes: &[Vector3<S>; 3], gravity: &Vector3<S>) -> Vector3<S> {
    let zero = S::from(0.0);
    let weight = gravity.dot(gravity).sqrt();
    let up =
        if weight.re() > 0.0 { -gravity / weight } else { Vector3::new(zero, zero, S::from(1.0)) };
    let tilt = |axis: &Vector3<S>| {
        let sine = axis.dot(&up);
        let level = axis.cross(&up);
        let cosine = (level.dot(&level) + UPRIGHT).sqrt();
        sine.atan2(cosine)
    };
    Vector3::new(tilt(&axes[0]), tilt(&axes[1]), zero)
}

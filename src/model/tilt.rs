//! Tilts of frames of the arm, and their derivatives.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::Model;
use super::elastic::seed_arm;
use super::rows::{Input, Rows};
use crate::mechanics::{Arm, StaticState, Workspace};
use crate::observation::{Observation, Scene};
use crate::problem::PoseView;

/// Differentiates the tilts of frames, with one copy of the arm in dual numbers for each input.
pub(super) struct TiltDerivatives {
    arm: Arm<f64>,
    /// Copy of `arm` in dual numbers with zero derivatives, for the values of the frame's axes.
    unseeded: Arm<Dual64>,
    inputs: Vec<(Input, Arm<Dual64>)>,
    state: StaticState,
    real: Workspace<f64>,
    dual: Workspace<Dual64>,
}

impl TiltDerivatives {
    /// Prepares the differentiation with respect to `inputs`. `x` is the full parameter vector of
    /// `model`, and `arm` the arm with these values.
    pub fn new(model: &Model, x: &[f64], arm: Arm<f64>, inputs: Vec<Input>) -> Self {
        let seeded = |input: Input| {
            let arm = seed_arm(model, x, &[&input]);
            (input, arm)
        };
        Self {
            unseeded: arm.lift(),
            arm,
            inputs: inputs.into_iter().map(seeded).collect(),
            state: StaticState::default(),
            real: Workspace::default(),
            dual: Workspace::default(),
        }
    }

    /// Returns the axes of frame `frame` (0 is the base, i that of joint i), arm base frame; `None`
    /// if the pose has no equilibrium.
    pub fn axes(&mut self, setup: &PoseView, frame: usize) -> Option<[Vector3<f64>; 3]> {
        let Self { arm, unseeded, state, real, dual, .. } = self;
        arm.equilibrate(setup, real, state).ok()?;
        let axes = axes(unseeded, setup, frame, state, dual);
        Some(axes.map(|axis| axis.map(|coordinate| coordinate.re)))
    }

    /// Writes the derivatives of the tilts that a row measures into `rows`; returns the tilts
    /// \[rad\], `None` if the pose has no equilibrium.
    pub fn write(
        &mut self,
        (commanded, setup): (&PoseView, &PoseView),
        observation: Observation,
        rows: &mut Rows,
    ) -> Option<Vector3<f64>> {
        let frame = observation.frame();
        let real_axes = self.axes(setup, frame)?;
        let Self { arm, inputs, state, dual, .. } = self;
        for (input, seeded) in inputs {
            let axes = axes(seeded, setup, frame, state, dual);
            let tilts = observation.predict(&Scene {
                frame: axes,
                gravity: seeded.gravity,
                ..Scene::default()
            });
            rows.put_input(input, commanded, &tilts.map(|tilt| tilt.eps));
        }
        let scene = Scene { frame: real_axes, gravity: arm.gravity, ..Scene::default() };
        Some(observation.predict(&scene))
    }
}

/// Returns the axes of frame `frame` (0 is the base, i that of joint i) of the undeflected arm, arm
/// base frame.
pub(super) fn rigid_frame_axes(
    arm: &Arm<f64>,
    setup: &PoseView,
    frame: usize,
) -> [Vector3<f64>; 3] {
    let Some(joint) = frame.checked_sub(1) else { return Scene::default().frame };
    arm.rigid_frame(setup, joint.min(arm.last())).axes
}

fn axes(
    arm: &Arm<Dual64>,
    setup: &PoseView,
    frame: usize,
    state: &StaticState,
    workspace: &mut Workspace<Dual64>,
) -> [Vector3<Dual64>; 3] {
    let frames = arm.frames(setup, state, workspace);
    frames.get(frame).or(frames.last()).map_or_else(|| Scene::default().frame, |frame| frame.axes)
}

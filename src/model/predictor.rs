//! Predictions of rows at one parameter vector.

use nalgebra::Vector3;

use super::Model;
use super::command_terms::CommandTerms;
use super::instrument::Instrument;
use super::pose::Pose;
use super::tilt::{TiltDerivatives, rigid_frame_axes};
use crate::mechanics::{Arm, StaticState, Workspace};
use crate::observation::{FixtureValues, Needs, Scene};
use crate::problem::PoseView;
use crate::spatial::{Frame, rotation_axes, rotation_between};

/// Arm with its set-up at one parameter vector, ready to predict one row after another.
pub(super) struct Predictor<'m> {
    model: &'m Model,
    /// Full parameter vector of the predictions.
    x: Vec<f64>,
    /// True if the prediction uses geometry alone: rigid links and joints, no effects on the arm.
    is_rigid: bool,
    arm: Arm<f64>,
    bases: Vec<Frame<f64>>,
    targets: Vec<Vector3<f64>>,
    /// Axes of the targets in the frames that carry them.
    target_axes: Vec<[Vector3<f64>; 3]>,
    fixtures: Vec<FixtureValues<f64>>,
    instrument: Instrument,
    commands: CommandTerms,
    /// Frames of the arm for tilts, created by the first row that measures one.
    tilts: Option<TiltDerivatives>,
    state: StaticState,
    workspace: Workspace<f64>,
}

/// Predicted numbers and orientation of a row.
pub(super) struct Prediction {
    /// Predicted numbers \[m\], \[rad\] or \[px\], followed by zeros.
    pub numbers: Vector3<f64>,
    /// Rotation vector from the predicted to the measured orientation, measuring frame \[rad\]. It
    /// is 0 for a planned orientation without a measured value; `None` if the row has no
    /// orientation.
    pub orientation_error: Option<Vector3<f64>>,
}

impl<'m> Predictor<'m> {
    /// Creates a predictor at the full parameter vector `x`.
    pub fn new(model: &'m Model, x: &[f64]) -> Self {
        Self {
            model,
            x: x.to_vec(),
            is_rigid: false,
            arm: model.arm(|k| x[k]),
            bases: model.base_frames(x),
            targets: model.target_positions(x),
            target_axes: model.target_rotations(x).iter().map(rotation_axes).collect(),
            fixtures: model.fixtures(x),
            instrument: model.instrument_at(x),
            commands: model.commands(x),
            tilts: None,
            state: StaticState::default(),
            workspace: Workspace::default(),
        }
    }

    /// Creates a predictor of the geometry alone: rigid links and joints, no effects on the arm.
    pub fn rigid(model: &'m Model, x: &[f64]) -> Self {
        let commands = CommandTerms::new(&model.fixed_terms, &model.nominal, &[], &[]);
        Self { is_rigid: true, commands, ..Self::new(model, x) }
    }

    /// Returns the frame that carries the target, arm base frame; `None` without equilibrium.
    #[inline]
    pub fn target_frame(&mut self, pose: &Pose) -> Option<Frame<f64>> {
        self.joint_frame(pose, self.model.target_joint(pose.target))
    }

    /// Returns the frame of a joint, arm base frame; `None` without equilibrium.
    #[inline]
    fn joint_frame(&mut self, pose: &Pose, joint: usize) -> Option<Frame<f64>> {
        let setup = self.commands.apply(&pose.setup);
        if self.is_rigid {
            return Some(self.arm.rigid_frame(&setup, joint));
        }
        let Self { arm, workspace, state, .. } = self;
        arm.equilibrate_at(&setup, joint, workspace, state).ok()?;
        Some(state.frame)
    }

    /// Returns the pose with the terms of mimic joints and effects added to its commands and
    /// strains.
    pub fn setup<'b>(&'b mut self, pose: &'b Pose) -> PoseView<'b> {
        self.commands.apply(&pose.setup)
    }

    /// Returns the position of the target in the frame that carries it \[m\].
    pub fn target(&self, pose: &Pose) -> Vector3<f64> {
        self.targets[pose.target]
    }

    /// Returns the frame of the arm's base in a pose, measuring frame.
    #[inline]
    pub fn base_frame(&self, pose: &Pose) -> Frame<f64> {
        self.instrument.base_frame(&self.bases[pose.base], &pose.setup)
    }

    /// Returns the axes of the target in a pose, measuring frame. `frame` carries the target, arm
    /// base frame; `base` is the arm's base, measuring frame.
    #[inline]
    pub fn axes(&self, pose: &Pose, base: &Frame<f64>, frame: &Frame<f64>) -> [Vector3<f64>; 3] {
        self.target_axes[pose.target].map(|axis| base.vector(&frame.vector(&axis)))
    }

    /// Returns the predicted numbers and orientation of a row; NaN if the pose has no equilibrium.
    #[inline]
    pub fn predict(&mut self, pose: &Pose) -> Prediction {
        let undefined = Vector3::from_element(f64::NAN);
        self.try_predict(pose).unwrap_or(Prediction {
            numbers: undefined,
            orientation_error: pose.orientation.map(|_| undefined),
        })
    }

    fn try_predict(&mut self, pose: &Pose) -> Option<Prediction> {
        let observation = pose.observation;
        let mut turn = None;
        let scene = match observation.description().needs {
            Needs::Fixtures => Scene::default(),
            Needs::Frame => {
                let frame = self.frame_axes(pose)?;
                Scene { frame, gravity: self.arm.gravity, ..Scene::default() }
            }
            Needs::Carriers => {
                let carriers = self.carriers(pose)?;
                let point = self.model.fixture_point(observation);
                Scene { carriers, point, ..Scene::default() }
            }
            Needs::Target => {
                let frame = self.target_frame(pose)?;
                let base = self.base_frame(pose);
                let mut target = base.point(&frame.point(&self.target(pose)));
                if observation.is_position() {
                    target = self.instrument.reading(&target, &pose.setup);
                }
                turn = pose.orientation.map(|orientation| {
                    orientation.axes().map_or(Vector3::zeros(), |measured| {
                        rotation_between(&self.axes(pose, &base, &frame), &measured)
                    })
                });
                Scene { target, base: base.axes, ..Scene::default() }
            }
        };
        let fixtures = self.instrument.fixtures(pose, &self.fixtures);
        Some(Prediction {
            numbers: observation.predict(&Scene { fixtures, ..scene }),
            orientation_error: turn,
        })
    }

    /// Returns the frames that carry the two fixtures of a row, measuring frame; `None` without
    /// equilibrium.
    pub fn carriers(&mut self, pose: &Pose) -> Option<[Frame<f64>; 2]> {
        let base = self.base_frame(pose);
        let mut carriers = [Frame::identity(); 2];
        for (frame, carrier) in carriers.iter_mut().zip(self.model.carriers(pose.observation)) {
            *frame = match carrier.map(|carrier| carrier.checked_sub(1)) {
                None => continue,
                Some(None) => base,
                Some(Some(joint)) => base.compose(&self.joint_frame(pose, joint)?),
            };
        }
        Some(carriers)
    }

    /// Returns the axes of the frame whose tilt is measured, arm base frame; `None` without
    /// equilibrium.
    fn frame_axes(&mut self, pose: &Pose) -> Option<[Vector3<f64>; 3]> {
        let frame = pose.observation.frame();
        let setup = self.commands.apply(&pose.setup);
        if self.is_rigid {
            return Some(rigid_frame_axes(&self.arm, &setup, frame));
        }
        let Self { model, x, arm, tilts, .. } = self;
        let tilts =
            tilts.get_or_insert_with(|| TiltDerivatives::new(model, x, arm.clone(), Vec::new()));
        tilts.axes(&setup, frame)
    }
}

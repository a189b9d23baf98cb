//! The model: an arm, its bases and targets, and where each free parameter enters. Immutable; knows no files and no
//! sensors.

mod ablation;
mod command;
mod derivative;
mod poses;

pub use ablation::Ablation;
pub use poses::{Pose, PoseResiduals};

use nalgebra::Vector3;

use crate::arm::{Angle, Arm};
use crate::error::{InputError, InputErrorKind};
use crate::parameter::{BeamField, JointField, LinearConstraint, Parameter, Slot, constrain, resolve};
use crate::problem::{BasePose, Problem};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// What predicts positions, as a function of the free parameters.
#[derive(Debug, Clone)]
pub struct Model {
    nominal: Arm<f64>,
    bases: Vec<BasePose>,
    targets: Vec<Vector3<f64>>,
    /// Free parameters, shape of every full parameter vector.
    pub parameters: Vec<Parameter>,
    /// Linear inequalities between them.
    pub constraints: Vec<LinearConstraint>,
}

impl Model {
    /// The declared arm with one base per name in `bases` and one target per name in `targets`.
    ///
    /// # Errors
    /// A rule of `[parameters]` or a constraint does not fit the parameters there are, or an effect is declared.
    pub fn new(problem: &Problem, bases: &[String], targets: &[String]) -> Result<Self, InputError> {
        if let Some(declared) = problem.effects.first() {
            return Err(declared.location.clone().error(InputErrorKind::EffectNotModelled));
        }
        let parameters = resolve(problem, bases, targets)?;
        Ok(Self {
            constraints: constrain(problem, bases, targets, &parameters)?,
            nominal: Arm::nominal(problem),
            bases: vec![problem.base.clone(); bases.len()],
            targets: vec![problem.tool.target; targets.len()],
            parameters,
        })
    }

    /// Whether bounds or constraints limit the parameters.
    pub fn is_bounded(&self) -> bool {
        !self.constraints.is_empty() || self.parameters.iter().any(Parameter::is_bounded)
    }

    /// The arm with parameter k at deviation `x(k)`, as declared where no parameter is free.
    pub fn arm<S: Scalar>(&self, x: impl Fn(usize) -> S) -> Arm<S> {
        let mut arm = self.nominal.lift();
        for (k, parameter) in self.parameters.iter().enumerate() {
            let nominal = parameter.nominal;
            match parameter.slot {
                Slot::Joint { joint, field } => {
                    let (x, joint) = (x(k), &mut arm.joints[joint]);
                    match field {
                        JointField::Alpha => joint.alpha = Angle::new(x + nominal),
                        JointField::A => joint.a = x + nominal,
                        JointField::Theta => joint.theta = x + nominal,
                        JointField::D => joint.d = x + nominal,
                        JointField::Beta => joint.beta = Angle::new(x + nominal),
                        JointField::Stiffness => joint.flexibility = Some((-x).exp() / nominal),
                    }
                }
                Slot::Beam { joint, field } => {
                    let flexibility = (-x(k)).exp() / nominal;
                    if let Some(beam) = &mut arm.joints[joint].beam {
                        let all = &mut beam.flexibility;
                        match field {
                            BeamField::Axial => all.axial = flexibility,
                            BeamField::Bending => (all.about_y, all.about_z) = (flexibility, flexibility),
                            BeamField::BendingY => all.about_y = flexibility,
                            BeamField::BendingZ => all.about_z = flexibility,
                            BeamField::Twist => all.twist = flexibility,
                        }
                    }
                }
                Slot::Base { .. } | Slot::Target { .. } => {}
            }
        }
        arm
    }

    /// Base poses in the measuring frame: translation [m] and rotation vector [rad].
    pub fn base_poses(&self, x: &[f64]) -> Vec<BasePose> {
        let mut bases = self.bases.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let Slot::Base { base, axis } = parameter.slot {
                if axis < 3 {
                    bases[base].translation[axis] += x;
                } else {
                    bases[base].rotation[axis - 3] += x;
                }
            }
        }
        bases
    }

    /// Base frames in the measuring frame.
    pub fn base_frames(&self, x: &[f64]) -> Vec<Frame<f64>> {
        self.base_poses(x).iter().map(|base| Frame::from_rotation_vector(base.translation, &base.rotation)).collect()
    }

    /// Targets in the last frame [m].
    pub fn target_positions(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let mut targets = self.targets.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let Slot::Target { target, axis } = parameter.slot {
                targets[target][axis] += x;
            }
        }
        targets
    }
}

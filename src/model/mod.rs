//! The model: an arm, its bases and targets, and where each free parameter enters. Immutable; knows
//! no files and no sensors.

mod ablation;
mod command;
mod command_jacobian;
mod command_residuals;
mod commands;
mod derivatives;
mod driven;
pub mod effect;
mod elastic;
mod enter;
mod inputs;
mod instrument;
mod jacobian;
mod linear_model;
mod orientation;
pub mod parameter;
mod pose;
mod pose_residuals;
mod predictions;
mod predictor;
mod rigid;
mod rows;
mod series;
mod terms;
mod tilt;

pub use crate::mechanics::CentreLine;
pub use ablation::Ablation;
pub use command_residuals::CommandResiduals;
pub(crate) use linear_model::LinearModel;
pub use pose::{MeasuredOrientation, Pose};
pub use pose_residuals::PoseResiduals;

use nalgebra::Vector3;

use crate::error::InputError;
use crate::mechanics::{Arm, Joint};
use crate::model::parameter::{
    LinearConstraint, Parameter, ParameterSite, Regressor, constrain, resolve,
};
use crate::observation::FixtureValues;
use crate::problem::{BasePose, Effect, Problem};
use crate::scalar::Scalar;
use crate::spatial::Frame;
use commands::Commands;
use driven::Driven;
use instrument::Instrument;

/// What predicts positions, as a function of the free parameters.
#[derive(Debug, Clone)]
pub struct Model {
    nominal: Arm<f64>,
    /// What drives joints beyond their commands without being free.
    driven: Vec<Driven>,
    instrument: Instrument,
    bases: Vec<BasePose>,
    targets: Vec<Vector3<f64>>,
    /// Index of the joint whose frame carries each target.
    target_joints: Vec<usize>,
    /// Orientation of each target in that frame, a rotation vector \[rad\].
    turned: Vec<Vector3<f64>>,
    /// Points, anchors and surfaces, as declared; 0 where nothing is known.
    fixtures: Vec<FixtureValues<f64>>,
    /// The numbers of each of them that are declared.
    declared: Vec<Vec<Option<f64>>>,
    /// Free parameters, shape of every full parameter vector.
    pub parameters: Vec<Parameter>,
    /// Linear inequalities between them.
    pub constraints: Vec<LinearConstraint>,
}

impl Model {
    /// The declared arm with its effects, one base per name in `bases` and one target per name in
    /// `targets`.
    ///
    /// # Errors
    /// A rule of `[parameters]` or a constraint does not fit the parameters there are, a custom
    /// effect finds no room, or the problem declares targets and not all of these.
    pub fn new(
        problem: &Problem,
        bases: &[String],
        targets: &[String],
    ) -> Result<Self, InputError> {
        terms::check_customs(problem, bases.len(), targets.len())?;
        let effects = &effect::parameters(problem);
        let own = targets.iter().map(|word| problem.target(word)).collect::<Result<Vec<_>, _>>()?;
        let parameters = resolve(problem, bases, targets, effects)?;
        let mut nominal = Arm::nominal(problem);
        for effect in effects {
            enter::prepare(&mut nominal, effect.site, effect.nominal);
        }
        for declared in &problem.effects {
            enter::place(&mut nominal, &declared.effect);
        }
        Ok(Self {
            constraints: constrain(problem, bases, targets, effects, &parameters)?,
            nominal,
            driven: Driven::declared(problem),
            instrument: Instrument::default(),
            bases: vec![problem.base.clone(); bases.len()],
            targets: own.iter().map(|own| own.at).collect(),
            target_joints: own.iter().map(|own| own.joint).collect(),
            turned: own.iter().map(|own| own.rotation).collect(),
            fixtures: problem
                .fixtures
                .iter()
                .map(|fixture| FixtureValues::new(fixture.kind, &fixture.known))
                .collect(),
            declared: problem.fixtures.iter().map(|own| own.known.clone()).collect(),
            parameters,
        })
    }

    /// The same model with a further parameter, free and without effect at zero, at each of these
    /// slots.
    ///
    /// Given with each site is the value that it has where nothing deviates; what the arm declares
    /// goes before it.
    #[must_use]
    pub fn with_probes(&self, slots: &[(ParameterSite, f64)]) -> Self {
        let mut model = self.clone();
        for &(site, nominal) in slots {
            enter::prepare(&mut model.nominal, site, nominal);
            let added = match site {
                ParameterSite::Joint { field, .. } => field.is_geometry(),
                ParameterSite::Shift { .. } => true,
                _ => false,
            };
            model.parameters.push(Parameter {
                name: String::new(),
                site,
                regressor: if added { Regressor::Unit } else { Regressor::Constant },
                nominal,
                sigma: None,
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
            });
        }
        model
    }

    /// The same model with what these effects declare of the arm besides their parameters: where
    /// springs are.
    #[must_use]
    pub(crate) fn with_springs_of(&self, effects: &[Effect]) -> Self {
        let mut model = self.clone();
        for effect in effects {
            enter::place(&mut model.nominal, effect);
        }
        model
    }

    /// Number of joints, fixed ones among them.
    pub fn joints(&self) -> usize {
        self.nominal.joints.len()
    }

    /// How far the nominal arm can stretch \[m\]: Σ √(a² + d²), or ‖xyz‖, over the joints that
    /// carry a target and to it, the most of all targets; 1 m where all that is nought.
    pub fn reach(&self) -> f64 {
        let length = |joint: &Joint<f64>| {
            joint.a.hypot(joint.d)
                + joint.placement.as_ref().map_or(0.0, |placement| placement.xyz.norm())
        };
        let Arm { joints, tree, .. } = &self.nominal;
        let links = |tip: usize| -> f64 {
            let carrying =
                joints.iter().enumerate().filter(|(joint, _)| tree.path_contains(*joint, tip));
            carrying.map(|(_, own)| length(own)).sum()
        };
        let to_target = |(target, &tip): (&Vector3<f64>, &usize)| links(tip) + target.norm();
        let reach = self.targets.iter().zip(&self.target_joints).map(to_target).fold(0.0, f64::max);
        if reach > 0.0 { reach } else { 1.0 }
    }

    /// Whether bounds or constraints limit the parameters.
    pub fn is_bounded(&self) -> bool {
        !self.constraints.is_empty() || self.parameters.iter().any(Parameter::is_bounded)
    }

    /// The arm with parameter k at deviation `x(k)`, as declared where no parameter is free.
    pub fn arm<S: Scalar>(&self, x: impl Fn(usize) -> S) -> Arm<S> {
        let mut arm = self.nominal.lift();
        let mut tilt = [S::from(0.0); 2];
        for (k, parameter) in self.parameters.iter().enumerate() {
            if parameter.regressor.is_constant() {
                enter::enter(&mut arm, parameter.site, parameter.nominal, x(k), &mut tilt);
            }
        }
        if self
            .parameters
            .iter()
            .any(|parameter| matches!(parameter.site, ParameterSite::Arm(field) if field.turns_gravity()))
        {
            enter::turn_gravity(&mut arm, tilt);
        }
        arm
    }

    /// What adds to the joints' commands at the full parameter vector `x`.
    fn commands(&self, x: &[f64]) -> Commands {
        Commands::new(&self.driven, &self.parameters, x)
    }

    /// What the instrument makes of positions at the full parameter vector `x`.
    fn instrument_at(&self, x: &[f64]) -> Instrument {
        self.instrument.with(&self.parameters, x)
    }

    /// Base poses in the measuring frame: translation \[m\] and rotation vector \[rad\].
    pub fn base_poses(&self, x: &[f64]) -> Vec<BasePose> {
        let mut bases = self.bases.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Base { base, axis } = parameter.site {
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
        self.base_poses(x)
            .iter()
            .map(|base| Frame::from_rotation_vector(base.translation, &base.rotation))
            .collect()
    }

    /// Index of the joint whose frame carries a target.
    pub(crate) fn target_joint(&self, target: usize) -> usize {
        self.target_joints.get(target).copied().unwrap_or_else(|| self.nominal.last())
    }

    /// Targets in the frames that carry them \[m\].
    pub fn target_positions(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let mut targets = self.targets.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Target { target, axis: axis @ 0..3 } = parameter.site {
                targets[target][axis] += x;
            }
        }
        targets
    }

    /// Whether the problem says something of a number of a fixture.
    pub(crate) fn is_declared(&self, fixture: usize, axis: usize) -> bool {
        self.declared.get(fixture).and_then(|own| own.get(axis)).is_some_and(Option::is_some)
    }

    /// Points, anchors and surfaces in the measuring frame.
    pub(crate) fn fixtures(&self, x: &[f64]) -> Vec<FixtureValues<f64>> {
        let mut fixtures = self.fixtures.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Fixture { fixture, axis, .. } = parameter.site {
                fixtures[fixture].numbers[axis] += x;
            }
        }
        fixtures
    }

    /// Orientations of the targets in the frames that carry them, rotation vectors \[rad\].
    pub fn target_rotations(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let mut turned = self.turned.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Target { target, axis: axis @ 3.. } = parameter.site {
                turned[target][axis - 3] += x;
            }
        }
        turned
    }
}

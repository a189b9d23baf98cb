//! Model of a measurement: the arm, its bases and targets, and the site of each free parameter.
//! Immutable; reads no files.

mod ablation;
mod command_jacobian;
mod command_residuals;
mod command_term;
mod command_terms;
mod derivatives;
#[doc(hidden)]
pub mod effect;
mod elastic;
mod free_commands;
mod harmonic_sum;
mod instrument;
mod jacobian;
mod linear_model;
mod load_moments;
#[doc(hidden)]
pub mod parameter;
mod parts;
mod pose;
mod pose_residuals;
mod predictions;
mod predictor;
mod rigid;
mod rows;
mod sites;
mod tilt;

pub(crate) use crate::mechanics::CentreLine;
pub(crate) use command_residuals::CommandResiduals;
pub(crate) use linear_model::LinearModel;
pub(crate) use parts::{ModelParts, PartSite};
pub(crate) use pose::MeasuredOrientation;

use nalgebra::Vector3;

use crate::error::InputError;
use crate::mechanics::{Arm, Joint};
use crate::model::parameter::{
    JointField, LinearConstraint, Parameter, ParameterSite, Regressor, resolve, resolve_constraints,
};
use crate::observation::{FixtureValues, Observation};
use crate::problem::{BasePose, Effect, Fixture, JointKind, Problem};
use crate::scalar::Scalar;
use crate::spatial::Frame;
use command_term::CommandTerm;
use command_terms::CommandTerms;
use instrument::Instrument;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{ablation::Ablation, pose::Pose, pose_residuals::PoseResiduals};

/// Prediction of measured rows as a function of the free parameters.
#[derive(Debug, Clone)]
pub struct Model {
    nominal: Arm<f64>,
    /// Terms with fixed coefficients that add to joint coordinates, strains and small motions.
    fixed_terms: Vec<CommandTerm>,
    instrument: Instrument,
    bases: Vec<BasePose>,
    targets: Vec<Vector3<f64>>,
    /// True if the payload hangs at the target, which is the only one.
    payload_follows: bool,
    /// Index of the joint whose frame carries each target.
    target_joints: Vec<usize>,
    /// Orientation of each target in the frame of the joint that carries it (`target_joints`), as a
    /// rotation vector \[rad\].
    target_rotations: Vec<Vector3<f64>>,
    /// Declared values of the fixtures (points, anchors, surfaces, cameras, markers); undeclared
    /// numbers are 0.
    fixtures: Vec<FixtureValues<f64>>,
    /// Declarations of the fixtures, in the order of `fixtures`.
    declared: Vec<Fixture>,
    /// Free parameters, in the order of every full parameter vector.
    #[doc(hidden)]
    pub parameters: Vec<Parameter>,
    /// Linear inequalities between the free parameters.
    #[doc(hidden)]
    pub constraints: Vec<LinearConstraint>,
}

impl Model {
    /// Creates the model of the declared arm with its effects, one base per name in `bases` and one
    /// target per name in `targets`.
    ///
    /// # Errors
    /// Returns an error if a rule of `[parameters]` or a constraint matches no parameter, or a name
    /// in `targets` is not among the problem's declared targets.
    pub fn new(
        problem: &Problem,
        bases: &[String],
        targets: &[String],
    ) -> Result<Self, InputError> {
        let effects = &effect::parameters(problem);
        let declared =
            targets.iter().map(|word| problem.target(word)).collect::<Result<Vec<_>, _>>()?;
        let parameters = resolve(problem, bases, targets, effects)?;
        let mut nominal = Arm::nominal(problem);
        for effect in effects {
            sites::prepare_site(&mut nominal, effect.site, effect.nominal);
        }
        for effect in &problem.effects {
            sites::add_spring(&mut nominal, &effect.effect);
        }
        Ok(Self {
            constraints: resolve_constraints(problem, bases, targets, effects, &parameters)?,
            nominal,
            fixed_terms: CommandTerm::of_mimic_joints(problem),
            instrument: Instrument::default(),
            bases: vec![problem.base.clone(); bases.len()],
            payload_follows: problem.tool.payload_follows
                && problem.targets.is_empty()
                && targets.len() == 1,
            targets: declared.iter().map(|target| target.at).collect(),
            target_joints: declared.iter().map(|target| target.joint).collect(),
            target_rotations: declared.iter().map(|target| target.rotation).collect(),
            fixtures: problem
                .fixtures
                .iter()
                .map(|fixture| FixtureValues::new(fixture.kind, &fixture.known))
                .collect(),
            declared: problem.fixtures.clone(),
            parameters,
        })
    }

    /// Returns the model with one more free parameter at each site, which leaves predictions
    /// unchanged while it is zero.
    ///
    /// Each site comes with the value that the quantity has there without deviations. A value that
    /// the arm declares takes precedence.
    #[must_use]
    pub(crate) fn with_probes(&self, sites: &[(ParameterSite, f64)]) -> Self {
        let mut model = self.clone();
        for &(site, nominal) in sites {
            sites::prepare_site(&mut model.nominal, site, nominal);
            let added = match site {
                ParameterSite::Joint { field, .. } => {
                    field.is_geometry() || field.motion().is_some()
                }
                ParameterSite::Shift { .. }
                | ParameterSite::Turn { .. }
                | ParameterSite::FixtureShift { .. } => true,
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

    /// Returns the model with the gravity compensators (springs) that these effects declare, with
    /// zero spring force.
    #[must_use]
    pub(crate) fn with_springs_of(&self, effects: &[Effect]) -> Self {
        let mut model = self.clone();
        for effect in effects {
            sites::add_spring(&mut model.nominal, effect);
        }
        model
    }

    /// Returns the site of the coordinate that the command of a joint, counted from 0, moves.
    fn coordinate(&self, joint: usize) -> ParameterSite {
        let slides = self.nominal.joints[joint].kind == JointKind::Prismatic;
        let field = if slides { JointField::D } else { JointField::Theta };
        ParameterSite::Joint { joint, field }
    }

    /// Returns the number of joints, fixed ones included.
    pub(crate) fn joints(&self) -> usize {
        self.nominal.joints.len()
    }

    /// Returns the largest distance that the undeflected arm can reach \[m\]. It is Σ √(a² + d²),
    /// or ‖xyz‖, over the joints that carry a target, plus the target's offset; 1 m if that is
    /// zero.
    #[doc(hidden)]
    pub fn reach(&self) -> f64 {
        let length = |joint: &Joint<f64>| {
            joint.a.hypot(joint.d)
                + joint.placement.as_ref().map_or(0.0, |placement| placement.xyz.norm())
        };
        let Arm { joints, tree, .. } = &self.nominal;
        let links = |tip: usize| -> f64 {
            let carrying =
                joints.iter().enumerate().filter(|(joint, _)| tree.path_contains(*joint, tip));
            carrying.map(|(_, joint)| length(joint)).sum()
        };
        let to_target = |(target, &tip): (&Vector3<f64>, &usize)| links(tip) + target.norm();
        let reach = self.targets.iter().zip(&self.target_joints).map(to_target).fold(0.0, f64::max);
        if reach > 0.0 { reach } else { 1.0 }
    }

    /// Returns true if at least one parameter has a bound or a constraint.
    #[doc(hidden)]
    pub fn is_bounded(&self) -> bool {
        !self.constraints.is_empty() || self.parameters.iter().any(Parameter::is_bounded)
    }

    /// Returns the arm whose parameter k deviates by `x(k)` from nominal; all other quantities are
    /// as declared.
    #[doc(hidden)]
    pub fn arm<S: Scalar>(&self, x: impl Fn(usize) -> S) -> Arm<S> {
        self.arm_with(x, |_| true)
    }

    /// Returns the arm whose parameter k deviates by `x(k)` from nominal if `selected` is true for
    /// it, and otherwise keeps its nominal value.
    fn arm_with<S: Scalar>(
        &self,
        x: impl Fn(usize) -> S,
        selected: impl Fn(&Parameter) -> bool,
    ) -> Arm<S> {
        let mut arm = self.nominal.lift();
        let mut tilt = [S::from(0.0); 2];
        let parameters = self.parameters.iter().enumerate();
        for (k, parameter) in parameters.filter(|(_, parameter)| selected(parameter)) {
            if parameter.regressor.is_constant() {
                sites::set_site(&mut arm, parameter.site, parameter.nominal, x(k), &mut tilt);
            }
            if let Some(axis) = self.payload_axis(parameter.site) {
                arm.payload_at[axis] += x(k);
            }
        }
        if self
            .parameters
            .iter()
            .any(|parameter| matches!(parameter.site, ParameterSite::Arm(field) if field.turns_gravity()))
        {
            sites::rotate_gravity(&mut arm, tilt);
        }
        arm
    }

    /// Returns the axis of the target's frame (0 to 2) along which a parameter moves the payload
    /// with the target; `None` if the parameter does not shift the target, or if the payload does
    /// not follow it.
    fn payload_axis(&self, site: ParameterSite) -> Option<usize> {
        match site {
            ParameterSite::Target { axis: axis @ 0..3, .. } => Some(axis),
            _ => None,
        }
        .filter(|_| self.payload_follows)
    }

    /// Returns the terms that add to the joints' commands, strains and small motions at the full
    /// parameter vector `x`.
    fn commands(&self, x: &[f64]) -> CommandTerms {
        CommandTerms::new(&self.fixed_terms, &self.nominal, &self.parameters_at(x), x)
    }

    /// Returns the errors of the instrument and the rotations of the bases at the full parameter
    /// vector `x`.
    fn instrument_at(&self, x: &[f64]) -> Instrument {
        self.instrument.with_parameters(&self.parameters_at(x), x)
    }

    /// Returns the errors of the instrument at `x` in the readings of some `positions`, one for each
    /// pose, measuring frame \[m\]. Motions of the bases are no errors of readings; turns of the
    /// station are.
    pub(crate) fn reading_errors(
        &self,
        x: &[f64],
        poses: &[Pose],
        positions: &[Vector3<f64>],
    ) -> Vec<Vector3<f64>> {
        let instrument = self.instrument_at(x);
        let faultless = instrument.without_errors();
        let error = |(pose, position): (&Pose, &Vector3<f64>)| {
            let setup = &pose.setup;
            let turn = instrument.base_rotation(setup) - faultless.base_rotation(setup);
            let turned = Frame::from_rotation_vector(Vector3::zeros(), &turn).point(position);
            instrument.reading(&turned, setup) - faultless.reading(position, setup)
        };
        poses.iter().zip(positions).map(error).collect()
    }

    /// Returns the base poses at `x`, measuring frame: translation \[m\] and rotation vector
    /// \[rad\].
    pub(crate) fn base_poses(&self, x: &[f64]) -> Vec<BasePose> {
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

    /// Returns the base frames at `x`, measuring frame.
    #[doc(hidden)]
    pub fn base_frames(&self, x: &[f64]) -> Vec<Frame<f64>> {
        self.base_poses(x)
            .iter()
            .map(|base| Frame::from_rotation_vector(base.translation, &base.rotation))
            .collect()
    }

    /// Returns the index of the joint whose frame carries a target, from 0.
    pub(crate) fn target_joint(&self, target: usize) -> usize {
        self.target_joints.get(target).copied().unwrap_or_else(|| self.nominal.last())
    }

    /// Returns the positions of the targets at `x` in the frames that carry them \[m\].
    #[doc(hidden)]
    pub fn target_positions(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let mut targets = self.targets.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Target { target, axis: axis @ 0..3 } = parameter.site {
                targets[target][axis] += x;
            }
        }
        targets
    }

    /// Returns true if the problem declares the number with index `axis` of a fixture.
    pub(crate) fn declares_fixture_coordinate(&self, fixture: usize, axis: usize) -> bool {
        self.declared
            .get(fixture)
            .and_then(|fixture| fixture.known.get(axis))
            .is_some_and(Option::is_some)
    }

    /// Returns the name of a fixture.
    pub(crate) fn fixture_name(&self, fixture: usize) -> String {
        self.declared.get(fixture).map_or_else(String::new, |fixture| fixture.name.clone())
    }

    /// Returns the frame of the arm that carries each of a row's two fixtures: 0 is the base, i the
    /// frame of joint i. `None` if the fixture is at rest in the measuring frame.
    pub(crate) fn carriers(&self, observation: Observation) -> [Option<usize>; 2] {
        let carrier = |fixture: Option<usize>| self.declared.get(fixture?)?.carrier;
        observation.fixtures().map(carrier)
    }

    /// Returns the point of the second fixture (for example a board's corner) that a row measures,
    /// in the fixture's frame \[m\].
    pub(crate) fn fixture_point(&self, observation: Observation) -> Vector3<f64> {
        let point = || {
            let fixture = self.declared.get(observation.fixtures()[1]?)?;
            fixture.points.get(observation.point()?).copied()
        };
        point().unwrap_or_default()
    }

    /// Returns the points of a marker, marker frame \[m\]; empty for other fixtures.
    pub(crate) fn marker_points(&self, fixture: usize) -> &[Vector3<f64>] {
        self.declared.get(fixture).map_or(&[], |fixture| &fixture.points)
    }

    /// Returns the numbers of all points, anchors, surfaces, cameras and markers at `x`, without
    /// what laws add to them in single rows.
    pub(crate) fn fixtures(&self, x: &[f64]) -> Vec<FixtureValues<f64>> {
        let mut fixtures = self.fixtures.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Fixture { fixture, axis, .. } = parameter.site {
                fixtures[fixture].numbers[axis] += x;
            }
        }
        fixtures
    }

    /// Returns the orientations of the targets at `x` in the frames that carry them, as rotation
    /// vectors \[rad\].
    pub(crate) fn target_rotations(&self, x: &[f64]) -> Vec<Vector3<f64>> {
        let mut rotations = self.target_rotations.clone();
        for (parameter, x) in self.parameters.iter().zip(x) {
            if let ParameterSite::Target { target, axis: axis @ 3.. } = parameter.site {
                rotations[target][axis - 3] += x;
            }
        }
        rotations
    }
}

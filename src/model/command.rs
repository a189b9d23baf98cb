//! A model whose unknowns are the joint commands.

use nalgebra::DVector;

use super::Model;
use super::driven::Driven;
use crate::mechanics::Arm;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{Joint, JointKind, Problem};

impl Model {
    /// The arm with parameters `x`, whose free parameters are now the corrections to its moving
    /// joints' commands.
    ///
    /// A correction to q is one to θ of a revolute joint and to d of a prismatic one. Bases and
    /// targets stay as in `x`.
    #[must_use]
    pub fn with_free_commands(&self, problem: &Problem, x: &DVector<f64>) -> Self {
        let arm = self.arm(|k| x[k]);
        let parameters = commands(problem, &arm, Joint::command_kind);
        Self {
            nominal: arm,
            driven: Driven::all(&self.driven, &self.parameters, x.as_slice()),
            instrument: self.instrument_at(x.as_slice()),
            bases: self.base_poses(x.as_slice()),
            targets: self.target_positions(x.as_slice()),
            target_joints: self.target_joints.clone(),
            fixtures: self.fixtures(x.as_slice()),
            declared: self.declared.clone(),
            turned: self.target_rotations(x.as_slice()),
            parameters,
            constraints: Vec::new(),
        }
    }

    /// The same without what effects make of the measurement: it predicts where the target is, not
    /// what is read of it.
    #[must_use]
    pub fn without_instrument_errors(self) -> Self {
        Self { instrument: self.instrument.without_errors(), ..self }
    }

    /// A commanded model with corrections to the joints that follow others as further parameters.
    #[must_use]
    pub fn with_mimic_joints(mut self, problem: &Problem) -> Self {
        let of = |joint: &Joint| if joint.mimic.is_some() { joint.kind } else { JointKind::Fixed };
        self.parameters.extend(commands(problem, &self.nominal, of));
        self
    }

    /// The full parameter vector for values \[SI\] by name, or the first name that `value` does not
    /// know.
    ///
    /// # Errors
    /// A free parameter has no value.
    pub fn parameter_vector(
        &self,
        value: impl Fn(&str) -> Option<f64>,
    ) -> Result<DVector<f64>, String> {
        let entries = self.parameters.iter().map(|parameter| {
            let value = value(&parameter.name).ok_or_else(|| parameter.name.clone())?;
            Ok(parameter.deviation(value))
        });
        entries.collect::<Result<Vec<f64>, String>>().map(DVector::from_vec)
    }

    /// Whether something that is not free follows the joints' commands.
    pub fn follows_commands(&self) -> bool {
        self.driven.iter().any(|driven| driven.regressor.follows_commands())
    }

    /// Joints that the parameters of a commanded model move, in their order.
    pub fn moving_joints(&self) -> Vec<usize> {
        let joint = |parameter: &Parameter| match parameter.site {
            ParameterSite::Joint { joint, .. } => Some(joint),
            _ => None,
        };
        self.parameters.iter().filter_map(joint).collect()
    }
}

/// Corrections to the coordinates of joints, each of the kind that `of` says.
fn commands(problem: &Problem, arm: &Arm<f64>, of: fn(&Joint) -> JointKind) -> Vec<Parameter> {
    let joints = problem.joints.iter().zip(&arm.joints).enumerate();
    let corrected = joints.filter_map(|(joint, (declared, own))| {
        let (field, nominal) = match of(declared) {
            JointKind::Revolute => (JointField::Theta, own.theta),
            JointKind::Prismatic => (JointField::D, own.d),
            JointKind::Fixed => return None,
        };
        Some(Parameter {
            name: format!("q{}", joint + 1),
            site: ParameterSite::Joint { joint, field },
            regressor: Regressor::Constant,
            nominal,
            sigma: None,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        })
    });
    corrected.collect()
}

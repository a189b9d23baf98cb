//! Models whose free parameters are corrections to the joint commands.

use nalgebra::DVector;

use super::Model;
use super::command_term::CommandTerm;
use crate::mechanics::Arm;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{Joint, JointKind, Problem};

impl Model {
    /// Returns the arm at the parameters `x`, with corrections to the commands of its moving joints
    /// as free parameters.
    ///
    /// The correction adds to θ of a revolute joint and to d of a prismatic joint. Bases and
    /// targets keep their values at `x`.
    #[must_use]
    pub(crate) fn with_free_commands(&self, problem: &Problem, x: &DVector<f64>) -> Self {
        let arm = self.arm(|k| x[k]);
        let parameters = coordinate_corrections(problem, &arm, Joint::command_kind);
        Self {
            nominal: arm,
            fixed_terms: CommandTerm::fixed_and_free(
                &self.fixed_terms,
                &self.nominal,
                &self.parameters_at(x.as_slice()),
                x.as_slice(),
            ),
            instrument: self.instrument_at(x.as_slice()),
            bases: self.base_poses(x.as_slice()),
            targets: self.target_positions(x.as_slice()),
            payload_follows: self.payload_follows,
            target_joints: self.target_joints.clone(),
            fixtures: self.fixtures(x.as_slice()),
            declared: self.declared.clone(),
            target_rotations: self.target_rotations(x.as_slice()),
            parameters,
            constraints: Vec::new(),
        }
    }

    /// Returns the model without errors of the instrument: it predicts the position of the target,
    /// not the reading.
    #[must_use]
    pub(crate) fn without_instrument_errors(self) -> Self {
        Self { instrument: self.instrument.without_errors(), ..self }
    }

    /// Adds corrections to the coordinates of mimic joints, as free parameters, to a model with
    /// free commands.
    #[must_use]
    pub(crate) fn with_mimic_joints(mut self, problem: &Problem) -> Self {
        let kind =
            |joint: &Joint| if joint.mimic.is_some() { joint.kind } else { JointKind::Fixed };
        self.parameters.extend(coordinate_corrections(problem, &self.nominal, kind));
        self
    }

    /// Returns the full parameter vector (deviations from nominal) at which the parameters have the
    /// values that `value` returns for their names \[SI\].
    ///
    /// # Errors
    /// Returns the name of a free parameter that has no value.
    #[doc(hidden)]
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

    /// Returns true if a term with a fixed coefficient depends on the joints' commands.
    pub(crate) fn follows_commands(&self) -> bool {
        let [shifts, turns] = self.instrument.terms();
        let of_instrument = shifts.iter().chain(turns).map(|(_, regressor, _)| regressor);
        let mut regressors =
            self.fixed_terms.iter().map(|term| &term.regressor).chain(of_instrument);
        regressors.any(Regressor::follows_commands)
    }

    /// Returns the index of the joint that each parameter moves, in the order of the parameters,
    /// for a model with free commands.
    pub(crate) fn moving_joints(&self) -> Vec<usize> {
        let joint = |parameter: &Parameter| match parameter.site {
            ParameterSite::Joint { joint, .. } => Some(joint),
            _ => None,
        };
        self.parameters.iter().filter_map(joint).collect()
    }
}

/// Creates a parameter q1, q2, … for each joint, without prior: the correction to its θ or d.
/// Joints for which `kind` returns `Fixed` have none.
fn coordinate_corrections(
    problem: &Problem,
    arm: &Arm<f64>,
    kind: fn(&Joint) -> JointKind,
) -> Vec<Parameter> {
    let joints = problem.joints.iter().zip(&arm.joints).enumerate();
    let corrected = joints.filter_map(|(joint, (declared, nominal_joint))| {
        let (field, nominal) = match kind(declared) {
            JointKind::Revolute => (JointField::Theta, nominal_joint.theta),
            JointKind::Prismatic => (JointField::D, nominal_joint.d),
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

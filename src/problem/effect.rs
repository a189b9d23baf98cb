//! Effects that a problem declares, and the reasons why they cannot act on its arm.

use super::{Body, Data, Equilibrium, Joint, JointKind, Problem, Statics};
use crate::error::{InputErrorKind, Location};
pub(crate) use crate::laws::NAMES;
use crate::laws::{At, Effect, FAMILIES, JointField, LAW, Only, declaration};

/// Declared `[[effect]]` with its location in the file.
#[derive(Debug, Clone)]
pub struct EffectDeclaration {
    /// Effect with its arguments.
    pub effect: Effect,
    /// Location in the file, for errors.
    pub location: Location,
}

/// Example of the declaration of a law.
const LAW_EXAMPLE: &str =
    "law = { name = \"wobble\", at = \"joint1\", terms = [\"sin(2*q1)\"], sigma_deg = 0.05 }";

/// Returns an example declaration of the effect called `name` on this arm, such as `gear-ratio = {
/// joint = 1 }`.
pub(crate) fn example(name: &str, problem: &Problem) -> String {
    if name == LAW {
        return LAW_EXAMPLE.to_owned();
    }
    let family = FAMILIES.iter().find(|family| family.name == name);
    let arguments: Vec<_> = family.map_or(&[][..], |family| family.arguments).to_vec();
    let arguments: Vec<(&str, String)> =
        arguments.into_iter().map(|(key, kind)| (key, kind.example(problem))).collect();
    declaration(name, &arguments)
}

impl Effect {
    /// Returns the reason why the effect cannot act on this arm; `None` if it can. Either the
    /// declared model contains it already, or the arm or data lack what it acts on.
    pub(crate) fn refusal(
        &self,
        statics: Statics,
        joints: &[Joint],
        data: &Data,
    ) -> Option<InputErrorKind> {
        let only = self.family().map_or(&[][..], |family| family.only);
        only.iter().find_map(|only| self.unmet_condition_error(*only, statics, joints)).or_else(
            || {
                if let Some(name) = self.covariate()
                    && !data.covariates.iter().any(|known| known.name == name)
                {
                    let known = data.covariates.iter().map(|known| known.name.clone()).collect();
                    return Some(InputErrorKind::UnknownCovariate { name, known });
                }
                let write = "reference_temperature_C in [data]";
                (self.is_thermal() && data.reference_temperature.is_none())
                    .then_some(InputErrorKind::NeedsTemperature { write })
            },
        )
    }

    /// Returns the error if the arm does not meet the condition `only`, which the effect requires;
    /// `None` if it does.
    fn unmet_condition_error(
        &self,
        only: Only,
        statics: Statics,
        joints: &[Joint],
    ) -> Option<InputErrorKind> {
        match only {
            Only::Link => {
                let joint = self.joint()?;
                let link = joints.get(joint.wrapping_sub(1)).is_some_and(|joint| joint.a != 0.0);
                (!link).then_some(InputErrorKind::NoLink { joint })
            }
            Only::Bodies => {
                let joint = self.joint()?;
                let bodies = joints.get(joint.wrapping_sub(1)).map(|joint| &joint.bodies[..]);
                let is_bare = Body::total_mass(bodies.unwrap_or_default()) == 0.0;
                is_bare.then_some(InputErrorKind::NoBodies { joint })
            }
            Only::Undeflected => (statics.equilibrium == Equilibrium::Deflected)
                .then_some(InputErrorKind::InEquilibriumAlready),
            Only::Hoisted => {
                let hoisted =
                    |joint: &Joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some());
                (!joints.iter().any(hoisted)).then_some(InputErrorKind::NoHoist)
            }
            _ => None,
        }
    }

    /// Returns true if the effect makes a joint, counted from 1, rotate under a moment about its
    /// axis.
    pub(super) fn makes_compliant(&self, joint: usize) -> bool {
        self.joint() == Some(joint) && self.acts_at(At::Joint(JointField::Compliance))
    }
}

impl Problem {
    /// Returns true for each prismatic joint.
    pub(crate) fn slides(&self) -> Vec<bool> {
        self.joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect()
    }
}

//! Terms that add to the joints' commands, to the strains of beams, and to small motions.

use crate::model::parameter::{
    BeamField, JointField, Parameter, ParameterSite, Regressor, value_regressor,
};
use crate::problem::{Mimic, Problem};

use super::sites::lengths;
use crate::mechanics::Arm;

/// Quantity that a term adds to: a joint coordinate, a beam's strain or a small motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TermSite {
    /// Coordinate of a joint.
    Joint(usize),
    /// Strain that a joint's beam has without load: elongation or a curvature.
    Strain {
        /// Index of the joint that carries the beam, from 0.
        joint: usize,
        /// Index 0, 1 or 2 of the strain.
        which: usize,
    },
    /// Small motion of a joint's frame.
    Motion {
        /// Index of the joint.
        joint: usize,
        /// Index of the motion: 0 to 5 before the joint's rotation, 6 to 11 behind it (x, y, z, rx,
        /// ry, rz).
        which: usize,
    },
}

/// Term with a given coefficient: value × regressor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CommandTerm {
    pub site: TermSite,
    pub regressor: Regressor,
    /// Coefficient \[rad\], \[m\], \[1/m\] or 1 per unit of the regressor.
    pub value: f64,
}

impl CommandTerm {
    /// Returns the terms of mimic joints, which follow the commands of other joints.
    pub fn of_mimic_joints(problem: &Problem) -> Vec<Self> {
        let joints = problem.joints.iter().enumerate();
        let terms = joints.filter_map(|(joint, declared)| {
            let Mimic { joint: leader, ratio } = declared.mimic?;
            Some(Self {
                site: TermSite::Joint(joint),
                regressor: Regressor::command(problem, leader + 1),
                value: ratio,
            })
        });
        terms.collect()
    }

    /// Returns the fixed terms and, after them, the terms of the free parameters of `arm` at the
    /// full parameter vector `x`.
    pub fn fixed_and_free(
        fixed: &[Self],
        arm: &Arm<f64>,
        parameters: &[Parameter],
        x: &[f64],
    ) -> Vec<Self> {
        let mut terms = fixed.to_vec();
        for (k, &value) in x.iter().enumerate().take(parameters.len()) {
            let site = parameters[k].site;
            let regressor = || value_regressor(parameters, x, k).filter(|of| !of.is_constant());
            if site == ParameterSite::ArmStrain {
                let lengthened = |(joint, which, length)| {
                    let site = TermSite::Motion { joint, which };
                    Some(Self { site, regressor: regressor()?, value: value * length })
                };
                terms.extend(lengths(arm).filter_map(lengthened));
            } else if let Some(site) = TermSite::of(site) {
                terms.extend(regressor().map(|regressor| Self { site, regressor, value }));
            }
        }
        terms
    }
}

impl TermSite {
    /// Returns the coordinate, strain or motion to which a parameter at `site` adds its term; `None` for
    /// every other site.
    fn of(site: ParameterSite) -> Option<Self> {
        match site {
            ParameterSite::Joint { joint, field: JointField::Theta | JointField::D } => {
                Some(Self::Joint(joint))
            }
            ParameterSite::Joint { joint, field } => {
                Some(Self::Motion { joint, which: field.motion()? })
            }
            ParameterSite::Beam { joint, field } => {
                let which = BeamField::STRAINS.iter().position(|strain| *strain == field)?;
                Some(Self::Strain { joint, which })
            }
            _ => None,
        }
    }
}

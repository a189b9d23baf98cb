//! Terms that add to the joints' commands and to the strains of beams.

use crate::model::parameter::{BeamField, JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{Mimic, Problem};

/// Quantity that a term adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TermSite {
    /// Coordinate of a joint.
    Joint(usize),
    /// Strain of a joint's beam without load: elongation or a curvature.
    Strain {
        /// Index of the joint.
        joint: usize,
        /// Index 0, 1 or 2 of the strain.
        which: usize,
    },
}

/// Term with a known coefficient: value × regressor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandTerm {
    pub site: TermSite,
    pub regressor: Regressor,
    /// Coefficient \[rad\], \[m\], \[1/m\] or 1 per unit of the regressor.
    pub value: f64,
}

impl CommandTerm {
    /// Returns the terms of mimic joints, which follow the commands of other joints.
    pub fn declared(problem: &Problem) -> Vec<Self> {
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

    /// Returns the fixed terms and those of the free parameters at the full parameter vector `x`.
    pub fn all(fixed: &[Self], parameters: &[Parameter], x: &[f64]) -> Vec<Self> {
        let free = parameters.iter().zip(x);
        let free =
            free.filter_map(|(parameter, &x)| Self::of(parameter.site, parameter.regressor, x));
        fixed.iter().copied().chain(free).collect()
    }

    /// Returns the term of a parameter at `x`, if it has a regressor and adds to a joint's
    /// coordinate or a beam's strain.
    fn of(site: ParameterSite, regressor: Regressor, x: f64) -> Option<Self> {
        let site = match site {
            ParameterSite::Joint { joint, field: JointField::Theta | JointField::D } => {
                TermSite::Joint(joint)
            }
            ParameterSite::Beam { joint, field } => TermSite::Strain {
                joint,
                which: BeamField::STRAINS.iter().position(|strain| *strain == field)?,
            },
            _ => return None,
        };
        (!regressor.is_constant()).then_some(Self { site, regressor, value: x })
    }
}

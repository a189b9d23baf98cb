//! What adds to the joints' commands and to the strains of beams.

use crate::model::parameter::{BeamField, JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{Mimic, Problem};

/// What is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// The coordinate of a joint.
    Joint(usize),
    /// A strain of a joint's beam: elongation or one of its curvatures.
    Strain {
        /// The joint, counted from 0.
        joint: usize,
        /// 0, 1 or 2.
        which: usize,
    },
}

/// A known addition: value × regressor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub place: Place,
    pub regressor: Regressor,
    /// \[rad\], \[m\], \[1/m\] or 1 per unit of the regressor.
    pub value: f64,
}

impl Driven {
    /// Joints that follow the commands of others.
    pub fn declared(problem: &Problem) -> Vec<Self> {
        let joints = problem.joints.iter().enumerate();
        let driven = joints.filter_map(|(joint, own)| {
            let Mimic { joint: other, ratio } = own.mimic?;
            Some(Self {
                place: Place::Joint(joint),
                regressor: Regressor::command(problem, other + 1),
                value: ratio,
            })
        });
        driven.collect()
    }

    /// What is known to drive and the free parameters at the full parameter vector `x`.
    pub fn all(known: &[Self], parameters: &[Parameter], x: &[f64]) -> Vec<Self> {
        let free = parameters.iter().zip(x);
        let free =
            free.filter_map(|(parameter, &x)| Self::of(parameter.site, parameter.regressor, x));
        known.iter().copied().chain(free).collect()
    }

    /// What a parameter at `x` adds to, if it is driven and acts on a joint's coordinate or a
    /// beam's strain.
    fn of(site: ParameterSite, regressor: Regressor, x: f64) -> Option<Self> {
        let place = match site {
            ParameterSite::Joint { joint, field: JointField::Theta | JointField::D } => {
                Place::Joint(joint)
            }
            ParameterSite::Beam { joint, field } => Place::Strain {
                joint,
                which: BeamField::STRAINS.iter().position(|own| *own == field)?,
            },
            _ => return None,
        };
        (!regressor.is_constant()).then_some(Self { place, regressor, value: x })
    }
}

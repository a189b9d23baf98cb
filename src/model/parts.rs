//! Parts of a model at one parameter vector as plain data, from which other programs are generated.

use super::Model;
use super::command_term::{CommandTerm, TermSite};
use crate::mechanics::Arm;
use crate::model::parameter::Regressor;
use crate::spatial::{Frame, rotation_axes};

/// Quantity that a term adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartSite {
    /// Coordinate of a joint, counted from 0.
    Joint(usize),
    /// Strain of the beam of a joint: elongation, then curvatures about y and z.
    Strain {
        /// Index of the joint.
        joint: usize,
        /// Index 0, 1 or 2 of the strain.
        which: usize,
    },
    /// Small motion of a joint's frame: 0 to 5 before it turns, 6 to 11 behind it.
    Motion {
        /// Index of the joint.
        joint: usize,
        /// Index of the motion, 0 to 11.
        which: usize,
    },
    /// Displacement of the position along an axis of the measuring frame.
    Shift {
        /// Axis 0, 1 or 2, or 3 for the line of sight from the origin.
        axis: usize,
        /// True for an error of the instrument, false for a motion of the base.
        is_error: bool,
    },
    /// Rotation of all bases about an axis of the measuring frame.
    Turn {
        /// Axis 0, 1 or 2.
        axis: usize,
        /// True for an error of the instrument, false for a motion of the base.
        is_error: bool,
    },
}

/// Term of a prediction: value × regressor adds to the quantity of a site.
#[derive(Debug, Clone, PartialEq)]
pub struct PartTerm {
    /// Quantity that the term adds to.
    pub site: PartSite,
    /// Function of the pose.
    pub regressor: Regressor,
    /// Coefficient \[rad\], \[m\], \[1/m\] or 1 per unit of the regressor.
    pub value: f64,
}

/// Numbers from which the position and orientation of a target are predicted.
#[derive(Debug, Clone)]
pub struct ModelParts {
    /// Arm with the values of its parameters.
    pub arm: Arm<f64>,
    /// Terms value × regressor by which effects change quantities of joints, beams, bases and the
    /// instrument.
    pub terms: Vec<PartTerm>,
    /// Relative scale error of the instrument.
    pub scale: f64,
    /// Strain E of the measuring frame, entries xx, yy, zz, xy, xz, yz.
    pub strain: [f64; 6],
    /// Frames of the bases, expressed in the measuring frame.
    pub bases: Vec<Frame<f64>>,
    /// Index of the joint that carries each target, and the target's frame in it.
    pub targets: Vec<(usize, Frame<f64>)>,
}

impl Model {
    /// Returns the parts of the model at the full parameter vector `x`.
    pub fn parts(&self, x: &[f64]) -> ModelParts {
        let of_joint = |CommandTerm { site, regressor, value }: CommandTerm| {
            let site = match site {
                TermSite::Joint(joint) => PartSite::Joint(joint),
                TermSite::Strain { joint, which } => PartSite::Strain { joint, which },
                TermSite::Motion { joint, which } => PartSite::Motion { joint, which },
            };
            PartTerm { site, regressor, value }
        };
        let mut terms: Vec<PartTerm> = CommandTerm::fixed_and_free(
            &self.fixed_terms,
            &self.nominal,
            &self.parameters_at(x),
            x,
        )
        .into_iter()
        .map(of_joint)
        .collect();
        let instrument = self.instrument_at(x);
        let [shifts, rotations] = instrument.terms();
        terms.extend(shifts.iter().map(|(axis, regressor, value)| PartTerm {
            site: PartSite::Shift { axis: *axis, is_error: !regressor.moves_base() },
            regressor: regressor.clone(),
            value: *value,
        }));
        terms.extend(rotations.iter().map(|(axis, regressor, value)| PartTerm {
            site: PartSite::Turn { axis: *axis, is_error: !regressor.moves_base() },
            regressor: regressor.clone(),
            value: *value,
        }));
        let target = |(index, (position, rotation))| {
            (self.target_joint(index), Frame { axes: rotation_axes(&rotation), origin: position })
        };
        let targets = self.target_positions(x).into_iter().zip(self.target_rotations(x));
        ModelParts {
            arm: self.arm(|k| x[k]),
            terms,
            scale: instrument.scale,
            strain: instrument.strain_entries(),
            bases: self.base_frames(x),
            targets: targets.enumerate().map(target).collect(),
        }
    }
}

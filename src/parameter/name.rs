//! Where a parameter enters the model, and what it is called.

use super::Unit;

/// Where a parameter enters the model; joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Slot {
    /// A field of a joint.
    Joint {
        /// Index of the joint.
        joint: usize,
        /// Which field.
        field: JointField,
    },
    /// A rigidity of the beam before a joint.
    Beam {
        /// Index of the joint that carries the beam.
        joint: usize,
        /// Which rigidity.
        field: BeamField,
    },
    /// A coordinate of a base pose: translation x, y, z, then rotation vector x, y, z.
    Base {
        /// Index of the base.
        base: usize,
        /// 0..6.
        axis: usize,
    },
    /// A coordinate of a target in the last frame.
    Target {
        /// Index of the target.
        target: usize,
        /// 0..3.
        axis: usize,
    },
}

/// A field of a joint that may be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the letters of [Chen2021, eq. 1]")]
pub enum JointField {
    Alpha,
    A,
    Theta,
    D,
    Beta,
    Stiffness,
}

/// A rigidity of a beam that may be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BeamField {
    /// EA.
    Axial,
    /// EI about y and z, equal in nominal.
    Bending,
    /// `EI_y`.
    BendingY,
    /// `EI_z`.
    BendingZ,
    /// GJ.
    Twist,
}

impl JointField {
    /// The geometric fields, in the order of the transform.
    pub const GEOMETRY: [Self; 5] = [Self::Alpha, Self::A, Self::Theta, Self::D, Self::Beta];

    /// Name after the dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alpha => "alpha",
            Self::A => "a",
            Self::Theta => "theta",
            Self::D => "d",
            Self::Beta => "beta",
            Self::Stiffness => "stiffness",
        }
    }
}

impl BeamField {
    /// Name after the dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Axial => "EA",
            Self::Bending => "EI",
            Self::BendingY => "EIy",
            Self::BendingZ => "EIz",
            Self::Twist => "GJ",
        }
    }
}

impl Slot {
    /// Kind of quantity.
    pub fn unit(self) -> Unit {
        match self {
            Self::Joint { field, .. } => match field {
                JointField::Alpha | JointField::Theta | JointField::Beta => Unit::Angle,
                JointField::A | JointField::D => Unit::Length,
                JointField::Stiffness => Unit::TorsionalStiffness,
            },
            Self::Beam { field: BeamField::Axial, .. } => Unit::AxialRigidity,
            Self::Beam { .. } => Unit::FlexuralRigidity,
            Self::Base { axis, .. } => {
                if axis < 3 {
                    Unit::Length
                } else {
                    Unit::Angle
                }
            }
            Self::Target { .. } => Unit::Length,
        }
    }

    /// Whether the slot describes elasticity rather than geometry.
    pub fn is_elastic(self) -> bool {
        matches!(self, Self::Beam { .. } | Self::Joint { field: JointField::Stiffness, .. })
    }

    /// Whether the slot belongs to a session's set-up (base or target) rather than to the arm.
    pub fn is_placement(self) -> bool {
        matches!(self, Self::Base { .. } | Self::Target { .. })
    }
}

//! Sites of parameters in the model.

use crate::laws::{ArmField, BeamField, JointField};
use crate::problem::FixtureKind;
use crate::quantity::Unit;

/// Site of a parameter in the model. Joints are counted from 0; [`ParameterSite::of_joint`] takes
/// the numbers of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ParameterSite {
    /// Field of a joint.
    Joint {
        /// Index of the joint.
        joint: usize,
        /// Field of the joint.
        field: JointField,
    },
    /// Field of the beam before a joint.
    Beam {
        /// Index of the joint that carries the beam.
        joint: usize,
        /// Field of that beam.
        field: BeamField,
    },
    /// Quantity of the arm as a whole.
    Arm(ArmField),
    /// Coordinate of a base pose: translation x, y, z, then rotation vector x, y, z.
    Base {
        /// Index of the base.
        base: usize,
        /// Index of the coordinate: 0 to 5 for x, y, z, rx, ry, rz.
        axis: usize,
    },
    /// Coordinate of a target in the frame that carries it: position x, y, z, then rotation vector
    /// x, y, z.
    Target {
        /// Index of the target.
        target: usize,
        /// Index of the coordinate: 0 to 5 for x, y, z, rx, ry, rz.
        axis: usize,
    },
    /// Number of a fixture, such as a coordinate of a point or the focal length of a camera, in the
    /// order of `FixtureKind::fields`.
    Fixture {
        /// Index of the fixture.
        fixture: usize,
        /// Kind of the fixture.
        kind: FixtureKind,
        /// Index of the number among the fixture's numbers.
        axis: usize,
    },
    /// Change of a number of a fixture from row to row, in the order of `FixtureKind::fields`; its
    /// parameter always has a regressor.
    FixtureShift {
        /// Index of the fixture.
        fixture: usize,
        /// Kind of the fixture.
        kind: FixtureKind,
        /// Index of the number among the fixture's numbers.
        axis: usize,
        /// How many numbers from that one on change alike.
        count: usize,
    },
    /// Displacement of every measured position, measuring frame.
    Shift {
        /// Axis 0, 1 or 2, or 3 for the line of sight from the origin.
        axis: usize,
    },
    /// Rotation of every base about an axis through the measuring frame's origin; its parameter
    /// always has a regressor.
    Turn {
        /// Axis 0, 1 or 2.
        axis: usize,
    },
    /// Time from the reading of the joints to the exposure of a pixel of a camera, by which the
    /// joints move on with their recorded velocities.
    Exposure {
        /// Index of the camera among the fixtures.
        camera: usize,
        /// True for the time per row of the image, false for that of its first row.
        by_row: bool,
    },
    /// Strain of the arm: all lengths a, d and xyz of placements grow in proportion; its parameter
    /// always has a regressor.
    ArmStrain,
    /// Relative scale error s of the instrument: a position p reads as p (1 + s).
    Scale,
    /// Entry of the strain E of the measuring frame: p reads as p + E p. E is triangular, in the
    /// order xx, yy, zz, xy, xz, yz.
    Strain {
        /// Index 0 to 5 of the entry in that order.
        entry: usize,
    },
}

impl ParameterSite {
    /// Creates the site of a field of a joint that is numbered from 1, as in files.
    pub fn of_joint(number: usize, field: JointField) -> Self {
        Self::Joint { joint: number.wrapping_sub(1), field }
    }

    /// Returns the unit of a parameter at this site if no regressor multiplies it.
    pub fn unit(self) -> Unit {
        match self {
            Self::Joint { field, .. } => match field {
                JointField::Alpha
                | JointField::Theta
                | JointField::Beta
                | JointField::Play
                | JointField::Roll
                | JointField::Pitch
                | JointField::Yaw
                | JointField::Before(3..)
                | JointField::After(3..) => Unit::Angle,
                JointField::A
                | JointField::D
                | JointField::SlidingPlay
                | JointField::X
                | JointField::Y
                | JointField::Z
                | JointField::Before(_)
                | JointField::After(_) => Unit::Length,
                JointField::Stiffness => Unit::TorsionalStiffness,
                JointField::Compliance | JointField::LateralX | JointField::LateralY => {
                    Unit::Compliance
                }
                JointField::Cubic => Unit::CubicCompliance,
                JointField::SlideFlexibility => Unit::Flexibility,
                JointField::SpringRate => Unit::ForcePerLength,
                JointField::SpringPreload => Unit::Force,
                JointField::BodyMass => Unit::Mass,
            },
            Self::Beam { field, .. } => match field {
                BeamField::Axial => Unit::AxialRigidity,
                BeamField::Bending
                | BeamField::BendingY
                | BeamField::BendingZ
                | BeamField::Twist => Unit::FlexuralRigidity,
                BeamField::Anisotropy | BeamField::Stretch => Unit::Ratio,
                BeamField::Flexibility | BeamField::CouplingY | BeamField::CouplingZ => {
                    Unit::Flexibility
                }
                BeamField::BowY | BeamField::BowZ => Unit::PerLength,
                BeamField::AddedMass => Unit::Mass,
                BeamField::AddedAt => Unit::Length,
            },
            Self::Arm(field) => match field {
                ArmField::Payload => Unit::Mass,
                ArmField::PayloadAt(_) => Unit::Length,
                ArmField::HoistForce | ArmField::HoistLeanX | ArmField::HoistLeanY => Unit::Ratio,
                ArmField::Mixing => Unit::Number,
                ArmField::HoistTrolley => Unit::PerLength,
                ArmField::MountingX | ArmField::MountingY => Unit::Compliance,
                ArmField::GravityX | ArmField::GravityY => Unit::Angle,
            },
            Self::Base { axis, .. } | Self::Target { axis, .. } if axis >= 3 => Unit::Angle,
            Self::Turn { .. } => Unit::Angle,
            Self::Base { .. } | Self::Target { .. } | Self::Shift { .. } => Unit::Length,
            Self::Fixture { kind, axis, .. } | Self::FixtureShift { kind, axis, .. } => {
                kind.unit(axis)
            }
            Self::Exposure { .. } => Unit::Time,
            Self::ArmStrain | Self::Scale | Self::Strain { .. } => Unit::Ratio,
        }
    }

    /// Returns true for stiffnesses, compliances and loads (mass, force, gravity), false for
    /// geometry and errors of the instrument.
    pub fn is_elastic(self) -> bool {
        match self {
            Self::Joint { field, .. } => {
                let is_play = matches!(field, JointField::Play | JointField::SlidingPlay);
                !field.is_geometry() && !is_play && field.motion().is_none()
            }
            Self::Beam { field, .. } => !field.is_strain(),
            Self::Arm(_) => true,
            Self::Base { .. }
            | Self::Target { .. }
            | Self::Fixture { .. }
            | Self::FixtureShift { .. }
            | Self::Shift { .. }
            | Self::Turn { .. }
            | Self::Exposure { .. }
            | Self::ArmStrain
            | Self::Scale
            | Self::Strain { .. } => false,
        }
    }

    /// Returns true for errors of loads: masses, payload, hoists and gravity.
    pub(crate) fn is_load(self) -> bool {
        match self {
            Self::Joint { field, .. } => field == JointField::BodyMass,
            Self::Beam { field, .. } => matches!(field, BeamField::AddedMass | BeamField::AddedAt),
            Self::Arm(field) => {
                !matches!(field, ArmField::Mixing | ArmField::MountingX | ArmField::MountingY)
            }
            _ => false,
        }
    }

    /// Returns true for the orientation of a target, which positions do not depend on.
    pub fn turns_target(self) -> bool {
        matches!(self, Self::Target { axis: 3.., .. })
    }

    /// Returns true for the set-up (base, target, position of a fixture), false for the arm and
    /// lenses.
    pub fn is_placement(self) -> bool {
        match self {
            Self::Fixture { kind, axis, .. } => !kind.has_pose() || axis < 6,
            _ => matches!(self, Self::Base { .. } | Self::Target { .. }),
        }
    }
}

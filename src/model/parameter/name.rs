//! Sites of parameters in the model, and their names.

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
        /// Field of that joint.
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
        /// Coordinate 0 to 5.
        axis: usize,
    },
    /// Coordinate of a target in the frame that carries it: position x, y, z, then rotation vector
    /// x, y, z.
    Target {
        /// Index of the target.
        target: usize,
        /// Coordinate 0 to 5.
        axis: usize,
    },
    /// Number of a fixture, in the order of [`FixtureKind::fields`].
    Fixture {
        /// Index of the fixture.
        fixture: usize,
        /// Kind of the fixture.
        kind: FixtureKind,
        /// Index of the number.
        axis: usize,
    },
    /// Displacement of every measured position, measuring frame.
    Shift {
        /// Axis 0, 1 or 2.
        axis: usize,
    },
    /// Rotation of every base about an axis through the measuring frame's origin; always with a
    /// regressor.
    Turn {
        /// Axis 0, 1 or 2.
        axis: usize,
    },
    /// Relative error of every measured coordinate.
    Scale,
    /// Entry of the strain E of the measuring frame: p reads as p + E p. E is triangular, in the
    /// order xx, yy, zz, xy, xz, yz.
    Strain {
        /// Entry 0 to 5.
        entry: usize,
    },
}

/// Field of a joint that may be free: first the letters of [Chen2021, eq. 1], then the fields of
/// effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "letters need no words")]
#[non_exhaustive]
pub enum JointField {
    Alpha,
    A,
    Theta,
    D,
    Beta,
    Stiffness,
    /// Addition to the compliance 1/k [rad/(N·m)].
    Compliance,
    /// Angle per cube of the moment [rad/(N·m)³].
    Cubic,
    /// Play \[rad\]: half of it to each side, by the direction of approach, or by the moment if
    /// that is unknown.
    Play,
    /// Play of a prismatic joint \[m\], taken up by the direction of approach only.
    SlidingPlay,
    /// Flexibility about x before the joint's rotation [rad/(N·m)].
    LateralX,
    /// Flexibility about y before the joint's rotation [rad/(N·m)].
    LateralY,
    /// Flexibility 1/EI of the slide [1/(N·m²)].
    SlideFlexibility,
    /// Spring rate of a gravity compensator [N/m].
    SpringRate,
    /// Preload of a gravity compensator \[N\].
    SpringPreload,
    /// Coordinates of a fixed joint's placement \[m\].
    X,
    Y,
    Z,
    /// Angles of a fixed joint's placement \[rad\].
    Roll,
    Pitch,
    Yaw,
}

/// Field of a beam that may be free: rigidities, then the fields of effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BeamField {
    /// Axial rigidity EA \[N\].
    Axial,
    /// Bending rigidity EI about y and z, equal in nominal [N·m²].
    Bending,
    /// Bending rigidity `EI_y` [N·m²].
    BendingY,
    /// Bending rigidity `EI_z` [N·m²].
    BendingZ,
    /// Torsional rigidity GJ [N·m²].
    Twist,
    /// Logarithm of the ratio of EI about z to the EI common to y and z.
    Anisotropy,
    /// Addition to 1/EI about y and z [1/(N·m²)].
    Flexibility,
    /// Coupling of twist with bending about y [1/(N·m²)].
    CouplingY,
    /// Coupling of twist with bending about z [1/(N·m²)].
    CouplingZ,
    /// Curvature about y without load [1/m].
    BowY,
    /// Curvature about z without load [1/m].
    BowZ,
    /// Elongation per length without load.
    Stretch,
    /// Point mass on the beam's axis \[kg\].
    AddedMass,
    /// Position of that mass, from the root \[m\].
    AddedAt,
}

/// Quantity of the arm as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ArmField {
    /// Addition to the mass of every payload \[kg\].
    Payload,
    /// Relative error of the hoist's force.
    HoistForce,
    /// Lean of the hoist's direction along x.
    HoistLeanX,
    /// Lean of the hoist's direction along y.
    HoistLeanY,
    /// Derivative of that lean with respect to the hook's position [1/m].
    HoistTrolley,
    /// Flexibility of the base about x [rad/(N·m)].
    MountingX,
    /// Flexibility of the base about y [rad/(N·m)].
    MountingY,
    /// Rotation of gravity about x \[rad\].
    GravityX,
    /// Rotation of gravity about y \[rad\].
    GravityY,
    /// Mixing factor λ from loads on the undeflected arm (0) to loads on the deflected arm (1).
    Mixing,
}

impl ArmField {
    /// Returns true for a coordinate of the rotation vector of gravity.
    pub fn turns_gravity(self) -> bool {
        matches!(self, Self::GravityX | Self::GravityY)
    }
}

impl JointField {
    /// Geometric fields, in the order of the transform.
    pub const GEOMETRY: [Self; 5] = [Self::Alpha, Self::A, Self::Theta, Self::D, Self::Beta];

    /// Fields of a placement by xyz and rpy, in the order of files.
    pub const PLACEMENT: [Self; 6] =
        [Self::X, Self::Y, Self::Z, Self::Roll, Self::Pitch, Self::Yaw];

    /// Returns the index in a placement: x, y, z, roll, pitch, yaw.
    pub fn placement(self) -> Option<usize> {
        Self::PLACEMENT.iter().position(|&field| field == self)
    }

    /// Returns true for geometry that a problem declares.
    pub fn is_geometry(self) -> bool {
        Self::GEOMETRY.contains(&self) || self.placement().is_some()
    }

    /// Returns the part of the parameter's name after the dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alpha => "alpha",
            Self::A => "a",
            Self::Theta => "theta",
            Self::D => "d",
            Self::Beta => "beta",
            Self::Stiffness => "stiffness",
            Self::Compliance => "compliance",
            Self::Cubic => "cubic",
            Self::Play => "play",
            Self::SlidingPlay => "sliding_play",
            Self::LateralX => "lateral_x",
            Self::LateralY => "lateral_y",
            Self::SlideFlexibility => "slide_flexibility",
            Self::SpringRate => "spring_rate",
            Self::SpringPreload => "spring_preload",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }
}

impl BeamField {
    /// Strains without load, in the order of `PoseView::strains`.
    pub const STRAINS: [Self; 3] = [Self::Stretch, Self::BowY, Self::BowZ];

    /// Returns true for a strain without load.
    pub fn is_strain(self) -> bool {
        Self::STRAINS.contains(&self)
    }

    /// Returns true for a field that describes the beam's deflection under loads.
    pub fn is_rigidity(self) -> bool {
        let of_effects = matches!(self, Self::Flexibility | Self::CouplingY | Self::CouplingZ);
        of_effects || self.is_declared()
    }

    /// Returns true for a rigidity that a problem declares.
    pub fn is_declared(self) -> bool {
        matches!(self, Self::Axial | Self::Bending | Self::BendingY | Self::BendingZ | Self::Twist)
    }

    /// Returns the part of the parameter's name after the dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Axial => "EA",
            Self::Bending => "EI",
            Self::BendingY => "EIy",
            Self::BendingZ => "EIz",
            Self::Twist => "GJ",
            Self::Anisotropy => "anisotropy",
            Self::Flexibility => "flexibility",
            Self::CouplingY => "coupling_y",
            Self::CouplingZ => "coupling_z",
            Self::BowY => "bow_y",
            Self::BowZ => "bow_z",
            Self::Stretch => "stretch",
            Self::AddedMass => "added_mass",
            Self::AddedAt => "added_at",
        }
    }
}

impl ParameterSite {
    /// Creates the site of a field of a joint that is numbered from 1, as in files.
    pub fn of_joint(number: usize, field: JointField) -> Self {
        Self::Joint { joint: number.wrapping_sub(1), field }
    }

    /// Returns the unit of a parameter without regressor.
    pub fn unit(self) -> Unit {
        match self {
            Self::Joint { field, .. } => match field {
                JointField::Alpha
                | JointField::Theta
                | JointField::Beta
                | JointField::Play
                | JointField::Roll
                | JointField::Pitch
                | JointField::Yaw => Unit::Angle,
                JointField::A
                | JointField::D
                | JointField::SlidingPlay
                | JointField::X
                | JointField::Y
                | JointField::Z => Unit::Length,
                JointField::Stiffness => Unit::TorsionalStiffness,
                JointField::Compliance | JointField::LateralX | JointField::LateralY => {
                    Unit::Compliance
                }
                JointField::Cubic => Unit::CubicCompliance,
                JointField::SlideFlexibility => Unit::Flexibility,
                JointField::SpringRate => Unit::ForcePerLength,
                JointField::SpringPreload => Unit::Force,
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
                ArmField::HoistForce | ArmField::HoistLeanX | ArmField::HoistLeanY => Unit::Ratio,
                ArmField::Mixing => Unit::Number,
                ArmField::HoistTrolley => Unit::PerLength,
                ArmField::MountingX | ArmField::MountingY => Unit::Compliance,
                ArmField::GravityX | ArmField::GravityY => Unit::Angle,
            },
            Self::Base { axis, .. } | Self::Target { axis, .. } if axis >= 3 => Unit::Angle,
            Self::Turn { .. } => Unit::Angle,
            Self::Base { .. } | Self::Target { .. } | Self::Shift { .. } => Unit::Length,
            Self::Fixture { kind, axis, .. } => kind.unit(axis),
            Self::Scale | Self::Strain { .. } => Unit::Ratio,
        }
    }

    /// Returns true for elasticity and loads, false for geometry.
    pub fn is_elastic(self) -> bool {
        match self {
            Self::Joint { field, .. } => {
                !field.is_geometry() && !matches!(field, JointField::Play | JointField::SlidingPlay)
            }
            Self::Beam { field, .. } => !field.is_strain(),
            Self::Arm(_) => true,
            Self::Base { .. }
            | Self::Target { .. }
            | Self::Fixture { .. }
            | Self::Shift { .. }
            | Self::Turn { .. }
            | Self::Scale
            | Self::Strain { .. } => false,
        }
    }

    /// Returns true for the orientation of a target, which positions do not depend on.
    pub fn turns_target(self) -> bool {
        matches!(self, Self::Target { axis: 3.., .. })
    }

    /// Returns true for the set-up (base, target, fixture), false for the arm.
    pub fn is_placement(self) -> bool {
        matches!(self, Self::Base { .. } | Self::Target { .. } | Self::Fixture { .. })
    }
}

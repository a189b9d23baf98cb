//! Where a parameter enters the model, and what it is called.

use crate::problem::FixtureKind;
use crate::quantity::Unit;

/// Where a parameter enters the model; joints are counted from 0, [`ParameterSite::of_joint`] takes the
/// numbers of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ParameterSite {
    /// A field of a joint.
    Joint {
        /// Index of the joint.
        joint: usize,
        /// Which field.
        field: JointField,
    },
    /// A field of the beam before a joint.
    Beam {
        /// Index of the joint that carries the beam.
        joint: usize,
        /// Which field.
        field: BeamField,
    },
    /// What acts on the arm as a whole.
    Arm(ArmField),
    /// A coordinate of a base pose: translation x, y, z, then rotation vector x, y, z.
    Base {
        /// Index of the base.
        base: usize,
        /// 0..6.
        axis: usize,
    },
    /// A coordinate of a target in the frame that carries it: x, y, z, then the rotation vector of
    /// its orientation x, y, z.
    Target {
        /// Index of the target.
        target: usize,
        /// 0..6.
        axis: usize,
    },
    /// A number of a fixture, in the order of [`FixtureKind::fields`].
    Fixture {
        /// Index of the fixture.
        fixture: usize,
        /// What it is.
        kind: FixtureKind,
        /// Which number.
        axis: usize,
    },
    /// A displacement of every measured position, measuring frame.
    Shift {
        /// 0..3.
        axis: usize,
    },
    /// A turn of every base about an axis of the measuring frame, through that frame's origin; a
    /// regressor's alone.
    Turn {
        /// 0..3.
        axis: usize,
    },
    /// A relative error of every measured coordinate.
    Scale,
    /// An entry of the strain E of the measuring frame, in which p is measured as p + E p, E
    /// triangular: xx, yy, zz, xy, xz, yz.
    Strain {
        /// 0..6.
        entry: usize,
    },
}

/// A field of a joint that may be free: first the letters of [Chen2021, eq. 1], then what effects
/// add.
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
    /// Added to 1/k [rad/(N·m)].
    Compliance,
    /// Angle per cube of the moment [rad/(N·m)³].
    Cubic,
    /// Play: half of it each way, as the direction of approach says, or the moment where that is
    /// not known \[rad\].
    Play,
    /// Play of a joint that slides, which only a direction of approach takes up \[m\].
    SlidingPlay,
    /// Flexibility about x before the joint turns [rad/(N·m)].
    LateralX,
    /// Flexibility about y before the joint turns [rad/(N·m)].
    LateralY,
    /// Flexibility 1/EI of the slide [1/(N·m²)].
    SlideFlexibility,
    /// Rate of the spring of a gravity compensator [N/m].
    SpringRate,
    /// Preload of that spring \[N\].
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

/// A field of a beam that may be free: rigidities, then what effects add.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
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
    /// ln of EI about z over the value that it shares with EI about y.
    Anisotropy,
    /// Added to 1/EI about y and z [1/(N·m²)].
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
    /// A mass on the beam's axis \[kg\].
    AddedMass,
    /// Where that mass is, from the root \[m\].
    AddedAt,
}

/// What acts on the arm as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ArmField {
    /// Added to every payload that is carried \[kg\].
    Payload,
    /// Relative error of the hoist's force.
    HoistForce,
    /// Lean of the hoist's direction along x.
    HoistLeanX,
    /// Lean of the hoist's direction along y.
    HoistLeanY,
    /// Change of that lean with the hook's place [1/m].
    HoistTrolley,
    /// Flexibility of the base about x [rad/(N·m)].
    MountingX,
    /// Flexibility of the base about y [rad/(N·m)].
    MountingY,
    /// Gravity turned about x \[rad\].
    GravityX,
    /// Gravity turned about y \[rad\].
    GravityY,
    /// λ between loads on the rigid arm, 0, and on the bent arm, 1.
    Mixing,
}

impl ArmField {
    /// Whether it is a coordinate of the rotation vector that turns gravity.
    pub fn turns_gravity(self) -> bool {
        matches!(self, Self::GravityX | Self::GravityY)
    }
}

impl JointField {
    /// The geometric fields, in the order of the transform.
    pub const GEOMETRY: [Self; 5] = [Self::Alpha, Self::A, Self::Theta, Self::D, Self::Beta];

    /// The fields of a placement by xyz and rpy, in the order of files.
    pub const PLACEMENT: [Self; 6] =
        [Self::X, Self::Y, Self::Z, Self::Roll, Self::Pitch, Self::Yaw];

    /// Its place in a placement: x, y, z, roll, pitch, yaw.
    pub fn placement(self) -> Option<usize> {
        Self::PLACEMENT.iter().position(|&own| own == self)
    }

    /// Whether it is geometry that a problem declares.
    pub fn is_geometry(self) -> bool {
        Self::GEOMETRY.contains(&self) || self.placement().is_some()
    }

    /// Name after the dot.
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
    /// The strains without load, in the order in which poses have them.
    pub const STRAINS: [Self; 3] = [Self::Stretch, Self::BowY, Self::BowZ];

    /// Whether it is a strain without load.
    pub fn is_strain(self) -> bool {
        Self::STRAINS.contains(&self)
    }

    /// Whether it says how a beam gives way to loads.
    pub fn is_rigidity(self) -> bool {
        let of_effects = matches!(self, Self::Flexibility | Self::CouplingY | Self::CouplingZ);
        of_effects || self.is_declared()
    }

    /// Whether it is a rigidity that a problem declares.
    pub fn is_declared(self) -> bool {
        matches!(self, Self::Axial | Self::Bending | Self::BendingY | Self::BendingZ | Self::Twist)
    }

    /// Name after the dot.
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
    /// A field of a joint that is numbered from 1, as in files.
    pub fn of_joint(number: usize, field: JointField) -> Self {
        Self::Joint { joint: number.wrapping_sub(1), field }
    }

    /// Kind of quantity.
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

    /// Whether the site describes elasticity or loads rather than geometry.
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

    /// Whether it turns a target, which positions do not show.
    pub fn turns_target(self) -> bool {
        matches!(self, Self::Target { axis: 3.., .. })
    }

    /// Whether the site belongs to the set-up (base, target, fixture) rather than to the arm.
    pub fn is_placement(self) -> bool {
        matches!(self, Self::Base { .. } | Self::Target { .. } | Self::Fixture { .. })
    }
}

//! Fields of joints, beams and the arm to which laws add.

/// Field of a joint that may be free: first the parameters of [Chen2021, eq. 1], then the fields
/// that effects change.
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
    /// Compliance in addition to the declared 1/k [rad/(N·m)].
    Compliance,
    /// Angle per cube of the moment [rad/(N·m)³].
    Cubic,
    /// Play \[rad\]: half of it to each side, by the direction of approach, or by the moment if
    /// that is unknown.
    Play,
    /// Play of a prismatic joint \[m\], taken up by the direction of approach only.
    SlidingPlay,
    /// Compliance about x before the joint's rotation [rad/(N·m)].
    LateralX,
    /// Compliance about y before the joint's rotation [rad/(N·m)].
    LateralY,
    /// Flexibility 1/EI of the slide [1/(N·m²)].
    SlideFlexibility,
    /// Spring rate of a gravity compensator [N/m].
    SpringRate,
    /// Preload of a gravity compensator \[N\].
    SpringPreload,
    /// Mass that is added to the bodies of the joint, in proportion to their declared masses \[kg\].
    BodyMass,
    /// Coordinates of a fixed joint's placement \[m\].
    X,
    Y,
    Z,
    /// Angles of a fixed joint's placement \[rad\].
    Roll,
    Pitch,
    Yaw,
    /// Component of the small motion before the joint turns, by its index: x, y, z \[m\], rx, ry,
    /// rz \[rad\].
    Before(usize),
    /// Component of the small motion behind the joint, by its index: x, y, z \[m\], rx, ry, rz
    /// \[rad\].
    After(usize),
}

/// Names of the components of a small motion: translations, then rotations.
pub(crate) const MOTION_NAMES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

worded! {
    /// Field of a beam that may be free: rigidities, then the fields that effects change.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum BeamField: name {
        /// Axial rigidity EA \[N\].
        Axial = "EA";
        /// Bending rigidity EI about both y and z, which are nominally equal [N·m²].
        Bending = "EI";
        /// Bending rigidity `EI_y` [N·m²].
        BendingY = "EIy";
        /// Bending rigidity `EI_z` [N·m²].
        BendingZ = "EIz";
        /// Torsional rigidity GJ [N·m²].
        Twist = "GJ";
        /// Logarithm of the ratio of EI about z to the common EI of y and z.
        Anisotropy = "anisotropy";
        /// Flexibility in addition to the declared 1/EI about y and z [1/(N·m²)].
        Flexibility = "flexibility";
        /// Coupling of twist with bending about y [1/(N·m²)].
        CouplingY = "coupling_y";
        /// Coupling of twist with bending about z [1/(N·m²)].
        CouplingZ = "coupling_z";
        /// Curvature about y without load [1/m].
        BowY = "bow_y";
        /// Curvature about z without load [1/m].
        BowZ = "bow_z";
        /// Elongation per length without load.
        Stretch = "stretch";
        /// Point mass on the beam's axis \[kg\].
        AddedMass = "added_mass";
        /// Position of the added mass, from the beam's root \[m\].
        AddedAt = "added_at";
    }
}

/// Quantity of the arm as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ArmField {
    /// Mass that is added to every payload \[kg\].
    Payload,
    /// Displacement of the payload along an axis, 0 to 2, of the frame that carries it \[m\].
    PayloadAt(usize),
    /// Relative error of the hoist's force.
    HoistForce,
    /// Number added to the x component of the unit vector along the hoist's rope.
    HoistLeanX,
    /// Number added to the y component of the unit vector along the hoist's rope.
    HoistLeanY,
    /// Derivative of the lean of the hoist's direction with respect to the hook's position [1/m].
    HoistTrolley,
    /// Compliance of the base about x [rad/(N·m)].
    MountingX,
    /// Compliance of the base about y [rad/(N·m)].
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

    /// Returns the index of the field in a placement (x, y, z, roll, pitch, yaw); `None` for other
    /// fields.
    pub fn placement(self) -> Option<usize> {
        Self::PLACEMENT.iter().position(|&field| field == self)
    }

    /// Returns the index of the field among the twelve components of the two small motions of a
    /// joint, those before it first; `None` for other fields.
    pub fn motion(self) -> Option<usize> {
        match self {
            Self::Before(axis) => Some(axis),
            Self::After(axis) => Some(MOTION_NAMES.len() + axis),
            _ => None,
        }
    }

    /// Returns true for a geometric field that a problem declares.
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
            Self::BodyMass => "body_mass",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
            Self::Before(_) => "before",
            Self::After(_) => "after",
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
}

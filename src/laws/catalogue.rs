//! Catalogue of effects. It has one entry for each family, from which parameters, search and texts
//! of the effects follow.
//!
//! An entry reads `Variant "name-in-files" { field: Type = Kind as "key" } => Family { … }`.
//! Formulas are those of [`expression`](super::expression); `{joint}` is replaced by the argument
//! `joint`, and `T` for T − T₀. In the comments, θ is the joint's command, M the moment that the
//! loads beyond the joint, link or base exert on it, T the temperature and T₀ its reference. Every
//! effect vanishes if its parameters are zero.

use super::argument::{Argument, ArgumentKind, Field, FreeLength, Mount};
use super::family::{At, Chance, Family, Need, Only, Prior, Search, TermEntry};
use super::law::{FOCAL, LAW, Law};
use super::site::{ArmField, BeamField, JointField};
use super::sizes::{
    ARM_STRAIN_SIGMA, DRIFT_SIGMA, EXPOSURE_DELAY_SIGMA, FLEXIBILITY_SIGMA, LENS_DRIFT_SIGMA,
    LENS_SAG_SIGMA, MAX_TURN, PAYLOAD_SHIFT_SIGMA, READING_SHIFT_SIGMA, RELATIVE_SIGMA,
    ROW_TIME_SIGMA, SETUP_SHIFT_SIGMA,
};

/// Returns the key of an argument: the name of its field, or the text after `as`.
macro_rules! key {
    ($field:ident) => {
        stringify!($field)
    };
    ($field:ident $key:literal) => {
        $key
    };
}

/// Defines [`Effect`] and [`FAMILIES`] from the entries of the catalogue.
macro_rules! catalogue {
    ($(
        $(#[$doc:meta])*
        $variant:ident $name:literal $({ $($field:ident: $type:ty = $kind:ident $(as $key:literal)?),+ })?
        => $family:expr;
    )+) => {
        /// Effect of the catalogue with its arguments, or a law. Joints are numbered from 1 as in
        /// files, links are identified by the name of their beam.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        #[expect(missing_docs, reason = "arguments carry the names of the file format")]
        pub enum Effect {
            $($(#[$doc])* $variant $({ $($field: $type),+ })?,)+
            /// Declared law, or a law that the search for effects composed.
            Law(Law),
        }

        /// Families of the catalogue, in the order of the file format.
        pub static FAMILIES: &[Family] = &[$(Family {
            name: $name,
            arguments: &[$($((key!($field $($key)?), ArgumentKind::$kind)),+)?],
            ..$family
        }),+];

        /// Names of effects in files: the families, and declared laws.
        pub(crate) const NAMES: &[&str] = &[$($name,)+ LAW];

        /// Index of each family in [`FAMILIES`].
        #[derive(Clone, Copy)]
        enum Index {
            $($variant),+
        }

        impl Effect {
            /// Returns the family of the effect; `None` for a declared law.
            #[doc(hidden)]
            pub fn family(&self) -> Option<&'static Family> {
                let index = match self {
                    $(Self::$variant $({ $($field: _),+ })? => Index::$variant,)+
                    Self::Law(_) => return None,
                };
                FAMILIES.get(index as usize)
            }

            /// Returns the arguments with their keys, in the order of files.
            #[doc(hidden)]
            pub fn arguments(&self) -> Vec<(&str, Argument)> {
                match self {
                    $(Self::$variant $({ $($field),+ })? => {
                        vec![$($($field.argument(key!($field $($key)?))),+)?]
                    })+
                    Self::Law(law) => law.arguments(),
                }
            }

            /// Creates the effect of the family `name` from its arguments by key; `None` if there
            /// is no such family, or if an argument is missing or of another kind.
            pub(crate) fn from_name(name: &str, argument: &dyn Fn(&str) -> Option<Argument>) -> Option<Self> {
                match name {
                    $($name => Some(Self::$variant $({
                        $($field: <$type>::of(&argument(key!($field $($key)?))?)?),+
                    })?),)+
                    _ => None,
                }
            }
        }
    };
}

catalogue! {
    /// Compliance of a joint that is declared rigid: Δθ = c `M_z`.
    JointCompliance "joint-compliance" { joint: usize = AnyJoint } => Family {
        terms: &[TermEntry::at(At::Joint(JointField::Compliance), "compliance", 1e-3).never_negative()],
        says: "joint {joint} gives way about its axis",
        only: &[Only::RigidJoint],
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Harmonics of integer order of a joint's command: Δθ = Σₖ aₖ sin kθ + bₖ cos kθ.
    JointHarmonic "joint-harmonic" { joint: usize = MovingJoint, orders: Vec<u32> = Orders } => Family {
        terms: &[
            TermEntry::driven(At::Coordinate, "sin{orders}", "sin({orders}*q{joint})", DRIFT_SIGMA),
            TermEntry::driven(At::Coordinate, "cos{orders}", "cos({orders}*q{joint})", DRIFT_SIGMA),
        ],
        says: "angle of joint {joint} errs with {orders:cycles} a revolution",
        only: &[Only::Turning],
        needs: &[Need::Moves("joint")],
        search: Search::Orders,
        chance: Chance::Orders,
        ..Family::PLAIN
    };
    /// Wave of any order k, such as the error of an inner gear stage: Δθ = a sin kθ + b cos kθ.
    JointWave "joint-wave" { joint: usize = MovingJoint, order: f64 = Order } => Family {
        terms: &[
            TermEntry::driven(At::Coordinate, "sin", "sin({order}*q{joint})", DRIFT_SIGMA),
            TermEntry::driven(At::Coordinate, "cos", "cos({order}*q{joint})", DRIFT_SIGMA),
        ],
        says: "joint {joint} errs in waves of order {order}",
        search: Search::Declared,
        chance: Chance::Waves,
        ..Family::PLAIN
    };
    /// Error of the transmission ratio: Δθ = ε θ.
    GearRatio "gear-ratio" { joint: usize = MovingJoint } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "error", "q{joint}", RELATIVE_SIGMA)],
        says: "transmission ratio of joint {joint} is off",
        needs: &[Need::Moves("joint")],
        ..Family::PLAIN
    };
    /// Play b of a joint: Δθ = (b/2)·approach. Without recorded directions of approach, the moment
    /// at the joint decides on which side of the play the joint rests.
    Backlash "backlash" { joint: usize = MovingJoint } => Family {
        terms: &[TermEntry::at(At::JointOrSlide(JointField::Play, JointField::SlidingPlay), "width", 0.01)],
        says: "play in joint {joint}",
        needs: &[Need::Play],
        ..Family::PLAIN
    };
    /// Play proportional to the payload m: Δθ = (w m / 2)·approach.
    PayloadBacklash "payload-backlash" { joint: usize = MovingJoint } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "width", "0.5*payload*approach{joint}", 0.01)],
        says: "play in joint {joint} that grows with the payload",
        needs: &[Need::PayloadFromBothSides],
        ..Family::PLAIN
    };
    /// Friction hysteresis: Δθ = h z with dz/dθ = (g − z)/s, where g = ±1 is the side from which
    /// the joint comes \[Dahl 1968\].
    JointHysteresis "joint-hysteresis" { joint: usize = TurningJoint, distance: f64 = Distance as "distance_rad" } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "amplitude", "friction(q{joint}, {distance_rad})", DRIFT_SIGMA)],
        says: "friction holds joint {joint} back towards the side from which it came",
        needs: &[Need::Moves("joint"), Need::Clock],
        search: Search::Distances,
        ..Family::PLAIN
    };
    /// Cubic term of a joint's torsion: Δθ = c₃ `M_z`³.
    JointNonlinearStiffness "joint-nonlinear-stiffness" { joint: usize = AnyJoint } => Family {
        terms: &[TermEntry::at(At::Joint(JointField::Cubic), "cubic", 0.0).prior(Prior::OfCubedMoment(MAX_TURN))],
        says: "stiffness of joint {joint} changes with its load",
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Compliance of a joint's bearings: before the joint's rotation, they tilt by (`c_x` `M_x`,
    /// `c_y` `M_y`, 0).
    JointLateralCompliance "joint-lateral-compliance" { joint: usize = AnyJoint } => Family {
        terms: &[
            TermEntry::at(At::Joint(JointField::LateralX), "about_x", 1e-3).never_negative(),
            TermEntry::at(At::Joint(JointField::LateralY), "about_y", 1e-3).never_negative(),
        ],
        says: "joint {joint} tilts across its axis",
        only: &[Only::Commanded],
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Gravity compensator: a spring between an anchor before the joint and a lever on the link
    /// behind it, which exerts a moment about the axis.
    GravityCompensator "gravity-compensator" {
        joint: usize = RelievedJoint,
        anchor: [f64; 2] = Point as "anchor_m",
        lever: [f64; 2] = Point as "lever_m",
        free_length: FreeLength = FreeLength as "free_length_m"
    } => Family {
        terms: &[
            TermEntry::at(At::Joint(JointField::SpringRate), "rate", 0.0).prior(Prior::SpringRate).never_negative(),
            TermEntry::at(At::Joint(JointField::SpringPreload), "preload", 0.0).prior(Prior::SpringPreload),
        ],
        says: "a gravity compensator takes load off joint {joint}",
        search: Search::Declared,
        ..Family::PLAIN
    };
    /// Thermal drift of a joint's zero: Δθ = k (T − T₀).
    JointThermalDrift "joint-thermal-drift" { joint: usize = MovingJoint } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "rate", "T", DRIFT_SIGMA)],
        says: "zero of joint {joint} drifts with temperature",
        needs: &[Need::Temperature],
        ..Family::PLAIN
    };
    /// Thermal drift with a lagged temperature T̃: Δθ = k (T̃ − T₀), dT̃/dt = (T − T̃)/τ.
    JointThermalDriftLag "joint-thermal-drift-lag" { joint: usize = MovingJoint, time_constant: f64 = Duration as "time_constant_s" } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "rate", "lag(T, {time_constant_s})", DRIFT_SIGMA)],
        says: "zero of joint {joint} drifts with a temperature that lags by {time_constant_s} s",
        needs: &[Need::Clock, Need::Temperature],
        search: Search::TimeConstants,
        ..Family::PLAIN
    };
    /// Coupling of joints: Δθ of one joint = k q of another.
    JointCoupling "joint-coupling" { joint: usize = MovingJoint, from: usize = OtherJoint } => Family {
        terms: &[TermEntry::driven(At::Coordinate, "factor", "q{from}", RELATIVE_SIGMA)],
        says: "joint {joint} is coupled to joint {from}",
        needs: &[Need::Moves("from")],
        ..Family::PLAIN
    };
    /// Bending flexibility 1/EI of a link that is declared rigid.
    LinkBending "link-bending" { joint: usize = LinkedJoint } => Family {
        terms: &[TermEntry::at(At::Beam(BeamField::Flexibility), "flexibility", FLEXIBILITY_SIGMA).never_negative()],
        says: "the link before joint {joint} bends",
        only: &[Only::Link, Only::RigidLink],
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Bending flexibility 1/EI of the slide of a prismatic joint, a cantilever as long as it is
    /// extended.
    SlideBending "slide-bending" { joint: usize = SlidingJoint } => Family {
        terms: &[TermEntry::at(At::Joint(JointField::SlideFlexibility), "flexibility", FLEXIBILITY_SIGMA).never_negative()],
        says: "the slide of joint {joint} bends",
        needs: &[Need::Moves("joint"), Need::Loads],
        ..Family::PLAIN
    };
    /// Coupling of twist and bending of a beam: torsional moments bend it by (`k_y`, `k_z`), and
    /// bending moments twist it by the same coefficients.
    TwistBending "twist-bending" { link: String = Beam } => Family {
        terms: &[
            TermEntry::at(At::Beam(BeamField::CouplingY), "about_y", 0.0).prior(Prior::TwistCoupling { about_z: false }),
            TermEntry::at(At::Beam(BeamField::CouplingZ), "about_z", 0.0).prior(Prior::TwistCoupling { about_z: true }),
        ],
        says: "link {link} twists as it bends, and bends as it twists",
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Thermal bending of a beam: curvature (`k_y`, `k_z`)·(T − T₀).
    LinkThermalBending "link-thermal-bending" { link: String = Beam } => Family {
        terms: &[
            TermEntry::driven(At::Beam(BeamField::BowY), "about_y", "T", DRIFT_SIGMA),
            TermEntry::driven(At::Beam(BeamField::BowZ), "about_z", "T", DRIFT_SIGMA),
        ],
        says: "link {link} bows with temperature",
        needs: &[Need::Temperature],
        ..Family::PLAIN
    };
    /// Thermal expansion of a beam: strain α (T − T₀).
    LinkThermalExpansion "link-thermal-expansion" { link: String = Beam } => Family {
        terms: &[TermEntry::driven(At::Beam(BeamField::Stretch), "strain", "T", DRIFT_SIGMA)],
        says: "link {link} grows with temperature",
        needs: &[Need::Temperature],
        ..Family::PLAIN
    };
    /// Thermal expansion of the whole arm but its tool: lengths a, d and xyz grow by ε (T − T₀).
    ArmThermalExpansion "arm-thermal-expansion" => Family {
        terms: &[TermEntry::driven(At::ArmStrain, "strain", "T", ARM_STRAIN_SIGMA)],
        says: "the arm grows with temperature",
        needs: &[Need::Temperature],
        ..Family::PLAIN
    };
    /// Thermal bending of a beam with a lagged temperature T̃: curvature (`k_y`, `k_z`)·(T̃ − T₀).
    LinkThermalBendingLag "link-thermal-bending-lag" { link: String = Beam, time_constant: f64 = Duration as "time_constant_s" } => Family {
        terms: &[
            TermEntry::driven(At::Beam(BeamField::BowY), "about_y", "lag(T, {time_constant_s})", DRIFT_SIGMA),
            TermEntry::driven(At::Beam(BeamField::BowZ), "about_z", "lag(T, {time_constant_s})", DRIFT_SIGMA),
        ],
        says: "link {link} bows with a temperature that lags by {time_constant_s} s",
        needs: &[Need::Clock, Need::Temperature],
        search: Search::TimeConstants,
        ..Family::PLAIN
    };
    /// Thermal expansion of a beam with a lagged temperature T̃: strain α (T̃ − T₀).
    LinkThermalExpansionLag "link-thermal-expansion-lag" { link: String = Beam, time_constant: f64 = Duration as "time_constant_s" } => Family {
        terms: &[TermEntry::driven(At::Beam(BeamField::Stretch), "strain", "lag(T, {time_constant_s})", DRIFT_SIGMA)],
        says: "link {link} grows with a temperature that lags by {time_constant_s} s",
        needs: &[Need::Clock, Need::Temperature],
        search: Search::TimeConstants,
        ..Family::PLAIN
    };
    /// Undeclared point mass m on a beam, at the distance s from its root.
    UnmodelledMass "unmodelled-mass" { link: String = Beam } => Family {
        terms: &[
            TermEntry::at(At::Beam(BeamField::AddedMass), "mass", 5.0).never_negative(),
            TermEntry::at(At::Beam(BeamField::AddedAt), "at", 0.0).prior(Prior::HalfLength).nominal(Prior::HalfLength),
        ],
        says: "link {link} carries a mass that is not declared",
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Error m of the mass of a joint's bodies, which is spread over them in proportion to their
    /// declared masses.
    BodyMass "body-mass" { joint: usize = LoadedJoint } => Family {
        terms: &[TermEntry::at(At::Joint(JointField::BodyMass), "mass", 0.0).prior(Prior::BodyMass)],
        says: "bodies of joint {joint} have another mass than declared",
        only: &[Only::Bodies],
        needs: &[Need::Loads, Need::GivesWay],
        ..Family::PLAIN
    };
    /// Error m of the payload's mass, in all poses with a payload.
    PayloadMass "payload-mass" => Family {
        terms: &[TermEntry::at(At::Arm(ArmField::Payload), "mass", 2.0)],
        says: "payloads have another mass than declared",
        needs: &[Need::Payload, Need::OtherLoads],
        ..Family::PLAIN
    };
    /// Displacement of the payload's centre of mass from its declared position, in the frame that
    /// carries the payload.
    PayloadPosition "payload-position" => Family {
        terms: &[
            TermEntry::at(At::Arm(ArmField::PayloadAt(0)), "x", PAYLOAD_SHIFT_SIGMA),
            TermEntry::at(At::Arm(ArmField::PayloadAt(1)), "y", PAYLOAD_SHIFT_SIGMA),
            TermEntry::at(At::Arm(ArmField::PayloadAt(2)), "z", PAYLOAD_SHIFT_SIGMA),
        ],
        says: "the payload's centre of mass is not where it is declared",
        needs: &[Need::Payload, Need::GivesWay],
        ..Family::PLAIN
    };
    /// Relative error k of the hoist's force: F (1 + k).
    HoistForce "hoist-force" => Family {
        terms: &[TermEntry::at(At::Arm(ArmField::HoistForce), "error", 0.3)],
        says: "the hoist pulls with another force",
        only: &[Only::Hoisted],
        ..Family::PLAIN
    };
    /// Lean of the hoist's rope: direction ∝ declared one + (`t_x` + k x, `t_y` + k y, 0), with the
    /// hook at x, y.
    HoistDirection "hoist-direction" => Family {
        terms: &[
            TermEntry::at(At::Arm(ArmField::HoistLeanX), "lean_x", 0.1),
            TermEntry::at(At::Arm(ArmField::HoistLeanY), "lean_y", 0.1),
            TermEntry::at(At::Arm(ArmField::HoistTrolley), "trolley", 0.1),
        ],
        says: "the rope of the hoist leans",
        only: &[Only::Hoisted],
        ..Family::PLAIN
    };
    /// Compliance of the base: it rotates by (`C_x` `M_x`, `C_y` `M_y`, 0) under its moments.
    BaseCompliance "base-compliance" => Family {
        terms: &[
            TermEntry::at(At::Arm(ArmField::MountingX), "about_x", 1e-4).never_negative(),
            TermEntry::at(At::Arm(ArmField::MountingY), "about_y", 1e-4).never_negative(),
        ],
        says: "the base tilts under the load",
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Error of the gravity direction: gravity is rotated by (`r_x`, `r_y`, 0).
    GravityDirection "gravity-direction" => Family {
        terms: &[
            TermEntry::at(At::Arm(ArmField::GravityX), "about_x", 0.1),
            TermEntry::at(At::Arm(ArmField::GravityY), "about_y", 0.1),
        ],
        says: "the base does not stand level",
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Mixing factor λ between loads on the undeflected arm (0) and loads on the deflected arm (1).
    DeflectedEquilibrium "deflected-equilibrium" => Family {
        terms: &[TermEntry::at(At::Arm(ArmField::Mixing), "lambda", 1.0).never_negative()],
        says: "the loads act on the bent arm",
        only: &[Only::Undeflected],
        needs: &[Need::Loads],
        ..Family::PLAIN
    };
    /// Scale error of the instrument: measured positions are multiplied by 1 + s.
    TrackerScale "tracker-scale" => Family {
        terms: &[TermEntry::at(At::Scale, "error", RELATIVE_SIGMA)],
        says: "the scale of the measurement is off",
        ..Family::PLAIN
    };
    /// Scale and squareness errors of the instrument's axes: positions are measured as p + E p with
    /// E upper triangular, as usual for coordinate measuring machines. A rotation of the axes
    /// belongs to the base.
    FrameStrain "frame-strain" => Family {
        terms: &[
            TermEntry::at(At::Strain(0), "xx", RELATIVE_SIGMA),
            TermEntry::at(At::Strain(1), "yy", RELATIVE_SIGMA),
            TermEntry::at(At::Strain(2), "zz", RELATIVE_SIGMA),
            TermEntry::at(At::Strain(3), "xy", RELATIVE_SIGMA),
            TermEntry::at(At::Strain(4), "xz", RELATIVE_SIGMA),
            TermEntry::at(At::Strain(5), "yz", RELATIVE_SIGMA),
        ],
        says: "axes of the measuring frame are off in scale or not square",
        ..Family::PLAIN
    };
    /// Drift of the instrument: measured positions move by v (t − `t_first`).
    TrackerDrift "tracker-drift" => Family {
        terms: &[
            TermEntry::driven(At::Shift(0), "x", "t", 1e-5),
            TermEntry::driven(At::Shift(1), "y", "t", 1e-5),
            TermEntry::driven(At::Shift(2), "z", "t", 1e-5),
        ],
        says: "the measuring station or the arm's base drifts",
        needs: &[Need::Times],
        ..Family::PLAIN
    };
    /// Shift of the instrument: measured positions are displaced by d from a time on.
    StationShift "station-shift" { at_time: f64 = Time as "at_time_s" } => Family {
        terms: &[
            TermEntry::driven(At::Shift(0), "x", "step(time - {at_time_s})", READING_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(1), "y", "step(time - {at_time_s})", READING_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(2), "z", "step(time - {at_time_s})", READING_SHIFT_SIGMA),
        ],
        says: "the measuring station or the arm's base moved at {at_time_s} s",
        says_by_row: "the measuring station or the arm's base moved after row {at_time_s:row}",
        search: Search::Times,
        ..Family::PLAIN
    };
    /// Move of the instrument: from a time on, measured positions are rotated by (`r_x`, `r_y`,
    /// `r_z`) about the measuring frame's origin and displaced by d.
    StationMove "station-move" { at_time: f64 = Time as "at_time_s" } => Family {
        terms: &[
            TermEntry::driven(At::Shift(0), "x", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(1), "y", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(2), "z", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
            TermEntry::driven(At::Turn(0), "rx", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
            TermEntry::driven(At::Turn(1), "ry", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
            TermEntry::driven(At::Turn(2), "rz", "step(time - {at_time_s})", SETUP_SHIFT_SIGMA),
        ],
        says: "the measuring station or the arm's base moved and turned at {at_time_s} s",
        says_by_row: "the measuring station or the arm's base moved and turned after row {at_time_s:row}",
        search: Search::Declared,
        ..Family::PLAIN
    };
    /// Settling of the instrument: measured positions move by d (1 − exp(−(t − `t_first`)/τ)).
    TrackerSettling "tracker-settling" { time_constant: f64 = Duration as "time_constant_s" } => Family {
        terms: &[
            TermEntry::driven(At::Shift(0), "x", "-expm1(-t/{time_constant_s})", READING_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(1), "y", "-expm1(-t/{time_constant_s})", READING_SHIFT_SIGMA),
            TermEntry::driven(At::Shift(2), "z", "-expm1(-t/{time_constant_s})", READING_SHIFT_SIGMA),
        ],
        says: "the measuring station or the arm's base settles with a time constant of {time_constant_s} s",
        says_by_row: "the measuring station or the arm's base settles with a time constant of {time_constant_s} rows",
        search: Search::SettlingTimes,
        ..Family::PLAIN
    };
    /// Exposure of an image while the arm moves: a pixel in row v shows the arm at the joint
    /// coordinates q + q̇ (t₀ + v `t_row`), with the recorded velocities q̇. A rolling shutter exposes
    /// one row after another, a global shutter has `t_row` = 0.
    RollingShutter "rolling-shutter" { camera: String = Camera } => Family {
        terms: &[
            TermEntry::at(At::Exposure { by_row: false }, "delay", EXPOSURE_DELAY_SIGMA),
            TermEntry::at(At::Exposure { by_row: true }, "row", ROW_TIME_SIGMA),
        ],
        says: "images of camera {camera} are exposed at another time than the joints are read (a delay, and a time per row)",
        needs: &[Need::Velocities],
        ..Family::PLAIN
    };
    /// Drift of a lens with temperature: both focal lengths change by k (T − T₀).
    LensThermalDrift "lens-thermal-drift" { camera: String = Camera } => Family {
        terms: &[
            TermEntry::driven(At::Camera(FOCAL), "rate", "T", LENS_DRIFT_SIGMA),
        ],
        says: "the focal length of camera {camera} moves with temperature",
        needs: &[Need::Temperature],
        ..Family::PLAIN
    };
    /// Sag of a lens or sensor under its weight: the centre moves with the attitude of the camera,
    /// and so with a joint between it and the base.
    LensSag "lens-sag" { camera: String = Camera, joint: usize = TurningJoint } => Family {
        terms: &[
            TermEntry::driven(At::Camera("cx"), "cx_sin", "sin(q{joint})", LENS_SAG_SIGMA),
            TermEntry::driven(At::Camera("cx"), "cx_cos", "cos(q{joint})", LENS_SAG_SIGMA),
            TermEntry::driven(At::Camera("cy"), "cy_sin", "sin(q{joint})", LENS_SAG_SIGMA),
            TermEntry::driven(At::Camera("cy"), "cy_cos", "cos(q{joint})", LENS_SAG_SIGMA),
        ],
        says: "the image centre of camera {camera} moves with the angle of joint {joint}",
        only: &[Only::CarriesCamera],
        needs: &[Need::Moves("joint"), Need::Loads],
        ..Family::PLAIN
    };
    /// Displacement of a joint's coordinate, or small motion of the base, proportional to a
    /// covariate of the problem.
    Covariate "covariate" { joint: Mount = Mount, of: String = Covariate } => Family {
        terms: &[
            TermEntry::driven(At::Coordinate, "rate", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseTurn(0), "rx", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseTurn(1), "ry", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseTurn(2), "rz", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseShift(0), "x", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseShift(1), "y", "{of:formula}", f64::INFINITY),
            TermEntry::driven(At::BaseShift(2), "z", "{of:formula}", f64::INFINITY),
        ],
        says: "zero of joint {joint} moves with {of}",
        says_of_base: "the base moves with {of}",
        needs: &[Need::Covariate],
        ..Family::PLAIN
    };
}

//! The problem file: the arm as declared, what is free, and where the data are.
//!
//! Everything here is plain data in SI units (m, rad, N, kg, s; temperatures in °C), read once from `problem.toml`
//! and never changed afterwards.

mod arm;
mod constraints;
pub(crate) mod digest;
pub(crate) mod effects;
pub(crate) mod item;
mod parameters;
pub(crate) mod pattern;
pub(crate) mod read;
mod robust;
pub(crate) mod section;

use std::path::PathBuf;

use nalgebra::Vector3;

use crate::error::Location;

/// A problem as declared in `problem.toml`.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Short name; results go to `out/<name>` by default.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Gravity in the arm's base frame [m/s²].
    pub gravity: Vector3<f64>,
    /// How static loads act.
    pub statics: Statics,
    /// Joints from the base outwards; joint `i` of the files is element `i − 1`.
    pub joints: Vec<Joint>,
    /// The measured point and the payload.
    pub tool: Tool,
    /// Pose of the arm's base in the measuring frame.
    pub base: BasePose,
    /// Effects that the model declares.
    pub effects: Vec<EffectDeclaration>,
    /// What is free, in the order of the file: a later rule wins.
    pub parameters: Vec<ParameterRule>,
    /// Linear inequalities between parameters.
    pub constraints: Vec<Constraint>,
    /// Where the measurements are and how they are used.
    pub data: Data,
    /// How gross errors are kept from ruling the fit; `None`: they are not.
    pub robust: Option<Robust>,
}

/// `[[constraint]]`: at_least ≤ Σ coefficient · parameter ≤ at_most.
#[derive(Debug, Clone)]
pub struct Constraint {
    /// Parameters and their coefficients.
    pub terms: Vec<ConstraintTerm>,
    /// Lower limit.
    pub at_least: Option<Limit>,
    /// Upper limit.
    pub at_most: Option<Limit>,
    /// For errors.
    pub location: Location,
}

/// One term of a constraint.
#[derive(Debug, Clone)]
pub struct ConstraintTerm {
    /// Name of the parameter.
    pub name: String,
    /// Its coefficient, not zero.
    pub coefficient: f64,
    /// For errors.
    pub location: Location,
}

/// A limit of a constraint.
#[derive(Debug, Clone)]
pub struct Limit {
    /// Value [rad], [m] or of the logarithm.
    pub value: f64,
    /// What it limits.
    pub kind: LimitKind,
    /// For errors.
    pub location: Location,
}

/// What a constraint adds up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Angles [rad].
    Angle,
    /// Lengths [m].
    Length,
    /// Logarithms of stiffnesses and rigidities in SI units.
    Logarithm,
}

/// `[robust]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robust {
    /// What residuals count.
    pub loss: RobustLoss,
    /// `threshold_sigma`: the length of a residual from which it counts less than its square [σ]; `None`: the usual one.
    pub threshold: Option<f64>,
}

/// What the residual of a pose counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobustLoss {
    /// Its square up to the threshold, its length beyond.
    Huber,
    /// Its length, rounded off below the threshold.
    L1,
}

/// `[statics]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Statics {
    /// On which arm the loads act.
    pub equilibrium: Equilibrium,
    /// Closed-form elements per beam, at least 1.
    pub beam_elements: usize,
}

/// On which arm the loads act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Equilibrium {
    /// On the rigid arm: the first order of the paper.
    Undeflected,
    /// On the bent arm, in equilibrium.
    Deflected,
}

/// What a joint's configuration coordinate does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// q adds to θ [rad].
    Revolute,
    /// q adds to d [m].
    Prismatic,
    /// A constant transform that takes no q.
    Fixed,
}

/// `[[joint]]`: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1].
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name for people; parameters go by number.
    pub name: String,
    /// What q does.
    pub kind: JointKind,
    /// α [rad].
    pub alpha: f64,
    /// a [m].
    pub a: f64,
    /// θ [rad].
    pub theta: f64,
    /// d [m].
    pub d: f64,
    /// β [rad].
    pub beta: f64,
    /// Range of q [rad] or [m], infinite where none is given; commands keep to it.
    pub limits: (f64, f64),
    /// Torsional stiffness about `z_i` [N·m/rad]; `None`: rigid.
    pub stiffness: Option<f64>,
    /// Elastic link along this joint's a.
    pub beam: Option<Beam>,
    /// Rigid masses carried by frame `i`, after the whole `T_i`.
    pub bodies: Vec<Body>,
}

/// `[joint.beam]`: an elastic link, clamped after Rx(α), its x axis along the link.
#[derive(Debug, Clone)]
pub struct Beam {
    /// Name; its parameters are `<name>.EA` and so on.
    pub name: String,
    /// Mass spread evenly over the length [kg].
    pub mass: f64,
    /// Axial rigidity EA [N]; `None`: does not stretch.
    pub ea: Option<f64>,
    /// Flexural rigidity about y, `EI_y` [N·m²]: bends in the x-z plane; `None`: rigid there.
    pub ei_y: Option<f64>,
    /// Flexural rigidity about z, `EI_z` [N·m²]: bends in the x-y plane; `None`: rigid there.
    pub ei_z: Option<f64>,
    /// Torsional rigidity GJ [N·m²]; `None`: does not twist.
    pub gj: Option<f64>,
    /// Masses carried on the beam, positions in the beam's frame.
    pub masses: Vec<Body>,
    /// Suspension force on the beam.
    pub hoist: Option<Hoist>,
}

/// A point mass.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name for people.
    pub name: String,
    /// Mass [kg], not negative.
    pub mass: f64,
    /// Centre of mass in the carrier's frame [m].
    pub position: Vector3<f64>,
}

/// `[joint.beam.hoist]`: a suspension force on a beam.
#[derive(Debug, Clone)]
pub struct Hoist {
    /// Hook in the beam's frame [m].
    pub at: Vector3<f64>,
    /// Force [N]; a column `hoist_N` overrides it pose by pose.
    pub force: f64,
    /// Unit direction in the arm's base frame.
    pub direction: Vector3<f64>,
}

/// `[tool]`.
#[derive(Debug, Clone)]
pub struct Tool {
    /// The measured point in the last frame [m].
    pub target: Vector3<f64>,
    /// Where a payload hangs, in the last frame [m].
    pub payload_at: Vector3<f64>,
    /// Payload where no column `payload_kg` says otherwise [kg].
    pub payload_mass: f64,
}

/// `[base]`: pose of the arm's base in the measuring frame.
#[derive(Debug, Clone)]
pub struct BasePose {
    /// Origin [m].
    pub translation: Vector3<f64>,
    /// Rotation vector [rad].
    pub rotation: Vector3<f64>,
}

/// One `[[effect]]` and where it stands in the file.
#[derive(Debug, Clone)]
pub struct EffectDeclaration {
    /// The effect.
    pub effect: Effect,
    /// For errors.
    pub location: Location,
}

/// An effect and its arguments; joints are numbered from 1, links go by the name of their beam.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "arguments carry the names of the file format")]
pub enum Effect {
    JointCompliance { joint: usize },
    JointHarmonic { joint: usize, orders: Vec<u32> },
    GearRatio { joint: usize },
    Backlash { joint: usize },
    JointNonlinearStiffness { joint: usize },
    JointLateralCompliance { joint: usize },
    JointThermalDrift { joint: usize },
    JointCoupling { joint: usize, from: usize },
    LinkBending { joint: usize },
    LinkThermalBending { link: String },
    LinkThermalExpansion { link: String },
    UnmodelledMass { link: String },
    PayloadMass,
    HoistForce,
    HoistDirection,
    BaseCompliance,
    GravityDirection,
    DeflectedEquilibrium,
    TrackerScale,
    TrackerDrift,
    StationShift { at_time: f64 },
}

impl Effect {
    /// Whether it follows the temperature.
    pub fn is_thermal(&self) -> bool {
        matches!(
            self,
            Self::JointThermalDrift { .. } | Self::LinkThermalBending { .. } | Self::LinkThermalExpansion { .. }
        )
    }
}

/// One line of `[parameters]`.
#[derive(Debug, Clone)]
pub struct ParameterRule {
    /// Name with `*` for any run of characters.
    pub pattern: String,
    /// What the rule says.
    pub freedom: Freedom,
    /// For errors.
    pub location: Location,
}

/// What a rule makes of the parameters it matches.
#[derive(Debug, Clone)]
pub enum Freedom {
    /// Held at its nominal value.
    Fixed,
    /// Free, with or without prior and bounds.
    Free {
        /// 1 σ of a Gaussian prior about the nominal value.
        sigma: Quantities,
        /// Lower bound on the deviation from nominal (relative: multiple of nominal).
        min: Quantities,
        /// Upper bound on the deviation from nominal (relative: multiple of nominal).
        max: Quantities,
    },
}

/// The same thing said for each kind of parameter that a pattern may match.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quantities {
    /// Angles [rad].
    pub angle: Option<f64>,
    /// Lengths [m].
    pub length: Option<f64>,
    /// Relative to nominal; a σ is that of ln(value / nominal).
    pub relative: Option<f64>,
}

/// `[data]`.
#[derive(Debug, Clone)]
pub struct Data {
    /// Measurement files, already resolved against the problem's folder.
    pub files: Vec<PathBuf>,
    /// 1 σ of a measured coordinate [m]; `None`: not known.
    pub position_sigma: Option<f64>,
    /// Which rows never take part in fitting or choosing; `None` where the file says nothing.
    pub held_out: Option<HeldOut>,
    /// T₀ [°C].
    pub reference_temperature: Option<f64>,
    /// Where `files` stands, or `[data]`, for errors.
    pub files_location: Location,
    /// Where `held_out` stands, or `[data]`, for errors.
    pub held_out_location: Location,
    /// Where `[data]` stands, for errors.
    pub location: Location,
}

/// `held_out` of `[data]`.
#[derive(Debug, Clone, PartialEq)]
pub enum HeldOut {
    /// Rows whose column says `validation`.
    Column(String),
    /// A random part of the joint configurations; rows of one configuration stay together.
    Fraction {
        /// Part of the rows, in (0, 1).
        fraction: f64,
        /// Seed of the choice.
        seed: u64,
    },
    /// Every row of one session.
    Session(String),
}

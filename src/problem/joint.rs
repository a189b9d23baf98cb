//! Declared joints, elastic links and masses.

use nalgebra::Vector3;

use crate::error::Location;

/// Kind of a joint, which determines the effect of its coordinate q.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// q adds to θ \[rad\].
    Revolute,
    /// q adds to d \[m\].
    Prismatic,
    /// Constant transform without a coordinate.
    Fixed,
}

/// Table `[[joint]]`: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1], preceded by the
/// placement of a fixed joint.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Display name; parameters are named by the joint's number.
    pub name: String,
    /// Kind of the joint.
    pub kind: JointKind,
    /// Index of the parent joint, which is listed earlier; `None` for the base.
    pub parent: Option<usize>,
    /// Transform before all others of this joint; only fixed joints have one.
    pub placement: Option<Placement>,
    /// Joint whose command this joint follows, if it takes no command itself.
    pub mimic: Option<Mimic>,
    /// Twist angle α \[rad\].
    pub alpha: f64,
    /// Link length a \[m\].
    pub a: f64,
    /// Joint angle θ at q = 0 \[rad\].
    pub theta: f64,
    /// Link offset d at q = 0 \[m\].
    pub d: f64,
    /// Angle β about y \[rad\].
    pub beta: f64,
    /// Range of q \[rad\] or \[m\], infinite without limits; commands stay inside it.
    pub limits: (f64, f64),
    /// Torsional stiffness about `z_i` [N·m/rad]; `None` for a rigid joint.
    pub stiffness: Option<f64>,
    /// Elastic link along this joint's a.
    pub beam: Option<Beam>,
    /// Rigid masses attached to frame `i`, after the whole `T_i`.
    pub bodies: Vec<Body>,
    /// Place in the file, for errors.
    pub location: Location,
}

impl Joint {
    /// Returns the kind of coordinate that a command sets: `Fixed` for a joint that follows
    /// another.
    pub fn command_kind(&self) -> JointKind {
        if self.mimic.is_some() { JointKind::Fixed } else { self.kind }
    }

    /// Returns true if the joint takes a command.
    pub(crate) fn takes_command(&self) -> bool {
        self.command_kind() != JointKind::Fixed
    }

    /// Returns true if the command of the joint is an angle.
    pub(crate) fn takes_angle(&self) -> bool {
        self.command_kind() == JointKind::Revolute
    }

    /// Returns true if the command of the joint is a length.
    pub(crate) fn takes_length(&self) -> bool {
        self.command_kind() == JointKind::Prismatic
    }
}

/// Transform `xyz_m` and `rpy_deg` of a fixed joint, in URDF convention: Txyz Rz(yaw) Ry(pitch)
/// Rx(roll).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Origin in the parent's frame \[m\].
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\].
    pub rpy: Vector3<f64>,
}

/// Coupling `mimic` of a joint: its q is `ratio` times the command of another joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// Index of the leading joint, counted from 0.
    pub joint: usize,
    /// Ratio of the coordinates [rad or m per rad or m].
    pub ratio: f64,
}

/// Elastic link `[joint.beam]`, clamped after Rx(α), with its x axis along the link.
#[derive(Debug, Clone)]
pub struct Beam {
    /// Name of the beam; its parameters are `<name>.EA` and so on.
    pub name: String,
    /// Mass, uniformly distributed over the length \[kg\].
    pub mass: f64,
    /// Axial rigidity EA \[N\]; `None` for an inextensible beam.
    pub ea: Option<f64>,
    /// Flexural rigidity about y, `EI_y` [N·m²], for bending in the x-z plane; `None` for rigid.
    pub ei_y: Option<f64>,
    /// Flexural rigidity about z, `EI_z` [N·m²], for bending in the x-y plane; `None` for rigid.
    pub ei_z: Option<f64>,
    /// Torsional rigidity GJ [N·m²]; `None` for a beam that does not twist.
    pub gj: Option<f64>,
    /// Point masses on the beam; positions in the beam's frame.
    pub masses: Vec<Body>,
    /// Suspension force on the beam.
    pub hoist: Option<Hoist>,
}

/// Returns the names of the beams, in order of the joints.
pub(crate) fn beam_names(joints: &[Joint]) -> Vec<String> {
    joints.iter().filter_map(|joint| Some(joint.beam.as_ref()?.name.clone())).collect()
}

/// Point mass carried by a frame or beam.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of the mass for display.
    pub name: String,
    /// Mass \[kg\], not negative.
    pub mass: f64,
    /// Centre of mass in the carrying frame \[m\].
    pub position: Vector3<f64>,
}

impl Body {
    /// Returns the sum of the masses \[kg\].
    pub(crate) fn total_mass(bodies: &[Self]) -> f64 {
        bodies.iter().map(|body| body.mass).sum()
    }
}

/// Suspension force `[joint.beam.hoist]` on a beam.
#[derive(Debug, Clone)]
pub struct Hoist {
    /// Hook position in the beam's frame \[m\].
    pub at: Vector3<f64>,
    /// Force \[N\]; the column `hoist_N` overrides it in each pose.
    pub force: f64,
    /// Unit direction in the arm's base frame.
    pub direction: Vector3<f64>,
}

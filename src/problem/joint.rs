//! Joints, elastic links and masses, as declared.

use nalgebra::Vector3;

use crate::error::Location;

/// What a joint's configuration coordinate does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// q adds to θ \[rad\].
    Revolute,
    /// q adds to d \[m\].
    Prismatic,
    /// A constant transform that takes no q.
    Fixed,
}

/// `[[joint]]`: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1], behind the placement
/// where there is one.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name for people; parameters go by number.
    pub name: String,
    /// What q does.
    pub kind: JointKind,
    /// Index of the joint on whose frame it stands, an earlier one; `None`: the base.
    pub parent: Option<usize>,
    /// A transform before all others of this joint; of fixed joints alone.
    pub placement: Option<Placement>,
    /// Whose command the joint follows, if it has none of its own.
    pub mimic: Option<Mimic>,
    /// α \[rad\].
    pub alpha: f64,
    /// a \[m\].
    pub a: f64,
    /// θ \[rad\].
    pub theta: f64,
    /// d \[m\].
    pub d: f64,
    /// β \[rad\].
    pub beta: f64,
    /// Range of q \[rad\] or \[m\], infinite where none is given; commands keep to it.
    pub limits: (f64, f64),
    /// Torsional stiffness about `z_i` [N·m/rad]; `None`: rigid.
    pub stiffness: Option<f64>,
    /// Elastic link along this joint's a.
    pub beam: Option<Beam>,
    /// Rigid masses carried by frame `i`, after the whole `T_i`.
    pub bodies: Vec<Body>,
    /// For errors.
    pub location: Location,
}

impl Joint {
    /// What a command of the joint's own does: nothing where it follows another one.
    pub fn commanded(&self) -> JointKind {
        if self.mimic.is_some() { JointKind::Fixed } else { self.kind }
    }
}

/// `xyz_m` and `rpy_deg` of a fixed joint: Txyz Rz(yaw) Ry(pitch) Rx(roll), as URDF has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Origin \[m\].
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\].
    pub rpy: Vector3<f64>,
}

/// `mimic` of a joint: its q is `ratio` times the command of another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// Index of the other joint, counted from 0.
    pub joint: usize,
    /// q per q of the other one [rad or m per rad or m].
    pub ratio: f64,
}

/// `[joint.beam]`: an elastic link, clamped after Rx(α), its x axis along the link.
#[derive(Debug, Clone)]
pub struct Beam {
    /// Name; its parameters are `<name>.EA` and so on.
    pub name: String,
    /// Mass spread evenly over the length \[kg\].
    pub mass: f64,
    /// Axial rigidity EA \[N\]; `None`: does not stretch.
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
    /// Mass \[kg\], not negative.
    pub mass: f64,
    /// Centre of mass in the carrier's frame \[m\].
    pub position: Vector3<f64>,
}

/// `[joint.beam.hoist]`: a suspension force on a beam.
#[derive(Debug, Clone)]
pub struct Hoist {
    /// Hook in the beam's frame \[m\].
    pub at: Vector3<f64>,
    /// Force \[N\]; a column `hoist_N` overrides it pose by pose.
    pub force: f64,
    /// Unit direction in the arm's base frame.
    pub direction: Vector3<f64>,
}

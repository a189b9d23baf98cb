//! Parameters of the arm in the paper: geometry E and flexibilities S.

use super::kinematics::Mdh;
use super::link::LinkFlexibility;
use crate::problem::Problem;

/// Geometric parameters E and flexibilities S, with an entry for each joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Modified Denavit–Hartenberg parameters of each joint, the geometry E.
    pub geometry: Vec<Mdh>,
    /// Flexibility l/(`GI_p`) of each joint [rad/(N·m)]; 0 is rigid.
    pub joints: Vec<f64>,
    /// Flexibilities of the link before each joint; all 0 if the link is rigid.
    pub links: Vec<LinkFlexibility>,
}

/// Identifier of one flexibility, with the index of its joint, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Flexibility {
    /// Torsional flexibility of a joint, 1/k [rad/(N·m)].
    Joint(usize),
    /// Axial flexibility 1/EA of the link before a joint [1/N].
    Axial(usize),
    /// Bending flexibility 1/EI, equal in both planes, of the link before a joint [1/(N·m²)].
    Bending(usize),
    /// Bending flexibility `1/EI_y` about y of the link before a joint [1/(N·m²)].
    BendingY(usize),
    /// Bending flexibility `1/EI_z` about z of the link before a joint [1/(N·m²)].
    BendingZ(usize),
    /// Torsional flexibility 1/GJ of the link before a joint [1/(N·m²)].
    Twist(usize),
}

impl Parameters {
    /// Returns the geometry and the flexibilities that the problem declares.
    pub fn nominal(problem: &Problem) -> Self {
        let reciprocal = |rigidity: Option<f64>| rigidity.map_or(0.0, f64::recip);
        Self {
            geometry: problem.joints.iter().map(Mdh::nominal).collect(),
            joints: problem.joints.iter().map(|joint| reciprocal(joint.stiffness)).collect(),
            links: problem
                .joints
                .iter()
                .map(|joint| {
                    joint.beam.as_ref().map_or_else(LinkFlexibility::default, |beam| {
                        LinkFlexibility {
                            axial: reciprocal(beam.ea),
                            about_y: reciprocal(beam.ei_y),
                            about_z: reciprocal(beam.ei_z),
                            twist: reciprocal(beam.gj),
                        }
                    })
                })
                .collect(),
        }
    }

    /// Returns the geometry that the problem declares, with all flexibilities 0.
    pub fn rigid(problem: &Problem) -> Self {
        let n = problem.joints.len();
        let geometry = problem.joints.iter().map(Mdh::nominal).collect();
        Self { geometry, joints: vec![0.0; n], links: vec![LinkFlexibility::default(); n] }
    }

    /// Returns parameters without geometry in which the flexibility `which` is 1 and all others are
    /// 0.
    pub(super) fn unit(joints: usize, which: Flexibility) -> Self {
        let mut out = Self {
            geometry: Vec::new(),
            joints: vec![0.0; joints],
            links: vec![LinkFlexibility::default(); joints],
        };
        out.set(which, 1.0);
        out
    }

    /// Returns the identifiers of the flexibilities that are not 0. A link with equal EI in both
    /// planes has one bending flexibility, as in the paper.
    pub fn flexibilities(&self) -> Vec<Flexibility> {
        let joints = self.joints.iter().enumerate().map(|(k, _)| Flexibility::Joint(k));
        let links = self.links.iter().enumerate().flat_map(|(k, link)| {
            let bending = if link.about_y.total_cmp(&link.about_z).is_eq() {
                vec![Flexibility::Bending(k)]
            } else {
                vec![Flexibility::BendingY(k), Flexibility::BendingZ(k)]
            };
            [vec![Flexibility::Axial(k)], bending, vec![Flexibility::Twist(k)]].concat()
        });
        joints.chain(links).filter(|&which| self.get(which) != 0.0).collect()
    }

    /// Returns the value of the flexibility `which`, in the unit that [`Flexibility`] states.
    pub fn get(&self, which: Flexibility) -> f64 {
        match which {
            Flexibility::Joint(k) => self.joints[k],
            Flexibility::Axial(k) => self.links[k].axial,
            Flexibility::Bending(k) | Flexibility::BendingZ(k) => self.links[k].about_z,
            Flexibility::BendingY(k) => self.links[k].about_y,
            Flexibility::Twist(k) => self.links[k].twist,
        }
    }

    /// Sets the flexibility `which` to `value`, in the unit that [`Flexibility`] states.
    pub fn set(&mut self, which: Flexibility, value: f64) {
        match which {
            Flexibility::Joint(k) => self.joints[k] = value,
            Flexibility::Axial(k) => self.links[k].axial = value,
            Flexibility::Bending(k) => {
                (self.links[k].about_y, self.links[k].about_z) = (value, value);
            }
            Flexibility::BendingY(k) => self.links[k].about_y = value,
            Flexibility::BendingZ(k) => self.links[k].about_z = value,
            Flexibility::Twist(k) => self.links[k].twist = value,
        }
    }
}

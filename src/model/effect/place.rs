//! Places of an arm that effects are about; joints are counted from 1, as in files.

use crate::model::parameter::{Driver, JointField, Slot};
use crate::problem::{Body, Joint, JointKind, Problem};

/// Whether a joint, counted from 1, slides.
pub(super) fn slides(problem: &Problem, joint: usize) -> bool {
    joint.checked_sub(1).and_then(|index| problem.joints.get(index)).is_some_and(|own| own.kind == JointKind::Prismatic)
}

impl Slot {
    /// What an error of a joint adds to: d where it slides, else θ. The joint is numbered from 1, as in files.
    pub fn coordinate(problem: &Problem, joint: usize) -> Self {
        Self::of_joint(joint, if slides(problem, joint) { JointField::D } else { JointField::Theta })
    }
}

impl Driver {
    /// What a joint is told: q \[rad\] or \[m\]. The joint is numbered from 1, as in files.
    pub fn command(problem: &Problem, joint: usize) -> Self {
        let index = joint.wrapping_sub(1);
        if slides(problem, joint) { Self::Travel(index) } else { Self::Command(index) }
    }
}

/// Numbers, from 1, of the joints that take a command.
pub(super) fn commanded(problem: &Problem) -> impl Iterator<Item = usize> + '_ {
    let takes = |&(_, joint): &(usize, &crate::problem::Joint)| joint.commanded() != JointKind::Fixed;
    problem.joints.iter().enumerate().filter(takes).map(|(index, _)| index + 1)
}

/// The weight of everything that is declared beyond a joint, counted from 1, at the length of the arm beyond it [N·m].
pub(super) fn greatest_moment(problem: &Problem, joint: usize) -> f64 {
    let all = |bodies: &[Body]| bodies.iter().map(|body| body.mass).sum::<f64>();
    let beam = |joint: &Joint| joint.beam.as_ref().map_or(0.0, |beam| beam.mass + all(&beam.masses));
    let tree = problem.tree();
    let own = &problem.joints[joint - 1];
    let beyond = || problem.joints.iter().enumerate().skip(joint).filter(|(k, _)| tree.leads_through(joint - 1, *k));
    let mass = all(&own.bodies) + beyond().map(|(_, joint)| all(&joint.bodies) + beam(joint)).sum::<f64>();
    let reach: f64 = beyond().map(|(_, joint)| joint.a.hypot(joint.d)).sum();
    problem.gravity.norm() * (mass + problem.tool.payload_mass) * (reach + problem.tool.target.norm())
}

/// Index of the joint whose beam has that name.
pub(super) fn carrier(problem: &Problem, link: &str) -> Option<usize> {
    problem.joints.iter().position(|joint| joint.beam.as_ref().is_some_and(|beam| beam.name == link))
}

/// Names of all beams.
pub(super) fn links(problem: &Problem) -> impl Iterator<Item = String> + '_ {
    problem.joints.iter().filter_map(|joint| joint.beam.as_ref()).map(|beam| beam.name.clone())
}

/// Whether some rope hoists the arm.
pub(super) fn is_hoisted(problem: &Problem) -> bool {
    problem.joints.iter().any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()))
}

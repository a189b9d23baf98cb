//! Places of an arm at which effects act; joints are counted from 1, as in files.

use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::{Body, Joint, JointKind, Problem};

/// Returns true if a joint, counted from 1, is prismatic.
pub(super) fn slides(problem: &Problem, joint: usize) -> bool {
    joint
        .checked_sub(1)
        .and_then(|index| problem.joints.get(index))
        .is_some_and(|joint| joint.kind == JointKind::Prismatic)
}

impl ParameterSite {
    /// Returns the site of the coordinate that a joint's command moves, joint numbered from 1 as in
    /// files: d of a prismatic joint, else θ.
    pub fn coordinate(problem: &Problem, joint: usize) -> Self {
        Self::of_joint(
            joint,
            if slides(problem, joint) { JointField::D } else { JointField::Theta },
        )
    }
}

/// Smallest moment from which a prior size is derived [N·m]; smaller moments are raised to it.
/// Otherwise a joint without load would get an infinite compliance and a spring without force.
pub(super) const MIN_MOMENT: f64 = 10.0;

/// Returns an upper estimate of the moment on a joint, counted from 1 [N·m]: weight of everything
/// declared beyond it, payload included, times the length of its longest branch.
pub(super) fn greatest_moment(problem: &Problem, joint: usize) -> f64 {
    let beam = |joint: &Joint| {
        joint.beam.as_ref().map_or(0.0, |beam| beam.mass + Body::total_mass(&beam.masses))
    };
    let tree = problem.tree();
    let first = &problem.joints[joint - 1];
    let beyond = || {
        problem
            .joints
            .iter()
            .enumerate()
            .skip(joint)
            .filter(|(k, _)| tree.path_contains(joint - 1, *k))
    };
    let mass = Body::total_mass(&first.bodies)
        + beyond().map(|(_, joint)| Body::total_mass(&joint.bodies) + beam(joint)).sum::<f64>();
    let payload = if tree.path_contains(joint - 1, problem.tool.joint) {
        problem.tool.payload_mass
    } else {
        0.0
    };
    let carried = |joint: usize| {
        let targets = problem.targets.iter().map(|target| (target.joint, target.at));
        let points_at_joint = targets
            .chain([(problem.tool.joint, problem.tool.target)])
            .filter(|(carrier, _)| *carrier == joint);
        points_at_joint.map(|(_, at)| at.norm()).fold(0.0, f64::max)
    };
    let reach = |tip: usize| {
        let path = beyond().filter(|(k, _)| tree.path_contains(*k, tip));
        path.map(|(_, joint)| joint.a.hypot(joint.d)).sum::<f64>() + carried(tip)
    };
    let tips = beyond().map(|(k, _)| k).chain([joint - 1]);
    problem.gravity.norm() * (mass + payload) * tips.map(reach).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two arms on a trunk: joints 2 and 3 carry a target at 0.2 m, joints 4 and 5 the tool.
    const ARM: &str = "name = 'arm'\njoint = [{ d_m = 0.5 }, { a_m = 0.3 }, { a_m = 0.4, body = [{ mass_kg = 2 }] }, { parent = 1, a_m = 0.6 }, { a_m = 0.1 }]\n\
                       gravity_m_s2 = [0, 0, -10]\n[tool]\npayload_kg = 3\ntarget_m = [0, 0, 0.1]\n\
                       [[target]]\nname = 'a'\njoint = 3\nat_m = [0, 0.2, 0]\n[[target]]\nname = 'b'\n";

    #[test]
    fn a_moment_is_of_what_a_joint_carries_at_the_longest_branch() {
        let problem = Problem::parse(ARM, "problem.toml".as_ref()).unwrap();
        let chain = Problem::parse(
            &ARM.replace("parent = 1, ", "").replace("'a'\njoint = 3", "'a'"),
            "problem.toml".as_ref(),
        );
        let tree: [f64; 5] = [
            10.0 * 5.0 * 0.9,
            10.0 * 2.0 * 0.6,
            10.0 * 2.0 * 0.2,
            10.0 * 3.0 * 0.2,
            10.0 * 3.0 * 0.1,
        ];
        let serial: [f64; 5] = [
            10.0 * 5.0 * 1.6,
            10.0 * 5.0 * 1.3,
            10.0 * 5.0 * 0.9,
            10.0 * 3.0 * 0.3,
            10.0 * 3.0 * 0.2,
        ];
        for (problem, expected) in [(problem, tree), (chain.unwrap(), serial)] {
            for (joint, moment) in (1..).zip(expected) {
                let found = greatest_moment(&problem, joint);
                assert!((found - moment).abs() < 1e-12, "joint {joint}: {found} N·m, not {moment}");
            }
        }
    }
}

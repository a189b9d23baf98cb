//! Masses that the moving joints of a chain carry.

use nalgebra::Vector3;

use super::chain::{Chain, moved};
use super::read::Kind;
use crate::spatial::Frame;

/// Mass of a link of the chain or of a branch of it, with the moving joint that moves it.
pub(super) struct CarriedMass {
    /// Index of the last moving joint of the chain before the link, among the stages.
    pub stage: usize,
    /// Name of the link.
    pub name: String,
    /// Mass of the link \[kg\].
    pub mass: f64,
    /// Centre of mass with all joints at zero, frame of the chain's base \[m\].
    pub at: Vector3<f64>,
}

/// Returns all links with a mass that the chain's moving joints move, in the order of the joints.
/// Also returns the names of the other moving joints that they move, which are taken at zero. The
/// joints at the indices `elsewhere` carry links of other chains, which are left out.
pub(super) fn carried_masses(
    chain: &Chain,
    elsewhere: &[usize],
) -> (Vec<CarriedMass>, Vec<String>) {
    let robot = chain.robot;
    let (mut masses, mut beside) = (Vec::new(), Vec::new());
    // Each entry is a link with its frame and the stage that moves it, from the base outwards.
    let mut open = vec![(chain.base, Frame::identity(), None)];
    while let Some((link, frame, carrier)) = open.pop() {
        if let (Some(stage), Some(body)) = (carrier, robot.links.get(link))
            && body.mass > 0.0
        {
            masses.push(CarriedMass {
                stage,
                name: body.name.clone(),
                mass: body.mass,
                at: frame.point(&body.com),
            });
        }
        for (index, joint) in
            robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link)
        {
            if elsewhere.contains(&index) {
                continue;
            }
            let mut next = frame.compose(&joint.origin.frame());
            let stage = chain.stages.iter().position(|stage| stage.joint == index);
            if let Some(moving) = stage.and_then(|stage| chain.stages.get(stage)) {
                // A mimic joint may have an offset when its leader is at zero.
                next = moved(&next.compose(&moving.axis), joint, moving.offset)
                    .compose(&moving.axis.inverse());
            } else if joint.kind != Kind::Fixed && carrier.is_some() {
                beside.push(joint.name.clone());
            }
            open.push((joint.child, next, stage.or(carrier)));
        }
    }
    masses.sort_by_key(|link| link.stage);
    (masses, beside)
}

//! Masses of the links that an arm carries, in the frames of its problem.

use nalgebra::Vector3;

use super::chain::{Chain, moved};
use super::read::Kind;
use crate::spatial::Frame;

/// A mass that a stage of the chain carries.
pub(super) struct Weight {
    /// Stage behind which the link is.
    pub stage: usize,
    pub name: String,
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass with all joints at zero, frame of the chain's base \[m\].
    pub at: Vector3<f64>,
}

/// Every link with a mass behind a joint of the chain, and the joints beside the chain that move
/// some of them.
pub(super) fn weights(chain: &Chain) -> (Vec<Weight>, Vec<String>) {
    let robot = chain.robot;
    let (mut weights, mut beside) = (Vec::new(), Vec::new());
    // Links with their frames and the stages that carry them, from the base outwards.
    let mut open = vec![(chain.base, Frame::identity(), None)];
    while let Some((link, frame, carrier)) = open.pop() {
        if let (Some(stage), Some(own)) = (carrier, robot.links.get(link))
            && own.mass > 0.0
        {
            weights.push(Weight {
                stage,
                name: own.name.clone(),
                mass: own.mass,
                at: frame.point(&own.com),
            });
        }
        for (index, joint) in
            robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link)
        {
            let mut next = frame.compose(&joint.origin.frame());
            let stage = chain.stages.iter().position(|stage| stage.joint == index);
            if let Some(own) = stage.and_then(|stage| chain.stages.get(stage)) {
                // A joint that follows another may be off zero with it.
                next =
                    moved(&next.compose(&own.axis), joint, own.addend).compose(&own.axis.inverse());
            } else if joint.kind != Kind::Fixed && carrier.is_some() {
                beside.push(joint.name.clone());
            }
            open.push((joint.child, next, stage.or(carrier)));
        }
    }
    weights.sort_by_key(|weight| weight.stage);
    (weights, beside)
}

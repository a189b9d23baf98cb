//! From the declared arm and its effects to a chain of pieces, springs and loads.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::Rig;
use super::chain::{Chain, Force, Hinge, Place, Spring};
use super::effect::TrueEffect;
use crate::problem::{Effect, Joint, JointKind, Placement, PoseConditions};
use crate::spatial::rotate;

/// An effect and its values.
pub(super) type Part<'a> = (&'a Effect, &'a [f64]);

impl Rig {
    /// The chain of one pose, in the base frame, and where the frame of each joint is on it.
    pub(super) fn chain(&self, conditions: &PoseConditions) -> (Chain, Vec<Place>) {
        let gravity = self.gravity();
        let weight = |mass: f64| Force::Constant(gravity * mass);
        let mut chain = Chain::new(self.base_hinge());
        let (base, mut frames) = (chain.place(), Vec::with_capacity(self.arm.joints.len()));
        for (index, joint) in self.arm.joints.iter().enumerate() {
            let number = index + 1;
            chain.go_on_from(joint.parent.and_then(|parent| frames.get(parent)).unwrap_or(&base));
            if let Some(Placement { xyz, rpy }) = &joint.placement {
                chain.end().translate(xyz);
                chain.end().rotate_z(rpy.z.sin_cos());
                chain.end().rotate_y(rpy.y.sin_cos());
                chain.end().rotate_x(rpy.x.sin_cos());
            }
            chain.end().rotate_x(joint.alpha.sin_cos());
            self.link(joint, number, &gravity, conditions, &mut chain);
            let (before, about) = self.joint_hinges(joint, number, conditions);
            chain.hinge(before);
            let (mut turn, mut slide) = (joint.theta, joint.d);
            let command =
                |joint: usize| conditions.configuration.get(joint).copied().unwrap_or(0.0);
            let q = joint
                .mimic
                .map_or_else(|| command(index), |mimic| mimic.ratio * command(mimic.joint));
            let miss = self.miss(number, conditions);
            match joint.kind {
                JointKind::Revolute => turn += q + miss,
                JointKind::Prismatic => slide += q + miss,
                JointKind::Fixed => turn += miss,
            }
            chain.hinge(about);
            if !about.is_rigid() {
                chain.spring(self.springs(number, turn));
            }
            chain.end().rotate_z(turn.sin_cos());
            self.slide(number, slide, &mut chain);
            chain.end().rotate_y(joint.beta.sin_cos());
            for body in &joint.bodies {
                chain.load(&body.position, weight(body.mass));
            }
            frames.push(chain.place());
        }
        let payload = self.payload(conditions);
        if let Some(tool) = frames.get(self.arm.tool.joint).filter(|_| payload != 0.0) {
            chain.go_on_from(tool);
            chain.load(&self.arm.tool.payload_at, weight(payload));
        }
        (chain, frames)
    }

    /// The effects of the catalogue with their strengths.
    pub(super) fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        self.effects.iter().filter_map(TrueEffect::parts)
    }

    /// Gravity, base frame [m/s²].
    pub(super) fn gravity(&self) -> Vector3<f64> {
        let turn = |gravity, part: Part<'_>| match part {
            (Effect::GravityDirection, &[x, y]) => rotate(&Vector3::new(x, y, 0.0), &gravity),
            _ => gravity,
        };
        self.parts().fold(self.arm.gravity, turn)
    }

    fn base_hinge(&self) -> Hinge {
        let mut hinge = Hinge::default();
        for part in self.parts() {
            if let (Effect::BaseCompliance, [x, y]) = part {
                hinge.compliance += Vector3::new(*x, *y, 0.0);
            }
        }
        hinge
    }

    /// The hinges of a joint: one that tilts it before it turns, and one about its z.
    fn joint_hinges(
        &self,
        joint: &Joint,
        number: usize,
        conditions: &PoseConditions,
    ) -> (Hinge, Hinge) {
        let (mut before, mut about) = (Hinge::default(), Hinge::default());
        about.compliance.z = softness(joint.stiffness);
        for part in self.parts() {
            match part {
                (Effect::JointCompliance { joint }, [compliance]) if *joint == number => {
                    about.compliance.z += compliance;
                }
                (Effect::JointNonlinearStiffness { joint }, [cubic]) if *joint == number => {
                    about.cubic += cubic
                }
                (Effect::JointLateralCompliance { joint }, [x, y]) if *joint == number => {
                    before.compliance += Vector3::new(*x, *y, 0.0);
                }
                // A moment about its axis moves no joint along its slide.
                (Effect::Backlash { joint: place }, [width])
                    if *place == number
                        && conditions.approach.is_none()
                        && joint.kind != JointKind::Prismatic =>
                {
                    about.play += width;
                }
                _ => {}
            }
        }
        (before, about)
    }

    /// The springs of compensators at a joint that is at this angle \[rad\] before it gives way.
    fn springs(&self, number: usize, angle: f64) -> impl Iterator<Item = Spring> {
        self.parts().filter_map(move |part| match part {
            (
                Effect::GravityCompensator { joint, anchor, lever, free_length },
                &[rate, preload],
            ) if *joint == number => {
                let (anchor, end) =
                    (Vector2::from(*anchor), Rotation2::new(angle) * Vector2::from(*lever));
                Some(Spring { piece: 0, anchor, end, free_length: free_length.0, rate, preload })
            }
            _ => None,
        })
    }

    /// Payload \[kg\].
    fn payload(&self, conditions: &PoseConditions) -> f64 {
        let declared = conditions.payload.unwrap_or(self.arm.tool.payload_mass);
        let more = |payload: f64, part: Part<'_>| match part {
            (Effect::PayloadMass, &[mass]) if declared > 0.0 => payload + mass,
            _ => payload,
        };
        self.parts().fold(declared, more)
    }
}

/// 1/k, or 0 where nothing gives way.
pub(super) fn softness(stiffness: Option<f64>) -> f64 {
    stiffness.map_or(0.0, f64::recip)
}

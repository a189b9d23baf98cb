//! Construction of the chain of pieces, hinges and loads from the declared arm and its effects.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::Rig;
use super::chain::{Chain, Force, Hinge, PieceFrame, Spring};
use super::effect::TrueEffect;
use crate::laws::At;
use crate::problem::{Body, Effect, Joint, JointKind, Placement, PoseConditions};
use crate::spatial::rotate;

/// Effect of the catalogue with its true parameter values, SI units.
pub(super) type EffectValues<'a> = (&'a Effect, &'a [f64]);

impl Rig {
    /// Returns the undeformed chain of one pose, and the frame of each joint on it.
    pub(super) fn chain(&self, conditions: &PoseConditions) -> (Chain, Vec<PieceFrame>) {
        let gravity = self.gravity();
        let weight = |mass: f64| Force::Constant(gravity * mass);
        let mut chain = Chain::new(self.base_hinge());
        let (base, mut frames) = (chain.end_frame(), Vec::with_capacity(self.arm.joints.len()));
        for (index, joint) in self.arm.joints.iter().enumerate() {
            let number = index + 1;
            chain
                .continue_from(joint.parent.and_then(|parent| frames.get(parent)).unwrap_or(&base));
            let growth = self.growth(conditions);
            if let Some(Placement { xyz, rpy }) = &joint.placement {
                chain.end().translate(&(xyz * (1.0 + growth)));
                chain.end().rotate_z(rpy.z.sin_cos());
                chain.end().rotate_y(rpy.y.sin_cos());
                chain.end().rotate_x(rpy.x.sin_cos());
            }
            chain.end().rotate_x(joint.alpha.sin_cos());
            self.add_link(joint, number, &gravity, conditions, &mut chain);
            chain.end().translate_x(growth * joint.a);
            let (lateral, about_axis) = self.joint_hinges(joint, number, conditions);
            chain.add_hinge(lateral);
            let before = self.moved_by_laws(conditions, At::Before, Some(number));
            *chain.end() = chain.end().compose(&before);
            let (mut turn, mut slide) = (joint.theta, joint.d * (1.0 + growth));
            let command =
                |joint: usize| conditions.configuration.get(joint).copied().unwrap_or(0.0);
            let q = joint
                .mimic
                .map_or_else(|| command(index), |mimic| mimic.ratio * command(mimic.joint));
            let error = self.command_error(number, conditions);
            match joint.kind {
                JointKind::Revolute => turn += q + error,
                JointKind::Prismatic => slide += q + error,
                JointKind::Fixed => turn += error,
            }
            chain.add_hinge(about_axis);
            if !about_axis.is_rigid() {
                chain.add_springs(self.springs(number, turn));
            }
            chain.end().rotate_z(turn.sin_cos());
            self.add_slide(number, slide, &mut chain);
            chain.end().rotate_y(joint.beta.sin_cos());
            let behind = self.moved_by_laws(conditions, At::After, Some(number));
            *chain.end() = chain.end().compose(&behind);
            if index == self.arm.tool.joint {
                let tool = self.moved_by_laws(conditions, At::Tool, None);
                *chain.end() = chain.end().compose(&tool);
            }
            let masses = self.masses(&joint.bodies, number);
            for (body, mass) in joint.bodies.iter().zip(masses) {
                chain.add_load(&body.position, weight(mass));
            }
            frames.push(chain.end_frame());
        }
        let payload = self.payload(conditions);
        if let Some(tool) = frames.get(self.arm.tool.joint).filter(|_| payload != 0.0) {
            chain.continue_from(tool);
            chain.add_load(&self.payload_position(), weight(payload));
        }
        (chain, frames)
    }

    /// Returns the catalogue effects of the truth with their values.
    pub(super) fn effect_values(&self) -> impl Iterator<Item = EffectValues<'_>> {
        self.effects.iter().filter_map(TrueEffect::catalogued)
    }

    /// Returns the true gravity vector, base frame [m/s²].
    pub(super) fn gravity(&self) -> Vector3<f64> {
        let turn = |gravity, effect: EffectValues<'_>| match effect {
            (Effect::GravityDirection, &[x, y]) => rotate(&Vector3::new(x, y, 0.0), &gravity),
            _ => gravity,
        };
        self.effect_values().fold(self.arm.gravity, turn)
    }

    /// Returns the strain of all lengths of the arm in a pose.
    fn growth(&self, conditions: &PoseConditions) -> f64 {
        let strain = |effect: EffectValues<'_>| match effect {
            (Effect::ArmThermalExpansion, &[strain]) => strain * self.warming(conditions),
            _ => 0.0,
        };
        self.effect_values().map(strain).sum()
    }

    /// Returns the hinge between the ground and the arm's base.
    fn base_hinge(&self) -> Hinge {
        let mut hinge = Hinge::default();
        for effect in self.effect_values() {
            if let (Effect::BaseCompliance, [x, y]) = effect {
                hinge.compliance += Vector3::new(*x, *y, 0.0);
            }
        }
        hinge
    }

    /// Returns two hinges of a joint: the one that tilts across the axis before the joint's
    /// rotation, and the one about the joint's z axis. `number` counts joints from 1.
    fn joint_hinges(
        &self,
        joint: &Joint,
        number: usize,
        conditions: &PoseConditions,
    ) -> (Hinge, Hinge) {
        let (mut lateral, mut about_axis) = (Hinge::default(), Hinge::default());
        about_axis.compliance.z = compliance(joint.stiffness);
        for effect in self.effect_values() {
            match effect {
                (Effect::JointCompliance { joint }, [extra]) if *joint == number => {
                    about_axis.compliance.z += extra;
                }
                (Effect::JointNonlinearStiffness { joint }, [cubic]) if *joint == number => {
                    about_axis.cubic += cubic;
                }
                (Effect::JointLateralCompliance { joint }, [x, y]) if *joint == number => {
                    lateral.compliance += Vector3::new(*x, *y, 0.0);
                }
                // Backlash yields to moments about the axis, about which a prismatic joint does not
                // rotate.
                (Effect::Backlash { joint: affected }, [width])
                    if *affected == number
                        && conditions.approach.is_none()
                        && joint.kind != JointKind::Prismatic =>
                {
                    about_axis.play += width;
                }
                _ => {}
            }
        }
        (lateral, about_axis)
    }

    /// Returns the springs of gravity compensators at a joint whose angle without deformation is
    /// `angle` \[rad\]; `number` counts joints from 1.
    fn springs(&self, number: usize, angle: f64) -> impl Iterator<Item = Spring> {
        self.effect_values().filter_map(move |effect| match effect {
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

    /// Returns the true payload of a pose \[kg\]: the stated one with its error.
    fn payload(&self, conditions: &PoseConditions) -> f64 {
        let declared = conditions.payload.unwrap_or(self.arm.tool.payload_mass);
        let add = |payload: f64, effect: EffectValues<'_>| match effect {
            (Effect::PayloadMass, &[mass]) if declared > 0.0 => payload + mass,
            _ => payload,
        };
        self.effect_values().fold(declared, add)
    }

    /// Returns the true position of the payload \[m\], in the frame that carries it.
    fn payload_position(&self) -> Vector3<f64> {
        let add = |at, effect: EffectValues<'_>| match effect {
            (Effect::PayloadPosition, &[x, y, z]) => at + Vector3::new(x, y, z),
            _ => at,
        };
        self.effect_values().fold(self.arm.tool.payload_at, add)
    }

    /// Returns the true masses \[kg\] of the bodies of a joint; `number` counts joints from 1.
    fn masses(&self, bodies: &[Body], number: usize) -> Vec<f64> {
        let error: f64 = self
            .effect_values()
            .filter_map(|effect| match effect {
                (Effect::BodyMass { joint }, &[mass]) if *joint == number => Some(mass),
                _ => None,
            })
            .sum();
        let declared = Body::total_mass(bodies);
        bodies.iter().map(|body| body.mass + error * body.mass / declared).collect()
    }
}

/// Returns the compliance 1 / `stiffness`, or 0 for a rigid part (`None`).
pub(super) fn compliance(stiffness: Option<f64>) -> f64 {
    stiffness.map_or(0.0, f64::recip)
}

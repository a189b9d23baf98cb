//! From the declared arm and its effects to a chain of pieces, springs and loads.

use nalgebra::Vector3;

use super::chain::{Chain, Force, Hinge};
use super::effect::TrueEffect;
use super::{Conditions, Rig};
use crate::problem::{Beam, Effect, Joint, JointKind};
use crate::spatial::rotate;

/// A load on a link, at a point of the straight link's frame [m].
type LinkLoad = (Vector3<f64>, Force);
/// Part of a segment before its first hinge and behind its second: they sit at the points of Gauss and Legendre, so that
/// bending moments that change with up to the cube of the station are summed exactly.
const OUTER: f64 = 0.211_324_865_405_187_1;

/// An effect and its values.
type Part<'a> = (&'a Effect, &'a [f64]);

impl Rig {
    /// The chain of one pose, in the base frame.
    pub(super) fn chain(&self, conditions: &Conditions) -> Chain {
        let gravity = self.gravity();
        let weight = |mass: f64| Force::Constant(gravity * mass);
        let mut chain = Chain::new(self.base_hinge());
        for (index, joint) in self.arm.joints.iter().enumerate() {
            let number = index + 1;
            chain.end().rotate_x(joint.alpha.sin_cos());
            self.link(joint, number, &gravity, conditions, &mut chain);
            let (before, about) = self.joint_hinges(joint, number, conditions);
            chain.hinge(before);
            let (mut turn, mut slide) = (joint.theta, joint.d);
            let q = conditions.configuration.get(index).copied().unwrap_or(0.0);
            let miss = self.miss(number, conditions);
            match joint.kind {
                JointKind::Revolute => turn += q + miss,
                JointKind::Prismatic => slide += q + miss,
                JointKind::Fixed => turn += miss,
            }
            chain.hinge(about);
            chain.end().rotate_z(turn.sin_cos());
            chain.end().translate_z(slide);
            chain.end().rotate_y(joint.beta.sin_cos());
            for body in &joint.bodies {
                chain.load(&body.position, weight(body.mass));
            }
        }
        let payload = self.payload(conditions);
        if payload != 0.0 {
            chain.load(&self.arm.tool.payload_at, weight(payload));
        }
        chain
    }

    /// The effects of the catalogue with their strengths.
    fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        self.effects.iter().filter_map(TrueEffect::parts)
    }

    /// Gravity, base frame [m/s²].
    fn gravity(&self) -> Vector3<f64> {
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
    fn joint_hinges(&self, joint: &Joint, number: usize, conditions: &Conditions) -> (Hinge, Hinge) {
        let (mut before, mut about) = (Hinge::default(), Hinge::default());
        about.compliance.z = softness(joint.stiffness);
        for part in self.parts() {
            match part {
                (Effect::JointCompliance { joint }, [compliance]) if *joint == number => {
                    about.compliance.z += compliance;
                }
                (Effect::JointNonlinearStiffness { joint }, [cubic]) if *joint == number => about.cubic += cubic,
                (Effect::JointLateralCompliance { joint }, [x, y]) if *joint == number => {
                    before.compliance += Vector3::new(*x, *y, 0.0);
                }
                (Effect::Backlash { joint }, [width]) if *joint == number && conditions.approach.is_empty() => {
                    about.play += width;
                }
                _ => {}
            }
        }
        (before, about)
    }

    /// Payload [kg].
    fn payload(&self, conditions: &Conditions) -> f64 {
        let declared = conditions.payload.unwrap_or(self.arm.tool.payload_mass);
        let more = |payload: f64, part: Part<'_>| match part {
            (Effect::PayloadMass, &[mass]) if declared > 0.0 => payload + mass,
            _ => payload,
        };
        self.parts().fold(declared, more)
    }

    /// The link along a joint's a: segments with two hinges each, or one rigid piece.
    ///
    /// The link is cut where it carries something, so that bending is smooth along every segment.
    fn link(&self, joint: &Joint, number: usize, gravity: &Vector3<f64>, conditions: &Conditions, chain: &mut Chain) {
        let beam = joint.beam.as_ref();
        if beam.is_none() && self.hinge(beam, number, joint.a, conditions).is_rigid() {
            return chain.end().translate_x(joint.a);
        }
        let mut loads = beam.map_or_else(Vec::new, |beam| self.link_loads(beam, joint.a, gravity, conditions));
        // From the root outwards; what lies beyond either end hangs on that end.
        let station = |at: &Vector3<f64>| (at.x * joint.a.signum()).clamp(0.0, joint.a.abs());
        loads.sort_by(|(one, _), (other, _)| station(one).total_cmp(&station(other)));
        let weight = gravity * beam.map_or(0.0, |beam| beam.mass);
        let mut from = 0.0;
        for (at, force) in loads {
            let to = station(&at);
            self.span(&weight, joint, number, to - from, conditions, chain);
            chain.load(&Vector3::new(at.x - to * joint.a.signum(), at.y, at.z), force);
            from = to;
        }
        self.span(&weight, joint, number, joint.a.abs() - from, conditions, chain);
    }

    /// A part of a link, `reach` [m] long: its share of the link's segments.
    fn span(
        &self,
        weight: &Vector3<f64>,
        joint: &Joint,
        number: usize,
        reach: f64,
        conditions: &Conditions,
        chain: &mut Chain,
    ) {
        let share = reach / joint.a.abs();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a count")]
        let segments = (share * self.segments as f64).ceil() as usize;
        let length = joint.a * share / segments as f64;
        let hinge = self.hinge(joint.beam.as_ref(), number, length / 2.0, conditions);
        let rigid = |part: f64, chain: &mut Chain| {
            let weight = Force::Constant(weight * (part * length / joint.a));
            chain.load(&Vector3::new(part * length / 2.0, 0.0, 0.0), weight);
            chain.end().translate_x(part * length);
        };
        for _ in 0..segments {
            rigid(OUTER, chain);
            chain.hinge(hinge);
            rigid(1.0 - 2.0 * OUTER, chain);
            chain.hinge(hinge);
            rigid(OUTER, chain);
        }
    }

    /// The hinge that stands for `length` [m] of a link, which is negative along −x.
    fn hinge(&self, beam: Option<&Beam>, number: usize, length: f64, conditions: &Conditions) -> Hinge {
        let mut hinge = Hinge::default();
        let between = length.abs();
        if let Some(beam) = beam {
            let softness = Vector3::new(softness(beam.gj), softness(beam.ei_y), softness(beam.ei_z));
            hinge.compliance = softness * between;
            hinge.stretch = self::softness(beam.ea) * between;
        }
        let is_this = |link: &String| beam.is_some_and(|beam| beam.name == *link);
        for part in self.parts() {
            match part {
                (Effect::LinkBending { joint }, [flexibility]) if *joint == number => {
                    hinge.compliance += Vector3::new(0.0, *flexibility, *flexibility) * between;
                }
                (Effect::LinkThermalBending { link }, [y, z]) if is_this(link) => {
                    hinge.free_rotation += Vector3::new(0.0, *y, *z) * (self.warming(conditions) * length);
                }
                (Effect::LinkThermalExpansion { link }, [strain]) if is_this(link) => {
                    hinge.free_stretch += strain * self.warming(conditions) * length;
                }
                _ => {}
            }
        }
        hinge
    }

    /// What a beam of signed length `a` [m] carries besides its own weight.
    fn link_loads(&self, beam: &Beam, a: f64, gravity: &Vector3<f64>, conditions: &Conditions) -> Vec<LinkLoad> {
        let weight = |mass: f64| Force::Constant(gravity * mass);
        let mut loads: Vec<LinkLoad> =
            beam.masses.iter().map(|carried| (carried.position, weight(carried.mass))).collect();
        for part in self.parts() {
            if let (Effect::UnmodelledMass { link }, &[mass, at]) = part
                && *link == beam.name
            {
                loads.push((Vector3::new(at.copysign(a), 0.0, 0.0), weight(mass)));
            }
        }
        if let Some(hoist) = &beam.hoist {
            let mut tension = conditions.hoist.unwrap_or(hoist.force);
            let (mut direction, mut trolley) = (hoist.direction, 0.0);
            for part in self.parts() {
                match part {
                    (Effect::HoistForce, [error]) => tension *= 1.0 + error,
                    (Effect::HoistDirection, &[x, y, per_metre]) => {
                        direction += Vector3::new(x, y, 0.0);
                        trolley += per_metre;
                    }
                    _ => {}
                }
            }
            loads.push((hoist.at, Force::Rope { tension, direction, trolley }));
        }
        loads
    }
}

/// 1/k, or 0 where nothing gives way.
fn softness(stiffness: Option<f64>) -> f64 {
    stiffness.map_or(0.0, f64::recip)
}

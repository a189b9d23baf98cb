//! Links as segments of rigid parts and hinges.

use nalgebra::{Vector2, Vector3};

use super::Rig;
use super::build::{EffectValues, compliance};
use super::chain::{Chain, Force, Hinge};
use crate::problem::{Beam, Effect, Joint, PoseConditions};

/// Load on a link, at a point in the frame of the straight link \[m\].
type LinkLoad = (Vector3<f64>, Force);
/// Fraction of a segment before its first hinge and behind its second. The hinges are at the
/// Gauss–Legendre points, so that bending moments up to third order along the segment are
/// integrated exactly.
const OUTER_FRACTION: f64 = 0.211_324_865_405_187_1;

impl Rig {
    /// Adds to `chain` the link along the length a of a joint: segments with two hinges each, or
    /// one rigid piece. `number` counts joints from 1.
    ///
    /// The link is divided where it carries a load, so that its bending moment is smooth along
    /// every segment.
    pub(super) fn add_link(
        &self,
        joint: &Joint,
        number: usize,
        gravity: &Vector3<f64>,
        conditions: &PoseConditions,
        chain: &mut Chain,
    ) {
        let beam = joint.beam.as_ref();
        if beam.is_none() && self.hinge(beam, number, joint.a, conditions).is_rigid() {
            return chain.end().translate_x(joint.a);
        }
        let mut loads =
            beam.map_or_else(Vec::new, |beam| self.link_loads(beam, joint.a, gravity, conditions));
        // The link is divided at the load's distance from its root; a load beyond either end of the
        // link acts at that end.
        let station = |at: &Vector3<f64>| (at.x * joint.a.signum()).clamp(0.0, joint.a.abs());
        loads.sort_by(|(a, _), (b, _)| station(a).total_cmp(&station(b)));
        let weight = gravity * beam.map_or(0.0, |beam| beam.mass);
        let mut from = 0.0;
        for (at, force) in loads {
            let to = station(&at);
            self.add_span(&weight, joint, number, to - from, conditions, chain);
            chain.add_load(&Vector3::new(at.x - to * joint.a.signum(), at.y, at.z), force);
            from = to;
        }
        self.add_span(&weight, joint, number, joint.a.abs() - from, conditions, chain);
    }

    /// Adds to `chain` a part of a link, `reach` \[m\] long, divided into its share of the link's
    /// segments. `weight` is the weight of the whole link \[N\].
    fn add_span(
        &self,
        weight: &Vector3<f64>,
        joint: &Joint,
        number: usize,
        reach: f64,
        conditions: &PoseConditions,
        chain: &mut Chain,
    ) {
        let share = reach / joint.a.abs();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a part of a count"
        )]
        let segments = (share * self.segments as f64).ceil() as usize;
        let length = joint.a * share / segments as f64;
        let hinge = self.hinge(joint.beam.as_ref(), number, length / 2.0, conditions);
        let rigid = |part: f64, chain: &mut Chain| {
            let weight = Force::Constant(weight * (part * length / joint.a));
            chain.add_load(&Vector3::new(part * length / 2.0, 0.0, 0.0), weight);
            chain.end().translate_x(part * length);
        };
        for _ in 0..segments {
            rigid(OUTER_FRACTION, chain);
            chain.add_hinge(hinge);
            rigid(1.0 - 2.0 * OUTER_FRACTION, chain);
            chain.add_hinge(hinge);
            rigid(OUTER_FRACTION, chain);
        }
    }

    /// Adds to `chain` the slide of a joint, `length` \[m\] along z (negative along −z): segments
    /// with two hinges each, or one rigid piece. `number` counts joints from 1.
    pub(super) fn add_slide(&self, number: usize, length: f64, chain: &mut Chain) {
        let flexibility = |effect: EffectValues<'_>| match effect {
            (Effect::SlideBending { joint }, &[flexibility]) if *joint == number => flexibility,
            _ => 0.0,
        };
        let flexibility: f64 = self.effect_values().map(flexibility).sum();
        if flexibility == 0.0 {
            return chain.end().translate_z(length);
        }
        let segment = length / self.segments as f64;
        let lateral = flexibility * segment.abs() / 2.0;
        let hinge = Hinge { compliance: Vector3::new(lateral, lateral, 0.0), ..Hinge::default() };
        for _ in 0..self.segments {
            chain.end().translate_z(OUTER_FRACTION * segment);
            chain.add_hinge(hinge);
            chain.end().translate_z((1.0 - 2.0 * OUTER_FRACTION) * segment);
            chain.add_hinge(hinge);
            chain.end().translate_z(OUTER_FRACTION * segment);
        }
    }

    /// Returns the hinge that represents `length` \[m\] of the link before the joint with this
    /// number, from 1; `length` is negative for a link along −x.
    fn hinge(
        &self,
        beam: Option<&Beam>,
        number: usize,
        length: f64,
        conditions: &PoseConditions,
    ) -> Hinge {
        let mut hinge = Hinge::default();
        let size = length.abs();
        if let Some(beam) = beam {
            let per_length =
                Vector3::new(compliance(beam.gj), compliance(beam.ei_y), compliance(beam.ei_z));
            hinge.compliance = per_length * size;
            hinge.stretch = compliance(beam.ea) * size;
            let [strain, about_y, about_z] = self.strained_by_laws(&beam.name, conditions);
            hinge.free_stretch = strain * length;
            hinge.free_rotation = Vector3::new(0.0, about_y, about_z) * length;
        }
        let is_this = |link: &String| beam.is_some_and(|beam| beam.name == *link);
        for effect in self.effect_values() {
            match effect {
                (Effect::LinkBending { joint }, [flexibility]) if *joint == number => {
                    hinge.compliance += Vector3::new(0.0, *flexibility, *flexibility) * size;
                }
                (Effect::TwistBending { link }, [y, z]) if is_this(link) => {
                    hinge.coupling += Vector2::new(*y, *z) * size;
                }
                (Effect::LinkThermalBending { link }, [y, z]) if is_this(link) => {
                    hinge.free_rotation +=
                        Vector3::new(0.0, *y, *z) * (self.warming(conditions) * length);
                }
                (Effect::LinkThermalBendingLag { link, time_constant }, [y, z])
                    if is_this(link) =>
                {
                    let warming = self.lagged_warming(conditions, *time_constant);
                    hinge.free_rotation += Vector3::new(0.0, *y, *z) * (warming * length);
                }
                (Effect::LinkThermalExpansion { link }, [strain]) if is_this(link) => {
                    hinge.free_stretch += strain * self.warming(conditions) * length;
                }
                (Effect::LinkThermalExpansionLag { link, time_constant }, [strain])
                    if is_this(link) =>
                {
                    let warming = self.lagged_warming(conditions, *time_constant);
                    hinge.free_stretch += strain * warming * length;
                }
                _ => {}
            }
        }
        hinge
    }

    /// Returns the loads on a beam of signed length `a` \[m\], except the beam's weight.
    fn link_loads(
        &self,
        beam: &Beam,
        a: f64,
        gravity: &Vector3<f64>,
        conditions: &PoseConditions,
    ) -> Vec<LinkLoad> {
        let weight = |mass: f64| Force::Constant(gravity * mass);
        let mut loads: Vec<LinkLoad> =
            beam.masses.iter().map(|carried| (carried.position, weight(carried.mass))).collect();
        for effect in self.effect_values() {
            if let (Effect::UnmodelledMass { link }, &[mass, at]) = effect
                && *link == beam.name
            {
                loads.push((Vector3::new(at.copysign(a), 0.0, 0.0), weight(mass)));
            }
        }
        if let Some(hoist) = &beam.hoist {
            let mut tension = conditions.hoist.unwrap_or(hoist.force);
            let (mut direction, mut trolley) = (hoist.direction, 0.0);
            for effect in self.effect_values() {
                match effect {
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

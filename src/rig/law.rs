//! Laws of a truth: formulas that add to a quantity of the arm, its base, tool or instrument.

use nalgebra::Vector3;

use super::Rig;
use super::build::EffectValues;
use super::command::friction;
use crate::laws::{At, BeamField, Law, Quantity};
use crate::problem::{Effect, JointKind, PoseConditions};
use crate::spatial::Frame;

/// Rotation \[rad\] or displacement \[m\] of a joint to each side, over which the work of the loads
/// is differentiated numerically.
const MOMENT_STEP: f64 = 1e-4;

impl Rig {
    /// Returns the sum that the laws for which `is_selected` is true add to the quantity at their
    /// site, SI units.
    pub(super) fn added_by_laws(
        &self,
        conditions: &PoseConditions,
        is_selected: impl Fn(&Law) -> bool,
    ) -> f64 {
        let added = |effect: EffectValues<'_>| match effect {
            (Effect::Law(law), coefficients) if is_selected(law) => {
                self.sum_of_terms(law, coefficients, conditions)
            }
            _ => 0.0,
        };
        self.effect_values().map(added).sum()
    }

    /// Returns the small motion that laws add: translations at the sites `at(0)` to `at(2)`, and
    /// the rotation vector at `at(3)` to `at(5)`; the identity without such a law. `joint` counts
    /// from 1; `None` accepts laws of any place.
    pub(super) fn moved_by_laws(
        &self,
        conditions: &PoseConditions,
        at: fn(usize) -> At,
        joint: Option<usize>,
    ) -> Frame<f64> {
        let number = |axis: usize| {
            self.added_by_laws(conditions, |law| {
                law.at() == at(axis) && (joint.is_none() || law.joint() == joint)
            })
        };
        let turn = Vector3::from_fn(|axis, _| number(3 + axis));
        Frame::from_rotation_vector(Vector3::from_fn(|axis, _| number(axis)), &turn)
    }

    /// Returns the strain that laws add along the beam of a link, and the curvatures about the
    /// beam's y and z axes [1/m].
    pub(super) fn strained_by_laws(&self, link: &str, conditions: &PoseConditions) -> [f64; 3] {
        BeamField::STRAINS.map(|field| {
            self.added_by_laws(conditions, |law| {
                law.at() == At::Beam(field) && law.link() == Some(link)
            })
        })
    }

    /// Returns Σ cᵢ · termᵢ of a law with these coefficients, SI units.
    fn sum_of_terms(&self, law: &Law, coefficients: &[f64], conditions: &PoseConditions) -> f64 {
        let side = |joint: usize| {
            let sides = conditions.approach.as_ref();
            sides.and_then(|sides| sides.get(joint)).copied().unwrap_or(0.0)
        };
        let of = |quantity: Quantity| match quantity {
            Quantity::Command(joint) => conditions.configuration.get(joint).copied().unwrap_or(0.0),
            Quantity::Warming => self.warming(conditions),
            Quantity::Lagging { time_constant } => self.lagged_warming(conditions, time_constant),
            Quantity::Friction { joint, distance } => friction(conditions, joint, distance),
            Quantity::Elapsed => conditions.elapsed,
            Quantity::Time => conditions.time,
            Quantity::Payload => conditions.payload.unwrap_or(self.arm.tool.payload_mass),
            Quantity::Hoist => conditions.hoist.unwrap_or_else(|| {
                let beams = self.arm.joints.iter().filter_map(|joint| joint.beam.as_ref());
                beams.filter_map(|beam| beam.hoist.as_ref()).map(|hoist| hoist.force).sum()
            }),
            Quantity::Approach(joint) => side(joint),
            Quantity::Covariate(k) => conditions.covariates.get(k).copied().unwrap_or(0.0),
            Quantity::Moment(joint) => self.moment(joint, conditions),
        };
        let inner: Vec<f64> = law.parameters().iter().map(|parameter| parameter.start).collect();
        let terms = law.expressions().zip(coefficients);
        terms.map(|(formula, size)| size * formula.evaluate(&of, &inner)).sum()
    }

    /// Returns the moment of the loads about the axis of a joint on the undeflected arm [N·m]; for
    /// a prismatic joint, their force along the axis \[N\]. It is the work of the loads, errors of
    /// the loads included, per motion of the joint. `joint` counts from 0.
    fn moment(&self, joint: usize, conditions: &PoseConditions) -> f64 {
        let errors_of_loads = self.effects.iter().filter(|effect| {
            matches!(
                effect.catalogued(),
                Some((
                    Effect::PayloadMass
                        | Effect::PayloadPosition
                        | Effect::BodyMass { .. }
                        | Effect::UnmodelledMass { .. }
                        | Effect::HoistForce
                        | Effect::HoistDirection
                        | Effect::GravityDirection,
                    _
                ))
            )
        });
        let mut bare =
            Self::new(self.arm.clone(), errors_of_loads.cloned().collect()).with_segments(1);
        let loaded = bare.chain(conditions).0;
        let mut work = |step: f64| {
            if let Some(joint) = bare.arm.joints.get_mut(joint) {
                match joint.kind {
                    JointKind::Prismatic => joint.d += step,
                    _ => joint.theta += step,
                }
            }
            loaded.work(&bare.chain(conditions).0)
        };
        (work(MOMENT_STEP) - work(-2.0 * MOMENT_STEP)) / (2.0 * MOMENT_STEP)
    }
}

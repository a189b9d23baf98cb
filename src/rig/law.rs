//! Laws of a truth: formulas that add to the coordinate of a joint.

use super::Rig;
use crate::laws::{At, Law, Quantity};
use crate::problem::PoseConditions;

/// Returns the reason why the rig cannot apply a law, if it cannot.
pub(super) fn refusal(law: &Law) -> Option<&'static str> {
    let quantities = || law.expressions().flat_map(crate::laws::expression::Expression::quantities);
    if law.at() != At::Coordinate {
        return Some("laws of the rig add to the coordinate of a joint; write at = \"joint1\"");
    }
    let is_of_loads = |quantity: Quantity| matches!(quantity, Quantity::Moment(_));
    quantities()
        .any(is_of_loads)
        .then_some("laws of the rig take no moments of the loads; write another quantity")
}

impl Rig {
    /// Returns what a law with these coefficients adds to its joint's coordinate \[rad\] or \[m\].
    pub(super) fn law_error(
        &self,
        law: &Law,
        coefficients: &[f64],
        conditions: &PoseConditions,
    ) -> f64 {
        let side = |joint: usize| {
            let sides = conditions.approach.as_ref();
            sides.and_then(|sides| sides.get(joint)).copied().unwrap_or(0.0)
        };
        let of = |quantity: Quantity| match quantity {
            Quantity::Command(joint) => conditions.configuration.get(joint).copied().unwrap_or(0.0),
            Quantity::Warming => self.warming(conditions),
            Quantity::Lagging { time_constant } => self.lagged_warming(conditions, time_constant),
            Quantity::Friction { joint, distance } => {
                super::command::friction(conditions, joint, distance)
            }
            Quantity::Elapsed => conditions.elapsed,
            Quantity::Time => conditions.time,
            Quantity::Payload => conditions.payload.unwrap_or(self.arm.tool.payload_mass),
            Quantity::Hoist => conditions.hoist.unwrap_or_else(|| {
                let beams = self.arm.joints.iter().filter_map(|joint| joint.beam.as_ref());
                beams.filter_map(|beam| beam.hoist.as_ref()).map(|hoist| hoist.force).sum()
            }),
            Quantity::Approach(joint) => side(joint),
            Quantity::Covariate(k) => conditions.covariates.get(k).copied().unwrap_or(0.0),
            Quantity::Moment(_) => 0.0,
        };
        let inner: Vec<f64> = law.parameters().iter().map(|parameter| parameter.start).collect();
        let terms = law.expressions().zip(coefficients);
        terms.map(|(formula, size)| size * formula.evaluate(&of, &inner)).sum()
    }
}

//! Where a joint really goes when it is told to go to q.

use super::Rig;
use super::effect::{Cause, Shape, TrueEffect};
use crate::problem::{Effect, Mount, PoseConditions};

impl Rig {
    /// By how much the coordinate of the joint with this number misses its command, without any load \[rad\] or \[m\].
    ///
    /// Errors of a prismatic joint add to its d.
    pub(super) fn miss(&self, number: usize, conditions: &PoseConditions) -> f64 {
        let of = |joint: usize| conditions.configuration.get(joint - 1).copied().unwrap_or(0.0);
        let q = of(number);
        let part = |effect: &TrueEffect| match (effect.cause(), effect.values()) {
            (Cause::Outside { joint, shape }, [height, centre, width]) if *joint == number => {
                let u = (q - centre) / width;
                height
                    * match shape {
                        Shape::Bump => (-0.5 * u * u).exp(),
                        Shape::Step => u.tanh(),
                    }
            }
            (Cause::Catalogued(effect), values) => match (effect, values) {
                (Effect::JointHarmonic { joint, orders }, values) if *joint == number => orders
                    .iter()
                    .zip(values.chunks_exact(2))
                    .map(|(order, wave)| {
                        let (sin, cos) = (f64::from(*order) * q).sin_cos();
                        wave[0] * sin + wave[1] * cos
                    })
                    .sum(),
                (Effect::JointWave { joint, order }, [a, b]) if *joint == number => {
                    a * (q * order).sin() + b * (q * order).cos()
                }
                (Effect::GearRatio { joint }, [error]) if *joint == number => error * q,
                (Effect::Backlash { joint }, [width]) if *joint == number => {
                    0.5 * width
                        * conditions.approach.as_ref().and_then(|sides| sides.get(number - 1)).copied().unwrap_or(0.0)
                }
                (Effect::PayloadBacklash { joint }, [width]) if *joint == number => {
                    let sides = conditions.approach.as_ref().and_then(|sides| sides.get(number - 1));
                    let payload = conditions.payload.unwrap_or(self.arm.tool.payload_mass);
                    sides.map_or(0.0, |side| payload * width * side / 2.0)
                }
                (Effect::JointThermalDrift { joint }, [rate]) if *joint == number => rate * self.warming(conditions),
                (Effect::Covariate { joint: Mount::Joint(joint), of }, [rate]) if *joint == number => {
                    rate * self.covariate(of, conditions)
                }
                (Effect::JointCoupling { joint, from }, [factor]) if *joint == number => factor * of(*from),
                _ => 0.0,
            },
            _ => 0.0,
        };
        self.effects.iter().map(part).sum()
    }

    /// One of the problem's own covariates, in its unit; 0 where nobody knows.
    pub(super) fn covariate(&self, name: &str, conditions: &PoseConditions) -> f64 {
        let own = self.arm.data.covariates.iter().zip(&conditions.covariates);
        own.filter(|(own, _)| own.name == name).map(|(_, value)| *value).sum()
    }

    /// T − T₀ [°C].
    pub(super) fn warming(&self, conditions: &PoseConditions) -> f64 {
        match (conditions.temperature, self.arm.data.reference_temperature) {
            (Some(temperature), Some(reference)) => temperature - reference,
            _ => 0.0,
        }
    }
}

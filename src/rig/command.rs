//! Deviation of a joint coordinate from its command.

use super::Rig;
use super::effect::{Cause, Shape, TrueEffect};
use crate::laws::At;
use crate::problem::{Effect, Mount, PoseConditions};

impl Rig {
    /// Returns by how much the coordinate of the joint with this number (from 1) exceeds its
    /// command, without deformation under load \[rad\], or \[m\] for a prismatic joint.
    pub(super) fn command_error(&self, number: usize, conditions: &PoseConditions) -> f64 {
        let command =
            |joint: usize| conditions.configuration.get(joint - 1).copied().unwrap_or(0.0);
        let q = command(number);
        let deviation = |effect: &TrueEffect| match (effect.cause(), effect.values()) {
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
                        * conditions
                            .approach
                            .as_ref()
                            .and_then(|sides| sides.get(number - 1))
                            .copied()
                            .unwrap_or(0.0)
                }
                (Effect::PayloadBacklash { joint }, [width]) if *joint == number => {
                    let sides =
                        conditions.approach.as_ref().and_then(|sides| sides.get(number - 1));
                    let payload = conditions.payload.unwrap_or(self.arm.tool.payload_mass);
                    sides.map_or(0.0, |side| payload * width * side / 2.0)
                }
                (Effect::JointThermalDrift { joint }, [rate]) if *joint == number => {
                    rate * self.warming(conditions)
                }
                (Effect::JointThermalDriftLag { joint, time_constant }, [rate])
                    if *joint == number =>
                {
                    rate * self.lagged_warming(conditions, *time_constant)
                }
                (Effect::JointHysteresis { joint, distance }, [amplitude]) if *joint == number => {
                    amplitude * friction(conditions, number - 1, *distance)
                }
                (Effect::Covariate { joint: Mount::Joint(joint), of }, [rate])
                    if *joint == number =>
                {
                    rate * self.covariate(of, conditions)
                }
                (Effect::JointCoupling { joint, from }, [factor]) if *joint == number => {
                    factor * command(*from)
                }
                _ => 0.0,
            },
            _ => 0.0,
        };
        let by_laws = self.added_by_laws(conditions, |law| {
            law.at() == At::Coordinate && law.joint() == Some(number)
        });
        self.effects.iter().map(deviation).sum::<f64>() + by_laws
    }

    /// Returns the value of the covariate `name` of the problem in a pose, in its unit; 0 if the
    /// pose has none.
    pub(super) fn covariate(&self, name: &str, conditions: &PoseConditions) -> f64 {
        let covariates = self.arm.data.covariates.iter().zip(&conditions.covariates);
        let matching = covariates.filter(|(covariate, _)| covariate.name == name);
        matching.map(|(_, value)| *value).sum()
    }

    /// Returns the difference T − T₀ from the reference temperature [°C]; 0 if either is not
    /// stated.
    pub(super) fn warming(&self, conditions: &PoseConditions) -> f64 {
        match (conditions.temperature, self.arm.data.reference_temperature) {
            (Some(temperature), Some(reference)) => temperature - reference,
            _ => 0.0,
        }
    }

    /// Returns the lagged temperature difference T̃ − T₀ [°C] of a body that follows the
    /// temperature with a time constant \[s\]; 0 if the pose states no temperature.
    ///
    /// The temperature is linear between the readings of successive poses.
    pub(super) fn lagged_warming(&self, conditions: &PoseConditions, time_constant: f64) -> f64 {
        let past = &conditions.past;
        let Some(now) = conditions.temperature else { return 0.0 };
        let reference = self.arm.data.reference_temperature.unwrap_or(now);
        let before = past.times.iter().copied().zip(past.temperatures.iter().copied());
        let mut readings = before.chain([(conditions.time, now)]);
        let Some((mut time, mut air)) = readings.next() else { return now - reference };
        let mut lagged = air;
        for (next, reading) in readings {
            let passed = next - time;
            // Under a steady rate the body lags by rate × τ.
            let lag = if passed > 0.0 { (reading - air) / passed * time_constant } else { 0.0 };
            let start = if passed > 0.0 { lagged - air } else { lagged - reading };
            lagged = reading - lag + (start + lag) * (-passed / time_constant).exp();
            (time, air) = (next, reading);
        }
        lagged - reference
    }
}

/// Returns the friction state z ∈ [−1, 1] of a joint (index from 0) in a pose, after the earlier
/// poses of the session. `distance` is the path over which the friction reverses \[rad\] or \[m\].
/// [Dahl 1968]
pub(super) fn friction(conditions: &PoseConditions, joint: usize, distance: f64) -> f64 {
    let past = &conditions.past;
    let joints = conditions.configuration.len();
    let no_sides = vec![0.0; joints];
    let sides_now = conditions.approach.as_ref().unwrap_or(&no_sides);
    let sides = past
        .approaches
        .chunks(joints)
        .chain(std::iter::repeat(no_sides.as_slice()))
        .take(past.times.len());
    let earlier = past.configurations.chunks(joints).zip(sides);
    let mut state: Option<(f64, f64)> = None;
    for (configuration, sides) in
        earlier.chain([(conditions.configuration.as_slice(), sides_now.as_slice())])
    {
        let (q, side) = (configuration[joint], sides[joint]);
        state = Some(match state {
            None => (q, side),
            Some((last, z)) => {
                let step = q - last;
                let direction = match side {
                    0.0 if step > 0.0 => 1.0,
                    0.0 => -1.0,
                    side => side,
                };
                let memory = 1.0 / (step.abs() / distance).exp();
                (q, direction * (1.0 - memory) + z * memory)
            }
        });
    }
    state.map_or(0.0, |(_, z)| z)
}

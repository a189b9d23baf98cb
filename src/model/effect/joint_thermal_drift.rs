//! `joint-thermal-drift`: Δθ = k (T − T₀).

use super::coverage::NO_TEMPERATURE;
use super::place::{commanded, coordinate};
use super::{Candidate, Family, Term};
use crate::model::parameter::Driver;
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-thermal-drift",
    terms: |effect, problem| match effect {
        Effect::JointThermalDrift { joint } => {
            let driver = Driver::Warming { reference: problem.data.reference_temperature.unwrap_or(0.0) };
            vec![Term::driven("rate", coordinate(problem, *joint), driver, 1e-3)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |joint| Effect::JointThermalDrift { joint };
        commanded(problem).map(|joint| Candidate::needing(effect(joint), data.temperature, NO_TEMPERATURE)).collect()
    },
    describe: |effect| match effect {
        Effect::JointThermalDrift { joint } => format!("zero of joint {joint} drifts with temperature"),
        _ => String::new(),
    },
};

//! `joint-thermal-drift`: Δθ = k (T − T₀).

use super::coverage::without_temperature;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{commanded, warming};
use crate::model::parameter::ParameterSite;
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-thermal-drift",
    terms: |effect, problem| match effect {
        Effect::JointThermalDrift { joint } => {
            vec![Term::driven(
                "rate",
                ParameterSite::coordinate(problem, *joint),
                warming(problem),
                1e-3,
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |joint| Effect::JointThermalDrift { joint };
        commanded(problem)
            .map(|joint| Candidate { effect: effect(joint), untestable: data.no_temperature })
            .collect()
    },
    describe: |effect| match effect {
        Effect::JointThermalDrift { joint } => {
            format!("zero of joint {joint} drifts with temperature")
        }
        _ => String::new(),
    },
    missing_column: without_temperature,
    ..USUAL
};

//! `…-lag`: what follows the temperature with a time constant τ, dT̃/dt = (T − T̃)/τ, by (T̃ − T₀).

use super::coverage::{Columns, DataCoverage, NO_TIMES, without_temperature};
use super::family::{Candidate, Family, Term, USUAL, to_three_digits};
use super::place::{carrier, commanded, links};
use crate::model::parameter::{BeamField, ParameterSite, Regressor};
use crate::problem::{Effect, Problem};

/// Longest time constant that is looked for, as part of the time measured; a longer one is a drift.
const LONGEST: f64 = 0.6;
/// Shortest one in times from one pose to the next: between poses nothing lags.
const SHORTEST: f64 = 2.0;
/// Each over the one before.
const STEP: f64 = 1.25;

/// Zero of a joint.
pub(super) const JOINT: Family = Family {
    name: "joint-thermal-drift-lag",
    terms: |effect, problem| match effect {
        Effect::JointThermalDriftLag { joint, time_constant } => {
            let site = ParameterSite::coordinate(problem, *joint);
            vec![Term::driven("rate", site, lagging(problem, *time_constant), 1e-3)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let of = |joint| move |time_constant| Effect::JointThermalDriftLag { joint, time_constant };
        commanded(problem).flat_map(|joint| each(data, of(joint))).collect()
    },
    describe: |effect| match effect {
        Effect::JointThermalDriftLag { joint, time_constant } => {
            format!(
                "zero of joint {joint} drifts with a temperature that lags by {time_constant} s"
            )
        }
        _ => String::new(),
    },
    missing_column: without_history,
    searched: Some(SEARCHED),
    scaled: |effect, factor| match effect {
        Effect::JointThermalDriftLag { joint, time_constant } => {
            let time_constant = to_three_digits(factor * time_constant)?;
            Some(Effect::JointThermalDriftLag { joint: *joint, time_constant })
        }
        _ => None,
    },
    ..USUAL
};

/// Curvature of a link.
pub(super) const BENDING: Family = Family {
    name: "link-thermal-bending-lag",
    terms: |effect, problem| match effect {
        Effect::LinkThermalBendingLag { link, time_constant } => {
            let regressor = lagging(problem, *time_constant);
            let terms = |joint| {
                [("about_y", BeamField::BowY), ("about_z", BeamField::BowZ)].map(|(name, field)| {
                    Term::driven(name, ParameterSite::Beam { joint, field }, regressor, 1e-3)
                })
            };
            carrier(problem, link).map_or_else(Vec::new, |joint| terms(joint).to_vec())
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let of = |link: String| {
            move |time_constant| Effect::LinkThermalBendingLag { link: link.clone(), time_constant }
        };
        links(problem).flat_map(|link| each(data, of(link))).collect()
    },
    describe: |effect| match effect {
        Effect::LinkThermalBendingLag { link, time_constant } => {
            format!("link {link} bows with a temperature that lags by {time_constant} s")
        }
        _ => String::new(),
    },
    missing_column: without_history,
    searched: Some(SEARCHED),
    scaled: |effect, factor| match effect {
        Effect::LinkThermalBendingLag { link, time_constant } => {
            let time_constant = to_three_digits(factor * time_constant)?;
            Some(Effect::LinkThermalBendingLag { link: link.clone(), time_constant })
        }
        _ => None,
    },
    ..USUAL
};

/// Strain of a link.
pub(super) const EXPANSION: Family = Family {
    name: "link-thermal-expansion-lag",
    terms: |effect, problem| match effect {
        Effect::LinkThermalExpansionLag { link, time_constant } => {
            let regressor = lagging(problem, *time_constant);
            let site = |joint| ParameterSite::Beam { joint, field: BeamField::Stretch };
            carrier(problem, link)
                .map(|joint| Term::driven("strain", site(joint), regressor, 1e-3))
                .into_iter()
                .collect()
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let of = |link: String| {
            move |time_constant| Effect::LinkThermalExpansionLag {
                link: link.clone(),
                time_constant,
            }
        };
        links(problem).flat_map(|link| each(data, of(link))).collect()
    },
    describe: |effect| match effect {
        Effect::LinkThermalExpansionLag { link, time_constant } => {
            format!("link {link} grows with a temperature that lags by {time_constant} s")
        }
        _ => String::new(),
    },
    missing_column: without_history,
    searched: Some(SEARCHED),
    scaled: |effect, factor| match effect {
        Effect::LinkThermalExpansionLag { link, time_constant } => {
            let time_constant = to_three_digits(factor * time_constant)?;
            Some(Effect::LinkThermalExpansionLag { link: link.clone(), time_constant })
        }
        _ => None,
    },
    ..USUAL
};

/// The argument that is searched.
const SEARCHED: &str = "time_constant_s";

fn lagging(problem: &Problem, time_constant: f64) -> Regressor {
    Regressor::Lagging {
        reference: problem.data.reference_temperature.unwrap_or(0.0),
        time_constant,
    }
}

/// The column without which the temperature that was is not known.
fn without_history(effect: &Effect, problem: &Problem, columns: Columns) -> Option<&'static str> {
    without_temperature(effect, problem, columns)
        .or_else(|| (!columns.time).then_some("a column time_s"))
}

/// An effect of each time constant that these data can show.
fn each(data: &DataCoverage, effect: impl Fn(f64) -> Effect) -> Vec<Candidate> {
    let Some((between, span)) = data.clock else {
        return vec![Candidate::needing(effect(1.0), false, NO_TIMES)];
    };
    let all = std::iter::successors(Some(SHORTEST * between), |own| Some(own * STEP));
    all.take_while(|own| *own > 0.0 && *own <= LONGEST * span)
        .filter_map(to_three_digits)
        .map(|time_constant| Candidate {
            effect: effect(time_constant),
            untestable: data.no_temperature,
        })
        .collect()
}

//! Check of the numbers of points, anchors and surfaces that the fit does not vary.

use serde_json::json;

use super::finding::{Finding, FindingCode};
use super::freed::{Freed, MAX_CHANCE_PROBABILITY};
use super::row_kind::format_error;
use crate::fit::{Estimate, Identification, IdentifyError};
use crate::measurement::Measurements;
use crate::problem::{Fixture, Problem};
use crate::quantity::format::{decimals, number};

/// Smallest reduced χ² at which held fixtures are freed.
const MIN_CHI2: f64 = 2.0;
/// Largest share of what exceeds the noise in χ² that a freed fixture leaves.
const MAX_LEFT: f64 = 0.05;
/// Maximum number of fixtures that are freed, each by itself.
const MAX_FITTED: usize = 8;
/// Smallest deviation of a freed number, in standard errors, at which the finding names it.
const MIN_NAMED_SIGMAS: f64 = 3.0;

/// Returns the finding that the held numbers of one point, anchor or surface cause nearly all of a
/// misfit; `None` if they do not. `fit` repeats the fit with another problem.
pub(in crate::fit) fn held_fixture(
    problem: &Problem,
    rows: &Measurements,
    found: &Identification,
    fit: impl Fn(&Problem) -> Result<Identification, IdentifyError>,
) -> Option<Finding> {
    let before = found.reduced_chi2.filter(|chi2| *chi2 > MIN_CHI2)?;
    let held_numbers = |fixture: &Fixture| {
        let word = fixture.kind.word();
        let fields = fixture.kind.fields().iter();
        let names = fields.map(|field| format!("{word}[{}].{field}", fixture.name));
        let held: Vec<String> = names.filter(|name| !found.unknowns.contains(name)).collect();
        (["point", "anchor", "surface"].contains(&word) && !held.is_empty()).then_some(held)
    };
    let held: Vec<Vec<String>> = problem.fixtures.iter().filter_map(held_numbers).collect();
    if held.len() > MAX_FITTED {
        return None;
    }
    let freed = held.into_iter().filter_map(|names| {
        let freed = Freed::new((problem, found), &names, &fit)?;
        Some((names, freed))
    });
    let (names, Freed { fitted, reduced_chi2: after, chance, .. }) =
        freed.min_by(|(_, a), (_, b)| a.reduced_chi2.total_cmp(&b.reduced_chi2))?;
    if after - 1.0 >= MAX_LEFT * (before - 1.0) || chance > MAX_CHANCE_PROBABILITY {
        return None;
    }
    let is_off = |estimate: &&Estimate| {
        let deviation = (estimate.estimate - estimate.nominal).abs();
        names.contains(&estimate.name)
            && estimate.std_error.is_some_and(|error| deviation > MIN_NAMED_SIGMAS * error)
    };
    let off: Vec<&Estimate> = fitted.estimates.iter().filter(is_off).collect();
    let first = off.first()?;
    let words = off.iter().map(|estimate| {
        let unit = estimate.unit.display(estimate.nominal);
        let [from, to] = [estimate.nominal, estimate.estimate].map(|value| value * unit.factor);
        let shown = |value: f64| number(value, decimals(value.abs(), 5));
        format!(
            "{} is held at {} {3} and fits as {} {3}",
            estimate.name,
            shown(from),
            shown(to),
            unit.symbol
        )
    });
    let kind = rows.leading().kind();
    let [left, declared] = [&fitted, found].map(|of| of.fitted.identification.rms.norm);
    let text = format!(
        "{}: with that the reduced χ² is {after:.2} instead of {before:.2}, and the rms error {} \
         instead of {}",
        words.collect::<Vec<_>>().join(", "),
        format_error(kind, left, 3),
        format_error(kind, declared, 3)
    );
    let alike: Vec<&str> = off.iter().skip(1).map(|estimate| estimate.name.as_str()).collect();
    let numbers = [json!(first.name), json!(alike), declared.into(), left.into()];
    let rules = off.iter().map(|estimate| format!("\"{}\" = {{ free = true }}", estimate.name));
    let rules = rules.collect::<Vec<_>>().join(", ");
    let remedy = format!("correct what is held, or free it in [parameters]: {rules}");
    Some(Finding::new(FindingCode::HeldParameter, numbers, text).with_remedy(remedy))
}

//! Check of held intrinsics: an error of a lens is no error of the arm.

use serde_json::json;

use super::finding::Finding;
use crate::fit::{Estimate, FindingCode, Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::problem::{Fixture, Freedom, ParameterRule, Problem, Quantities};

/// Smallest share of the excess of the reduced χ² over 1 that free intrinsics remove at which they
/// are the cause of a misfit.
const MIN_REMOVED_SHARE: f64 = 0.5;
/// Smallest deviation of a coefficient from its declared value at which it is named \[σ\].
const MIN_NAMED_SIGMAS: f64 = 5.0;

/// Compares the fit with one whose intrinsics are free: focal lengths, image centres and
/// distortion. Returns a finding if the rows miss the fit beyond noise, and free intrinsics remove
/// most of that.
///
/// `fit` repeats the fit with another problem. There is nothing to compare without pixels, or if
/// all intrinsics are free.
pub(in crate::fit) fn lens_finding(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    fit: impl FnOnce(&Problem) -> Result<Identification, IdentifyError>,
) -> Option<Finding> {
    let rows = &data.measurements;
    let is_used = |fixture: usize| {
        let mut used = data.split.identification.iter();
        used.any(|&row| rows.observation(row).fixtures()[0] == Some(fixture))
    };
    let of_fixture = |(index, fixture): (usize, &Fixture)| {
        let is_camera = fixture.kind.word() == "camera" && is_used(index);
        let fields = fixture.kind.fields().iter().skip(6).filter(move |_| is_camera);
        let name = fixture.name.clone();
        fields.map(move |field| format!("camera[{name}].{field}")).collect::<Vec<_>>()
    };
    let held: Vec<String> = problem
        .fixtures
        .iter()
        .enumerate()
        .flat_map(of_fixture)
        .filter(|name| !found.unknowns.contains(name))
        .collect();
    let (before, (_, highest)) = (found.reduced_chi2?, found.chance?);
    if held.is_empty() || before <= highest {
        return None;
    }
    let mut freed = problem.clone();
    freed.parameters.extend(held.iter().map(|name| ParameterRule {
        pattern: name.clone(),
        freedom: Freedom::Free {
            sigma: Quantities::default(),
            min: Quantities::default(),
            max: Quantities::default(),
        },
        location: problem.data.location.clone(),
    }));
    let other = fit(&freed).ok()?;
    let after = other.reduced_chi2?;
    let is_cause = before - after > MIN_REMOVED_SHARE * (before - 1.0);
    if !other.termination.converged() || !is_cause {
        return None;
    }
    let is_off = |estimate: &&Estimate| {
        let deviation = (estimate.estimate - estimate.nominal).abs();
        let error = estimate.std_error.filter(|_| held.contains(&estimate.name));
        error.is_some_and(|error| deviation > MIN_NAMED_SIGMAS * error)
    };
    let off: Vec<&Estimate> = other.estimates.iter().filter(is_off).collect();
    if off.is_empty() {
        return None;
    }
    let words = off.iter().map(|estimate| {
        let error = estimate.std_error.unwrap_or_default();
        format!("{} = {:.6} ± {error:.6}", estimate.name, estimate.estimate)
    });
    let names: Vec<&str> = off.iter().map(|estimate| estimate.name.as_str()).collect();
    let text = format!(
        "the intrinsics are not as declared: with {} the reduced χ² falls from {before:.2} to {after:.2}",
        words.collect::<Vec<_>>().join(", ")
    );
    let numbers = [json!(names), json!(before), json!(after)];
    Some(Finding::new(FindingCode::LensContradicted, numbers, text))
}

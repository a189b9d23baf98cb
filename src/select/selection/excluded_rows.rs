//! Rows that are too far off to be noise and therefore took no part in the choice of effects: they
//! have gross errors, which may spoil the last fit, or an effect acts in them.

use std::collections::BTreeSet;

use serde_json::json;

use super::found::{Found, lower};
use super::search::{Searched, search, unless_stopped};
use super::state::SearchState;
use super::status::Status;
use crate::error::Location;
use crate::fit::{Finding, FindingCode, Identification, IdentifyError, Noise};
use crate::observation::kind_named;
use crate::quantity::format::{counted, number};
use crate::select::evidence::{HypothesisSet, evaluate, ln_posterior};
use crate::select::fitted::Fitted;
use crate::select::settings::{
    LN_ODDS_OF_COMMON_CAUSE, OUTLIER_SQUARED_DISTANCE, PRIOR_OF_GROSS_ERROR,
};

/// Maximum number of rows that the text of the finding names.
const MAX_NAMED_ROWS: usize = 3;

/// Searches again with all rows if the search ended at a fit from which rows stand out. Returns the
/// end of the new search, with its state in `state`, if its effects explain some of these rows
/// together with the others, and this is more probable than gross errors by
/// [`LN_ODDS_OF_COMMON_CAUSE`]; otherwise the end of the first one.
///
/// An effect that grows fast with its quantity displaces a few rows most. If these are left out as
/// gross errors, what remains may not show the effect.
///
/// # Errors
/// Returns an error if a fit fails or the search was stopped.
pub(super) fn searched_with_all_rows(
    state: &mut SearchState,
    declared: &Fitted,
    first: Searched,
) -> Result<Searched, IdentifyError> {
    let aside = first.0.set_aside.len();
    if aside == 0 || declared.problem.robust.is_some() || state.misread.is_some() {
        return Ok(first);
    }
    let all_rows = declared.with_outliers(Vec::new());
    let mut other = SearchState::new(state.data, state.options, &all_rows);
    // Rows that spoil the fit may end this search; the first one stands then.
    let Ok(second) = search(&mut other, all_rows) else { return Ok(first) };
    // The evidence about effects that it does not remove from the fit is not known.
    let (added, judged) = (other.added(&second.0), other.reconsidered(&second.0));
    if added.is_empty() || added != judged || second.0.set_aside.len() >= aside {
        return Ok(first);
    }
    let sigma = first.0.sigma;
    let there = ln_evidence(&other, &second, sigma)?;
    let here = ln_evidence(state, &first, sigma)?;
    if there.zip(here).is_none_or(|(there, here)| there < here + LN_ODDS_OF_COMMON_CAUSE) {
        return Ok(first);
    }
    other.evidence_of_declared = state.evidence_of_declared.take();
    *state = other;
    Ok(second)
}

/// Returns ln of the posterior of the end of a search, in which rows that it excluded have gross
/// errors; `None` if the residual is not finite. Residuals are in units of `sigma` \[m\].
fn ln_evidence(
    state: &SearchState,
    (fitted, evidence): &Searched,
    sigma: f64,
) -> Result<Option<f64>, IdentifyError> {
    let data = state.data;
    let reconsidered = state.reconsidered(fitted);
    let evaluated = || unless_stopped(data, || evaluate(fitted, data, &reconsidered));
    let Some(mut evidence) = evidence.clone().map_or_else(evaluated, |known| Ok(Some(known)))?
    else {
        return Ok(None);
    };
    let rows = data.evidence_rows();
    let alone = evidence.left_out.iter().map(|&pose| rows[pose]);
    let excluded: BTreeSet<usize> = fitted.set_aside.iter().copied().chain(alone).collect();
    let best = evidence.certain_set(data.rules.inclusion_threshold);
    let functions = best.map_or_else(Vec::new, HypothesisSet::without_law);
    let numbers = |row: &usize| kind_named(data.measurements.observation(*row).kind()).numbers;
    let used = excluded.iter().filter(|row| rows.contains(row));
    // A gross error is at least as large as the distance from which rows stand out.
    let of_errors: f64 = used
        .map(|row| {
            PRIOR_OF_GROSS_ERROR.ln() - 0.5 * numbers(row) as f64 * OUTLIER_SQUARED_DISTANCE.ln()
        })
        .sum();
    evidence.left_out.clear();
    let others = fitted.with_outliers(excluded.into_iter().collect());
    let of_others = unless_stopped(data, || {
        ln_posterior(&others, data, (&reconsidered, &evidence), (&functions, sigma))
    })?;
    Ok(of_others.map(|ln| ln + of_errors))
}

/// Returns true if rows that took no part in the choice of effects (`excluded`) spoil the fit
/// `found`. If there are effects, their status is at most probable then, and the finding on these
/// rows is returned too. A loop that explains nothing claims nothing that they spoil.
pub(super) fn withhold_claims(
    found: &Identification,
    excluded: &[Location],
    effects: &mut [Found],
) -> (bool, Option<Finding>) {
    let finding = excluded_rows_finding(found, excluded);
    let is_spoilt = finding.is_some();
    if is_spoilt {
        lower(effects.iter_mut(), Status::Probable);
    }
    (is_spoilt, finding.filter(|_| !effects.is_empty()))
}

/// Returns the finding that the `excluded` rows, which the choice of effects left out, count in full
/// in the fit `found` and make its residual larger than the declared noise; `None` if they do not.
/// The effects explain the other rows, but the values of their parameters follow the wrong ones.
fn excluded_rows_finding(found: &Identification, excluded: &[Location]) -> Option<Finding> {
    let (chi2, (_, highest)) = found.reduced_chi2.zip(found.chance)?;
    if excluded.is_empty() || found.noise != Noise::Declared || chi2 <= highest {
        return None;
    }
    let rows = excluded.iter().map(|row| json!({ "file": row.file, "line": row.line })).collect();
    let mut named: Vec<String> =
        excluded.iter().take(MAX_NAMED_ROWS).map(ToString::to_string).collect();
    if let more @ 1.. = excluded.len().saturating_sub(MAX_NAMED_ROWS) {
        named.push(format!("{more} more"));
    }
    let text = format!(
        "{} too far off to be noise ({}) {} in full in the fit: its χ²/ν is {}, expected up to {} if \
         only noise is left",
        counted(excluded.len(), "row"),
        named.join(", "),
        if excluded.len() == 1 { "counts" } else { "count" },
        number(chi2, 2),
        number(highest, 2)
    );
    let numbers = [rows, json!(found.fitted.identification.n), json!(chi2)];
    Some(Finding::new(FindingCode::ExcludedRowsFitted, numbers, text))
}

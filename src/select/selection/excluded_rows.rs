//! Check of the last fit of a loop: rows with gross errors that took no part in the choice of
//! effects may spoil it.

use serde_json::json;

use super::found::Found;
use super::status::Status;
use crate::error::Location;
use crate::fit::{Finding, FindingCode, Identification, Noise};
use crate::quantity::format::{counted, number};

/// Maximum number of rows that the text of the finding names.
const MAX_NAMED_ROWS: usize = 3;

/// Lowers the status of found effects to probable if rows that took no part in their choice
/// (`excluded`) spoil the fit `found` with these effects, and returns the finding on these rows.
/// `None` if they do not, or if there is no effect, as in a loop that explains nothing.
pub(super) fn withhold_claims(
    found: &Identification,
    excluded: &[Location],
    effects: Option<&mut [Found]>,
) -> Option<Finding> {
    let effects = effects.filter(|effects| !effects.is_empty())?;
    let finding = excluded_rows_finding(found, excluded)?;
    for effect in effects {
        effect.status = effect.status.max(Status::Probable);
    }
    Some(finding)
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

//! Onset of a change: the first row of the table that shows it.

use nalgebra::DMatrix;

use super::assessment::{AssessedCause, Assessment, weighted_cause};
use super::causes::Cause;
use super::evidence::{Unchanged, ln_sum};
use super::rows::{SensitiveRows, Sums};

/// Prior probability that a change begins within the table rather than before its first row.
const WITHIN_PROBABILITY: f64 = 0.2;
/// Maximum number of rows that are tried as the onset of a change, evenly spaced in the table.
const MAX_ONSETS: usize = 24;
/// Smallest number of rows from the onset to the end of the table. A gross row at the end of the
/// table is thus no change.
const MIN_CHANGED_ROWS: usize = 3;

/// Adds the hypotheses that a cause acts only from a later row on. The causes of the assessment then
/// have the most probable onset of each, the most probable cause first.
///
/// The probability of a cause is the sum over all its onsets. Noise and gross rows have no onsets.
/// The evidence for a change, and with it the rate of false alarms, does not depend on onsets.
/// Returns `None` if a number is not finite.
pub(super) fn with_onsets(
    assessment: Assessment,
    rows: &SensitiveRows,
    factor: &DMatrix<f64>,
    causes: &[Cause],
) -> Option<Assessment> {
    let last = (rows.len() + 1).saturating_sub(MIN_CHANGED_ROWS);
    let step = last.saturating_sub(1).div_ceil(MAX_ONSETS).max(1);
    let onsets: Vec<usize> = (1..last).step_by(step).collect();
    let has_onset = |cause: &AssessedCause| {
        cause.row.is_none() && !causes[cause.cause].columns.is_empty() && !onsets.is_empty()
    };
    // The logarithm of the probability of each onset of each cause, up to a common term.
    let mut hypotheses: Vec<Vec<(f64, AssessedCause)>> = assessment
        .causes
        .iter()
        .map(|cause| {
            let ln_prior = if has_onset(cause) { (1.0 - WITHIN_PROBABILITY).ln() } else { 0.0 };
            vec![(cause.probability.ln() + ln_prior, cause.clone())]
        })
        .collect();
    let every_column: Vec<usize> = (0..rows.sensitivity.ncols()).collect();
    let ln_prior = WITHIN_PROBABILITY.ln() - (onsets.len().max(1) as f64).ln();
    for &onset in &onsets {
        let (masked, columns) = rows.masked_before(onset, &every_column);
        let unchanged =
            Unchanged::new(&sums_of(&masked, 1.0), &padded_factor(factor, columns.len()))?;
        for (assessed, of_cause) in assessment.causes.iter().zip(&mut hypotheses) {
            let found = weighted_cause(&unchanged, &causes[assessed.cause], &columns);
            if let Some(found) = found.filter(|_| has_onset(assessed)) {
                let ln_probability = found.ln_share - assessment.ln_sum + ln_prior;
                of_cause.push((ln_probability, found.assessed(assessed.cause, onset)));
            }
        }
    }
    let all = ln_sum(hypotheses.iter().flatten().map(|of| of.0));
    let mut found: Vec<AssessedCause> = hypotheses
        .into_iter()
        .filter_map(|of_cause| {
            let probability = (ln_sum(of_cause.iter().map(|of| of.0)) - all).exp();
            let best = of_cause.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some(AssessedCause { probability, ..best.1 })
        })
        .collect();
    found.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Some(Assessment { causes: found, ln_sum: assessment.ln_sum + all, ..assessment })
}

/// Returns the sums over all rows, for noise that is `ratio` times the assumed one.
pub(super) fn sums_of(rows: &SensitiveRows, ratio: f64) -> Sums {
    let mut sums = Sums::new(rows.sensitivity.ncols(), ratio);
    (0..rows.len()).for_each(|row| sums.add(rows, row, 1.0));
    sums
}

/// Returns the factor of a covariance to which `added` parameters of variance zero are appended.
pub(super) fn padded_factor(factor: &DMatrix<f64>, added: usize) -> DMatrix<f64> {
    factor.clone().resize_vertically(factor.nrows() + added, 0.0)
}

//! Search for influential rows: few rows whose removal removes most of the misfit.

use crate::fit::checks::outliers::{InfluentialRows, Outlier};
use crate::fit::outcome::Identification;
use crate::fit::uncertainty::noise::Noise;

/// Ratio of the residual variance without some rows to that with them, below which the rows are
/// influential even if a misfit remains. Such rows may also be the only ones that an effect
/// concerns, for example two rows with a payload.
const MAX_DECISIVE_RATIO: f64 = 0.01;
/// Ratio of the residual variance without some rows to that with them, below which the rows are
/// influential if the declared σ explains the residual of the other rows.
const MAX_INFLUENTIAL_RATIO: f64 = 0.5;
/// Minimum number of fitted rows for each influential row. If more rows seem influential, the model
/// is wrong, not these rows.
const MIN_ROWS_PER_INFLUENTIAL: usize = 5;
/// Number of fitted rows for each row that is removed in one round (at least one is removed). A
/// gross error makes good rows look like outliers, so few are removed at a time.
const ROWS_PER_REMOVAL: usize = 100;
/// Ratio of the residual variance after a round to that before, above which the removed rows are
/// not gross errors and the search ends.
const MAX_GAINFUL_RATIO: f64 = 0.95;

/// Finds the influential rows of the fit `found`; `without` fits the identification rows except
/// those with the given indices.
///
/// Outliers with the largest residuals are removed and the other rows fitted again, until the
/// declared σ explains the residual or no outlier remains. The search ends at a fit that does not
/// converge. Returns `None` if the declared σ explains the residual of `found`, or if no few rows
/// cause most of the misfit.
pub(super) fn influential_rows(
    found: &Identification,
    without: impl Fn(&[usize]) -> Option<Identification>,
) -> Option<InfluentialRows> {
    if is_explained_by_sigma(found) {
        return None;
    }
    let count = found.fitted.identification.n;
    let (max_rows, rows_per_round) =
        ((count / MIN_ROWS_PER_INFLUENTIAL).max(1), (count / ROWS_PER_REMOVAL).max(1));
    let mut rows: Vec<Outlier> = Vec::new();
    let mut reduced_fit: Option<Identification> = None;
    loop {
        let last = reduced_fit.as_ref().unwrap_or(found);
        // Known distances are never left out.
        let mut largest: Vec<&Outlier> =
            last.outliers.iter().filter(|row| row.kind != "known distance").collect();
        largest.sort_by(|a, b| b.distance.total_cmp(&a.distance));
        largest.truncate(rows_per_round);
        let largest: Vec<Outlier> = largest.into_iter().cloned().collect();
        if is_explained_by_sigma(last)
            || largest.is_empty()
            || rows.len() + largest.len() > max_rows
        {
            break;
        }
        let numbers: Vec<usize> = rows.iter().chain(&largest).map(|outlier| outlier.row).collect();
        let Some(next) = without(&numbers).filter(|fit| fit.termination.converged()) else { break };
        if variance_ratio(&next, last) > MAX_GAINFUL_RATIO {
            break;
        }
        rows.extend(largest);
        reduced_fit = Some(next);
    }
    let reduced_fit = reduced_fit?;
    rows.sort_by_key(|outlier| outlier.row);
    let ratio = variance_ratio(&reduced_fit, found);
    let is_better = ratio < MAX_DECISIVE_RATIO
        || (ratio < MAX_INFLUENTIAL_RATIO && is_explained_by_sigma(&reduced_fit));
    let Identification { reduced_chi2, sigma_taken, .. } = reduced_fit;
    is_better.then_some(InfluentialRows { rows, reduced_chi2, sigma_taken })
}

/// Returns true if σ is declared and explains the residual: the fit did not assume a larger σ.
fn is_explained_by_sigma(fit: &Identification) -> bool {
    fit.noise == Noise::Declared && fit.noise_factor <= 1.0 + 1e-9
}

/// Returns the ratio of the residual variance of `fit` to that of `other`.
fn variance_ratio(fit: &Identification, other: &Identification) -> f64 {
    match (fit.reduced_chi2, other.reduced_chi2) {
        (Some(chi2), Some(other)) => chi2 / other,
        _ => (fit.sigma_taken / other.sigma_taken).powi(2),
    }
}

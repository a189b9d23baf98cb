//! Search for influential rows: few rows whose removal removes most of the misfit.

use std::collections::BTreeMap;

use crate::fit::checks::outliers::{InfluentialRows, Outlier};
use crate::fit::checks::view_order::views;
use crate::fit::outcome::Identification;
use crate::fit::uncertainty::noise::Noise;
use crate::measurement::Measurements;

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
/// Most influential rows that are not sought as whole views.
const MAX_SINGLE_ROWS: usize = 4;

/// Finds the influential rows of the fit `found`, or influential views if many rows of images are
/// influential. `identified` holds the identification rows of the measurements; `without` fits them
/// except those with the given indices.
pub(super) fn influential(
    found: &Identification,
    (measurements, identified): (&Measurements, &[usize]),
    without: impl Fn(&[usize]) -> Option<Identification>,
) -> Option<InfluentialRows> {
    let rows = influential_rows(found, &without);
    if rows.as_ref().is_some_and(|rows| rows.rows.len() <= MAX_SINGLE_ROWS) {
        return rows;
    }
    let rows_at = |view: Vec<usize>| view.into_iter().map(|place| identified[place]).collect();
    let views: Vec<Vec<usize>> = views(measurements, identified).into_iter().map(rows_at).collect();
    influential_views(found, measurements, &views, without).or(rows)
}

/// Finds the views without which the declared σ explains the residual, or nearly: the one with the
/// largest mean square is removed and the others fitted again, until that is so.
fn influential_views(
    found: &Identification,
    measurements: &Measurements,
    views: &[Vec<usize>],
    without: impl Fn(&[usize]) -> Option<Identification>,
) -> Option<InfluentialRows> {
    let mut removed: Vec<usize> = Vec::new();
    let mut rows: Vec<Outlier> = Vec::new();
    let mut reduced_fit: Option<Identification> = None;
    while MIN_ROWS_PER_INFLUENTIAL * (removed.len() + 1) <= views.len() {
        let last = reduced_fit.as_ref().unwrap_or(found);
        if is_explained_by_sigma(last) {
            break;
        }
        let outliers: BTreeMap<usize, &Outlier> =
            last.outliers.iter().map(|outlier| (outlier.row, outlier)).collect();
        let square = |view: &usize| {
            let distances = views[*view].iter().filter_map(|row| outliers.get(row));
            let sum: f64 = distances.map(|outlier| outlier.distance.powi(2)).sum();
            sum / views[*view].len() as f64
        };
        // Where single points stand out, it is not the view that is wrong.
        let stands_out = |view: &usize| {
            let count = views[*view].iter().filter(|row| outliers.contains_key(row)).count();
            2 * count > views[*view].len()
        };
        let left = (0..views.len()).filter(|view| !removed.contains(view) && stands_out(view));
        let Some(worst) = left.max_by(|a, b| square(a).total_cmp(&square(b))) else { break };
        rows.extend(views[worst].iter().filter_map(|row| outliers.get(row).copied().cloned()));
        removed.push(worst);
        let numbers: Vec<usize> = removed.iter().flat_map(|&view| &views[view]).copied().collect();
        let next = without(&numbers).filter(|fit| fit.termination.converged())?;
        reduced_fit = Some(next);
    }
    let reduced_fit = reduced_fit?;
    rows.sort_by_key(|outlier| outlier.row);
    let place = |view: &usize| {
        let (first, last) = (views[*view].iter().min()?, views[*view].iter().max()?);
        Some(format!("{} to {}", measurements.location(*first), measurements.location(*last)))
    };
    let views = removed.iter().filter_map(place).collect();
    let influential = InfluentialRows { views, ..outcome(rows, &reduced_fit) };
    is_decisive(&reduced_fit, found).then_some(influential)
}

/// Finds the influential rows of the fit `found`; `without` fits the identification rows except
/// those with the given indices.
///
/// Outliers with the largest residuals are removed and the other rows fitted again, until the
/// declared σ explains the residual or no outlier remains. The search ends at a fit that does not
/// converge. Returns `None` if the declared σ explains the residual of `found`, or if no few rows
/// cause most of the misfit.
fn influential_rows(
    found: &Identification,
    without: &impl Fn(&[usize]) -> Option<Identification>,
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
    is_decisive(&reduced_fit, found).then(|| outcome(rows, &reduced_fit))
}

/// Returns true if a fit without some rows explains the others much better than `found` does.
fn is_decisive(reduced_fit: &Identification, found: &Identification) -> bool {
    let ratio = variance_ratio(reduced_fit, found);
    ratio < MAX_DECISIVE_RATIO
        || (ratio < MAX_INFLUENTIAL_RATIO && is_explained_by_sigma(reduced_fit))
}

/// Returns influential rows with the residual of the fit without them.
fn outcome(rows: Vec<Outlier>, reduced_fit: &Identification) -> InfluentialRows {
    let &Identification { reduced_chi2, sigma_taken, .. } = reduced_fit;
    InfluentialRows { rows, views: Vec::new(), reduced_chi2, sigma_taken }
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

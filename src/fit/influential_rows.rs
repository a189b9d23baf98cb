//! Search for influential rows: few rows whose removal removes most of the misfit.

use crate::fit::checks::outliers::{InfluentialRows, Outlier};
use crate::fit::outcome::Identification;
use crate::fit::uncertainty::noise::Noise;

/// Part of the variance left without the rows up to which they are influential in any case. Rows
/// that one effect alone concerns, such as two with a payload, may be among them.
const FAR_BETTER: f64 = 0.01;
/// Part of the variance left without the rows up to which they are influential if the declared σ
/// then explains the rest.
const MOST_OF_IT: f64 = 0.5;
/// Reciprocal of the largest part of the rows that can be influential; beyond it, the model misses
/// all.
const ONE_IN: usize = 5;
/// Reciprocal of the part of the rows that is left out in one round, at least one row: a gross
/// error makes other rows look far off and hides smaller errors.
const ONE_A_ROUND_IN: usize = 100;
/// Part of the variance left after a round above which its rows are no gross errors.
const NO_GAIN: f64 = 0.95;

/// Finds the influential rows of the fit `found`; `without` fits the identification rows except
/// some.
///
/// The rows farthest off are left out and the others fitted again, until the declared σ explains
/// the residual or no row is too far off. The search ends at a fit that does not converge.
pub(super) fn influential_rows(
    found: &Identification,
    without: impl Fn(&[usize]) -> Option<Identification>,
) -> Option<InfluentialRows> {
    if explains(found) {
        return None;
    }
    let count = found.fitted.identification.n;
    let (most, a_round) = ((count / ONE_IN).max(1), (count / ONE_A_ROUND_IN).max(1));
    let mut rows: Vec<Outlier> = Vec::new();
    let mut rest: Option<Identification> = None;
    loop {
        let last = rest.as_ref().unwrap_or(found);
        // Known distances are never left out.
        let mut far: Vec<&Outlier> =
            last.outliers.iter().filter(|row| row.kind != "known distance").collect();
        far.sort_by(|a, b| b.distance.total_cmp(&a.distance));
        far.truncate(a_round);
        let far: Vec<Outlier> = far.into_iter().cloned().collect();
        if explains(last) || far.is_empty() || rows.len() + far.len() > most {
            break;
        }
        let numbers: Vec<usize> = rows.iter().chain(&far).map(|outlier| outlier.row).collect();
        let Some(next) = without(&numbers).filter(|fit| fit.termination.converged()) else { break };
        if part(&next, last) > NO_GAIN {
            break;
        }
        rows.extend(far);
        rest = Some(next);
    }
    let rest = rest?;
    rows.sort_by_key(|outlier| outlier.row);
    let left = part(&rest, found);
    let is_better = left < FAR_BETTER || (left < MOST_OF_IT && explains(&rest));
    let Identification { reduced_chi2, sigma_taken, .. } = rest;
    is_better.then_some(InfluentialRows { rows, reduced_chi2, sigma_taken })
}

/// Returns true if the declared σ explains the residual of a fit.
fn explains(fit: &Identification) -> bool {
    fit.noise == Noise::Declared && fit.noise_factor <= 1.0 + 1e-9
}

/// Returns the variance of the residual of `fit` over that of `other`.
fn part(fit: &Identification, other: &Identification) -> f64 {
    match (fit.reduced_chi2, other.reduced_chi2) {
        (Some(chi2), Some(other)) => chi2 / other,
        _ => (fit.sigma_taken / other.sigma_taken).powi(2),
    }
}

//! Rows that carry what a fit does not explain.

use crate::fit::checks::outliers::{InfluentialRows, Outlier};
use crate::fit::outcome::Identification;
use crate::fit::uncertainty::noise::Noise;

/// Without its influential_rows a fit leaves no more than this part of the variance, or half of it and what
/// the declared σ explains: then they carry most of it. Rows that an effect touches alone, as two
/// with a payload, may be such.
const FAR_BETTER: f64 = 0.01;
const MOST_OF_IT: f64 = 0.5;
/// More than one row in so many carry nothing: the model misses them all.
const ONE_IN: usize = 5;
/// Rows left out in one round: one in so many, at least one. A gross one makes others look far off,
/// and hides smaller ones.
const ONE_A_ROUND_IN: usize = 100;
/// A round that leaves more than this part of the variance shows that the outliers are no gross
/// ones.
const NO_GAIN: f64 = 0.95;

/// The rows that carry what `found` does not explain; `without` fits the identification rows but
/// for some.
///
/// Those farthest off are left out and the rest fitted again, until the declared σ explains it or
/// nothing more is too far off. A fit that fails tells nothing.
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
        // Known distances stay.
        let mut far: Vec<&Outlier> =
            last.outliers.iter().filter(|own| own.kind != "known distance").collect();
        far.sort_by(|a, b| b.distance.total_cmp(&a.distance));
        far.truncate(a_round);
        let far: Vec<Outlier> = far.into_iter().cloned().collect();
        if explains(last) || far.is_empty() || rows.len() + far.len() > most {
            break;
        }
        let numbers: Vec<usize> = rows.iter().chain(&far).map(|own| own.row).collect();
        let Some(next) = without(&numbers).filter(|fit| fit.termination.converged()) else { break };
        if part(&next, last) > NO_GAIN {
            break;
        }
        rows.extend(far);
        rest = Some(next);
    }
    let rest = rest?;
    rows.sort_by_key(|own| own.row);
    let left = part(&rest, found);
    let is_better = left < FAR_BETTER || (left < MOST_OF_IT && explains(&rest));
    let Identification { reduced_chi2, sigma_taken, .. } = rest;
    is_better.then_some(InfluentialRows { rows, reduced_chi2, sigma_taken })
}

/// Whether the declared σ explains what a fit leaves.
fn explains(fit: &Identification) -> bool {
    fit.noise == Noise::Declared && fit.noise_factor <= 1.0 + 1e-9
}

/// Variance that a fit leaves over that of another.
fn part(fit: &Identification, other: &Identification) -> f64 {
    match (fit.reduced_chi2, other.reduced_chi2) {
        (Some(own), Some(other)) => own / other,
        _ => (fit.sigma_taken / other.sigma_taken).powi(2),
    }
}

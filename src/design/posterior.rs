//! Information of an update on the parameters, as rows of a design.

use nalgebra::DMatrix;

use super::exchange::Unknowns;
use super::{Sensitivity, Site};
use crate::fit::Identification;
use crate::numeric::inverse_factor;

/// Fraction of the variances that is added to a covariance, so that its inverse exists despite
/// rounding.
const JITTER: f64 = 1e-9;

/// Returns rows whose information is that of the posterior of `found` on the parameters of a site. A
/// pose has `coordinates` rows. The posterior contains the priors of these parameters, so they are
/// removed from the `unknowns`.
///
/// With the covariance C = D ρ D and ρ = L Lᵀ, the rows are L⁻¹ D⁻¹: their information is C⁻¹. Without
/// a covariance there are no rows.
pub(super) fn posterior_rows(
    site: &Site,
    found: &Identification,
    coordinates: usize,
    unknowns: &mut Unknowns,
) -> Sensitivity {
    let declared = &site.model.parameters;
    let known: Vec<(usize, usize)> = (0..found.estimates.len())
        .filter(|&k| found.covariance.entry(k, k).is_some_and(|variance| variance > 0.0))
        .filter_map(|k| {
            let is_it = |name: &str| name == found.estimates[k].name;
            Some((k, declared.iter().position(|parameter| is_it(&parameter.name))?))
        })
        .collect();
    // Estimates have the unit of the parameter's value; the rows have that of its deviation.
    let sigma = |&(k, place): &(usize, usize)| {
        let slope = declared[place].value_error(found.x[k], 1.0).abs();
        found.covariance.entry(k, k).unwrap_or(0.0).sqrt() / slope
    };
    let sigmas: Vec<f64> = known.iter().map(sigma).collect();
    let variance = |k: usize| found.covariance.entry(k, k).unwrap_or(1.0);
    let correlation = DMatrix::from_fn(known.len(), known.len(), |i, j| {
        let (one, other) = (known[i].0, known[j].0);
        let covariance = found.covariance.entry(one, other).unwrap_or(0.0);
        let jitter = if i == j { JITTER } else { 0.0 };
        covariance / (variance(one) * variance(other)).sqrt() + jitter
    });
    let Some(inverse) = inverse_factor(&correlation) else {
        return Sensitivity { rows: DMatrix::zeros(declared.len(), 0), coordinates };
    };
    let columns = known.len().next_multiple_of(coordinates);
    let mut rows = DMatrix::zeros(declared.len(), columns);
    for (i, &(_, place)) in known.iter().enumerate() {
        unknowns.sigmas[place] = None;
        for row in 0..known.len() {
            rows[(place, row)] = inverse[(row, i)] / sigmas[i];
        }
    }
    Sensitivity { rows, coordinates }
}

//! Limits (bounds and constraints) of the declared problem on which a fit rests. If one is wrong,
//! the misfit that it causes looks like an effect.
//!
//! If a bound is removed, its parameter p displaces the poses along ∂r/∂p. If the i-th of the
//! active constraints with rows A is removed, the unknowns move along A⁺eᵢ and the poses along J
//! A⁺eᵢ. Along the directions that A leaves free the unknowns are fitted, so units do not matter.
//! Rows that depend linearly on others are removed together. The priors state how wrong a limit may
//! be: a removed bound by the σ of its parameter.

use crate::select::settings::MAX_PLAUSIBLE;
use nalgebra::DMatrix;

use super::block::Design;
use super::candidate::Candidate;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use super::marginal::Coefficients;
use crate::select::fitted::Fitted;
use crate::select::neighbourhood::Linearised;

/// Smallest singular value of the constraint rows at which the rows are independent.
const MIN_SINGULAR_VALUE: f64 = 1e-9;

/// Returns the hypotheses that a limit (bound or constraint) is wrong, one for each limit that is
/// active in the fit `fitted`. The column of each is the derivative of the residual, from
/// `linearised`, along the direction of the parameters that is free without that limit. Evidence is
/// evaluated on the first `evidence_poses` poses. Together the hypotheses have the prior
/// probability exp(`ln_family`).
pub(super) fn limits(
    fitted: &Fitted,
    linearised: &Linearised,
    evidence_poses: usize,
    ln_family: f64,
) -> Vec<Candidate> {
    let found = &fitted.found;
    let is_at_bound = |&k: &usize| {
        found.estimates[k].at_bound.is_some() && found.unknowns.contains(&found.estimates[k].name)
    };
    let at_bound: Vec<usize> = (0..found.estimates.len()).filter(is_at_bound).collect();
    let count = at_bound.len() + fitted.active.nrows();
    if count == 0 {
        return Vec::new();
    }
    let ln_prior = ln_family - (count as f64).ln();
    let candidate = |words: String, k: usize, columns: DMatrix<f64>, largest: f64| {
        let site = fitted.model.parameters[k].site;
        let length =
            columns.rows(0, 3 * evidence_poses).norm() / ((3 * evidence_poses) as f64).sqrt();
        let coefficients =
            Coefficients { largest: vec![largest * length], ..Coefficients::default() };
        let hypothesis =
            Hypothesis::new(HypothesisKind::Limit(words), Site::of(site), None, Vec::new());
        let design = Design::Dense(columns).scaled(evidence_poses)?;
        Some(Candidate { hypothesis, variant: 0, design, ln_prior, coefficients })
    };
    let freed = linearised.of_parameters(&fitted.model, &at_bound, &found.x);
    let sigma_of = |k: usize| fitted.model.parameters[k].sigma;
    let bounds = at_bound.iter().enumerate().filter_map(|(j, &k)| {
        let largest = sigma_of(k).map_or(f64::INFINITY, |sigma| MAX_PLAUSIBLE * sigma);
        candidate(
            format!("of {}", found.estimates[k].name),
            k,
            freed.columns(j, 1).into_owned(),
            largest,
        )
    });
    let fitted_columns = linearised.fitted().columns(0, fitted.unknowns.len()).into_owned();
    let active = &fitted.active;
    // A matrix without rows has no singular value decomposition.
    let decomposed = Some(active).filter(|active| !active.is_empty()).cloned();
    let directions = decomposed.and_then(|active| active.pseudo_inverse(MIN_SINGULAR_VALUE).ok());
    let directions = directions.unwrap_or_default();
    let constraints =
        found.active_constraints.iter().zip(directions.column_iter()).zip(active.row_iter());
    let constraints = constraints.filter_map(|((constraint, along), row)| {
        let first = row.iter().position(|coefficient| *coefficient != 0.0)?;
        let variance = |(&a, &k): (&f64, &usize)| {
            if a == 0.0 { Some(0.0) } else { sigma_of(k).map(|sigma| (a * sigma).powi(2)) }
        };
        let variance: Option<f64> = row.iter().zip(&fitted.unknowns).map(variance).sum();
        let largest = variance.map_or(f64::INFINITY, |variance| MAX_PLAUSIBLE * variance.sqrt());
        candidate(
            constraint.words.clone(),
            fitted.unknowns[first],
            DMatrix::from_columns(&[&fitted_columns * along]),
            largest,
        )
    });
    bounds.chain(constraints).collect()
}

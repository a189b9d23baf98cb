//! Uncertainty that a bound hides: unknowns that follow another one, which rests on a bound.
//!
//! If the data hardly determine a combination of unknowns, a bound on one of them seems to
//! determine the others. These have small standard errors if that unknown is held at its bound, but
//! the bound only limits it to one side. Along the valley of the cost, x + s u, the unknown lies
//! inside its bound by u ≥ 0, and the posterior of u is
//!
//! p(u) ∝ exp(−μ u − ½ h u²) on 0 ≤ u ≤ w
//!
//! with the multiplier μ of the bound, the curvature h of the cost along the valley, and the width
//! w after which the valley meets another bound. E u² s sᵀ is added to the covariance of the
//! unknowns.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::stage::Stage;
use crate::least_squares::Triangle;
use crate::least_squares::solver::AtBound;

/// Smallest ratio of two deviations of an unknown at which the bound of another unknown hides its
/// uncertainty. They are its deviation along the valley, and its standard error with the other
/// unknown held at the bound. At 3, the valley has nine tenths of the variance.
const MIN_HIDDEN_RATIO: f64 = 3.0;
/// Factor on the rows that hold combinations constant, so large that data and priors hardly change
/// these combinations.
const CONSTRAINT_WEIGHT: f64 = 1e5;
/// Largest −ln of the posterior density of the distance u from the bound (μ u + ½ h u², see the
/// module) up to which it is integrated; beyond it, the density is negligible.
const MAX_EXPONENT: f64 = 40.0;
/// Number of intervals of the quadrature over u; even, for Simpson's rule.
const QUADRATURE_INTERVALS: u32 = 400;

/// Direction in which the cost hardly rises if an unknown moves away from the bound at which it is,
/// with the other unknowns that move along.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct HiddenByBound {
    /// Index of the unknown that is at its bound.
    pub unknown: usize,
    /// Bound (lower or upper) at which the unknown is.
    pub side: AtBound,
    /// Root mean square distance √(E u²) of the unknown from its bound in the posterior \[unit of
    /// x\]; infinite if neither data nor other bounds limit it.
    pub deviation: f64,
    /// Direction s of the valley in all unknowns. Its component of the unknown itself is 1 at a
    /// lower bound, −1 at an upper one.
    pub direction: DVector<f64>,
    /// Indices of the partners: the other unknowns whose uncertainty the bound hides.
    pub partners: Vec<usize>,
}

/// Finds the bounds of a stage that hide the uncertainty of other unknowns.
///
/// `triangle` is the factor R of the weighted data at the full parameter vector `at`, and the rows
/// of `closed` are combinations that are held constant. `held` marks unknowns that are not
/// estimated, `at_bound` those at a bound, whose Lagrange multipliers are `multipliers`. `errors`
/// are the standard errors with every unknown at a bound held there.
pub(in crate::fit) fn hidden_by_bounds(
    stage: &Stage,
    at: &DVector<f64>,
    (triangle, closed): (&DMatrix<f64>, &DMatrix<f64>),
    (held, at_bound): (&[bool], &[Option<AtBound>]),
    multipliers: &[Option<f64>],
    errors: &[f64],
) -> Vec<HiddenByBound> {
    let hidden_by_bound_of = |j: usize| -> Option<HiddenByBound> {
        let (side, multiplier) = (at_bound[j]?, multipliers[j]?);
        let parameters: Vec<_> = stage.parameters().collect();
        if parameters[j].lower >= parameters[j].upper {
            return None;
        }
        let (mut direction, curvature) = valley_direction(stage, (triangle, closed), held, j)?;
        if side == AtBound::Upper {
            direction.neg_mut();
        }
        let room = |k: usize| {
            let (x, s) = (at[stage.unknowns[k]], direction[k]);
            match s.partial_cmp(&0.0) {
                Some(std::cmp::Ordering::Greater) => (parameters[k].upper - x) / s,
                Some(std::cmp::Ordering::Less) => (parameters[k].lower - x) / s,
                _ => f64::INFINITY,
            }
        };
        let width = (0..held.len()).map(room).fold(f64::INFINITY, f64::min).max(0.0);
        let deviation = deviation(multiplier, curvature, width);
        let is_hidden = |k: &usize| {
            let moved = direction[*k].abs() * deviation;
            !held[*k] && errors[*k] > 0.0 && moved > MIN_HIDDEN_RATIO * errors[*k]
        };
        let partners: Vec<usize> = (0..held.len()).filter(is_hidden).collect();
        (!partners.is_empty()).then_some(HiddenByBound {
            unknown: j,
            side,
            deviation,
            direction,
            partners,
        })
    };
    (0..held.len()).filter_map(hidden_by_bound_of).collect()
}

/// Returns the direction s in which the free unknowns follow the unknown `j`, with component 1 for
/// `j` itself, and the curvature h of the cost along it \[1 / unit of x²\]. `None` if the free
/// unknowns are not determined.
///
/// With the columns of the free unknowns first and that of `j` last, \[R r; 0 ρ\] is the factor of
/// data, priors and held combinations: s = −R⁻¹ r and h = ρ².
fn valley_direction(
    stage: &Stage,
    (triangle, closed): (&DMatrix<f64>, &DMatrix<f64>),
    held: &[bool],
    j: usize,
) -> Option<(DVector<f64>, f64)> {
    let columns: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).chain([j]).collect();
    let (rows, priors, n) = (triangle.nrows(), stage.priors(), columns.len());
    let height = rows + priors.nrows() + closed.nrows();
    let mut stack = DMatrix::zeros(height.max(n), n);
    for (place, &k) in columns.iter().enumerate() {
        stack.view_mut((0, place), (rows, 1)).copy_from(&triangle.column(k));
        stack.view_mut((rows, place), (priors.nrows(), 1)).copy_from(&priors.column(k));
        let from = rows + priors.nrows();
        let held_rows = closed.column(k) * CONSTRAINT_WEIGHT;
        stack.view_mut((from, place), (closed.nrows(), 1)).copy_from(&held_rows);
    }
    let factor = Triangle::factor(&stack);
    let last = n - 1;
    let left = factor.view((0, 0), (last, last));
    let right = factor.view((0, last), (last, 1)).column(0).into_owned();
    let response = left.solve_upper_triangular(&right)?;
    let mut direction = DVector::zeros(held.len());
    for (place, &k) in columns[..last].iter().enumerate() {
        direction[k] = -response[place];
    }
    direction[j] = 1.0;
    direction.iter().all(|s| s.is_finite()).then_some((direction, factor[(last, last)].powi(2)))
}

/// Returns √(E u²) of p(u) ∝ exp(−μ u − ½ h u²) on 0 ≤ u ≤ `width`, by Simpson's rule.
fn deviation(multiplier: f64, curvature: f64, width: f64) -> f64 {
    // At this u the exponent reaches its limit: μ u + ½ h u² = MAX_EXPONENT.
    let root = (multiplier * multiplier + 2.0 * curvature * MAX_EXPONENT).sqrt();
    let reach = 2.0 * MAX_EXPONENT / (multiplier + root);
    let end = width.min(reach);
    if !end.is_finite() {
        return f64::INFINITY;
    }
    let step = end / f64::from(QUADRATURE_INTERVALS);
    let (mut total, mut squares) = (0.0, 0.0);
    for k in 0..=QUADRATURE_INTERVALS {
        let u = f64::from(k) * step;
        let weight = match k {
            0 | QUADRATURE_INTERVALS => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let density = weight * (-multiplier * u - 0.5 * curvature * u * u).exp();
        total += density;
        squares += density * u * u;
    }
    (squares / total).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_from_a_bound_follow_the_posterior() {
        // The cases are a uniform, an exponential and a half-normal distribution.
        for (multiplier, curvature, width, expected) in [
            (0.0, 0.0, 3.0, 3.0 / 3.0_f64.sqrt()),
            (2.0, 0.0, f64::INFINITY, 0.5_f64.sqrt()),
            (0.0, 4.0, f64::INFINITY, 0.5),
        ] {
            let found = deviation(multiplier, curvature, width);
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
        assert!(deviation(0.0, 0.0, f64::INFINITY).is_infinite());
    }
}

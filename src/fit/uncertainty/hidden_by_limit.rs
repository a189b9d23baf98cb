//! Uncertainty that a limit hides: unknowns that follow a bound or constraint on which the fit rests.
//!
//! If the data hardly determine a combination of unknowns, a limit on it seems to determine these
//! unknowns. They have small standard errors if the fit is held at the limit, but the limit only
//! restricts it to one side. Along the valley of the cost, x + s u, the limited sum a·x lies inside
//! its limit by u ≥ 0, and the posterior of u is
//!
//! p(u) ∝ exp(−μ u − ½ h u²) on 0 ≤ u ≤ w
//!
//! with the multiplier μ of the limit, the curvature h of the cost along the valley, and the width
//! w after which the valley meets another limit. E u² s sᵀ is added to the covariance of the
//! unknowns.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::active_limits::{ActiveLimit, confine};
use crate::fit::stages::fitting::FitEnd;
use crate::fit::stages::stage::Stage;
use crate::fit::uncertainty::prices::Prices;
use crate::fit::uncertainty::shadow_price::ShadowPrice;
use crate::least_squares::Triangle;
use crate::least_squares::solver::AtBound;

/// Smallest ratio of two deviations of an unknown at which a limit hides its uncertainty. They are
/// its deviation along the valley, and its standard error with the fit held at the limit. At 3, the
/// valley has nine tenths of the variance.
const MIN_HIDDEN_RATIO: f64 = 3.0;
/// Factor on the rows that hold combinations constant, so large that data and priors hardly change
/// these combinations.
const CONSTRAINT_WEIGHT: f64 = 1e5;
/// Largest −ln of the posterior density of the distance u from the bound (μ u + ½ h u², see the
/// module) up to which it is integrated; beyond it, the density is negligible.
const MAX_EXPONENT: f64 = 40.0;
/// Number of intervals of the quadrature over u; even, for Simpson's rule.
const QUADRATURE_INTERVALS: u32 = 400;

/// Bound or constraint on which a fit rests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::fit) enum Limit {
    /// Bound of the unknown with this index.
    Bound(usize),
    /// Constraint with this index among those of the model.
    Constraint(usize),
}

/// Direction in which the cost hardly rises if a limited sum a·x of unknowns moves away from its
/// limit, with the other unknowns that move along.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct HiddenByLimit {
    /// Limit on which the fit rests.
    pub limit: Limit,
    /// Side (lower or upper) of the limit.
    pub side: AtBound,
    /// Root mean square distance √(E u²) of the sum from its limit in the posterior \[unit of the
    /// sum\]; infinite if neither data nor other limits restrict it.
    pub deviation: f64,
    /// Direction s of the valley in all unknowns. The sum changes by 1 along it at a lower limit,
    /// by −1 at an upper one.
    pub direction: DVector<f64>,
    /// Indices of the unknowns whose uncertainty the limit hides; without the unknown of a bound.
    pub partners: Vec<usize>,
}

/// Limit of a stage with what a valley from it depends on.
struct AtLimit {
    limit: Limit,
    side: AtBound,
    /// Lagrange multiplier μ of the limit, at least 0.
    multiplier: f64,
    /// Distance from the opposite limit of the same sum, in its unit.
    width: f64,
    /// Coefficients a of the limited sum, one per unknown.
    row: DVector<f64>,
    /// Marks the unknowns that are not estimated, apart from one in the limited sum.
    held: Vec<bool>,
    /// Combinations that are held constant besides, shape = (combinations, unknowns).
    closed: DMatrix<f64>,
}

/// Returns the limits on which a stage rests at `end`, apart from equalities. `triangle` is the
/// factor R of the weighted data, and the rows of `closed` are combinations that are held constant
/// together with the unknowns that are `held`.
fn limits_at(
    stage: &Stage,
    end: &FitEnd,
    triangle: &DMatrix<f64>,
    (closed, held): (&DMatrix<f64>, &[bool]),
    (constraints, prices): (&[ActiveLimit], &Prices),
) -> Vec<AtLimit> {
    let parameters: Vec<_> = stage.parameters().collect();
    let n = held.len();
    let bound = |j: usize| {
        let (side, price) = (end.at_bound[j]?, prices.bounds[j]?);
        Some(AtLimit {
            limit: Limit::Bound(j),
            side,
            multiplier: price.multiplier,
            width: parameters[j].upper - parameters[j].lower,
            row: DVector::from_fn(n, |k, _| if k == j { 1.0 } else { 0.0 }),
            held: held.to_vec(),
            closed: closed.clone(),
        })
    };
    let constraint = |(i, price): (usize, &ShadowPrice)| {
        let others = [&constraints[..i], &constraints[i + 1..]].concat();
        let mut held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        let closed = confine(triangle, &end.gauge.rows, &others, &mut held);
        let active = &constraints[i];
        let sum = &stage.model.constraints[active.constraint];
        AtLimit {
            limit: Limit::Constraint(active.constraint),
            side: active.side,
            multiplier: price.multiplier,
            width: sum.upper - sum.lower,
            row: DVector::from_vec(active.row.clone()),
            held,
            closed,
        }
    };
    (0..n)
        .filter_map(bound)
        .chain(prices.constraints.iter().enumerate().map(constraint))
        .filter(|found| found.width > 0.0)
        .collect()
}

/// Finds the limits of a stage that hide the uncertainty of unknowns; arguments as of
/// [`limits_at`]. `errors` are the standard errors with the fit held at every limit on which it
/// rests.
pub(in crate::fit) fn hidden_by_limits(
    stage: &Stage,
    end: &FitEnd,
    triangle: &DMatrix<f64>,
    kept: (&DMatrix<f64>, &[bool]),
    active: (&[ActiveLimit], &Prices),
    errors: &[f64],
) -> Vec<HiddenByLimit> {
    let parameters: Vec<_> = stage.parameters().collect();
    let hidden_by = |found: AtLimit| -> Option<HiddenByLimit> {
        let (mut direction, curvature) = valley_direction(stage, triangle, &found)?;
        if found.side == AtBound::Upper {
            direction.neg_mut();
        }
        let room = |k: usize| {
            let (x, s) = (end.x[stage.unknowns[k]], direction[k]);
            match s.partial_cmp(&0.0) {
                Some(std::cmp::Ordering::Greater) => (parameters[k].upper - x) / s,
                Some(std::cmp::Ordering::Less) => (parameters[k].lower - x) / s,
                _ => f64::INFINITY,
            }
        };
        let width = (0..errors.len()).map(room).fold(found.width, f64::min).max(0.0);
        let deviation = deviation(found.multiplier, curvature, width);
        let is_hidden = |k: &usize| {
            let moved = direction[*k].abs() * deviation;
            !found.held[*k] && errors[*k] > 0.0 && moved > MIN_HIDDEN_RATIO * errors[*k]
        };
        let partners: Vec<usize> = (0..errors.len()).filter(is_hidden).collect();
        let AtLimit { limit, side, .. } = found;
        (!partners.is_empty()).then_some(HiddenByLimit {
            limit,
            side,
            deviation,
            direction,
            partners,
        })
    };
    limits_at(stage, end, triangle, kept, active).into_iter().filter_map(hidden_by).collect()
}

/// Returns the direction s in which the unknowns follow a limited sum a·x, with a·s = 1, and the
/// curvature h of the cost along it \[1 / unit of the sum²\]. `None` if the other unknowns are not
/// determined.
///
/// The sum takes the place of its unknown with the largest coefficient. With the columns of the
/// other unknowns first and that of the sum last, \[R r; 0 ρ\] is the factor of data, priors and
/// held combinations: s = −R⁻¹ r and h = ρ².
fn valley_direction(
    stage: &Stage,
    triangle: &DMatrix<f64>,
    AtLimit { limit, row, held, closed, .. }: &AtLimit,
) -> Option<(DVector<f64>, f64)> {
    let is_open = |k: &usize| !held[*k] || *limit == Limit::Bound(*k);
    let replaced = (0..held.len()).filter(is_open).max_by(|&k, &l| {
        let size = |k: usize| row[k].abs() * triangle.column(k).norm().recip().min(f64::MAX);
        size(k).total_cmp(&size(l))
    })?;
    let others: Vec<usize> = (0..held.len()).filter(|k| !held[*k] && *k != replaced).collect();
    let (rows, priors, n) = (triangle.nrows(), stage.priors(), others.len() + 1);
    let height = rows + priors.nrows() + closed.nrows();
    let whole = |k: usize| {
        let mut column = DVector::zeros(height.max(n));
        column.rows_mut(0, rows).copy_from(&triangle.column(k));
        column.rows_mut(rows, priors.nrows()).copy_from(&priors.column(k));
        let held_rows = closed.column(k) * CONSTRAINT_WEIGHT;
        column.rows_mut(rows + priors.nrows(), closed.nrows()).copy_from(&held_rows);
        column
    };
    let of_sum = whole(replaced) / row[replaced];
    let mut stack = DMatrix::zeros(height.max(n), n);
    for (place, &k) in others.iter().enumerate() {
        stack.set_column(place, &(whole(k) - &of_sum * row[k]));
    }
    stack.set_column(n - 1, &of_sum);
    let factor = Triangle::factor(&stack);
    let last = n - 1;
    let left = factor.view((0, 0), (last, last));
    let right = factor.view((0, last), (last, 1)).column(0).into_owned();
    let response = left.solve_upper_triangular(&right)?;
    let mut direction = DVector::zeros(held.len());
    for (place, &k) in others.iter().enumerate() {
        direction[k] = -response[place];
    }
    direction[replaced] = (1.0 - row.dot(&direction)) / row[replaced];
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

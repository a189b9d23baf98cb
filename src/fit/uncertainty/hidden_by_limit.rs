//! Uncertainty that limits hide: unknowns that follow bounds and constraints on which the fit
//! rests.
//!
//! If the data hardly determine some combinations of unknowns, limits on them seem to determine
//! these unknowns. They have small standard errors if the fit is held at the limits, but a limit
//! only restricts it to one side. If the distances u of the limited sums from their limits grow,
//! the other unknowns follow along the valley of the cost, x + S u, and the posterior of u is
//!
//! p(u) ∝ exp(−μᵀu − ½ uᵀ H u) on 0 ≤ u ≤ w
//!
//! with the multipliers μ of the limits, the curvature H of the cost along the valley, and the
//! widths w after which the sums meet their opposite limits; x + S u keeps all bounds. S E(u uᵀ) Sᵀ
//! is added to the covariance of the unknowns. The moments are those of a Markov chain that draws u
//! along one line after another: along each distance and along each principal axis of H.

use nalgebra::{DMatrix, DVector, Matrix, SymmetricEigen};
use rand::RngExt as _;

use crate::fit::stages::active_limits::{ActiveLimit, confine};
use crate::fit::stages::fitting::FitEnd;
use crate::fit::stages::stage::Stage;
use crate::fit::uncertainty::prices::Prices;
use crate::least_squares::Triangle;
use crate::least_squares::solver::AtBound;
use crate::random;

/// Smallest ratio of two deviations of an unknown at which limits hide its uncertainty. They are
/// its deviation along the valley, and its standard error with the fit held at the limits. At 3,
/// the valley has nine tenths of the variance.
const MIN_HIDDEN_RATIO: f64 = 3.0;
/// Smallest ratio of the motion of a hidden unknown by one limit to that by the limit that moves it
/// most, at which it is a partner of the limit.
const MIN_PARTNER_RATIO: f64 = 0.5;
/// Factor on the rows that hold combinations constant, so large that data and priors hardly change
/// these combinations.
const CONSTRAINT_WEIGHT: f64 = 1e5;
/// Smallest coefficient of a limited sum, relative to its largest one, that is more than rounding
/// if the sums before it are known.
const MIN_COEFFICIENT: f64 = 1e-9;
/// Largest −ln of the density along a line, relative to its highest value, up to which it is drawn
/// from; beyond it, the density is negligible.
const MAX_EXPONENT: f64 = 20.0;
/// Number of intervals of a line in each of which the density is linear.
const INTERVALS: u32 = 100;
/// Longest line, as a multiple of the lengths over which the distances alone vary, at which limits
/// restrict the distances.
const MAX_REACH: f64 = 1e6;
/// Number of rounds of the chain, each along all lines, without those at its beginning.
const ROUNDS: u32 = 2000;
const FIRST_ROUNDS: u32 = 100;

/// Bound or constraint on which a fit rests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::fit) enum Limit {
    /// Bound of the unknown with this index.
    Bound(usize),
    /// Constraint with this index among those of the model.
    Constraint(usize),
}

/// Limit that hides the uncertainty of unknowns, which move if its sum moves away from it.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct HiddenByLimit {
    /// Limit on which the fit rests.
    pub limit: Limit,
    /// Side (lower or upper) of the limit.
    pub side: AtBound,
    /// Root mean square distance √(E u²) of the sum from its limit in the posterior \[unit of the
    /// sum\]; infinite if neither data nor other limits restrict it.
    pub deviation: f64,
    /// Change of all unknowns per distance of the sum from its limit.
    pub direction: DVector<f64>,
    /// Indices of the unknowns whose uncertainty the limit hides; without the unknown of a bound.
    pub partners: Vec<usize>,
}

/// Limit of a stage that is released.
struct Released {
    limit: Limit,
    side: AtBound,
    /// Lagrange multiplier μ of the limit, at least 0.
    multiplier: f64,
    /// Distance from the opposite limit of the same sum, in its unit.
    width: f64,
    /// Coefficients of the distance from the limit, one per unknown.
    row: DVector<f64>,
}

/// Returns the limits on which a stage rests at `end`, apart from equalities, and the constraints
/// that are equalities.
fn limits_at(
    stage: &Stage,
    end: &FitEnd,
    (constraints, prices): (&[ActiveLimit], &Prices),
) -> (Vec<Released>, Vec<ActiveLimit>) {
    let n = end.at_bound.len();
    let of = |limit, side, multiplier, width: f64, row: DVector<f64>| {
        let row = if side == AtBound::Upper { -row } else { row };
        (width > 0.0).then_some(Released { limit, side, multiplier, width, row })
    };
    let bounds = stage.parameters().enumerate().filter_map(|(j, parameter)| {
        let (side, price) = (end.at_bound[j]?, prices.bounds[j]?);
        let row = DVector::from_fn(n, |k, _| if k == j { 1.0 } else { 0.0 });
        of(Limit::Bound(j), side, price.multiplier, parameter.upper - parameter.lower, row)
    });
    let mut released: Vec<Released> = bounds.collect();
    let mut equalities = Vec::new();
    for (active, price) in constraints.iter().zip(&prices.constraints) {
        let sum = &stage.model.constraints[active.constraint];
        let limit = Limit::Constraint(active.constraint);
        let row = DVector::from_column_slice(&active.row);
        match of(limit, active.side, price.multiplier, sum.upper - sum.lower, row) {
            Some(found) => released.push(found),
            None => equalities.push(active.clone()),
        }
    }
    (released, equalities)
}

/// Finds the limits of a stage that hide the uncertainty of unknowns, and the covariance that they
/// hide, shape = (unknowns, unknowns). `triangle` is the factor R of the weighted data, and
/// `errors` are the standard errors with the fit held at every limit on which it rests.
pub(in crate::fit) fn hidden_by_limits(
    stage: &Stage,
    end: &FitEnd,
    triangle: &DMatrix<f64>,
    active: (&[ActiveLimit], &Prices),
    errors: &[f64],
) -> (Vec<HiddenByLimit>, DMatrix<f64>) {
    let n = errors.len();
    let nothing = || (Vec::new(), DMatrix::zeros(n, n));
    let (mut released, equalities) = limits_at(stage, end, active);
    let Some(Valley { directions, curvature, kept }) =
        valley(stage, end, triangle, &mut released, &equalities)
    else {
        return nothing();
    };
    let parameters: Vec<_> = stage.parameters().collect();
    let room = |k: usize| {
        let x = end.x[stage.unknowns[k]];
        let row = directions.row(k).transpose();
        let [lowest, highest] = [parameters[k].lower - x, parameters[k].upper - x];
        // An unknown that rests on its bound is a distance itself; one whose error is larger than
        // its range may follow in another way.
        let is_wall = end.at_bound[k].is_none() && errors[k] < highest - lowest;
        (is_wall && row.amax() > 0.0).then_some((row, lowest, highest))
    };
    let room = (0..n).filter_map(room);
    let distance = |(i, found): (usize, &Released)| {
        let row = DVector::from_fn(kept, |k, _| if k == i { 1.0 } else { 0.0 });
        (row, 0.0, found.width)
    };
    let walls: Vec<Wall> = released.iter().enumerate().map(distance).chain(room).collect();
    let multipliers = DVector::from_iterator(kept, released.iter().map(|found| found.multiplier));
    let (moments, is_open) = moments(&multipliers, &curvature, &walls);
    let covariance = &directions * &moments * directions.transpose();
    let deviations: Vec<f64> = (0..kept)
        .map(|i| if is_open[i] { f64::INFINITY } else { moments[(i, i)].max(0.0).sqrt() })
        .collect();
    let motion = |i: usize, k: usize| match directions[(k, i)].abs() {
        s if s > 0.0 => s * deviations[i],
        _ => 0.0,
    };
    let largest = |k: usize| (0..kept).map(|i| motion(i, k)).fold(0.0, f64::max);
    let is_hidden = |k: &usize| {
        let moved = if largest(*k).is_finite() { covariance[(*k, *k)].sqrt() } else { largest(*k) };
        errors[*k] > 0.0 && moved > MIN_HIDDEN_RATIO * errors[*k]
    };
    let partners: Vec<usize> = (0..n).filter(is_hidden).collect();
    if partners.is_empty() {
        return nothing();
    }
    let hidden = released.iter().enumerate().filter_map(|(i, found)| {
        let is_moved = |k: &&usize| motion(i, **k) >= MIN_PARTNER_RATIO * largest(**k);
        let partners: Vec<usize> = partners.iter().filter(is_moved).copied().collect();
        (!partners.is_empty()).then(|| HiddenByLimit {
            limit: found.limit,
            side: found.side,
            deviation: deviations[i],
            direction: directions.column(i).into_owned(),
            partners,
        })
    });
    (hidden.collect(), covariance)
}

/// Valley of the cost in which the unknowns follow the distances from limits.
struct Valley {
    /// Change S of the unknowns per distance, shape = (unknowns, distances).
    directions: DMatrix<f64>,
    /// Curvature H of the cost \[1 / product of the distances' units\].
    curvature: DMatrix<f64>,
    /// Number of distances.
    kept: usize,
}

/// Returns the valley of the limits that are `released`, from which those are removed that the
/// others decide; `None` without limits, or if the other unknowns are not determined.
///
/// Each distance takes the place of an unknown of its sum. With the columns of the other unknowns
/// first and those of the distances last, \[R Q; 0 P\] is the factor of data, priors and held
/// combinations: the others follow by −R⁻¹ Q, and H = PᵀP.
fn valley(
    stage: &Stage,
    end: &FitEnd,
    triangle: &DMatrix<f64>,
    released: &mut Vec<Released>,
    equalities: &[ActiveLimit],
) -> Option<Valley> {
    let n = end.at_bound.len();
    let is_released = |j: usize| released.iter().any(|found| found.limit == Limit::Bound(j));
    let mut held: Vec<bool> =
        (0..n).map(|j| end.at_bound[j].is_some() && !is_released(j)).collect();
    let closed = confine(triangle, &end.gauge.rows, equalities, &mut held);
    let replaced = replaced_unknowns(triangle, released, &held);
    let m = replaced.len();
    let others: Vec<usize> = (0..n).filter(|k| !held[*k] && !replaced.contains(k)).collect();
    let (rows, priors) = (triangle.nrows(), stage.priors());
    let above = rows + priors.nrows() + closed.nrows();
    let columns = |which: &[usize]| {
        let mut whole = DMatrix::zeros(above + n, which.len());
        for (mut column, &k) in whole.column_iter_mut().zip(which) {
            column.rows_mut(0, rows).copy_from(&triangle.column(k));
            column.rows_mut(rows, priors.nrows()).copy_from(&priors.column(k));
            let held_rows = closed.column(k) * CONSTRAINT_WEIGHT;
            column.rows_mut(rows + priors.nrows(), closed.nrows()).copy_from(&held_rows);
        }
        whole
    };
    let coefficients =
        |which: &[usize]| DMatrix::from_fn(m, which.len(), |i, k| released[i].row[which[k]]);
    let inverse = coefficients(&replaced).try_inverse().filter(|_| m > 0)?;
    let of_others = coefficients(&others);
    let of_distances = columns(&replaced) * &inverse;
    let mut stack = columns(&others) - &of_distances * &of_others;
    // Bounds decide how far unknowns move that only follow together.
    let parameters: Vec<_> = stage.parameters().collect();
    for (place, &k) in others.iter().enumerate() {
        stack[(above + place, place)] = (parameters[k].upper - parameters[k].lower).recip();
    }
    let first = others.len();
    stack = stack.insert_columns(first, m, 0.0);
    stack.columns_mut(first, m).copy_from(&of_distances);
    let factor = Triangle::factor(&stack);
    let response = -factor
        .view((0, 0), (first, first))
        .solve_upper_triangular(&factor.view((0, first), (first, m)))?;
    let mut directions = DMatrix::zeros(n, m);
    for (&k, row) in others.iter().zip(response.row_iter()) {
        directions.set_row(k, &row);
    }
    let moved = inverse * (DMatrix::identity(m, m) - of_others * response);
    for (&k, row) in replaced.iter().zip(moved.row_iter()) {
        directions.set_row(k, &row);
    }
    let along = factor.view((first, first), (m, m));
    let curvature = along.tr_mul(&along);
    let is_finite = directions.iter().chain(curvature.iter()).all(|value| value.is_finite());
    is_finite.then_some(Valley { directions, curvature, kept: m })
}

/// Returns the unknown of each sum whose place its distance takes, in the order of the limits:
/// those that the data determine least. Limits that the ones before decide are removed.
fn replaced_unknowns(
    triangle: &DMatrix<f64>,
    released: &mut Vec<Released>,
    held: &[bool],
) -> Vec<usize> {
    let mut replaced: Vec<usize> = Vec::new();
    let mut reduced: Vec<DVector<f64>> = Vec::new();
    released.retain(|found| {
        let mut row = found.row.clone();
        for (&k, before) in replaced.iter().zip(&reduced) {
            let factor = row[k] / before[k];
            row.axpy(-factor, before, 1.0);
            row[k] = 0.0;
        }
        let size = |k: usize| row[k].abs() * triangle.column(k).norm().recip().min(f64::MAX);
        let least = MIN_COEFFICIENT * found.row.amax();
        let is_open = |k: &usize| !held[*k] && row[*k].abs() > least;
        let place = (0..held.len()).filter(is_open).max_by(|&k, &l| size(k).total_cmp(&size(l)));
        replaced.extend(place);
        reduced.extend(place.map(|_| row));
        place.is_some()
    });
    replaced
}

/// Sum of distances (its coefficients) with the lowest and the highest value that it may have.
type Wall = (DVector<f64>, f64, f64);

/// Returns E(u uᵀ) of p(u) ∝ exp(−μᵀu − ½ uᵀ H u) between the `walls`, the first of which are those
/// of the distances themselves, and marks the distances that nothing restricts. Such a distance is
/// held at 0.
fn moments(
    multipliers: &DVector<f64>,
    curvature: &DMatrix<f64>,
    walls: &[Wall],
) -> (DMatrix<f64>, Vec<bool>) {
    let n = multipliers.len();
    // Distances are in units of the length over which each varies by itself.
    let unit = |i: usize| reach(multipliers[i], curvature[(i, i)]).min(walls[i].2);
    let units: Vec<f64> = (0..n).map(unit).collect();
    let mut is_open: Vec<bool> = units.iter().map(|unit| !unit.is_finite()).collect();
    loop {
        let kept: Vec<usize> = (0..n).filter(|&i| !is_open[i]).collect();
        let scale = DVector::from_iterator(kept.len(), kept.iter().map(|&i| units[i]));
        let scaled = |of: &DVector<f64>| of.select_rows(&kept).component_mul(&scale);
        let square = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            scale[i] * curvature[(kept[i], kept[j])] * scale[j]
        });
        let walls: Vec<Wall> =
            walls.iter().map(|(row, low, high)| (scaled(row), *low, *high)).collect();
        match sampled(&scaled(multipliers), &square, &walls) {
            Ok(found) => {
                let mut moments = DMatrix::zeros(n, n);
                for ((i, k), value) in (0..kept.len())
                    .flat_map(|k| (0..kept.len()).map(move |i| (i, k)))
                    .zip(found.iter())
                {
                    moments[(kept[i], kept[k])] = scale[i] * value * scale[k];
                }
                return (moments, is_open);
            }
            Err(line) => {
                let least = 0.5 * line.amax();
                for (&i, part) in kept.iter().zip(line.iter()) {
                    is_open[i] |= part.abs() >= least;
                }
            }
        }
    }
}

/// Returns E(u uᵀ) as [`moments`] does.
///
/// # Errors
/// Returns a line along which nothing restricts the distances.
fn sampled(
    slope: &DVector<f64>,
    curvature: &DMatrix<f64>,
    walls: &[Wall],
) -> Result<DMatrix<f64>, DVector<f64>> {
    let n = slope.len();
    if n == 0 {
        return Ok(DMatrix::zeros(0, 0));
    }
    let axes = SymmetricEigen::new(curvature.clone()).eigenvectors;
    let mut lines: Vec<DVector<f64>> =
        DMatrix::<f64>::identity(n, n).column_iter().map(Matrix::into_owned).collect();
    if n > 1 {
        lines.extend(axes.column_iter().map(Matrix::into_owned));
    }
    let curved: Vec<DVector<f64>> = lines.iter().map(|line| curvature * line).collect();
    let crossing: Vec<DVector<f64>> = lines
        .iter()
        .map(|line| DVector::from_iterator(walls.len(), walls.iter().map(|wall| wall.0.dot(line))))
        .collect();
    let mut random = random::stream(0, 0);
    let (mut u, mut gradient) = (DVector::zeros(n), slope.clone());
    let mut at = DVector::zeros(walls.len());
    let mut moments = DMatrix::zeros(n, n);
    for round in 0..FIRST_ROUNDS + ROUNDS {
        for ((line, curved), crossing) in lines.iter().zip(&curved).zip(&crossing) {
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for ((value, rate), (_, lowest, highest)) in at.iter().zip(crossing).zip(walls) {
                let ends = [(lowest - value) / rate, (highest - value) / rate];
                if *rate > 0.0 {
                    (low, high) = (low.max(ends[0]), high.min(ends[1]));
                } else if *rate < 0.0 {
                    (low, high) = (low.max(ends[1]), high.min(ends[0]));
                }
            }
            let shape = (gradient.dot(line), line.dot(curved));
            let range = (low.min(0.0), high.max(0.0));
            let step = drawn(shape, range, random.random()).ok_or_else(|| line.clone())?;
            u.axpy(step, line, 1.0);
            gradient.axpy(step, curved, 1.0);
            at.axpy(step, crossing, 1.0);
        }
        if round >= FIRST_ROUNDS {
            moments.ger(f64::from(ROUNDS).recip(), &u, &u, 1.0);
        }
    }
    Ok(moments)
}

/// Returns the t at which s t + ½ c t² is [`MAX_EXPONENT`], with a slope s ≥ 0 and a curvature c ≥
/// 0.
fn reach(slope: f64, curvature: f64) -> f64 {
    2.0 * MAX_EXPONENT / (slope + (slope * slope + 2.0 * curvature * MAX_EXPONENT).sqrt())
}

/// Returns the number t in a range around 0 at which the distribution with the density ∝ exp(−s t −
/// ½ c t²) has the value `share`, 0 to 1. Returns `None` if neither density nor range restricts t.
fn drawn((slope, curvature): (f64, f64), (low, high): (f64, f64), share: f64) -> Option<f64> {
    let curvature = curvature.max(0.0);
    let peak = match slope {
        _ if curvature > 0.0 => (-slope / curvature).clamp(low, high),
        s if s > 0.0 => low,
        s if s < 0.0 => high,
        _ => 0.0,
    };
    let at_peak = slope + curvature * peak;
    let from = low.max(peak - reach((-at_peak).max(0.0), curvature));
    let to = high.min(peak + reach(at_peak.max(0.0), curvature));
    let length = Some(to - from).filter(|length| *length < MAX_REACH)?;
    let step = length / f64::from(INTERVALS);
    let density = |k: u32| {
        let d = from + f64::from(k) * step - peak;
        (-at_peak * d - 0.5 * curvature * d * d).exp()
    };
    let sums: Vec<f64> = (0..INTERVALS)
        .scan(0.0, |sum, k| {
            *sum += density(k) + density(k + 1);
            Some(*sum)
        })
        .collect();
    let wanted = share * sums.last()?;
    let k = sums.partition_point(|sum| *sum < wanted).min(sums.len() - 1);
    let before = k.checked_sub(1).and_then(|k| sums.get(k)).copied().unwrap_or(0.0);
    let part = (wanted - before) / (sums.get(k)? - before);
    let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
    Some((from + (k as f64 + part) * step).clamp(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(multipliers: &[f64], curvature: &[f64], widths: &[f64]) -> (DMatrix<f64>, Vec<bool>) {
        let n = multipliers.len();
        let wall = |(i, width): (usize, &f64)| {
            (DVector::from_fn(n, |k, _| if k == i { 1.0 } else { 0.0 }), 0.0, *width)
        };
        let walls: Vec<Wall> = widths.iter().enumerate().map(wall).collect();
        let curvature = DMatrix::from_row_slice(n, n, curvature);
        moments(&DVector::from_column_slice(multipliers), &curvature, &walls)
    }

    #[test]
    fn deviations_from_a_bound_follow_the_posterior() {
        // The cases are a uniform, an exponential and a half-normal distribution.
        for (multiplier, curvature, width, expected) in
            [(0.0, 0.0, 3.0, 3.0), (2.0, 0.0, f64::INFINITY, 0.5), (0.0, 4.0, f64::INFINITY, 0.25)]
        {
            let found = of(&[multiplier], &[curvature], &[width]).0[(0, 0)];
            assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
        }
        assert!(of(&[0.0], &[0.0], &[f64::INFINITY]).1[0]);
    }

    #[test]
    fn bounds_that_meet_in_a_corner_are_left_along_the_weak_direction() {
        // The data determine the sum of the distances' difference alone: u moves along its
        // diagonal.
        let (found, _) = of(&[1.0, 1.0], &[1e6, -1e6, -1e6, 1e6], &[1.0, 1.0]);
        // Along the diagonal the density is exp(−2 t) on 0 to 1.
        let expected = {
            let e = (-2.0_f64).exp();
            (0.5 * (1.0 - e) - e - e) / (1.0 - e)
        };
        for k in 0..4 {
            assert!((found[k] / expected - 1.0).abs() < 0.1, "{found} {expected}");
        }
    }
}

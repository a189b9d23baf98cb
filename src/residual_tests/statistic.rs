//! Statistics of studentised residuals: order and dependence on covariates.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::fit_residual::FitResidual;
use super::outcome::{Sequence, Untestable};

/// Minimum number of poses for tests of order and of dependence.
const MIN_POSES: usize = 5;
/// Maximum number of lags of the autocorrelation [Hyndman and Athanasopoulos 2018, section 5.4].
const MAX_LAGS: usize = 10;
/// Number of poses that the longest session needs for each lag of the autocorrelation [ibid.].
const POSES_PER_LAG: usize = 5;
/// Largest range of a constant covariate, relative to its largest absolute value: rounding errors.
const MAX_CONSTANT_RANGE: f64 = 1e-12;

/// Studentised residuals of L draws side by side, each with its mean subtracted.
#[derive(Debug)]
pub(super) struct Sample<const L: usize> {
    /// Centred residual y of each pose, with Σ y = 0: coordinate by coordinate the values of all
    /// draws.
    centred: Vec<[[f64; L]; 3]>,
    /// Sum of outer products Σ y yᵀ of each draw.
    squares: [Matrix3<f64>; L],
}

impl<const L: usize> Sample<L> {
    /// Centres the studentised residuals of each draw.
    pub fn of(draws: [&[[f64; 3]]; L]) -> Self {
        let poses = draws.first().map_or(0, |values| values.len());
        let mut centred = vec![[[0.0; L]; 3]; poses];
        let mut squares = [Matrix3::zeros(); L];
        for (l, values) in draws.into_iter().enumerate() {
            let mean = values.iter().copied().map(Vector3::from).sum::<Vector3<f64>>()
                / values.len().max(1) as f64;
            for (target, value) in centred.iter_mut().zip(values) {
                let value = Vector3::from(*value) - mean;
                squares[l] += value * value.transpose();
                (0..3).for_each(|k| target[k][l] = value[k]);
            }
        }
        Self { centred, squares }
    }
}

/// Returns the scalar product of the residuals of two poses, for each draw.
#[inline]
fn dot<const L: usize>(a: &[[f64; L]; 3], b: &[[f64; L]; 3]) -> [f64; L] {
    std::array::from_fn(|l| a[0][l] * b[0][l] + a[1][l] * b[1][l] + a[2][l] * b[2][l])
}

/// Statistic that grows with one kind of structure in the residuals. It does not depend on their
/// unit.
#[derive(Debug)]
pub(super) enum Statistic {
    /// Fraction of the steps from pose to pose at which a coordinate keeps its sign.
    Runs(Arc<Order>),
    /// Ljung and Box's Q of the autocorrelation.
    LjungBox(Arc<Order>),
    /// Squared distance correlation with a covariate.
    Dependence(Cumulative),
}

impl Statistic {
    /// Returns the value of the statistic for each draw.
    pub fn evaluate<const L: usize>(&self, sample: &Sample<L>) -> [f64; L] {
        match self {
            Self::Runs(order) => order.kept_signs(sample),
            Self::LjungBox(order) => order.ljung_box(sample),
            Self::Dependence(cumulative) => cumulative.correlation(sample),
        }
    }
}

/// Indices of the poses of each session in a certain order. Poses of different sessions are not
/// compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Order {
    sessions: Vec<Vec<usize>>,
    /// Number of lags of the autocorrelation, 1…10.
    lags: usize,
}

/// Returns the orders of the poses `kept` for the tests: by time if it was measured, and by rows if
/// that differs. The indices in an order count the kept poses from 0.
pub(super) fn sequences(
    fit: &FitResidual,
    kept: &[usize],
) -> Vec<(Sequence, Result<Order, Untestable>)> {
    let by_rows = Order::of(fit, kept);
    if fit.time.is_empty() {
        return vec![(Sequence::Rows, by_rows)];
    }
    if !kept.iter().all(|&pose| fit.time[pose].is_finite()) {
        return vec![(Sequence::Time, Err(Untestable::NotFinite)), (Sequence::Rows, by_rows)];
    }
    let by_time = by_rows.clone().map(|mut order| {
        for session in &mut order.sessions {
            session.sort_by(|&a, &b| fit.time[kept[a]].total_cmp(&fit.time[kept[b]]));
        }
        order
    });
    let same = by_rows == by_time;
    let mut sequences = vec![(Sequence::Time, by_time)];
    if !same {
        sequences.push((Sequence::Rows, by_rows));
    }
    sequences
}

impl Order {
    fn of(fit: &FitResidual, kept: &[usize]) -> Result<Self, Untestable> {
        let mut by_session = std::collections::BTreeMap::<usize, Vec<usize>>::new();
        for (number, &pose) in kept.iter().enumerate() {
            by_session.entry(fit.session[pose]).or_default().push(number);
        }
        let sessions: Vec<Vec<usize>> = by_session.into_values().collect();
        let longest = sessions.iter().map(Vec::len).max().unwrap_or(0);
        if longest < MIN_POSES {
            return Err(Untestable::TooFewPoses);
        }
        Ok(Self { sessions, lags: (longest / POSES_PER_LAG).min(MAX_LAGS) })
    }

    /// Returns the pairs of poses that are `lag` steps apart, earlier and later, of all sessions.
    fn pairs(&self, lag: usize) -> impl Iterator<Item = (usize, usize)> {
        self.sessions
            .iter()
            .flat_map(move |session| session.iter().copied().zip(session.iter().skip(lag).copied()))
    }

    /// Returns the fraction of the steps from pose to pose at which a coordinate keeps its sign.
    /// Many kept signs mean few runs [Wald and Wolfowitz 1940].
    pub fn kept_signs<const L: usize>(&self, sample: &Sample<L>) -> [f64; L] {
        let (mut steps, mut kept) = (0_u32, [0_u32; L]);
        for (a, b) in self.pairs(1) {
            steps += 3;
            for (x, y) in sample.centred[a].iter().zip(&sample.centred[b]) {
                for l in 0..L {
                    kept[l] += u32::from((x[l] > 0.0) == (y[l] > 0.0));
                }
            }
        }
        kept.map(|kept| f64::from(kept) / f64::from(steps.max(1)))
    }

    /// Returns Ljung and Box's Q = 3 n (n + 2) Σₖ ρₖ² / nₖ,  ρₖ = Σ yₜ·yₜ₊ₖ / Σ |yₜ|²
    /// [Ljung and Box 1978]
    ///
    /// The sum is over lags k with nₖ pairs among n poses, all sessions together. The scalar
    /// products add the autocovariances of the three coordinates, hence the factor 3. Q is
    /// approximately χ² with as many degrees of freedom as lags.
    pub fn ljung_box<const L: usize>(&self, sample: &Sample<L>) -> [f64; L] {
        let n = sample.centred.len() as f64;
        let mut totals = [0.0; L];
        for lag in 1..=self.lags {
            let (mut pairs, mut sums) = (0.0, [0.0; L]);
            for (a, b) in self.pairs(lag) {
                pairs += 1.0;
                let products = dot(&sample.centred[a], &sample.centred[b]);
                (0..L).for_each(|l| sums[l] += products[l]);
            }
            for l in 0..L {
                let variance = sample.squares[l].trace();
                totals[l] += (sums[l] / variance).powi(2) / f64::max(pairs, 1.0);
            }
        }
        std::array::from_fn(|l| {
            let is_varying = sample.squares[l].trace() > 0.0;
            if is_varying { 3.0 * n * (n + 2.0) * totals[l] } else { 0.0 }
        })
    }
}

/// Squared distance correlation of the mean residual with a covariate, computed by cumulative sums.
///
/// ρ² = − Σᵢⱼ |xᵢ − xⱼ| yᵢ·yⱼ / (‖K‖ ‖Σ y yᵀ‖) = 2 Σₖ (x₍ₖ₊₁₎ − x₍ₖ₎) |Cₖ|² / (‖K‖ ‖Σ y yᵀ‖)
///
/// with K the doubly centred distances of the covariate x, y the centred residuals and Cₖ their sum
/// over the k poses with the smallest x. It is the distance correlation of [Székely, Rizzo and
/// Bakirov 2007] with squared distances between residuals instead of plain ones. That is the
/// martingale difference correlation of [Shao and Zhang 2014]. It is between 0 and 1, and 0 (for
/// many poses) exactly if the mean residual is the same at every x. An effect that the model lacks
/// moves the mean; noise that is larger at some x does not. The second form takes time proportional
/// to the number of poses, so that all poses of a long campaign can be used.
#[derive(Debug, Clone)]
pub(super) struct Cumulative {
    /// Indices of the poses in ascending order of x.
    order: Vec<usize>,
    /// Weights 2 (x₍ₖ₊₁₎ − x₍ₖ₎) / ‖K‖.
    weights: Vec<f64>,
}

impl Cumulative {
    /// Creates the statistic from the covariate's values in all poses, of which those in `kept` are
    /// used.
    ///
    /// # Errors
    /// Returns an error if `values` does not have `count` entries or one is not finite, if `kept`
    /// has fewer than five poses, or if the covariate is constant in them.
    pub fn new(values: &[f64], count: usize, kept: &[usize]) -> Result<Self, Untestable> {
        if values.len() != count {
            return Err(Untestable::SizeMismatch);
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(Untestable::NotFinite);
        }
        if kept.len() < MIN_POSES {
            return Err(Untestable::TooFewPoses);
        }
        let x = |number: usize| values[kept[number]];
        let mut order: Vec<usize> = (0..kept.len()).collect();
        order.sort_by(|&a, &b| x(a).total_cmp(&x(b)));
        let (least, most) = (x(order[0]), x(order[order.len() - 1]));
        let range = most - least;
        if range <= MAX_CONSTANT_RANGE * least.abs().max(most.abs()) || !range.is_finite() {
            return Err(Untestable::Constant);
        }
        let sorted: Vec<f64> = order.iter().map(|&number| (x(number) - least) / range).collect();
        let norm = centred_norm(&sorted);
        let weights = sorted.windows(2).map(|pair| 2.0 * (pair[1] - pair[0]) / norm).collect();
        Ok(Self { order, weights })
    }

    /// Returns the squared distance correlation ρ² of each draw.
    pub fn correlation<const L: usize>(&self, sample: &Sample<L>) -> [f64; L] {
        let (mut sum, mut totals) = ([[0.0; L]; 3], [0.0; L]);
        for (&pose, weight) in self.order.iter().zip(&self.weights) {
            for (sum, values) in sum.iter_mut().zip(&sample.centred[pose]) {
                (0..L).for_each(|l| sum[l] += values[l]);
            }
            let squares = dot(&sum, &sum);
            (0..L).for_each(|l| totals[l] += weight * squares[l]);
        }
        std::array::from_fn(|l| {
            let norm = sample.squares[l].norm();
            if norm > 0.0 { totals[l] / norm } else { 0.0 }
        })
    }
}

/// Returns the norm ‖K‖ for ascending values, Kᵢⱼ = dᵢⱼ − d̄ᵢ − d̄ⱼ + d̄ with d the distances: ‖K‖²
/// = Σ d² − 2 n Σ d̄ᵢ² + n² d̄².
fn centred_norm(sorted: &[f64]) -> f64 {
    let n = sorted.len() as f64;
    let sum: f64 = sorted.iter().sum();
    let squares: f64 = sorted.iter().map(|x| (x - sum / n).powi(2)).sum();
    let (mut below, mut means_sum, mut means_squares) = (0.0, 0.0, 0.0);
    for (i, x) in sorted.iter().enumerate() {
        // Mean distance from x: of the i values below x, and of the values from x on.
        let mean = (x * i as f64 - below + (sum - below) - x * (n - i as f64)) / n;
        means_sum += mean;
        means_squares += mean * mean;
        below += x;
    }
    (2.0 * n * squares - 2.0 * n * means_squares + means_sum * means_sum).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_agree() {
        let x = [0.3, -1.2, 2.5, 0.3, 0.9, -0.4];
        let y: Vec<[f64; 3]> =
            (0..6).map(f64::from).map(|k| [(3.0 * k).sin(), k * k, 1.0 / (k + 1.0)]).collect();
        let sample = Sample::of([&y]);
        let at = |pose: usize| Vector3::from(sample.centred[pose].map(|[value]| value));
        let distance = |i: usize, j: usize| -> f64 { f64::abs(x[i] - x[j]) };
        let mean = |i: usize| (0..6).map(|j| distance(i, j)).sum::<f64>() / 6.0;
        let grand_mean = (0..6).map(mean).sum::<f64>() / 6.0;
        let (mut sum, mut norm, mut gram) = (0.0, 0.0, 0.0);
        for i in 0..6 {
            for j in 0..6 {
                let product = at(i).dot(&at(j));
                sum -= distance(i, j) * product;
                norm += (distance(i, j) - mean(i) - mean(j) + grand_mean).powi(2);
                gram += product * product;
            }
        }
        let cumulative = Cumulative::new(&x, 6, &[0, 1, 2, 3, 4, 5]).unwrap();
        let expected = sum / (norm * gram).sqrt();
        assert!((cumulative.correlation(&sample)[0] - expected).abs() < 1e-12);
        assert!(expected > 0.1 && expected < 1.0);
    }
}

//! Statistics of studentised residuals: order and dependence on covariates.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::fit_residual::FitResidual;
use super::outcome::{Sequence, Untestable};

/// Minimum number of poses for tests of order and of dependence.
const MIN_POSES: usize = 5;
/// Maximum number of lags of the autocorrelation; a session needs this many poses for each lag
/// [Hyndman and Athanasopoulos 2018, section 5.4].
const MAX_LAGS: usize = 10;
const POSES_PER_LAG: usize = 5;
/// Number of poses that are copied to contiguous memory at a time, so that slow memory reads
/// overlap.
const POSES_PER_FETCH: usize = 64;
/// Range of a covariate, relative to its values, up to which it counts as constant.
const MAX_CONSTANT_RANGE: f64 = 1e-12;

/// Studentised residuals, with their mean subtracted.
#[derive(Debug)]
pub(super) struct Sample<'a> {
    /// Centred residual y of each pose, with Σ y = 0.
    centred: &'a [[f64; 3]],
    /// Sum of outer products Σ y yᵀ.
    squares: Matrix3<f64>,
}

impl<'a> Sample<'a> {
    /// Centres studentised residuals in place.
    pub fn of(values: &'a mut [[f64; 3]]) -> Self {
        let mean = values.iter().copied().map(Vector3::from).sum::<Vector3<f64>>()
            / values.len().max(1) as f64;
        let mut squares = Matrix3::zeros();
        for value in &mut *values {
            let centred = Vector3::from(*value) - mean;
            squares += centred * centred.transpose();
            *value = centred.into();
        }
        Self { centred: values, squares }
    }

    fn at(&self, pose: usize) -> Vector3<f64> {
        self.centred[pose].into()
    }
}

/// Statistic that grows with one kind of structure in the residuals. It does not depend on their
/// unit.
#[derive(Debug)]
pub(super) enum Statistic {
    /// Share of steps from pose to pose at which a coordinate keeps its sign.
    Runs(Arc<Order>),
    /// Ljung and Box's Q of the autocorrelation.
    LjungBox(Arc<Order>),
    /// Squared distance correlation with a covariate.
    Dependence(Cumulative),
}

impl Statistic {
    /// Returns the value of the statistic.
    pub fn evaluate(&self, sample: &Sample) -> f64 {
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
    lags: usize,
}

/// Returns the poses `kept`, renumbered from 0, in the order of time, and in the order of the rows
/// if that differs.
pub(super) fn sequences(
    fit: &FitResidual,
    kept: &[usize],
) -> Vec<(Sequence, Result<Order, Untestable>)> {
    let by_rows = Order::of(fit, kept);
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
    let mut all = vec![(Sequence::Time, by_time)];
    if !same {
        all.push((Sequence::Rows, by_rows));
    }
    all
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
    fn pairs<'a>(
        &'a self,
        sample: &'a Sample,
        lag: usize,
    ) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> {
        let within = move |session: &'a Vec<usize>| session.iter().zip(session.iter().skip(lag));
        self.sessions.iter().flat_map(within).map(|(&a, &b)| (sample.at(a), sample.at(b)))
    }

    /// Returns the share of steps at which a coordinate keeps its sign. Many kept signs mean few
    /// runs [Wald and Wolfowitz 1940].
    pub fn kept_signs(&self, sample: &Sample) -> f64 {
        let (mut steps, mut kept) = (0_u32, 0_u32);
        for (a, b) in self.pairs(sample, 1) {
            steps += 3;
            kept += (0..3).map(|k| u32::from((a[k] > 0.0) == (b[k] > 0.0))).sum::<u32>();
        }
        f64::from(kept) / f64::from(steps.max(1))
    }

    /// Returns Ljung and Box's Q = 3 n (n + 2) Σₖ ρₖ² / nₖ,  ρₖ = Σ yₜ·yₜ₊ₖ / Σ |yₜ|²
    /// [Ljung and Box 1978]
    ///
    /// The sum is over lags k with nₖ pairs among n poses, all sessions together. The scalar
    /// products add the autocovariances of the three coordinates, hence the factor 3. Q is
    /// approximately χ² with as many degrees of freedom as lags.
    pub fn ljung_box(&self, sample: &Sample) -> f64 {
        let n = sample.centred.len() as f64;
        let variance = sample.squares.trace();
        let of_lag = |lag: usize| {
            let (mut pairs, mut sum) = (0.0, 0.0);
            for (a, b) in self.pairs(sample, lag) {
                pairs += 1.0;
                sum += a.dot(&b);
            }
            (sum / variance).powi(2) / f64::max(pairs, 1.0)
        };
        if variance > 0.0 {
            3.0 * n * (n + 2.0) * (1..=self.lags).map(of_lag).sum::<f64>()
        } else {
            0.0
        }
    }
}

/// Squared distance correlation of the mean residual with a covariate, computed by cumulative sums.
///
/// ρ² = − Σᵢⱼ |xᵢ − xⱼ| yᵢ·yⱼ / (‖K‖ ‖Σ y yᵀ‖) = 2 Σₖ (x₍ₖ₊₁₎ − x₍ₖ₎) |Cₖ|² / (‖K‖ ‖Σ y yᵀ‖)
///
/// with K the doubly centred distances of the covariate x, y the centred residuals and Cₖ their sum
/// over the k poses with the smallest x. It is the distance correlation of [Székely, Rizzo and
/// Bakirov 2007] with squared distances between residuals instead of plain ones, which is the
/// martingale difference correlation of [Shao and Zhang 2014]: between 0 and 1, and 0 (for many
/// poses) exactly if the mean residual is the same at every x. An effect that the model lacks moves
/// the mean; noise that is larger at some x does not. The second form takes time proportional to
/// the number of poses, so that all poses of a long campaign can be used.
#[derive(Debug, Clone)]
pub(super) struct Cumulative {
    /// Indices of the poses in ascending order of x.
    order: Vec<usize>,
    /// Weights 2 (x₍ₖ₊₁₎ − x₍ₖ₎) / ‖K‖.
    weights: Vec<f64>,
}

impl Cumulative {
    /// Creates the statistic from the covariate's values in the poses `kept`, which are renumbered
    /// from 0.
    ///
    /// # Errors
    /// Returns an error if `values` does not have `all` entries, or if the covariate is constant.
    pub fn new(values: &[f64], all: usize, kept: &[usize]) -> Result<Self, Untestable> {
        if values.len() != all {
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

    /// Returns the squared distance correlation ρ² of a sample.
    pub fn correlation(&self, sample: &Sample) -> f64 {
        let mut sum = Vector3::zeros();
        let mut total = 0.0;
        let mut near = [Vector3::zeros(); POSES_PER_FETCH];
        for (numbers, weights) in
            self.order.chunks(POSES_PER_FETCH).zip(self.weights.chunks(POSES_PER_FETCH))
        {
            near.iter_mut().zip(numbers).for_each(|(near, &number)| *near = sample.at(number));
            for (centred, weight) in near.iter().zip(weights) {
                sum += centred;
                total += weight * sum.norm_squared();
            }
        }
        let norm = sample.squares.norm();
        if norm > 0.0 { total / norm } else { 0.0 }
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
        // The i values below x, and those from x on.
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
        let mut y: Vec<[f64; 3]> =
            (0..6).map(f64::from).map(|k| [(3.0 * k).sin(), k * k, 1.0 / (k + 1.0)]).collect();
        let sample = Sample::of(&mut y);
        let distance = |i: usize, j: usize| -> f64 { f64::abs(x[i] - x[j]) };
        let mean = |i: usize| (0..6).map(|j| distance(i, j)).sum::<f64>() / 6.0;
        let all = (0..6).map(mean).sum::<f64>() / 6.0;
        let (mut sum, mut norm, mut gram) = (0.0, 0.0, 0.0);
        for i in 0..6 {
            for j in 0..6 {
                let product = sample.at(i).dot(&sample.at(j));
                sum -= distance(i, j) * product;
                norm += (distance(i, j) - mean(i) - mean(j) + all).powi(2);
                gram += product * product;
            }
        }
        let cumulative = Cumulative::new(&x, 6, &[0, 1, 2, 3, 4, 5]).unwrap();
        let expected = sum / (norm * gram).sqrt();
        assert!((cumulative.correlation(&sample) - expected).abs() < 1e-12);
        assert!(expected > 0.1 && expected < 1.0);
    }
}

//! Whether residuals depend on a covariate.

use nalgebra::Vector3;

use super::LEAST_POSES;
use super::outcome::Untestable;
use super::statistic::Sample;

/// A range this small beside the values is rounding.
const ROUNDING: f64 = 1e-12;

/// Distance correlation with a covariate, of the mean.
///
/// ρ² = − Σᵢⱼ |xᵢ − xⱼ| yᵢ·yⱼ / (‖K‖ ‖Σ y yᵀ‖) = 2 Σₖ (x₍ₖ₊₁₎ − x₍ₖ₎) |Cₖ|² / (‖K‖ ‖Σ y yᵀ‖)
///
/// with K the doubly centred distances of the covariate x, y the centred residuals and Cₖ their sum over the k poses with the
/// smallest x. It is the distance correlation of [Székely, Rizzo and Bakirov 2007] with squared distances between
/// residuals instead of plain ones, which is the martingale difference correlation of [Shao and Zhang 2014]: 0 (for many
/// poses) exactly where the mean residual is the same at every x, and no more than 1. An effect that the model lacks moves the
/// mean; noise that is larger at some x does not. The second form takes as many steps as there are poses, so that all poses
/// of a long campaign count, not only some.
#[derive(Debug, Clone)]
pub(super) struct Cumulative {
    /// Poses by ascending x.
    order: Vec<usize>,
    /// 2 (x₍ₖ₊₁₎ − x₍ₖ₎) / ‖K‖.
    weights: Vec<f64>,
}

impl Cumulative {
    /// Of the values at the poses `kept`, which count from 0 anew; there should be `all` values.
    pub fn of(values: &[f64], all: usize, kept: &[usize]) -> Result<Self, Untestable> {
        if values.len() != all {
            return Err(Untestable::SizeMismatch);
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(Untestable::NotFinite);
        }
        if kept.len() < LEAST_POSES {
            return Err(Untestable::TooFewPoses);
        }
        let x = |number: usize| values[kept[number]];
        let mut order: Vec<usize> = (0..kept.len()).collect();
        order.sort_by(|&a, &b| x(a).total_cmp(&x(b)));
        let (least, most) = (x(order[0]), x(order[order.len() - 1]));
        let range = most - least;
        if range <= ROUNDING * least.abs().max(most.abs()) || !range.is_finite() {
            return Err(Untestable::Constant);
        }
        let sorted: Vec<f64> = order.iter().map(|&number| (x(number) - least) / range).collect();
        let norm = centred_norm(&sorted);
        let weights = sorted.windows(2).map(|pair| 2.0 * (pair[1] - pair[0]) / norm).collect();
        Ok(Self { order, weights })
    }

    /// ρ².
    pub fn correlation(&self, sample: &Sample) -> f64 {
        let mut sum = Vector3::zeros();
        let mut total = 0.0;
        for (&number, weight) in self.order.iter().zip(&self.weights) {
            sum += sample.centred[number];
            total += weight * sum.norm_squared();
        }
        let norm = sample.squares.norm();
        if norm > 0.0 { total / norm } else { 0.0 }
    }
}

/// ‖K‖ of ascending values, Kᵢⱼ = dᵢⱼ − d̄ᵢ − d̄ⱼ + d̄ with d the distances: ‖K‖² = Σ d² − 2 n Σ d̄ᵢ² + n² d̄².
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
        let y: Vec<Vector3<f64>> =
            (0..6).map(f64::from).map(|k| Vector3::new((3.0 * k).sin(), k * k, 1.0 / (k + 1.0))).collect();
        let sample = Sample::of(y);
        let distance = |i: usize, j: usize| -> f64 { f64::abs(x[i] - x[j]) };
        let mean = |i: usize| (0..6).map(|j| distance(i, j)).sum::<f64>() / 6.0;
        let all = (0..6).map(mean).sum::<f64>() / 6.0;
        let (mut sum, mut norm, mut gram) = (0.0, 0.0, 0.0);
        for i in 0..6 {
            for j in 0..6 {
                let product = sample.centred[i].dot(&sample.centred[j]);
                sum -= distance(i, j) * product;
                norm += (distance(i, j) - mean(i) - mean(j) + all).powi(2);
                gram += product * product;
            }
        }
        let cumulative = Cumulative::of(&x, 6, &[0, 1, 2, 3, 4, 5]).unwrap();
        let expected = sum / (norm * gram).sqrt();
        assert!((cumulative.correlation(&sample) - expected).abs() < 1e-12);
        assert!(expected > 0.1 && expected < 1.0);
    }
}

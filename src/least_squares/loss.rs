//! Robust losses, which limit the influence of gross errors.

use super::Block;
use crate::numeric::kernel::{norm, sum_of_squares};

/// Number of steps of the quadrature over residual lengths that gives the moments of a loss.
const MOMENT_QUADRATURE_STEPS: u32 = 2000;
/// Upper limit of that quadrature \[σ\]: longer normal residuals of a few coordinates have a
/// negligible probability.
const MAX_QUADRATURE_LENGTH: f64 = 10.0;

/// Loss function of an item (a pose). Its cost is ½ρ(s²), where s = ‖r‖ is the whitened residual
/// length \[σ\].
///
/// Rows of an item are scaled by √ρ′, with ρ′ = dρ/d(s²). The gradient ρ′ Jᵀr is then exact; the
/// curvature ρ′ JᵀJ neglects ρ″. This is the first-order form of [Triggs et al. 2000, sec. 4.3],
/// which Ceres uses where ρ″ < 0. Every ρ here is concave in s², so the weighted quadratic model
/// bounds the cost of the linearised residual from above. Steps therefore gain at least what they
/// predict (gain ratios of 1 to 2), and the convergence tests need no change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Loss {
    /// Least squares, ρ = s².
    #[default]
    Squares,
    /// Huber's loss: ρ = s² for s ≤ k, ρ = 2ks − k² beyond [Huber 1964].
    Huber {
        /// Length k of a residual above which the loss grows linearly \[σ\].
        threshold: f64,
    },
    /// Smoothed absolute length, ρ = 2c (√(s² + ε²) − ε); approximately c s²/ε for s ≪ ε.
    L1 {
        /// Slope c [1/σ]; ½ρ is the negative log-likelihood of a density ∝ exp(−c s).
        slope: f64,
        /// Smoothing length ε \[σ\].
        smoothing: f64,
    },
}

impl Loss {
    /// Threshold at which [`Loss::Huber`] has 95 % efficiency for three coordinates of Gaussian
    /// noise.
    ///
    /// Efficiency B²/A with A = E‖ψ‖²/3 and B = P(s ≤ k) + ⅔ k E[1/s; s > k], s² ~ χ²₃ (one
    /// coordinate: 1.345).
    /// [Huber & Ronchetti 2009, ch. 7]
    pub const HUBER_POSITION: f64 = 1.628;
    /// Slope of [`Loss::L1`] for three coordinates: the density ∝ exp(−2s) has standard deviation 1
    /// in each coordinate, like whitened noise.
    pub const L1_POSITION: f64 = 2.0;
    /// Smoothing length of [`Loss::L1`]: small against the noise, so that the efficiency on
    /// Gaussian noise is that of the unsmoothed loss, 85 %.
    pub const L1_SMOOTHING: f64 = 0.1;

    /// Returns the loss ρ(s²) of a residual length s.
    pub fn rho(self, s: f64) -> f64 {
        match self {
            Self::Squares => s * s,
            Self::Huber { threshold } if s <= threshold => s * s,
            Self::Huber { threshold } => threshold * (2.0 * s - threshold),
            // This form c s²/(√(s² + ε²) + ε) neither cancels nor overflows.
            Self::L1 { slope, smoothing } => {
                2.0 * slope * s * (s / (s.hypot(smoothing) + smoothing))
            }
        }
    }

    /// Returns the weight of an item, ρ′ = dρ/d(s²).
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber { threshold } => (threshold / s).min(1.0),
            Self::L1 { slope, smoothing } => slope / s.hypot(smoothing),
        }
    }

    /// Returns the second derivative of ½ρ with respect to the residual length s, d(ρ′ s)/ds.
    pub fn curvature(self, s: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber { threshold } => f64::from(u8::from(s <= threshold)),
            Self::L1 { slope, smoothing } => {
                let length = s.hypot(smoothing);
                slope / length * (smoothing / length).powi(2)
            }
        }
    }

    /// Returns Σ ρ over the items of `residuals`, which have `rows` values each.
    pub(super) fn sum_of_losses(self, residuals: &[f64], rows: usize) -> f64 {
        if self == Self::Squares {
            return sum_of_squares(residuals);
        }
        residuals.chunks_exact(rows.max(1)).map(|item| self.rho(norm(item))).sum()
    }

    /// Returns the weight ρ′ of each row of `residuals`. The rows of an item, `rows` in number,
    /// have the same weight.
    pub(super) fn weights(self, residuals: &[f64], rows: usize) -> Vec<f64> {
        let items = residuals.chunks_exact(rows.max(1));
        items.flat_map(|item| std::iter::repeat_n(self.weight(norm(item)), item.len())).collect()
    }

    /// Scales the rows of each item in `block` by √ρ′ and returns Σ ρ over the items, which have
    /// `rows` rows each. For [`Loss::Squares`] does nothing and returns `None`.
    pub(super) fn apply_weights(self, block: &mut Block, rows: usize) -> Option<f64> {
        if self == Self::Squares {
            return None;
        }
        let residuals = block.column(block.parameters());
        let sum = self.sum_of_losses(residuals, rows);
        let roots: Vec<f64> = residuals
            .chunks_exact(rows.max(1))
            .map(|item| self.weight(norm(item)).sqrt())
            .collect();
        for j in 0..=block.parameters() {
            for (item, root) in block.column_mut(j).chunks_exact_mut(rows.max(1)).zip(&roots) {
                for value in item {
                    *value *= root;
                }
            }
        }
        Some(sum)
    }

    /// Returns the expected second derivative of ½ρ, averaged over the directions of a residual,
    /// and the expected square of its slope per coordinate. Residuals are normal with `coordinates`
    /// coordinates of standard deviation `scale` \[σ\].
    ///
    /// E[(k − 1) ρ′(s) + ∂(ρ′ s)/∂s] / k and E[(ρ′ s)²] / k with s² / scale² ~ χ²ₖ [Huber &
    /// Ronchetti 2009, sec. 7.6].
    pub fn normal_moments(self, coordinates: usize, scale: f64) -> (f64, f64) {
        let k = coordinates as f64;
        let (mut total, mut curvature, mut square) = (0.0, 0.0, 0.0);
        for step in 0..MOMENT_QUADRATURE_STEPS {
            let s = (f64::from(step) + 0.5) / f64::from(MOMENT_QUADRATURE_STEPS)
                * MAX_QUADRATURE_LENGTH;
            let density = s.powf(k - 1.0) * (-0.5 * s * s).exp();
            let (weight, length) = (self.weight(s * scale), s * scale);
            total += density;
            curvature += density * ((k - 1.0) * weight + self.curvature(length)) / k;
            square += density * (weight * length).powi(2) / k;
        }
        (curvature / total, square / total)
    }

    /// Returns the factor A w̄ / B² by which the covariance of an M-estimate exceeds (JᵀWJ)⁻¹.
    ///
    /// A = Σ‖ρ′ r‖²/ν, w̄ is the mean of ρ′, and B is the mean curvature ∂²(½ρ)/∂r² over all
    /// directions of all items [Huber & Ronchetti 2009, sec. 7.6]. `lengths` are the whitened
    /// residual lengths \[σ\], `coordinates` the number of coordinates (directions) of each item,
    /// `freedom` ν the degrees of freedom.
    pub fn variance_factor(self, lengths: &[f64], coordinates: &[usize], freedom: f64) -> f64 {
        let directions = coordinates.iter().sum::<usize>() as f64;
        if self == Self::Squares || directions <= 0.0 || freedom <= 0.0 {
            return 1.0;
        }
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            lengths.iter().zip(coordinates).map(|(&s, &count)| of(s, count as f64)).sum::<f64>()
        };
        let influence = sum(&|s, _| (self.weight(s) * s).powi(2)) / freedom;
        let weight = sum(&|s, count| count * self.weight(s)) / directions;
        // Along the residual, the curvature is that of the loss; across it, it is the weight ρ′.
        let curvature =
            sum(&|s, count| (count - 1.0) * self.weight(s) + self.curvature(s)) / directions;
        influence * weight / (curvature * curvature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_absolute_lengths_are_those_of_normal_residuals() {
        // E[1/s] = √(2/π) for three coordinates.
        let loss = Loss::L1 { slope: Loss::L1_POSITION, smoothing: 1e-3 };
        let (curvature, square) = loss.normal_moments(3, 1.0);
        let expected = 2.0 * 2.0 / 3.0 * (2.0 / std::f64::consts::PI).sqrt();
        assert!((curvature / expected - 1.0).abs() < 1e-3, "{curvature} {expected}");
        assert!((square / (4.0 / 3.0) - 1.0).abs() < 1e-3, "{square}");
        assert!((Loss::Squares.normal_moments(3, 1.0).0 - 1.0).abs() < 1e-12);
    }

    /// Compares the factor with closed forms of A / B² for normal residuals of one and of two
    /// coordinates, at thresholds that most residuals exceed.
    #[test]
    fn variance_of_rows_of_one_and_two_numbers() {
        use statrs::distribution::{ContinuousCDF as _, Normal};
        let normal = Normal::standard();
        let parts = || (0..20_000).map(|k| (f64::from(k) + 0.5) / 20_000.0);
        for (coordinates, threshold, expected) in [(1, 0.5, 1.2626), (2, 1.0, 1.1216)] {
            let length = |part: f64| match coordinates {
                1 => normal.inverse_cdf(0.5 + 0.5 * part),
                _ => (-2.0 * (1.0 - part).ln()).sqrt(),
            };
            let lengths: Vec<f64> = parts().map(length).collect();
            let loss = Loss::Huber { threshold };
            let freedom = (coordinates * lengths.len()) as f64;
            let factor = loss.variance_factor(&lengths, &vec![coordinates; lengths.len()], freedom);
            let weight =
                lengths.iter().map(|&s| loss.weight(s)).sum::<f64>() / lengths.len() as f64;
            assert!(
                (factor / weight - expected).abs() < 2e-3,
                "{coordinates}: {}",
                factor / weight
            );
        }
    }
}

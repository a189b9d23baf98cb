//! Losses that keep gross errors from ruling a fit.

use super::Block;
use super::kernel::{norm, sum_of_squares};

/// How the residual of an item (a pose) counts: ½ρ(s²), where s = ‖r‖ is its whitened length \[σ\].
///
/// Rows of an item are scaled by √ρ′, with ρ′ = dρ/d(s²). The gradient ρ′ Jᵀr is then exact, the
/// curvature ρ′ JᵀJ leaves out ρ″: the first-order form of [Triggs et al. 2000, sec. 4.3], which
/// Ceres takes where ρ″ < 0. Every ρ here is concave in s², so the weighted problem lies above the
/// cost of the linearised residual: steps achieve what they predict or more (gain ratios of 1 to
/// 2), and the tests for convergence hold as they are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Loss {
    /// ρ = s²: least squares.
    #[default]
    Squares,
    /// ρ = s² up to s = k, 2ks − k² beyond
    /// [Huber 1964]
    Huber {
        /// k \[σ\].
        threshold: f64,
    },
    /// ρ = 2c (√(s² + ε²) − ε): the length of the residual, rounded off to s²·c/ε where s ≪ ε.
    L1 {
        /// c [1/σ]: the negative log-likelihood of lengths that fall off as exp(−c s).
        slope: f64,
        /// ε \[σ\].
        smoothing: f64,
    },
}

impl Loss {
    /// k with which [`Loss::Huber`] keeps 95 % efficiency on three coordinates of Gaussian noise.
    ///
    /// Efficiency B²/A with A = E‖ψ‖²/3 and B = P(s ≤ k) + ⅔ k E[1/s; s > k], s² ~ χ²₃ (one
    /// coordinate: 1.345).
    /// [Huber & Ronchetti 2009, ch. 7]
    pub const HUBER_POSITION: f64 = 1.628;
    /// c of [`Loss::L1`] for three coordinates: exp(−2s) has the standard deviation 1 in each, as
    /// the whitened noise.
    pub const L1_POSITION: f64 = 2.0;
    /// ε of [`Loss::L1`]: small against the noise, so that 85 % efficiency on Gaussian noise is
    /// that of the plain length.
    pub const L1_SMOOTHING: f64 = 0.1;

    /// ρ(s²).
    pub fn rho(self, s: f64) -> f64 {
        match self {
            Self::Squares => s * s,
            Self::Huber { threshold } if s <= threshold => s * s,
            Self::Huber { threshold } => threshold * (2.0 * s - threshold),
            // c s²/(√(s² + ε²) + ε), free of cancellation and of overflow.
            Self::L1 { slope, smoothing } => {
                2.0 * slope * s * (s / (s.hypot(smoothing) + smoothing))
            }
        }
    }

    /// ρ′ = dρ/d(s²), the weight of an item.
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber { threshold } => (threshold / s).min(1.0),
            Self::L1 { slope, smoothing } => slope / s.hypot(smoothing),
        }
    }

    /// d(ρ′ s)/ds, the curvature of ½ρ along the residual.
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

    /// Σ ρ over the items of `residuals`, `rows` values each.
    pub(super) fn sum(self, residuals: &[f64], rows: usize) -> f64 {
        if self == Self::Squares {
            return sum_of_squares(residuals);
        }
        residuals.chunks_exact(rows.max(1)).map(|item| self.rho(norm(item))).sum()
    }

    /// ρ′ of the item of each row of `residuals`, `rows` values an item.
    pub(super) fn weights(self, residuals: &[f64], rows: usize) -> Vec<f64> {
        let items = residuals.chunks_exact(rows.max(1));
        items.flat_map(|item| std::iter::repeat_n(self.weight(norm(item)), item.len())).collect()
    }

    /// Scales the rows of each item by √ρ′ and returns Σ ρ; nothing is done for squares.
    pub(super) fn weigh(self, block: &mut Block, rows: usize) -> Option<f64> {
        if self == Self::Squares {
            return None;
        }
        let residuals = block.column(block.parameters());
        let sum = self.sum(residuals, rows);
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

    /// Variance of an estimate over that of its weighted Jacobian, from the whitened lengths of its
    /// residuals.
    ///
    /// (JᵀWJ)⁻¹ · A w̄ / B², with A = Σ‖ρ′ r‖²/ν, w̄ the mean of ρ′ and B that of the curvature
    /// ∂²(½ρ)/∂r² over all directions of all items; ν are the degrees of freedom, and `coordinates`
    /// says how many numbers each item has: its directions
    /// [Huber & Ronchetti 2009, sec. 7.6].
    pub fn variance_factor(self, lengths: &[f64], coordinates: &[usize], freedom: f64) -> f64 {
        let directions = coordinates.iter().sum::<usize>() as f64;
        if self == Self::Squares || directions <= 0.0 || freedom <= 0.0 {
            return 1.0;
        }
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            lengths.iter().zip(coordinates).map(|(&s, &own)| of(s, own as f64)).sum::<f64>()
        };
        let influence = sum(&|s, _| (self.weight(s) * s).powi(2)) / freedom;
        let weight = sum(&|s, own| own * self.weight(s)) / directions;
        // Along the residual the curvature is that of the loss, across it the weight.
        let curvature =
            sum(&|s, own| (own - 1.0) * self.weight(s) + self.curvature(s)) / directions;
        influence * weight / (curvature * curvature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against closed forms of A / B² over normal residuals of one and of two numbers, at
    /// thresholds where most of them are beyond.
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

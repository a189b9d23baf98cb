//! Comparison of two fits of the same rows by their predictions of blocks of poses left out.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::data::Data;
use super::fitted::Fitted;

/// Decreases of the sum of squared errors by one fit against another \[m²\], one for each block of
/// poses, predicted by fits without the block.
pub(super) struct LeftOutGain(Vec<f64>);

impl LeftOutGain {
    /// Compares the fit `new` with the fit `old`; `None` if an error is not finite.
    pub fn new(new: &Fitted, old: &Fitted, data: &Data) -> Option<Self> {
        let squares = |fitted: &Fitted| {
            let fit = fitted.with_all_rows().around(data);
            let blocks = fit.left_out_squares(&data.block)?;
            Some(blocks.into_iter().map(|sum| sum * fitted.sigma.powi(2)).collect::<Vec<f64>>())
        };
        let (before, after) = squares(old).zip(squares(new))?;
        Some(Self(before.iter().zip(&after).map(|(before, after)| before - after).collect()))
    }

    /// Returns true if the sum over all blocks decreases.
    pub fn is_positive(&self) -> bool {
        self.0.iter().sum::<f64>() > 0.0
    }

    /// Returns true if the mean decrease is larger than chance: one-sided t test over the blocks at
    /// 2.5 %.
    pub fn is_significant(&self) -> bool {
        let count = self.0.len() as f64;
        let mean = self.0.iter().sum::<f64>() / count;
        let squares = self.0.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let variance = squares / (count - 1.0);
        let quantile = StudentsT::new(0.0, 1.0, (count - 1.0).max(1.0));
        quantile.is_ok_and(|t| mean > t.inverse_cdf(0.975) * (variance / count).sqrt())
    }
}

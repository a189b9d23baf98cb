//! Whether residuals are normally distributed.

use nalgebra::Vector3;
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::chance::Chance;
use super::judgement::{Trial, Tried};
use super::outcome::{Test, Untestable};

/// Coordinates below which the distribution is not tested.
const LEAST: usize = 8;
/// Statistics beyond this have the same p-value: the fitted curve of [Stephens 1986] ends.
const LARGEST: f64 = 150.0;
/// Probabilities are kept this far from 0 and 1.
const EXTREME: f64 = 1e-300;

/// Anderson and Darling's test on all studentised coordinates, mean and variance estimated.
///
/// A² = −n − (1/n) Σᵢ (2i − 1) [ln Φ(z₍ᵢ₎) + ln Φ(−z₍ₙ₊₁₋ᵢ₎)], times 1 + 0.75/n + 2.25/n²
///                            [Stephens 1986, in D'Agostino and Stephens, Goodness-of-Fit Techniques, section 4.8.5]
///
/// The fit mixes the noise of many poses in each residual, which makes it more normal than the noise; so few poses hide
/// heavy tails, but do not make them up.
pub(super) fn anderson_darling(studentised: &[Vector3<f64>]) -> Tried {
    let mut values: Vec<f64> = studentised.iter().flatten().copied().filter(|value| *value != 0.0).collect();
    let trial = statistic(&mut values).map(|statistic| Trial {
        statistic,
        chance: Chance::AndersonDarling,
        shown: |value| value,
    });
    Tried { test: Test::Normality, trial }
}

fn statistic(values: &mut [f64]) -> Result<f64, Untestable> {
    if values.len() < LEAST {
        return Err(Untestable::TooFewPoses);
    }
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    if !spread.is_normal() {
        return Err(Untestable::Constant);
    }
    let normal = Normal::standard();
    let log = |z: f64| normal.cdf(z).max(EXTREME).ln();
    let terms =
        values.iter().zip(values.iter().rev()).enumerate().map(|(i, (low, high))| {
            (2.0 * i as f64 + 1.0) * (log((low - mean) / spread) + log((mean - high) / spread))
        });
    let squared = -n - terms.sum::<f64>() / n;
    Ok(squared * (1.0 + 0.75 / n + 2.25 / (n * n)))
}

/// Probability of `statistic` or more [Stephens 1986, table 4.9].
pub(super) fn p_value(statistic: f64) -> f64 {
    let a = statistic.clamp(0.0, LARGEST);
    let curve = |c0: f64, c1: f64, c2: f64| (c0 + c1 * a + c2 * a * a).exp();
    match a {
        _ if a < 0.2 => 1.0 - curve(-13.436, 101.14, -223.73),
        _ if a < 0.34 => 1.0 - curve(-8.318, 42.796, -59.938),
        _ if a < 0.6 => curve(0.9177, -4.279, -1.38),
        _ => curve(1.2937, -5.709, 0.0186),
    }
}

/// The value that is reached with probability `level`, by bisection.
pub(super) fn upper(level: f64) -> f64 {
    let (mut low, mut high) = (0.0, LARGEST);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if p_value(middle) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

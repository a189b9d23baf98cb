//! Bootstrap confidence interval of a mean.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use statrs::function::erf::{erfc, erfc_inv};

/// Estimate with its confidence interval, at the level that the function returning it states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Estimate of the quantity to which the interval belongs, in the unit of the quantity.
    pub value: f64,
    /// Lower end of the interval, in the unit of the quantity.
    pub low: f64,
    /// Upper end of the interval, in the unit of the quantity.
    pub high: f64,
}

/// Returns the mean of the values of all groups with its bootstrap confidence interval at level
/// `covered`, 0…1; NaN if there are no groups.
///
/// `sums` holds for each group the sum and the number of its values. Each of the `draws` bootstrap
/// samples draws whole groups; the interval is BCa (bias-corrected and accelerated) [Efron 1987].
pub(crate) fn mean_interval(
    sums: &[(f64, f64)],
    draws: usize,
    covered: f64,
    seed: u64,
) -> Interval {
    let mean = |drawn: &mut dyn Iterator<Item = (f64, f64)>| {
        let (sum, count) = drawn.fold((0.0, 0.0), |(sum, count), (s, c)| (sum + s, count + c));
        sum / f64::max(count, 1.0)
    };
    let value = mean(&mut sums.iter().copied());
    if sums.is_empty() {
        return Interval { value: f64::NAN, low: f64::NAN, high: f64::NAN };
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut means: Vec<f64> = (0..draws)
        .map(|_| mean(&mut (0..sums.len()).map(|_| sums[rng.random_range(0..sums.len())])))
        .collect();
    means.sort_by(f64::total_cmp);
    // z₀ corrects the bias of the bootstrap median. The acceleration comes from the skewness of the
    // jackknife means.
    let z0 = normal_quantile(means.partition_point(|drawn| *drawn < value) as f64 / draws as f64);
    let without = |left_out: usize| {
        mean(&mut sums.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, sum)| *sum))
    };
    let jackknife: Vec<f64> = (0..sums.len()).map(without).collect();
    let center = jackknife.iter().sum::<f64>() / jackknife.len().max(1) as f64;
    let moment = |k: i32| jackknife.iter().map(|mean| (center - mean).powi(k)).sum::<f64>();
    let scale = moment(2).powf(1.5);
    let acceleration = if scale > 0.0 { moment(3) / (6.0 * scale) } else { 0.0 };
    let quantile_of_means = |level: f64| {
        let z = z0 + normal_quantile(level);
        let shifted = z0 + z / (1.0 - acceleration * z).max(0.1);
        let corrected = 0.5 * erfc(-shifted / std::f64::consts::SQRT_2);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a fraction of a count"
        )]
        let index = (corrected * draws as f64) as usize;
        means[index.min(draws - 1)]
    };
    let tail = (1.0 - covered) / 2.0;
    Interval { value, low: quantile_of_means(tail), high: quantile_of_means(1.0 - tail) }
}

/// Returns the quantile z of the standard normal distribution with Φ(z) = `probability`, limited to
/// ±4.
fn normal_quantile(probability: f64) -> f64 {
    const MAX_SCORE: f64 = 4.0;
    if probability > 0.0 && probability < 1.0 {
        (-std::f64::consts::SQRT_2 * erfc_inv(2.0 * probability)).clamp(-MAX_SCORE, MAX_SCORE)
    } else if probability > 0.0 {
        MAX_SCORE
    } else {
        -MAX_SCORE
    }
}

#[cfg(test)]
mod tests {
    use super::normal_quantile;

    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        for (probability, z) in
            [(0.025, -1.959_963_984_5), (0.5, 0.0), (0.841_344_746_1, 1.0), (0.0, -4.0), (1.0, 4.0)]
        {
            assert!(
                (normal_quantile(probability) - z).abs() < 1e-6,
                "{probability} {}",
                normal_quantile(probability)
            );
        }
    }
}

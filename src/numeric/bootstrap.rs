//! How sure a mean is.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use statrs::function::erf::{erfc, erfc_inv};

/// An estimate with the interval that covers it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Mean of groups, each given by the sum and the number of its values, with the interval that
/// covers it in the part `covered` of cases; bootstrap over groups, corrected for bias and for a
/// spread that changes with the mean (BCa) [Efron 1987].
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
    // z₀: by how much the mean itself is not in the middle; a: a sixth of the skewness of what one
    // configuration does to it.
    let z0 = quantile(means.partition_point(|own| *own < value) as f64 / draws as f64);
    let without = |left_out: usize| {
        mean(&mut sums.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, sum)| *sum))
    };
    let influence: Vec<f64> = (0..sums.len()).map(without).collect();
    let middle = influence.iter().sum::<f64>() / influence.len().max(1) as f64;
    let power = |k: i32| influence.iter().map(|own| (middle - own).powi(k)).sum::<f64>();
    let spread = power(2).powf(1.5);
    let a = if spread > 0.0 { power(3) / (6.0 * spread) } else { 0.0 };
    let at = |part: f64| {
        let z = z0 + quantile(part);
        let part = 0.5 * erfc(-(z0 + z / (1.0 - a * z).max(0.1)) / std::f64::consts::SQRT_2);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a part of a count"
        )]
        let place = (part * draws as f64) as usize;
        means[place.min(draws - 1)]
    };
    let beyond = (1.0 - covered) / 2.0;
    Interval { value, low: at(beyond), high: at(1.0 - beyond) }
}

/// z with Φ(z) = part, within four standard deviations.
fn quantile(part: f64) -> f64 {
    let most = 4.0;
    if part > 0.0 && part < 1.0 {
        (-std::f64::consts::SQRT_2 * erfc_inv(2.0 * part)).clamp(-most, most)
    } else if part > 0.0 {
        most
    } else {
        -most
    }
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        for (part, z) in
            [(0.025, -1.959_963_984_5), (0.5, 0.0), (0.841_344_746_1, 1.0), (0.0, -4.0), (1.0, 4.0)]
        {
            assert!((quantile(part) - z).abs() < 1e-6, "{part} {}", quantile(part));
        }
    }
}

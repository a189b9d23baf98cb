//! Numerical methods that several modules share: matrix products, factors, bootstrap, bisection.

mod bootstrap;
mod factor;
pub(crate) mod kernel;
pub(crate) mod parallel;
mod product;

pub use bootstrap::Interval;
pub(crate) use bootstrap::mean_interval;
pub(crate) use factor::{inverse_factor, inverse_lower, lower_factor, solve_positive};
pub(crate) use product::{
    gram, gram_of_lower, lower_product, multiply_by_upper, product, product_with_lower,
    product_with_upper, product_with_upper_padded, subtract_product, transposed_narrow_product,
    transposed_product, zeros,
};

/// Returns the median of some values, or `None` if there are none. The median of an even number of
/// values is the mean of the two middle ones.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    Some(if sorted.len() % 2 == 1 { upper } else { 0.5 * (sorted[sorted.len() / 2 - 1] + upper) })
}

/// Returns the different numbers among some values, in ascending order.
pub(crate) fn levels(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut levels: Vec<f64> = values.into_iter().collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

/// Returns at most `count` of some items, evenly spaced.
pub(crate) fn spaced<T>(items: Vec<T>, count: usize) -> Vec<T> {
    let step = items.len().div_ceil(count).max(1);
    items.into_iter().step_by(step).collect()
}

/// Returns the root of the mean of some squares; 0 if there are none.
pub(crate) fn root_mean(squares: impl IntoIterator<Item = f64>) -> f64 {
    let (count, sum) = squares.into_iter().fold((0, 0.0), |(n, sum), square| (n + 1, sum + square));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Returns the integer part of a count or index of at least 0; 0 for smaller values and for NaN.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts are limited")]
pub(crate) fn whole(value: f64) -> usize {
    value as usize
}

/// Returns the smallest and the largest of the finite values; (∞, −∞) if there are none.
pub(crate) fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

/// Halves the interval `(low, high)` `halvings` times and returns the part in which `is_below`
/// changes from true to false. It is assumed to be true at `low` and false at `high`.
pub(crate) fn bisect(
    is_below: impl Fn(f64) -> bool,
    (mut low, mut high): (f64, f64),
    halvings: usize,
) -> (f64, f64) {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_below(middle) { low = middle } else { high = middle }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_few_values() {
        assert_eq!(median([]), None);
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median([1.0, f64::INFINITY, f64::INFINITY, 2.0]), Some(f64::INFINITY));
    }

    #[test]
    fn a_root_is_bracketed() {
        let (low, high) = bisect(|x| x * x < 2.0, (0.0, 2.0), 40);
        assert!(low < 2.0_f64.sqrt() && 2.0_f64.sqrt() <= high && high - low < 1e-11);
    }
}

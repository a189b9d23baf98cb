//! Axis limits that a few large values do not stretch.

/// Fraction of the values that always lies within the axis.
const INNER_FRACTION: f64 = 0.95;
/// Ratio of the largest value to the inner ones above which values are left outside the axis. Among
/// a hundred thousand values, noise alone gives 2.3.
const OUTLIER_RATIO: f64 = 2.5;
/// Ratio of the axis limit to the inner values if values are left outside.
const INNER_MARGIN: f64 = 1.8;

/// Returns the limit of an axis about zero: the largest absolute value, or, with outliers, a
/// multiple of the inner values.
pub fn axis_limit(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> =
        values.into_iter().map(f64::abs).filter(|size| size.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(&largest) = sizes.last() else { return 0.0 };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a fraction of a length"
    )]
    let inner = sizes[((sizes.len() - 1) as f64 * INNER_FRACTION) as usize];
    if inner > 0.0 && largest > OUTLIER_RATIO * inner { INNER_MARGIN * inner } else { largest }
}

/// Returns the sentence of a caption on values beyond the axes, for example " 3 values lie beyond
/// the axes: rings at the rim."; empty for none.
pub fn beyond_note(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => " One value lies beyond the axes: a ring at the rim.".to_owned(),
        n => format!(" {n} values lie beyond the axes: rings at the rim."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outlier_does_not_stretch_the_axis() {
        let noise = (0..100).map(|k| f64::from(k % 10) - 4.5);
        assert!((axis_limit(noise.clone()) - 4.5).abs() < 1e-12);
        assert!((axis_limit(noise.chain([-900.0])) - INNER_MARGIN * 4.5).abs() < 1e-12);
        assert!(axis_limit([]).abs() < 1e-12 && (axis_limit([0.0, 0.0, 3.0]) - 3.0).abs() < 1e-12);
    }
}

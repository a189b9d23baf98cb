//! Axes that a few large values do not flatten.

/// The part of the values that always stays within an axis.
const INNER: f64 = 0.95;
/// An axis leaves values out that are larger than this times what the inner ones reach: noise alone
/// comes to 2.3 times among a hundred thousand values.
const BEYOND: f64 = 2.5;
/// Then it reaches so many times as far as the inner ones.
const ROOM: f64 = 1.8;

/// How far an axis reaches about zero to show values: to the largest, or where few are far beyond
/// the others, as those need.
pub fn reach(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> =
        values.into_iter().map(f64::abs).filter(|size| size.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(&largest) = sizes.last() else { return 0.0 };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a part of a length"
    )]
    let inner = sizes[((sizes.len() - 1) as f64 * INNER) as usize];
    if inner > 0.0 && largest > BEYOND * inner { ROOM * inner } else { largest }
}

/// " 3 values lie beyond the axes: rings at the rim." where any do.
pub fn beyond(count: usize) -> String {
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
    fn one_outlier_flattens_nothing() {
        let noise = (0..100).map(|k| f64::from(k % 10) - 4.5);
        assert!((reach(noise.clone()) - 4.5).abs() < 1e-12);
        assert!((reach(noise.chain([-900.0])) - ROOM * 4.5).abs() < 1e-12);
        assert!(reach([]).abs() < 1e-12 && (reach([0.0, 0.0, 3.0]) - 3.0).abs() < 1e-12);
    }
}

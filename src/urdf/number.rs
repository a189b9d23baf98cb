//! Numbers in a URDF.

/// Parses N numbers separated by white space. Returns `None` if there are fewer or more, or if one
/// is not finite or larger than 10¹⁵⁰.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut words = text.split_ascii_whitespace();
    let mut out = [0.0; N];
    for value in &mut out {
        *value = words
            .next()?
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite() && value.abs() <= 1e150)?;
    }
    words.next().is_none().then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_n_finite_numbers_are_accepted() {
        assert_eq!(numbers("1 -2.5\t3e-1\n"), Some([1.0, -2.5, 0.3]));
        for text in ["", "1 2", "1 2 3 4", "1 2 nan", "1 2 inf", "1 2 x", "1,2,3", "1 2 1e200"] {
            assert_eq!(numbers::<3>(text), None, "{text}");
        }
    }
}

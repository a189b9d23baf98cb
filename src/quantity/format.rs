//! Formats of numbers in texts and tables.

/// Smallest magnitude that is written with a power of ten.
const MIN_SCIENTIFIC_SIZE: f64 = 1e12;
/// Maximum number of decimals of a value with a standard error.
pub(crate) const MAX_DECIMALS: usize = 6;
/// Smallest p-value that is written out. A smaller one depends more on the assumed distribution
/// than on the data.
const MIN_WRITTEN_P: f64 = 1e-16;

/// Returns the number of decimals that shows `error` with two significant digits, at most `most`.
/// Returns `most` if `error` is not above 0 or not finite.
pub(crate) fn decimals(error: f64, most: usize) -> usize {
    if error <= 0.0 || !error.is_finite() {
        return most;
    }
    let wanted = 1.0 - error.log10().floor();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=most"
    )]
    let wanted = wanted.clamp(0.0, most as f64) as usize;
    wanted
}

/// Formats `value` with two significant digits, but with at most `most` decimals.
pub(crate) fn two_digits(value: f64, most: usize) -> String {
    number(value, decimals(value, most))
}

/// Formats `value` with about three significant digits and at most four decimals.
pub(crate) fn about_three_digits(value: f64) -> String {
    number(value, (decimals(value, 4) + 1).min(4))
}

/// Formats `value` with `decimals` decimals, never as "-0"; huge values as `1.234e300`, and values
/// that are not finite as "–".
pub(crate) fn number(value: f64, decimals: usize) -> String {
    match value.abs() {
        size if size < MIN_SCIENTIFIC_SIZE => fixed(value, decimals),
        size if size.is_finite() => format!("{value:.3e}"),
        _ => "–".to_owned(),
    }
}

/// Formats 10 to the power of a whole number: "10⁻⁶".
pub(crate) fn power_of_ten(exponent: f64) -> String {
    let superscript = |digit: char| match digit {
        '-' => Some('⁻'),
        digit => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize),
    };
    let exponent: String = format!("{exponent:.0}").chars().filter_map(superscript).collect();
    format!("10{exponent}")
}

/// Formats `value` with `decimals` decimals for tables that programs read, never as "-0"; empty if
/// it is not finite.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

/// Formats a count with its noun: "1 pose", "3 poses".
pub(crate) fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Returns a probability in percent, rounded to four decimals.
pub(crate) fn percent_of(probability: f64) -> f64 {
    (probability * 1e6).round() / 1e4
}

/// Formats a length \[m\] in mm with `decimals` decimals.
pub(crate) fn mm(length: f64, decimals: usize) -> String {
    number(length * 1e3, decimals)
}

/// Formats a value by the function `words`; returns "–" for `None`.
pub(crate) fn or_dash<T>(value: Option<T>, words: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), words)
}

/// Formats a p-value: `0.003`, `2e-9`, `below 1e-16`.
pub(crate) fn p_value(p: f64) -> String {
    match p {
        p if p < MIN_WRITTEN_P => "below 1e-16".to_owned(),
        p if p < 1e-3 => format!("{p:.0e}"),
        p => format!("{p:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_show_two_digits() {
        assert_eq!(decimals(0.0123, 6), 3);
        assert_eq!(decimals(1.5, 6), 1);
        assert_eq!(decimals(314.0, 6), 0);
        assert_eq!(decimals(1e-12, 6), 6);
        assert_eq!(number(-0.0001, 3), "0.000");
        assert_eq!(number(-0.5, 1), "-0.5");
        assert_eq!(number(-1.5e300, 4), "-1.500e300");
        assert_eq!((fixed(f64::NAN, 2), fixed(f64::INFINITY, 2)), (String::new(), String::new()));
        assert_eq!(
            (number(f64::NAN, 2), number(f64::INFINITY, 2)),
            ("–".to_owned(), "–".to_owned())
        );
    }
}

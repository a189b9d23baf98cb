//! Numbers as a URDF writes them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Fewest and most decimals of a rounded right angle: `1.57` has two, and with six the rounding is
/// below a microradian.
const ROUNDED: std::ops::RangeInclusive<usize> = 2..=5;
/// Fewest decimals of a rounded half of a right angle: `0.79` may be meant.
const ROUNDED_HALF: usize = 4;

/// N finite numbers that stand in a text, and nothing else.
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

/// The multiple of a right angle, or of half of one, that a few decimals stand for: π/2 of `1.5708`
/// or `1.57`.
pub(super) fn meant_angle(written: &str) -> Option<f64> {
    let (_, decimals) = written.split_once('.')?;
    let value: f64 = written.parse().ok()?;
    let places = decimals.len();
    if !ROUNDED.contains(&places)
        || !decimals.bytes().all(|byte| byte.is_ascii_digit())
        || value == 0.0
    {
        return None;
    }
    let unit = if places < ROUNDED_HALF { FRAC_PI_2 } else { FRAC_PI_4 };
    let meant = (value / unit).round() * unit;
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "at most five")]
    let last = 10_f64.powi(-(places as i32));
    let cut = meant.abs() - value.abs();
    let rounded = cut.abs() <= 0.500_001 * last || (0.0..last).contains(&cut);
    (meant != 0.0 && rounded && meant.to_bits() != value.to_bits()).then_some(meant)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn rounded_right_angles_are_meant() {
        for (written, meant) in [
            ("1.5708", FRAC_PI_2),
            ("1.57", FRAC_PI_2),
            ("-1.570", -FRAC_PI_2),
            ("3.14", PI),
            ("3.1416", PI),
            ("3.14159", PI),
            ("-0.7854", -FRAC_PI_4),
            ("4.71239", 3.0 * FRAC_PI_2),
        ] {
            assert_eq!(meant_angle(written), Some(meant), "{written}");
        }
        for written in [
            "1.570796",
            "1.57079632679",
            "1.58",
            "1.6",
            "0.79",
            "0.5236",
            "0",
            "0.00",
            "1.5e0",
            "1.571e0",
            "x.57",
        ] {
            assert_eq!(meant_angle(written), None, "{written}");
        }
        assert_eq!(numbers("1 -2.5\t3e-1\n"), Some([1.0, -2.5, 0.3]));
        for text in ["", "1 2", "1 2 3 4", "1 2 nan", "1 2 inf", "1 2 x", "1,2,3", "1 2 1e200"] {
            assert_eq!(numbers::<3>(text), None, "{text}");
        }
    }
}

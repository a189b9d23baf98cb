//! Right angles that were rounded to a few decimals of a radian.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Numbers of decimals with which an angle may be a rounded right angle. With more decimals,
/// rounding is below a microradian and is ignored.
const ROUNDED_DECIMALS: std::ops::RangeInclusive<usize> = 2..=5;
/// Minimum number of decimals of a rounded 45° angle, because a number with fewer, such as `0.79`,
/// may be exact.
const MIN_DECIMALS_OF_45_DEGREES: usize = 4;

/// Returns the multiple of 90° or 45° from which a written angle was rounded: π/2 for `1.5708` or
/// `1.57`. `None` if there is none.
pub(crate) fn unrounded_right_angle(written: &str) -> Option<f64> {
    let (_, decimals) = written.split_once('.')?;
    let value: f64 = written.parse().ok()?;
    let places = decimals.len();
    if !ROUNDED_DECIMALS.contains(&places)
        || !decimals.bytes().all(|byte| byte.is_ascii_digit())
        || value == 0.0
    {
        return None;
    }
    let unit = if places < MIN_DECIMALS_OF_45_DEGREES { FRAC_PI_2 } else { FRAC_PI_4 };
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
    fn rounded_right_angles_are_recognised() {
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
            assert_eq!(unrounded_right_angle(written), Some(meant), "{written}");
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
            assert_eq!(unrounded_right_angle(written), None, "{written}");
        }
    }
}

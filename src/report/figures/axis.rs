//! Axes with round tick values.

use super::svg::{Colour, MUTED};
use crate::numeric::whole;
use crate::quantity::format::{number, power_of_ten};

/// Fraction of the values, the smallest in absolute value, that an axis always includes (the inner
/// values).
const INNER_FRACTION: f64 = 0.95;
/// Ratio of the largest absolute value to the largest inner value, above which an axis leaves out
/// the outlying values. Noise alone gives 2.3 for a hundred thousand values.
const OUTLIER_RATIO: f64 = 2.5;
/// Ratio of the axis limit to the largest inner value, if outlying values are left out.
const INNER_MARGIN: f64 = 1.8;
/// Sets of tick values within a decade of a logarithmic axis. The first set with few enough ticks
/// is used.
const DECADE_TICKS: [&[f64]; 4] =
    [&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];

/// Axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Values at both ends: left and right, or bottom and top; logarithms to base 10 for a
    /// logarithmic axis.
    pub range: (f64, f64),
    /// Label with the unit; empty for none.
    pub label: String,
    /// Ticks with their texts.
    pub ticks: Vec<Tick>,
    /// True if the ticks are numbers, false if they name rows.
    pub is_numeric: bool,
}

/// Tick of an axis: value, text and colour of the text.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    pub at: f64,
    pub text: String,
    pub colour: Colour,
}

impl Axis {
    /// Creates a linear axis with about `count` tick labels.
    pub fn linear(range: (f64, f64), label: &str, count: usize) -> Self {
        let (low, high) = widened(range);
        // `count` numbers divide the axis into `count` + 1 parts.
        let parts = (count + 1) as f64;
        let step = if count > 0 { round_step((high - low) / parts) } else { f64::INFINITY };
        let digits = decimal_count((-step.log10()).ceil());
        let first = (low / step - 1e-9).ceil();
        let values = (0..=64).map(|k| (first + f64::from(k)) * step);
        let ticks = values.take_while(|value| *value <= high + 1e-9 * (high - low));
        let exponent = low.abs().max(high.abs()).log10().floor();
        let tick = |at: f64| (at, linear_number(at, digits, (exponent, step)).replace('-', "−"));
        let ticks: Vec<_> = if count > 0 { ticks.map(tick).collect() } else { Vec::new() };
        Self::new((low, high), label, ticks)
    }

    /// Creates a logarithmic axis with about `count` tick labels; `range` is in common logarithms.
    pub fn logarithmic(range: (f64, f64), label: &str, count: usize) -> Self {
        let (low, high) = widened(range);
        let every = ((high - low) / count.max(1) as f64).round().max(1.0);
        let first = (low / every).floor() * every;
        let ticks = |steps: &[f64]| -> Vec<(f64, String)> {
            let decades = (0..=64).map(|k| first + every * f64::from(k));
            let value = |decade: f64, step: f64| (decade + step.log10(), power(decade, step));
            let values =
                decades.flat_map(|decade| steps.iter().map(move |step| value(decade, *step)));
            values.filter(|(at, _)| (low - 1e-9..=high + 1e-9).contains(at)).collect()
        };
        let steps = if every > 1.0 { &DECADE_TICKS[3..] } else { &DECADE_TICKS };
        let dense = steps.iter().map(|steps| ticks(steps)).find(|ticks| ticks.len() <= count + 2);
        let ticks = dense.unwrap_or_else(|| ticks(DECADE_TICKS[3]));
        Self::new((low, high), label, ticks)
    }

    /// Creates a vertical axis of row names; name k is at the value k, with k = 0 at the top.
    pub fn names(names: impl IntoIterator<Item = (String, Colour)>) -> Self {
        let tick =
            |(k, (text, colour)): (usize, (String, Colour))| Tick { at: k as f64, text, colour };
        let ticks: Vec<Tick> = names.into_iter().enumerate().map(tick).collect();
        let range = (ticks.len() as f64 - 0.5, -0.5);
        Self { range, label: String::new(), ticks, is_numeric: false }
    }

    /// Creates an axis without ticks and label.
    pub fn bare(range: (f64, f64)) -> Self {
        Self::new(widened(range), "", Vec::new())
    }

    fn new(range: (f64, f64), label: &str, ticks: Vec<(f64, String)>) -> Self {
        let ticks = ticks.into_iter().map(|(at, text)| Tick { at, text, colour: MUTED });
        Self { range, label: label.to_owned(), ticks: ticks.collect(), is_numeric: true }
    }
}

/// Largest exponent of the values of a linear axis whose ticks are written without a power of ten.
const MAX_PLAIN_EXPONENT: f64 = 5.0;

/// Returns a tick value of a linear axis as text with `digits` decimals. If the `exponent` of the
/// largest value is above [`MAX_PLAIN_EXPONENT`], it is written with that power of ten: `2.5·10⁹`.
fn linear_number(value: f64, digits: usize, (exponent, step): (f64, f64)) -> String {
    if exponent <= MAX_PLAIN_EXPONENT || value == 0.0 {
        return number(value, digits);
    }
    let mantissa_digits = decimal_count((exponent - step.log10()).ceil());
    let mantissa = number(value / 10.0_f64.powf(exponent), mantissa_digits);
    format!("{mantissa}·{}", power_of_ten(exponent))
}

/// Returns 10^`exponent` × `step` as text: `0.05`, `30`, or `10⁻⁶`.
fn power(exponent: f64, step: f64) -> String {
    if (-4.0..5.0).contains(&exponent) {
        let digits = decimal_count(-exponent) + usize::from(step.fract() > 0.0 && exponent < 1.0);
        return number(step * 10.0_f64.powf(exponent), digits);
    }
    let power = power_of_ten(exponent);
    if step > 1.0 { format!("{step}·{power}") } else { power }
}

/// Returns a number of decimals: the integer part of the value, limited to 0…12.
fn decimal_count(value: f64) -> usize {
    whole(value.clamp(0.0, 12.0))
}

/// Returns the smallest of 1, 2, 5 or 10 times a power of ten that is at least `value`.
fn round_step(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|factor| factor * power);
    steps.into_iter().find(|step| *step >= value).unwrap_or(10.0 * power)
}

/// Returns the range, or one of positive width for a single value or for none.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    match (low.is_finite() && high.is_finite(), high - low) {
        (false, _) => (0.0, 1.0),
        (true, width) if width > 0.0 => (low, high),
        (true, _) => (low - 0.5 * low.abs().max(1e-9), low + 0.5 * low.abs().max(1e-9)),
    }
}

/// Widens a range at both ends by a fraction of its width.
pub fn with_margin((low, high): (f64, f64), fraction: f64) -> (f64, f64) {
    let margin = fraction * (high - low);
    (low - margin, high + margin)
}

/// Returns the limit of an axis that is symmetric about zero: the largest absolute value or, if
/// there are outliers, a multiple of the largest inner value.
pub fn axis_limit(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> =
        values.into_iter().map(f64::abs).filter(|size| size.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(&largest) = sizes.last() else { return 0.0 };
    let inner = sizes[whole((sizes.len() - 1) as f64 * INNER_FRACTION)];
    if inner > 0.0 && largest > OUTLIER_RATIO * inner { INNER_MARGIN * inner } else { largest }
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

    #[test]
    fn ticks_are_round() {
        let texts = |axis: &Axis| {
            axis.ticks.iter().map(|tick| tick.text.clone()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(texts(&Axis::linear((-1.3, 1.3), "", 5)), "−1.0 −0.5 0.0 0.5 1.0");
        assert_eq!(texts(&Axis::logarithmic((-1.7, 0.7), "", 6)), "0.02 0.05 0.1 0.2 0.5 1 2 5");
        assert_eq!(texts(&Axis::logarithmic((-7.2, 0.0), "", 4)), "10⁻⁶ 0.0001 0.01 1");
        assert_eq!(
            texts(&Axis::linear((0.0, 1.1e10), "", 5)),
            "0 0.2·10¹⁰ 0.4·10¹⁰ 0.6·10¹⁰ 0.8·10¹⁰ 1.0·10¹⁰"
        );
        assert_eq!(texts(&Axis::linear((0.0, 150_000.0), "", 2)), "0 50000 100000 150000");
        assert_eq!(texts(&Axis::bare((0.0, 1.0))), "");
    }
}

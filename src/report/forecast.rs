//! Expected standard errors as people and programs read them.

use super::json::object;
use super::quantity::{decimals, number, or_dash};
use crate::design::Expected;
use crate::quantity::Display;

/// Decimals of any value at most.
const MOST: usize = 6;

object! {
    /// A parameter before anything is measured.
    ExpectedEntry<'a>(expected: &'a Expected) {
        name: &'a str = &expected.name,
        unit: &'a str = expected.unit.symbol(),
        nominal: f64 = expected.nominal,
        prior_sigma: Option<f64> = expected.prior,
        std_error: Option<f64> = expected.std_error,
        identified: f64 = expected.identified,
    }
}

/// Nominal value and some errors \[SI\] of a parameter in a unit for display: cells, and the unit.
pub(super) fn cells(expected: &Expected, errors: &[Option<f64>]) -> (Vec<String>, String) {
    let unit = expected.unit.display(expected.nominal);
    let digits = errors.iter().flatten().map(|error| decimals(error * unit.factor, MOST)).min().unwrap_or(4).min(4);
    let mut cells = vec![expected.name.clone(), number(expected.nominal * unit.factor, digits)];
    cells.extend(errors.iter().map(|&error| size(error, &unit)));
    (cells, unit.symbol)
}

/// A size \[SI\] with two digits that count.
pub(super) fn size(value: Option<f64>, unit: &Display) -> String {
    or_dash(value.map(|value| value * unit.factor), |value| number(value, decimals(value, MOST)))
}

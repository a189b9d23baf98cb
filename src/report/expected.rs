//! Expected standard errors as people and programs read them.

use serde::Serialize;

use super::quantity::{decimals, number};
use crate::design::Expected;

/// Decimals of any value at most.
const MOST: usize = 6;

/// A parameter before anything is measured.
#[derive(Debug, Serialize)]
pub(super) struct ExpectedEntry<'a> {
    name: &'a str,
    unit: &'a str,
    nominal: f64,
    prior_sigma: Option<f64>,
    std_error: Option<f64>,
    identified: f64,
}

impl<'a> ExpectedEntry<'a> {
    pub fn of(expected: &'a Expected) -> Self {
        Self {
            name: &expected.name,
            unit: expected.unit.symbol(),
            nominal: expected.nominal,
            prior_sigma: expected.prior,
            std_error: expected.std_error,
            identified: expected.identified,
        }
    }
}

/// Nominal value and some errors [SI] of a parameter in a unit for display: cells, and the unit.
pub(super) fn cells(expected: &Expected, errors: &[Option<f64>]) -> (Vec<String>, String) {
    let unit = expected.unit.display(expected.nominal);
    let show = |value: Option<f64>| {
        value.map_or_else(|| "–".to_owned(), |v| number(v * unit.factor, decimals(v * unit.factor, MOST)))
    };
    let digits = errors.iter().flatten().map(|error| decimals(error * unit.factor, MOST)).min().unwrap_or(4).min(4);
    let mut cells = vec![expected.name.clone(), number(expected.nominal * unit.factor, digits)];
    cells.extend(errors.iter().map(|&error| show(error)));
    (cells, unit.symbol)
}

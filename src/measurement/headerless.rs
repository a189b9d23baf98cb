//! Tables without a header, whose columns are selected by their places.

use crate::problem::{ColumnRule, ColumnSelector};

/// Returns true if the `cells` of the first record are a row, not a header. A rule must select a
/// column by its place in which the record has a number. The numbers of the record must not be 0,
/// 1, 2, … or 1, 2, 3, …, which number the columns.
pub(super) fn is_row_of_numbers(cells: &[String], rules: &[ColumnRule]) -> bool {
    let number = |cell: &String| {
        cell.replace(',', ".").parse::<f64>().ok().filter(|number| number.is_finite())
    };
    let cell = |rule: &ColumnRule| match rule.theirs {
        ColumnSelector::Place(place) => cells.get(place.checked_sub(1)?),
        _ => None,
    };
    let numbers: Vec<f64> = cells.iter().filter_map(number).collect();
    let counts = |from: f64| {
        let expected = |k: usize| from + k as f64;
        numbers.iter().enumerate().all(|(k, number)| (number - expected(k)).abs() < 1e-9)
    };
    let is_selected = rules.iter().filter_map(cell).any(|cell| number(cell).is_some());
    is_selected && !counts(0.0) && !counts(1.0)
}

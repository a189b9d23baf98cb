//! Tables without a header, whose columns are selected by their places.

use super::latin::parsed;
use super::meaning::is_numbered_or_position;
use crate::error::TableErrorKind;
use crate::problem::{ColumnRule, ColumnSelector};

/// Returns true if the `cells` of the first record are a row, not a header. A rule must select a
/// column by its place in which the record has a number. The numbers of the record must not be 0,
/// 1, 2, … or 1, 2, 3, …, which number the columns.
pub(super) fn is_row_of_numbers(cells: &[String], rules: &[ColumnRule]) -> bool {
    let number = |cell: &String| parsed(cell).filter(|number| number.is_finite());
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

/// Returns true if most names of a header are numbers, as in a table without a header.
pub(super) fn holds_numbers(header: &[String]) -> bool {
    let numbers = header.iter().filter(|name| parsed(name).is_some());
    header.len() > 2 && 2 * numbers.count() > header.len()
}

/// Returns the error of a table whose first line holds numbers.
pub(super) fn no_header(header: &[String]) -> TableErrorKind {
    let is_number = |name: &String| parsed(name).is_some();
    // The name of a pose, such as P01, has a number, and that of a quantity has none.
    let is_quantity = |name: &String| {
        is_numbered_or_position(name) || !name.contains(|letter: char| letter.is_ascii_digit())
    };
    match header {
        [first, others @ ..] if !is_number(first) && others.iter().all(is_number) => {
            if is_quantity(first) {
                TableErrorKind::Transposed { first: first.clone() }
            } else {
                TableErrorKind::NoHeader { select: "\"#1\" = \"pose\", \"#2\" = \"x_mm\"" }
            }
        }
        _ => TableErrorKind::NoHeader { select: "\"#1\" = \"q1_deg\"" },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_line_of_numbers_is_no_header() {
        let header =
            |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let transposed = no_header(&header(&["q1_deg", "1.5", "2"]));
        assert_eq!(transposed, TableErrorKind::Transposed { first: "q1_deg".to_owned() });
        let select = "\"#1\" = \"q1_deg\"";
        let kind = TableErrorKind::NoHeader { select };
        assert_eq!(no_header(&header(&["1", "1.5", "2"])), kind);
        let select = "\"#1\" = \"pose\", \"#2\" = \"x_mm\"";
        let kind = TableErrorKind::NoHeader { select };
        assert_eq!(no_header(&header(&["P01", "1.5", "2"])), kind);
    }
}

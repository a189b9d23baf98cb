//! Cells with restricted values.

use super::columns::Column;
use super::table::{Table, shortened};
use crate::error::{InputError, InputErrorKind, TableErrorKind};

/// Reads a number from the current row's cell of `column`, which must be above zero; returns it in
/// SI units.
pub(super) fn above_zero(table: &Table, column: &Column) -> Result<f64, InputError> {
    let value = table.number(column.place)?;
    // A tiny length in millimetres may underflow to 0 in metres.
    let converted = (column.to_si)(value);
    if converted > 0.0 {
        Ok(converted)
    } else {
        Err(table.cell_error(column.place, InputErrorKind::NotPositive { value }))
    }
}

/// Reads a number from the current row's cell of `column`, which must not be negative; returns it
/// in SI units.
pub(super) fn not_negative(table: &Table, column: &Column) -> Result<f64, InputError> {
    let value = table.number(column.place)?;
    if value < 0.0 {
        Err(table.cell_error(column.place, InputErrorKind::Negative { value }))
    } else {
        Ok((column.to_si)(value))
    }
}

/// Reads a direction of approach from the current row's cell of `column`: −1, 0 or +1.
pub(super) fn direction(table: &Table, column: &Column) -> Result<f64, InputError> {
    let word = table.non_empty_text(column.place)?;
    if word.chars().all(char::is_alphabetic) {
        let kind = TableErrorKind::DirectionInWords { value: shortened(word) };
        return Err(table.cell_error(column.place, kind));
    }
    let value = table.number(column.place)?;
    if [-1.0, 0.0, 1.0].contains(&value) {
        Ok(value)
    } else {
        Err(table.cell_error(column.place, TableErrorKind::NotADirection { value }))
    }
}

/// Returns true if the current row's cell in the column with index `place` is the word
/// `validation`, and false if it is `identification`; other words are errors.
pub(super) fn is_validation(table: &Table, place: usize) -> Result<bool, InputError> {
    match table.non_empty_text(place)? {
        "validation" => Ok(true),
        "identification" => Ok(false),
        word => {
            let meant = match word.to_lowercase().as_str() {
                "validation" | "valid" | "val" | "test" | "held_out" | "held-out" | "holdout" => {
                    Some("validation")
                }
                "identification" | "ident" | "train" | "training" | "fit" => Some("identification"),
                _ => None,
            };
            let kind = TableErrorKind::UnknownSplit { word: shortened(word), meant };
            Err(table.cell_error(place, kind))
        }
    }
}

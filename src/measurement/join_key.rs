//! Columns by which the rows of two tables are paired.

/// Column that pairs rows, and its conversion to seconds if it holds times.
#[derive(Clone, Copy)]
pub(super) struct Key {
    /// Index of the column.
    pub place: usize,
    /// Conversion of the cells to seconds.
    pub to_si: fn(f64) -> f64,
}

/// Returns the index of the column with names of poses, `pose` or else `name`.
pub(super) fn name_column(names: &[String]) -> Option<usize> {
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    place("pose").or_else(|| place("name"))
}

/// Conversion of a number to its SI unit.
type ToSi = fn(f64) -> f64;

/// Units of columns with times, each with its conversion to seconds. Controllers log milliseconds.
pub(super) const TIME_UNITS: [(&str, ToSi); 2] = [("s", |x| x), ("ms", |x| x / 1000.0)];

/// Returns the column with times: one with a unit, else `time`, whose cells must be dates.
pub(super) fn time_key(names: &[String]) -> Option<Key> {
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    let with_unit = TIME_UNITS.iter().find_map(|(unit, to_si)| {
        Some(Key { place: place(&format!("time_{unit}"))?, to_si: *to_si })
    });
    with_unit.or_else(|| place("time").map(|place| Key { place, to_si: |_| f64::NAN }))
}

/// Returns true for the name of a column with times.
pub(super) fn is_time(name: &str) -> bool {
    let has_unit = |unit: &str| TIME_UNITS.iter().any(|(known, _)| *known == unit);
    name == "time" || name.strip_prefix("time_").is_some_and(has_unit)
}

//! Times as numbers and as dates, and as text for messages.

mod dates;
mod parts;

pub(super) use dates::{DateOrder, assumed, date_part, date_time, is_ambiguous};
use parts::days;

/// Units of numbers that are times since 1970: noun, number of them in a second, and remedy.
const EPOCH_UNITS: [(&str, f64, &str); 4] = [
    ("seconds", 1.0, "call the column time_s"),
    ("milliseconds", 1e3, "call the column time_ms"),
    ("microseconds", 1e6, "divide them by 1000 and call the column time_ms"),
    ("nanoseconds", 1e9, "divide them by 1e6 and call the column time_ms"),
];

/// Days from the zero of other programs to 1970-01-01, with their names: serial dates of
/// spreadsheets, `datenum` of MATLAB, and modified Julian and Julian dates.
const DAY_NUMBERS: [(&str, f64); 4] = [
    ("a spreadsheet", 25_569.0),
    ("MATLAB", 719_529.0),
    ("the modified Julian calendar", 40_587.0),
    ("the Julian calendar", 2_440_587.5),
];

/// End of the times that are taken for those of a measurement \[s since 1970\]: 2040-01-01.
const LAST_DATE: f64 = 2_208_988_800.0;

/// Describes a number in a column of times whose name states no unit, with its remedy; `None` for
/// other texts.
pub(super) fn number_as_time(text: &str) -> Option<String> {
    let number: f64 = text.trim().replace(',', ".").parse().ok()?;
    let is_date = |seconds: &f64| (FIRST_DATE..LAST_DATE).contains(seconds);
    for (noun, count, remedy) in EPOCH_UNITS {
        if is_date(&(number / count)) {
            return Some(format!(
                "a number of {noun} since 1970, {}; {remedy}",
                shown(number / count)
            ));
        }
    }
    for (program, zero) in DAY_NUMBERS {
        let seconds = (number - zero) * 86_400.0;
        if is_date(&seconds) {
            return Some(format!(
                "a number without a unit; as a day number of {program} it is {}: then format the \
                 column as date and time, and export it again; if it counts seconds, call the \
                 column time_s",
                shown(seconds.round())
            ));
        }
    }
    Some(
        "a number without a unit; call the column time_s or time_ms, or write dates and times"
            .to_owned(),
    )
}

/// Smallest time that [`shown`] writes as a date \[s since 1970\]: 1990-01-01. Smaller numbers are
/// seconds of a clock with another zero.
pub(super) const FIRST_DATE: f64 = 631_152_000.0;

/// Returns a time as text: a date and time from [`FIRST_DATE`] on, else seconds.
pub(super) fn shown(seconds: f64) -> String {
    if seconds < FIRST_DATE {
        return format!("{seconds:.1} s");
    }
    #[expect(clippy::cast_possible_truncation, reason = "whole seconds")]
    let whole = seconds as i64;
    let (day, clock) = (whole.div_euclid(86_400), whole.rem_euclid(86_400));
    let after = |&year: &i64| days(year, 1, 1) <= day;
    let year = (1970..10_000).take_while(after).last().unwrap_or(1970);
    let month = (1..=12).rev().find(|&month| days(year, month, 1) <= day).unwrap_or(1);
    let date = day - days(year, month, 1) + 1;
    let [hour, minute, second] = [clock / 3600, clock / 60 % 60, clock % 60];
    format!("{year}-{month:02}-{date:02} {hour:02}:{minute:02}:{second:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_shown_as_dates_or_seconds() {
        assert_eq!(shown(1_717_157_000.25), "2024-05-31 12:03:20");
        assert_eq!(shown(12.5), "12.5 s");
    }
}

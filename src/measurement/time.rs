//! Parsers of dates and times.

use std::borrow::Cow;

/// Order of day and month in dates with slashes and the year last, such as `05/31/2024`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum DateOrder {
    /// No number above 12 shows the order, or dates contradict each other.
    #[default]
    Unknown,
    /// The same in a table with decimal commas: where these are written, the day stands first.
    LikelyDayFirst,
    DayFirst,
    MonthFirst,
}

impl DateOrder {
    /// Returns the order of the dates in a text. It is known by a date in which one number is above
    /// 12 and thus the day.
    pub fn of(text: &[u8]) -> Self {
        let words = text.split(|byte| !(byte.is_ascii_digit() || *byte == b'/'));
        let orders = words.filter_map(|word| Self::of_date(slashed(str::from_utf8(word).ok()?)?));
        let (mut day_first, mut month_first) = (false, false);
        for order in orders {
            day_first |= order == Self::DayFirst;
            month_first |= order == Self::MonthFirst;
        }
        match (day_first, month_first) {
            (true, false) => Self::DayFirst,
            (false, true) => Self::MonthFirst,
            _ => Self::Unknown,
        }
    }

    /// Returns the order of a date of which one number is above 12; `None` for other dates.
    fn of_date([first, second, _]: [u32; 3]) -> Option<Self> {
        match (first > 12, second > 12) {
            (true, false) => Some(Self::DayFirst),
            (false, true) => Some(Self::MonthFirst),
            _ => None,
        }
    }
}

/// Parses a date and time of ISO 8601, day first (`31.05.2024 14:03:20`), or with slashes
/// (`2024/05/31 14:03:20`, `05/31/2024 02:03:20 PM`) and returns the seconds since 1970-01-01T00:00
/// UTC.
///
/// If the year stands last after slashes, `order` or a number above 12 shows which number is the
/// day. If neither does, the month is first if the time has AM or PM; otherwise the date is not
/// accepted ([`is_ambiguous`]).
pub(super) fn date_time(text: &str, order: DateOrder) -> Option<f64> {
    let text = &*with_colons(text);
    iso_8601(text)
        .or_else(|| iso_8601(&iso_from_day_first(text.trim())?))
        .or_else(|| iso_8601(&iso_from_slashes(text.trim())?))
        .or_else(|| {
            let (date, basis) = iso_from_year_last(text.trim(), order)?;
            iso_8601(&date).filter(|_| basis != Basis::Guess)
        })
}

/// Returns a date and time whose time of day has colons in place of points, as in `14.02.29`, and
/// whose date ends without a comma.
fn with_colons(text: &str) -> Cow<'_, str> {
    let Some((date, clock)) = text.trim().split_once(' ') else { return Cow::Borrowed(text) };
    let clock = clock.trim_start();
    let has_points = !clock.contains(':') && clock.matches('.').count() >= 2;
    if !has_points && !date.ends_with(',') {
        return Cow::Borrowed(text);
    }
    let clock = if has_points { clock.replacen('.', ":", 2) } else { clock.to_owned() };
    Cow::Owned(format!("{} {clock}", date.trim_end_matches(',')))
}

/// Returns true for a date with slashes whose day and month may stand in either order, so that
/// [`date_time`] does not accept it.
pub(super) fn is_ambiguous(text: &str, order: DateOrder) -> bool {
    iso_from_year_last(with_colons(text).trim(), order)
        .is_some_and(|(date, basis)| basis == Basis::Guess && iso_8601(&date).is_some())
}

/// Returns the date, such as `2026-11-05`, of a time whose order of day and month is assumed: the
/// month is first because of AM or PM, or the day because of decimal commas (true). `None` for
/// other times.
pub(super) fn assumed(text: &str, order: DateOrder) -> Option<(String, bool)> {
    let (date, basis) = iso_from_year_last(text.trim(), order)?;
    let differs = date.get(5..7)? != date.get(8..10)?;
    let is_assumed = matches!(basis, Basis::HalfOfDay | Basis::DecimalComma);
    (is_assumed && differs && iso_8601(&date).is_some())
        .then(|| Some((date.get(..10)?.to_owned(), basis == Basis::DecimalComma)))?
}

/// Reason for the order in which day and month of a date were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Basis {
    /// A number above 12 in this date or in the other dates of its table.
    Numbers,
    /// AM or PM, which are usual with dates that have the month first.
    HalfOfDay,
    /// Decimal commas, which are usual with dates that have the day first.
    DecimalComma,
    /// No reason: the month is assumed to be first.
    Guess,
}

/// Splits a date such as `31/05/2024` into its numbers; `None` for other texts.
fn slashed(date: &str) -> Option<[u32; 3]> {
    let [first, second, year] = date.split('/').collect::<Vec<_>>()[..] else { return None };
    let is_short = |word: &str| (1..=2).contains(&word.len());
    if year.len() != 4 || !is_short(first) || !is_short(second) {
        return None;
    }
    Some([first.parse().ok()?, second.parse().ok()?, year.parse().ok()?])
}

/// Rewrites a date and time with slashes and the year last in the form of ISO 8601, for example
/// `11/25/2026 09:00:12 PM` as `2026-11-25 21:00:12`; `None` for other texts. Also returns the
/// reason for the order of day and month.
fn iso_from_year_last(text: &str, order: DateOrder) -> Option<(String, Basis)> {
    let (date, clock) = text.split_once(' ')?;
    let numbers @ [first, second, year] = slashed(date)?;
    let (hour, rest, is_halved) = hour_of_day(clock)?;
    let (order, basis) = match (order, DateOrder::of_date(numbers)) {
        // Other dates of the table were read month first because of AM or PM.
        (DateOrder::Unknown, Some(DateOrder::DayFirst)) if is_halved => return None,
        (DateOrder::Unknown | DateOrder::LikelyDayFirst, None) if is_halved => {
            (DateOrder::MonthFirst, Basis::HalfOfDay)
        }
        (DateOrder::LikelyDayFirst, None) => (DateOrder::DayFirst, Basis::DecimalComma),
        (DateOrder::Unknown, None) => (DateOrder::MonthFirst, Basis::Guess),
        (DateOrder::Unknown | DateOrder::LikelyDayFirst, Some(order)) | (order, _) => {
            (order, Basis::Numbers)
        }
    };
    let (month, day) = if order == DateOrder::DayFirst { (second, first) } else { (first, second) };
    Some((format!("{year}-{month:02}-{day:02} {hour:02}:{rest}"), basis))
}

/// Splits a clock such as `9:05:12 PM` into the hour, 0 to 23, and what follows it, and tells
/// whether it has AM or PM.
fn hour_of_day(clock: &str) -> Option<(u32, &str, bool)> {
    let clock = clock.trim();
    let half = |mark: &str| {
        let place = clock.len().checked_sub(mark.len())?;
        let (time, end) = (clock.get(..place)?, clock.get(place..)?);
        end.eq_ignore_ascii_case(mark).then(|| time.trim_end())
    };
    let (time, noon) = match (half("AM"), half("PM")) {
        (Some(time), _) => (time, Some(0)),
        (_, Some(time)) => (time, Some(12)),
        _ => (clock, None),
    };
    let (hour, rest) = time.split_once(':')?;
    let hour: u32 = hour.parse().ok()?;
    let hour = match noon {
        Some(noon) if (1..=12).contains(&hour) => hour % 12 + noon,
        Some(_) => return None,
        None => hour,
    };
    Some((hour, rest, noon.is_some()))
}

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

/// Rewrites `2024/5/31 14:03` as `2024-05-31 14:03`.
fn iso_from_slashes(text: &str) -> Option<String> {
    let (date, clock) = text.split_once([' ', 'T'])?;
    let [year, month, day] = date.split('/').collect::<Vec<_>>()[..] else { return None };
    let is_short = |word: &str| !word.is_empty() && word.len() <= 2;
    (year.len() == 4 && is_short(month) && is_short(day))
        .then(|| format!("{year}-{month:0>2}-{day:0>2} {}", clock.trim_start()))
}

/// Rewrites `31.05.2024 14:03` as `2024-05-31 14:03`; day, month and hour may have one digit.
fn iso_from_day_first(text: &str) -> Option<String> {
    let (date, clock) = text.split_once([' ', 'T'])?;
    let [day, month, year] = date.split('.').collect::<Vec<_>>()[..] else { return None };
    let is_number = |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    let (hour, rest, _) = hour_of_day(clock)?;
    let are_numbers = [day, month, year].into_iter().all(is_number);
    (are_numbers && year.len() == 4 && day.len() <= 2 && month.len() <= 2 && hour < 100)
        .then(|| format!("{year}-{month:0>2}-{day:0>2} {hour:0>2}:{rest}"))
}

/// Parses a date and time of ISO 8601 and returns the seconds since 1970-01-01T00:00 UTC. Without a
/// zone UTC is assumed.
///
/// Accepted are the extended form (`2024-05-31T14:03:20.25+02:00`, also with a space instead of T)
/// and the basic form (`20240531T140320Z`, also without T). In the extended form seconds may be
/// absent; they may have a decimal point or comma.
fn iso_8601(text: &str) -> Option<f64> {
    let (clock, zone) = split_zone(text.trim());
    let plain: String = clock.chars().filter(|c| !"-:T ".contains(*c)).collect();
    let marks: String = clock.chars().filter(|c| "-:T ".contains(*c)).collect();
    if !matches!(marks.as_str(), "" | "T" | "--T::" | "-- ::" | "--T:" | "-- :") {
        return None;
    }
    let (digits, fraction) = match plain.split_once(['.', ',']) {
        Some((digits, fraction)) if fraction.bytes().all(|byte| byte.is_ascii_digit()) => {
            (digits, format!("0.{fraction}").parse::<f64>().ok()?)
        }
        Some(_) => return None,
        None => (plain.as_str(), 0.0),
    };
    if !digits.is_ascii()
        || !digits.bytes().all(|byte| byte.is_ascii_digit())
        || ![12, 14].contains(&digits.len())
    {
        return None;
    }
    if digits.len() == 12 && (marks.is_empty() || fraction != 0.0) {
        return None;
    }
    let number = |from: usize, to: usize| {
        digits.get(from..to).map_or(Some(0), |part| part.parse::<i64>().ok())
    };
    let (year, month, day) = (number(0, 4)?, number(4, 6)?, number(6, 8)?);
    let (hour, minute, second) = (number(8, 10)?, number(10, 12)?, number(12, 14)?);
    let next = if month < 12 { (year, month + 1) } else { (year + 1, 1) };
    let length = days(next.0, next.1, 1) - days(year, month, 1);
    if !(1..=12).contains(&month)
        || !(1..=length).contains(&day)
        || hour > 24
        || minute > 59
        || second > 60
    {
        return None;
    }
    let whole = days(year, month, day) * 86400 + hour * 3600 + minute * 60 + second - zone?;
    Some(whole as f64 + fraction)
}

/// Splits a time into the part before the zone, and the zone \[s ahead of UTC\], which is `None` if
/// it is invalid and 0 if there is none.
fn split_zone(text: &str) -> (&str, Option<i64>) {
    if let Some(clock) = text.strip_suffix('Z') {
        return (clock, Some(0));
    }
    // A sign before the time of day is part of the date.
    let day = text.find(['T', ' ']).unwrap_or(text.len());
    let sign = text.get(day..).and_then(|rest| rest.rfind(['+', '-'])).map(|place| day + place);
    let Some((clock, zone)) = sign.and_then(|place| Some((text.get(..place)?, text.get(place..)?)))
    else {
        return (text, Some(0));
    };
    let digits: String = zone.chars().skip(1).filter(|c| *c != ':').collect();
    let ahead = match (digits.len(), digits.get(..2).and_then(|h| h.parse::<i64>().ok())) {
        (2, Some(hours)) => Some(hours * 3600),
        (4, Some(hours)) => digits
            .get(2..)
            .and_then(|m| m.parse::<i64>().ok())
            .map(|minutes| hours * 3600 + minutes * 60),
        _ => None,
    };
    (clock, ahead.map(|ahead| if zone.starts_with('-') { -ahead } else { ahead }))
}

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar. Years start in March, so
/// that the leap day is last.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    365 * year + year.div_euclid(4) - year.div_euclid(100)
        + year.div_euclid(400)
        + (153 * month + 2) / 5
        + day
        - 719_469
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_times_are_read_and_numbers_are_not() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", Some(0.0)),
            ("2000-02-29 12:00:00", Some(951_825_600.0)),
            ("2024-05-31T14:03:20.25+02:00", Some(1_717_157_000.25)),
            ("2024-05-31T14:03", Some(1_717_164_180.0)),
            ("20240531T140320Z", Some(1_717_164_200.0)),
            ("20200714163904", Some(1_594_744_744.0)),
            ("2024-05-31T14:03:20,5-0330", Some(1_717_176_800.5)),
            ("12.5", None),
            ("1717164200", None),
            ("2024-13-01T00:00:00", None),
            ("2024-02-30T00:00:00", None),
            ("2023-02-29T00:00:00", None),
            ("20240531140320.5e3", None),
            ("2024-12-31T00:00:00", Some(1_735_603_200.0)),
            ("2024-05-31", None),
            ("noon", None),
            ("", None),
        ] {
            assert_eq!(iso_8601(text), seconds, "{text}");
        }
        for (text, iso) in [
            ("31.05.2024 14:03:20,25", "2024-05-31T14:03:20.25"),
            ("31.05.2024 14.03.20,25", "2024-05-31T14:03:20.25"),
            ("31.05.2024, 14:03", "2024-05-31T14:03"),
            ("1.2.2024 9:05", "2024-02-01T09:05"),
            ("31.05.2024 14:03:20+02:00", "2024-05-31T14:03:20+02:00"),
            ("2024/5/31 14:03:20", "2024-05-31T14:03:20"),
            ("18.03.2025 1:12:07 PM", "2025-03-18T13:12:07"),
            ("05/31/2024 14:03", "2024-05-31T14:03"),
            ("28/05/2024 14:03", "2024-05-28T14:03"),
            ("11/05/2026 09:00:12 AM", "2026-11-05T09:00:12"),
            ("11/25/2026 12:00:12 am", "2026-11-25T00:00:12"),
            ("11/25/2026 1:00:12.5 PM", "2026-11-25T13:00:12.5"),
        ] {
            assert_eq!(date_time(text, DateOrder::Unknown), iso_8601(iso), "{text}");
            assert!(date_time(text, DateOrder::Unknown).is_some(), "{text}");
        }
        for text in
            ["31.05.24 14:03", "31.05.2024", "05/06/2024 14:03", "32.05.2024 14:03", "1.2.3"]
        {
            assert_eq!(date_time(text, DateOrder::Unknown), None, "{text}");
        }
        let is_ambiguous = |text| is_ambiguous(text, DateOrder::Unknown);
        assert!(is_ambiguous("05/06/2024 14:03") && !is_ambiguous("05/31/2024 14:03"));
        let month_first = assumed("11/05/2026 09:00:12 AM", DateOrder::Unknown);
        assert_eq!(month_first, Some(("2026-11-05".to_owned(), false)));
        let day_first = assumed("09/11/2026 15:41", DateOrder::LikelyDayFirst);
        assert_eq!(day_first, Some(("2026-11-09".to_owned(), true)));
        let with_commas = |text: &str| date_time(text, DateOrder::LikelyDayFirst);
        assert_eq!(with_commas("09/11/2026 15:41"), iso_8601("2026-11-09T15:41"));
        assert_eq!(with_commas("11/19/2026 15:41"), iso_8601("2026-11-19T15:41"));
        for clear in [
            "25/11/2026 09:00:12 AM",
            "11/25/2026 09:00:12 AM",
            "11/11/2026 9:00 PM",
            "05/31/2024 14:03",
            "2.5",
        ] {
            assert_eq!(assumed(clear, DateOrder::Unknown), None, "{clear}");
        }
        let day_first = DateOrder::of(b"time,x\n05/06/2024 14:03,1\n13/06/2024 14:03,2/3\n");
        assert_eq!(day_first, DateOrder::DayFirst);
        assert_eq!(date_time("05/06/2024 2:03 PM", day_first), iso_8601("2024-06-05T14:03"));
        assert_eq!(date_time("06/13/2024 14:03", day_first), None);
        assert_eq!(DateOrder::of(b"13/06/2024;06/13/2024"), DateOrder::Unknown);
        assert_eq!(DateOrder::of(b"06/13/2024;1/2;12/12/2024"), DateOrder::MonthFirst);
        assert_eq!(shown(1_717_157_000.25), "2024-05-31 12:03:20");
        assert_eq!(shown(12.5), "12.5 s");
    }
}

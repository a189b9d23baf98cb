//! Parser of dates with a time of day, as instruments, controllers and spreadsheets write them.

use super::parts::{
    Marks, Number, Token, WEEKDAYS, Word, abbreviates, days, half_of_day, is_day, is_one_of,
    month_of, seconds_of_day, short, tokens, without_space, year_of, zone,
};

/// Order of day and month in dates of numbers with the year last, such as `05/31/2024`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum DateOrder {
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
        let words = text.split(|byte| !(byte.is_ascii_digit() || b"/-".contains(byte)));
        let (mut day_first, mut month_first) = (false, false);
        for word in words {
            let order = str::from_utf8(word).ok().and_then(Self::of_word);
            day_first |= order == Some(Self::DayFirst);
            month_first |= order == Some(Self::MonthFirst);
        }
        match (day_first, month_first) {
            (true, false) => Self::DayFirst,
            (false, true) => Self::MonthFirst,
            _ => Self::Unknown,
        }
    }

    /// Returns the order of a date such as `31/05/2024`; `None` for other words. Hyphens also stand
    /// in other words, so years have four digits there.
    fn of_word(word: &str) -> Option<Self> {
        let is_like_a_date = (6..=10).contains(&word.len());
        let parts = is_like_a_date.then(|| tokens(word))?;
        let (date, rest) = Date::read(&parts)?;
        let is_date = rest.is_empty() && (word.contains('/') || !date.has_short_year);
        if date.form == Form::Open && is_date { Self::of_numbers(date.numbers) } else { None }
    }

    /// Returns the order of a date of which one number is above 12; `None` for other dates.
    fn of_numbers([first, second, _]: [i64; 3]) -> Option<Self> {
        match (first > 12, second > 12) {
            (true, false) => Some(Self::DayFirst),
            (false, true) => Some(Self::MonthFirst),
            _ => None,
        }
    }
}

/// Reason for the order in which the numbers of a date are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Basis {
    /// The form of the date, or a number above 12 in it or in the other dates of its table.
    Certain,
    /// AM or PM, which are usual with dates that have the month first.
    HalfOfDay,
    /// Decimal commas, which are usual with dates that have the day first.
    DecimalComma,
    /// The year has two digits and is taken to stand last.
    ShortYear,
    /// No reason: the month is assumed to be first.
    Guess,
}

/// Parses a date and time of day and returns the seconds since 1970-01-01T00:00 UTC. Without a zone
/// UTC is assumed.
///
/// If the date is of numbers with the year last, `order` or a number above 12 shows which number is
/// the day. If neither does, the month is first if the time has AM or PM; otherwise the date is not
/// accepted ([`is_ambiguous`]).
pub(crate) fn date_time(text: &str, order: DateOrder) -> Option<f64> {
    let instant = Instant::read(text)?;
    let (date, basis) = instant.date_in(order)?;
    (basis != Basis::Guess).then(|| instant.seconds_on(date))
}

/// Returns true for a date whose day and month may stand in either order, so that [`date_time`] does
/// not accept it.
pub(crate) fn is_ambiguous(text: &str, order: DateOrder) -> bool {
    let date = Instant::read(text).and_then(|instant| instant.date_in(order));
    date.is_some_and(|(_, basis)| basis == Basis::Guess)
}

/// Returns the date, such as `2026-11-05`, of a time whose order of day, month and year is assumed,
/// and the assumption in words; `None` for other times.
pub(crate) fn assumed(text: &str, order: DateOrder) -> Option<(String, &'static str)> {
    let ([year, month, day], basis) = Instant::read(text)?.date_in(order)?;
    let because = match basis {
        Basis::HalfOfDay if month != day => "month first",
        Basis::DecimalComma if month != day => "day first, because numbers have decimal commas",
        Basis::ShortYear => "with the year last",
        _ => return None,
    };
    Some((format!("{year}-{month:02}-{day:02}"), because))
}

/// Returns the date of a text in which a time of day follows it; other texts are returned whole.
pub(crate) fn date_part(text: &str) -> &str {
    /// Largest length of a date \[bytes\].
    const MAX_LENGTH: usize = 40;
    let is_date = |date: &&str| matches!(Date::read(&tokens(date)), Some((_, [])));
    let mut dates =
        (0..text.len().min(MAX_LENGTH)).filter_map(|end| text.get(..end)).filter(is_date);
    Instant::read(text).and_then(|_| dates.next_back()).unwrap_or(text)
}

/// Meaning of the three numbers of a date.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Year, month and day.
    Clear,
    /// Day and month in either order, and the year.
    Open,
}

/// Date as it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Date {
    numbers: [i64; 3],
    form: Form,
    /// True if the year has two digits, and no name shows which number is the month.
    has_short_year: bool,
}

impl Date {
    /// Reads a date at the beginning of `parts` and returns what follows it. In a date without a
    /// year, as in `Nov 12 14:03:11 2026`, the year is 0.
    fn read<'p, 't>(parts: &'p [Token<'t>]) -> Option<(Self, &'p [Token<'t>])> {
        let clear = |year, month, day| Self {
            numbers: [year, month, day],
            form: Form::Clear,
            has_short_year: false,
        };
        Some(match parts {
            [Number(date), rest @ ..] if date.len() == 8 => {
                let number = |from, to| date.get(from..to)?.parse().ok();
                (clear(number(0, 4)?, number(4, 6)?, number(6, 8)?), rest)
            }
            [
                Number(first),
                Marks(mark),
                Number(second),
                Marks(other),
                Number(third),
                rest @ ..,
            ] => {
                let second = short(second)?;
                let units = [mark, other].map(String::as_str);
                let has_units = matches!(units, ["年", "月"] | ["년", "월"]);
                if first.len() == 4 && (has_units || mark == other && is_one_of(mark, "-/.:_")) {
                    return Some((clear(first.parse().ok()?, second, short(third)?), rest));
                }
                let (first, has_short_year) = (short(first)?, third.len() == 2);
                let (numbers, form) = match units {
                    [".", "."] => ([year_of(third)?, second, first], Form::Clear),
                    ["/", "/"] | ["-", "-"] => ([first, second, year_of(third)?], Form::Open),
                    _ => return None,
                };
                (Self { numbers, form, has_short_year }, rest)
            }
            [Number(day), between @ ..] => {
                let (month, rest) = named_month(between)?;
                let [Marks(mark), Number(year), rest @ ..] = rest else { return None };
                is_one_of(mark, MARKS_BESIDE_NAMES).then_some(())?;
                (clear(year_of(year)?, month, short(day)?), rest)
            }
            [Word(name), Marks(mark), Number(day), rest @ ..] => {
                is_one_of(mark, MARKS_BESIDE_NAMES).then_some(())?;
                let (month, day) = (month_of(name)?, short(day)?);
                match rest {
                    [Marks(mark), Number(year), rest @ ..]
                        if year.len() == 4 && is_one_of(mark, MARKS_BESIDE_NAMES) =>
                    {
                        (clear(year_of(year)?, month, day), rest)
                    }
                    _ => (clear(0, month, day), rest),
                }
            }
            _ => return None,
        })
    }

    /// Returns year, month and day, with the reason for their order; `None` if there is no such day.
    /// `has_half` tells whether the time of day has AM or PM.
    fn in_order(self, order: DateOrder, has_half: bool) -> Option<([i64; 3], Basis)> {
        let [first, second, year] = self.numbers;
        let (date, basis) = if self.form == Form::Clear {
            let basis = if self.has_short_year { Basis::ShortYear } else { Basis::Certain };
            (self.numbers, basis)
        } else {
            use DateOrder::{DayFirst, LikelyDayFirst, MonthFirst, Unknown};
            let (order, basis) = match (order, DateOrder::of_numbers(self.numbers)) {
                // Other dates of the table were read month first because of AM or PM.
                (Unknown, Some(DayFirst)) if has_half => return None,
                (Unknown | LikelyDayFirst, None) if has_half => (MonthFirst, Basis::HalfOfDay),
                (LikelyDayFirst, None) => (DayFirst, Basis::DecimalComma),
                (Unknown, None) => (MonthFirst, Basis::Guess),
                (Unknown | LikelyDayFirst, Some(order)) | (order, _) => (order, Basis::Certain),
            };
            match order {
                // The number in the middle is the month also if the year stands first.
                DayFirst if self.has_short_year && basis == Basis::Certain => {
                    ([year, second, first], Basis::ShortYear)
                }
                DayFirst => ([year, second, first], basis),
                _ => ([year, first, second], basis),
            }
        };
        is_day(date).then_some((date, basis))
    }
}

/// Marks before and behind the name of a month.
const MARKS_BESIDE_NAMES: &str = "-/., ";

/// Reads the name of a month, between marks, at the beginning of `parts` and returns what follows.
fn named_month<'p, 't>(parts: &'p [Token<'t>]) -> Option<(i64, &'p [Token<'t>])> {
    match parts {
        [Marks(mark), Word(name), rest @ ..] if is_one_of(mark, MARKS_BESIDE_NAMES) => {
            Some((month_of(name)?, rest))
        }
        _ => None,
    }
}

/// Date with a time of day, as they are written.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Instant {
    date: Date,
    /// Seconds from the beginning of the date in UTC.
    seconds: f64,
    /// True if the time of day has AM or PM.
    has_half: bool,
}

impl Instant {
    /// Reads a whole text; `None` for other texts.
    fn read(text: &str) -> Option<Self> {
        let mut parts = tokens(text);
        // Date and time of day without marks between them.
        if let Some(Number(digits)) = parts.first()
            && digits.len() == 14
        {
            let (date, clock) = digits.split_at(8);
            let separate = [Number(date), Marks(" ".to_owned()), Number(clock)];
            parts.splice(..1, separate);
        }
        let mut parts = parts.as_slice();
        if let [Word(name), Marks(_), rest @ ..] = parts
            && abbreviates(name, WEEKDAYS, 2)
        {
            parts = rest;
        }
        let (mut date, rest) = Date::read(parts)?;
        let rest = match rest {
            [Word(t), rest @ ..] if t == "t" => rest,
            [Marks(mark), rest @ ..] if is_one_of(mark, " .,_-:日일") => rest,
            _ => return None,
        };
        let (before, rest) =
            half_of_day(rest).map_or((None, rest), |(half, rest)| (Some(half), rest));
        let (mut seconds, mut rest) = seconds_of_day(without_space(rest))?;
        let half = before.or_else(|| {
            let (half, after) = half_of_day(rest)?;
            rest = after;
            Some(half)
        });
        if let Some(half) = half {
            const NOON: f64 = 43_200.0;
            (3600.0..NOON + 3600.0).contains(&seconds).then_some(())?;
            seconds = seconds % NOON + if half.is_afternoon { NOON } else { 0.0 };
        }
        if let Some((ahead, after)) = zone(rest) {
            seconds -= ahead as f64;
            rest = after;
        }
        if let ([Marks(mark), Number(year)], 0) = (rest, date.numbers[0])
            && mark == " "
            && year.len() == 4
        {
            date.numbers[0] = year_of(year)?;
            rest = &[];
        }
        let has_half = half.is_some_and(|half| half.is_latin);
        let is_whole = rest.is_empty() && date.numbers[0] > 0;
        is_whole.then_some(Self { date, seconds, has_half })
    }

    /// Returns year, month and day, with the reason for their order; `None` if there is no such day.
    fn date_in(&self, order: DateOrder) -> Option<([i64; 3], Basis)> {
        self.date.in_order(order, self.has_half)
    }

    /// Returns the seconds since 1970-01-01T00:00 UTC if the date is this year, month and day.
    fn seconds_on(&self, [year, month, day]: [i64; 3]) -> f64 {
        (days(year, month, day) * 86_400) as f64 + self.seconds
    }
}

#[cfg(test)]
mod tests {
    use super::super::shown;
    use super::*;

    /// Forms of 2026-11-12 14:03:11 that instruments, controllers and spreadsheets write.
    const FORMS: [&str; 43] = [
        "2026-11-12T14:03:11Z",
        "2026-11-12 14:03:11",
        "2026-11-12 14:03:11.0 UTC",
        "2026-11-12T16:03:11+02:00",
        "2026-11-12 10:33:11 -0330",
        "2026-11-12 2:03:11 PM",
        "2026-11-12 02:03:11 pm",
        "2026-11-12 2:03:11\u{202f}PM",
        "2026-11-12 오후 2:03:11",
        "2026/11/12 2:03:11 PM",
        "2026/11/12 下午 02:03:11",
        "2026/11/12 下午02:03:11",
        "2026-11-12 2:03:11 午後",
        "2026/11/12 14:03:11",
        "2026年11月12日 14:03:11",
        "2026年11月12日14:03:11",
        "2026년 11월 12일 오후 2:03:11",
        "2026. 11. 12. 14:03:11",
        "2026. 11. 12. 오후 2:03:11",
        "2026.11.12 14:03:11",
        "12. 11. 2026 14:03:11",
        "12.11.2026 14:03:11",
        "12.11.2026, 14.03.11,000",
        "12.11.26 14:03:11",
        "12.11.2026 2:03:11 p.m.",
        "12-Nov-26 14:03:11",
        "12-NOV-26 14:03:11",
        "12-Nov-2026 02:03:11 PM",
        "12 Nov 2026 14:03:11 +0000",
        "12. November 2026 14:03:11",
        "Thu, 12 Nov 2026 14:03:11 GMT",
        "Thu Nov 12 14:03:11 2026",
        "Thu Nov 12 14:03:11 UTC 2026",
        "November 12, 2026 2:03:11 PM",
        "20261112T140311",
        "20261112140311",
        "20261112 140311",
        "20261112_140311",
        "20261112-140311.0",
        "2026-11-12_14:03:11",
        "2026-11-12 14-03-11",
        "2026-11-12-14-03-11",
        "2026:11:12 14:03:11",
    ];

    #[test]
    fn dates_are_read_as_they_are_written() {
        for text in FORMS {
            let seconds = date_time(text, DateOrder::Unknown);
            assert_eq!(seconds.map(shown).as_deref(), Some("2026-11-12 14:03:11"), "{text}");
        }
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", Some(0.0)),
            ("2000-02-29 12:00:00", Some(951_825_600.0)),
            ("2024-05-31T14:03:20.25+02:00", Some(1_717_157_000.25)),
            ("2024-05-31T14:03", Some(1_717_164_180.0)),
            ("20240531T140320Z", Some(1_717_164_200.0)),
            ("20200714163904", Some(1_594_744_744.0)),
            ("2024-05-31T14:03:20,5-0330", Some(1_717_176_800.5)),
            ("31.05.2024 14.03.20,25", Some(1_717_164_200.25)),
            ("31.05.2024, 14:03", Some(1_717_164_180.0)),
            ("2024/5/31 14:03:20", Some(1_717_164_200.0)),
            ("05/31/2024 14:03", Some(1_717_164_180.0)),
            ("31-05-2024 2:03:20 p. m.", Some(1_717_164_200.0)),
            ("11/25/2026 12:00:12 am", Some(1_795_564_812.0)),
            ("25/11/2026 오전 12:00:12", Some(1_795_564_812.0)),
            ("2024-12-31T00:00:00", Some(1_735_603_200.0)),
        ] {
            assert_eq!(date_time(text, DateOrder::Unknown), seconds, "{text}");
        }
        for text in [
            "",
            "noon",
            "12.5",
            "1.2.3",
            "1717164200",
            "2024-05-31",
            "31.05.2024",
            "Nov 12 14:03:11",
            "2024-13-01T00:00:00",
            "2024-02-30T00:00:00",
            "2023-02-29T00:00:00",
            "2024-05-31T25:00:00",
            "32.05.2024 14:03",
            "20240531140320.5e3",
            "2024-05-31 14:03:20 PM",
            "2024-05-31 0:03:20 AM",
            "2024-05-31 14-03-20-05",
            "12-Foo-26 14:03:11",
            "2024-05/31 14:03:20",
            "05/06/2024 14:03",
            "12-11-2026 14:03:11",
            "12/11/2026 2:03:11 p. m.",
        ] {
            assert_eq!(date_time(text, DateOrder::Unknown), None, "{text}");
        }
        for (text, date) in [
            ("2026. 11. 12. 0:00:00", "2026. 11. 12"),
            ("12-OCT-26 00:00:00", "12-OCT-26 "),
            ("12-OCT-26", "12-OCT-26"),
        ] {
            assert_eq!(date_part(text), date);
        }
    }

    #[test]
    fn other_rows_and_decimal_commas_decide_the_order_of_day_and_month() {
        let is_ambiguous = |text| is_ambiguous(text, DateOrder::Unknown);
        let open = ["05/06/2024 14:03", "12-11-2026 14:03:11", "12/11/2026 2:03:11 p. m."];
        assert!(open.into_iter().all(is_ambiguous) && !is_ambiguous("05/31/2024 14:03"));
        let commas = "day first, because numbers have decimal commas";
        for (text, order, read) in [
            ("11/05/2026 09:00:12 AM", DateOrder::Unknown, Some(("2026-11-05", "month first"))),
            ("09/11/2026 15:41", DateOrder::LikelyDayFirst, Some(("2026-11-09", commas))),
            ("09-11-26 15:41", DateOrder::LikelyDayFirst, Some(("2026-11-09", commas))),
            ("12.11.26 14:03", DateOrder::Unknown, Some(("2026-11-12", "with the year last"))),
            ("25/11/26 14:03", DateOrder::Unknown, Some(("2026-11-25", "with the year last"))),
            ("11/25/26 14:03", DateOrder::Unknown, None),
            ("25/11/2026 09:00:12 AM", DateOrder::Unknown, None),
            ("11/25/2026 09:00:12 AM", DateOrder::Unknown, None),
            ("11/11/2026 9:00 PM", DateOrder::Unknown, None),
            ("12-Nov-26 14:03", DateOrder::Unknown, None),
            ("2.5", DateOrder::Unknown, None),
        ] {
            let read = read.map(|(date, because)| (date.to_owned(), because));
            assert_eq!(assumed(text, order), read, "{text}");
        }
        let read = |text: &str, order| date_time(text, order).map(shown);
        let with_commas = |text: &str| read(text, DateOrder::LikelyDayFirst);
        assert_eq!(with_commas("11/19/2026 15:41").unwrap(), "2026-11-19 15:41:00");
        let day_first = DateOrder::of(b"time,x\n05/06/2024 14:03,1\n13/06/2024 14:03,2/3\n");
        assert_eq!(day_first, DateOrder::DayFirst);
        assert_eq!(read("05/06/2024 2:03 PM", day_first).unwrap(), "2024-06-05 14:03:00");
        assert_eq!(read("06/13/2024 14:03", day_first), None);
        for (text, order) in [
            ("13/06/2024;06/13/2024", DateOrder::Unknown),
            ("06/13/2024;1/2;12/12/2024", DateOrder::MonthFirst),
            ("12-11-2026 14:03:11\n13-11-2026 14:03:11", DateOrder::DayFirst),
            ("12-11-2026 13-03-11", DateOrder::Unknown),
        ] {
            assert_eq!(DateOrder::of(text.as_bytes()), order, "{text}");
        }
    }

    #[test]
    fn random_texts_are_read_or_refused() {
        let pieces: Vec<char> = FORMS.concat().chars().chain("é٣\u{a0}%".chars()).collect();
        let mut state = 1_u64;
        let mut draw = |below: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            usize::try_from(state >> 33).unwrap() % below
        };
        for trial in 0..10_000 {
            let mut text: Vec<char> = FORMS[draw(FORMS.len())].chars().collect();
            for _ in 0..=trial % 4 {
                let place = draw(text.len());
                match draw(3) {
                    0 => text[place] = pieces[draw(pieces.len())],
                    1 => text.insert(place, pieces[draw(pieces.len())]),
                    _ => text.truncate(place.max(1)),
                }
            }
            let text: String = text.into_iter().collect();
            let _ = (date_part(&text), DateOrder::of(text.as_bytes()));
            for order in [DateOrder::Unknown, DateOrder::LikelyDayFirst, DateOrder::DayFirst] {
                if let Some(seconds) = date_time(&text, order).filter(|seconds| *seconds > 7e8) {
                    // What is read is the same instant in the form of ISO 8601.
                    let again = date_time(&shown(seconds), order);
                    assert_eq!(again, Some(seconds.floor()), "{text}");
                }
            }
        }
    }
}

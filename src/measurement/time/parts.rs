//! Parts of written dates and times: numbers, words, and the marks between them.

/// Part of a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Token<'t> {
    /// Digits.
    Number(&'t str),
    /// Letters, in lower case.
    Word(String),
    /// Other characters and units of Chinese, Japanese and Korean dates; white space only if there is
    /// nothing else.
    Marks(String),
}

pub(super) use Token::{Marks, Number, Word};

/// Splits a text without surrounding white space into its parts.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    /// Units of the numbers in Chinese, Japanese and Korean dates.
    const UNITS: &str = "年月日년월일";
    let class = |c: char| match c {
        '0'..='9' => 0,
        c if c.is_alphabetic() && !UNITS.contains(c) => 1,
        _ => 2,
    };
    let mut rest = text.trim();
    let mut found = Vec::new();
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| class(c) != class(first)).unwrap_or(rest.len());
        let (part, after) = rest.split_at(end);
        rest = after;
        found.push(match class(first) {
            0 => Number(part),
            1 => Word(part.to_lowercase()),
            _ => {
                let marks: String = part.chars().filter(|c| !c.is_whitespace()).collect();
                Marks(if marks.is_empty() { " ".to_owned() } else { marks })
            }
        });
    }
    found
}

/// Returns a number of at most two digits.
pub(super) fn short(digits: &str) -> Option<i64> {
    (digits.len() <= 2).then(|| digits.parse().ok())?
}

/// Names of the months in English and German, in lower case.
pub(super) const MONTHS: [&str; 12] = [
    "january januar",
    "february februar",
    "march märz mrz",
    "april",
    "may mai",
    "june juni",
    "july juli",
    "august",
    "september",
    "october oktober",
    "november",
    "december dezember",
];
/// Names of the days of the week in English and German, in lower case.
pub(super) const WEEKDAYS: &str = "monday tuesday wednesday thursday friday saturday sunday \
                        montag dienstag mittwoch donnerstag freitag samstag sonntag";

/// Returns true if a word of at least `least` letters is one of some names or its beginning.
pub(super) fn abbreviates(word: &str, names: &str, least: usize) -> bool {
    word.chars().count() >= least && names.split(' ').any(|name| name.starts_with(word))
}

/// Returns the month, from 1, of a name such as `november` or `nov`.
pub(super) fn month_of(word: &str) -> Option<i64> {
    (1..).zip(MONTHS).find(|(_, names)| abbreviates(word, names, 3)).map(|(month, _)| month)
}

/// Returns true if a text is one of some characters.
pub(super) fn is_one_of(text: &str, characters: &str) -> bool {
    text.chars().count() == 1 && characters.contains(text)
}

/// Returns the year of four digits, or of two, which are 1970 to 2069.
pub(super) fn year_of(digits: &str) -> Option<i64> {
    let number = digits.parse().ok()?;
    match digits.len() {
        4 => Some(number),
        2 => Some(if number < 70 { 2000 + number } else { 1900 + number }),
        _ => None,
    }
}

/// Returns true if year, month and day are a date of the Gregorian calendar.
pub(super) fn is_day([year, month, day]: [i64; 3]) -> bool {
    let next = if month < 12 { (year, month + 1) } else { (year + 1, 1) };
    (1..=12).contains(&month) && (1..=days(next.0, next.1, 1) - days(year, month, 1)).contains(&day)
}

/// Half of a day, and whether it is written as AM or PM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Half {
    pub is_afternoon: bool,
    pub is_latin: bool,
}

/// Reads a half of a day, with the marks before it, and returns what follows it.
pub(super) fn half_of_day<'p, 't>(parts: &'p [Token<'t>]) -> Option<(Half, &'p [Token<'t>])> {
    let parts = without_space(parts);
    let half = |is_afternoon, is_latin| Half { is_afternoon, is_latin };
    // With points, as in Spanish, the order of day and month is another one than with AM and PM.
    if let [Word(half_word), Marks(point), Word(m), rest @ ..] = parts
        && ["a", "p"].contains(&half_word.as_str())
        && (point.as_str(), m.as_str()) == (".", "m")
    {
        let rest = match rest {
            [Marks(point), rest @ ..] if point == "." => rest,
            _ => rest,
        };
        return Some((half(half_word == "p", false), rest));
    }
    let [Word(word), rest @ ..] = parts else { return None };
    let found = match word.as_str() {
        "am" | "pm" => half(word == "pm", true),
        "오전" | "上午" | "午前" => half(false, false),
        "오후" | "下午" | "午後" => half(true, false),
        _ => return None,
    };
    Some((found, rest))
}

/// Returns the parts without white space at their beginning.
pub(super) fn without_space<'p, 't>(parts: &'p [Token<'t>]) -> &'p [Token<'t>] {
    match parts {
        [Marks(mark), rest @ ..] if mark == " " => rest,
        _ => parts,
    }
}

/// Reads a zone, with the marks before it, and returns it \[s ahead of UTC\] and what follows it.
pub(super) fn zone<'p, 't>(parts: &'p [Token<'t>]) -> Option<(i64, &'p [Token<'t>])> {
    if let [Word(name), rest @ ..] = without_space(parts) {
        return ["z", "utc", "gmt"].contains(&name.as_str()).then_some((0, rest));
    }
    let [Marks(sign), Number(hours), rest @ ..] = parts else { return None };
    let sign = match sign.as_str() {
        "+" => 1,
        "-" => -1,
        _ => return None,
    };
    let (hours, minutes, rest) = match (hours.len(), rest) {
        (2, [Marks(colon), Number(minutes), rest @ ..]) if colon == ":" && minutes.len() == 2 => {
            (*hours, *minutes, rest)
        }
        (2, _) => (*hours, "0", rest),
        (4, _) => (hours.get(..2)?, hours.get(2..)?, rest),
        _ => return None,
    };
    let [hours, minutes] = [short(hours)?, short(minutes)?];
    (hours <= 24 && minutes < 60).then_some((sign * (hours * 3600 + minutes * 60), rest))
}

/// Reads a time of day and returns its seconds and what follows it. Seconds may be absent behind
/// colons.
pub(super) fn seconds_of_day<'p, 't>(parts: &'p [Token<'t>]) -> Option<(f64, &'p [Token<'t>])> {
    let ([hour, minute, second], mut rest) = match parts {
        [Number(clock), rest @ ..] if clock.len() == 6 => {
            let number = |from: usize| short(clock.get(from..from + 2)?);
            ([number(0)?, number(2)?, number(4)?], rest)
        }
        [Number(clock), rest @ ..] if clock.len() == 4 => {
            let (hour, minute) = clock.split_at(2);
            return Some((seconds_of([short(hour)?, short(minute)?, 0], 0.0)?, rest));
        }
        [Number(hour), Marks(mark), Number(minute), Marks(other), Number(second), rest @ ..]
            if mark == other && is_one_of(mark, ":.-_") =>
        {
            // A zone cannot be told from the numbers of such a time.
            let is_followed = matches!(rest, [Marks(next), ..] if next == mark && next == "-");
            let numbers = [short(hour)?, short(minute)?, short(second)?];
            (!is_followed).then_some((numbers, rest))?
        }
        [Number(hour), Marks(mark), Number(minute), rest @ ..] if mark == ":" => {
            return Some((seconds_of([short(hour)?, short(minute)?, 0], 0.0)?, rest));
        }
        _ => return None,
    };
    let mut fraction = 0.0;
    if let [Marks(mark), Number(digits), after @ ..] = rest
        && is_one_of(mark, ".,")
    {
        fraction = format!("0.{digits}").parse().ok()?;
        rest = after;
    }
    Some((seconds_of([hour, minute, second], fraction)?, rest))
}

/// Returns the seconds of a time of day; `None` if there is no such time.
pub(super) fn seconds_of([hour, minute, second]: [i64; 3], fraction: f64) -> Option<f64> {
    let exists = hour <= 24 && minute < 60 && second <= 60;
    exists.then(|| (hour * 3600 + minute * 60 + second) as f64 + fraction)
}

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar. Years start in March, so
/// that the leap day is last.
pub(super) fn days(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    365 * year + year.div_euclid(4) - year.div_euclid(100)
        + year.div_euclid(400)
        + (153 * month + 2) / 5
        + day
        - 719_469
}

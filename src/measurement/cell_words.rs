//! Recognition of words in cells that should contain a number, for error messages.

use super::latin::parsed;
use crate::error::{TableErrorKind, shortened};

/// Units that tables of other programs write into cells.
pub(super) const UNITS: [&str; 18] = [
    "degrees", "degree", "deg", "°C", "°", "rad", "mm", "cm", "µm", "kg", "m", "ms", "s", "kN",
    "N", "C", "px", "%",
];

/// Months and their abbreviations in English, German and French, as spreadsheets write them.
const MONTHS: &str = "jan feb mar apr may jun jul aug sep sept oct nov dec january february march april \
    june july august september october november december mär mrz mai okt dez januar \
    februar märz juni juli oktober dezember janv févr mars avr juin juil août déc \
    janvier février avril juillet septembre octobre novembre décembre";

/// Returns true for a number with a decimal point whose thousands are separated by commas, such as
/// `1,874.383`.
pub(super) fn has_thousands(word: &str) -> bool {
    let Some((whole, _)) = word.split_once('.') else { return false };
    let mut groups = whole.trim_start_matches(['-', '+']).split(',');
    let is_digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    groups.next().is_some_and(|first| (1..=3).contains(&first.len()) && is_digits(first))
        && groups.all(|group| group.len() == 3 && is_digits(group))
        && word.replace(',', "").parse::<f64>().is_ok()
}

/// Returns the number that a word holds with further signs, with what it is and whether the number
/// format of a spreadsheet writes it so; `None` for other words.
fn decorated(word: &str) -> Option<(String, &'static str, bool)> {
    let of = |number: &str| {
        let number = number.trim();
        parsed(number).map(|_| number.to_owned())
    };
    let inner = word.strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
    if let Some(number) = inner.and_then(of).filter(|number| !number.starts_with('-')) {
        return Some((format!("-{number}"), "is a negative number in parentheses", true));
    }
    if let Some(number) = word.strip_suffix(['-', '+']).and_then(of) {
        let sign = if word.ends_with('-') { "-" } else { "" };
        return Some((format!("{sign}{number}"), "has its sign behind it", true));
    }
    if let Some(number) = word.strip_prefix('\'').and_then(of) {
        return Some((
            number,
            "begins with an apostrophe, by which a spreadsheet marks text",
            false,
        ));
    }
    if let Some(number) = word.strip_prefix(['~', '≈', '<', '>']).and_then(of) {
        return Some((number, "has a sign of comparison before it", false));
    }
    if let Some((number, _)) = word.split_once(['±']) {
        return of(number).map(|number| (number, "has an uncertainty", false));
    }
    let powers = ["*10^", "x10^", "×10^", "·10^", " E", " e"];
    let with_e = powers.iter().find_map(|power| {
        let (number, exponent) = word.split_once(power)?;
        of(&format!("{}e{}", number.trim(), exponent.trim().trim_start_matches('+')))
    });
    with_e.map(|number| (number, "has its exponent in another notation", false))
}

/// Returns true for a word by which a spreadsheet marks an error, such as `#DIV/0!`, `#WERT!` or
/// `Err:502`.
pub(super) fn is_spreadsheet_error(word: &str) -> bool {
    let code = word.strip_prefix("Err:").unwrap_or_default();
    let is_code = !code.is_empty() && code.bytes().all(|byte| byte.is_ascii_digit());
    let named = word.strip_prefix('#').unwrap_or_default();
    let is_upper = |word: &str| {
        !word.is_empty() && word.chars().all(|c| c.is_uppercase() || "/0_".contains(c))
    };
    let is_named = named.strip_suffix(['!', '?']).is_some_and(is_upper);
    let is_filled = word.len() > 2 && word.bytes().all(|byte| byte == b'#');
    is_code || is_named || is_filled || is_not_available(word)
}

/// Returns true for the mark of a spreadsheet that a value is not available, in several languages.
pub(super) fn is_not_available(word: &str) -> bool {
    ["#N/A", "#NV", "#N/D", "#N/V"].contains(&word)
}

/// Returns the error of a number in a notation that is not read: thousands that are separated by
/// spaces, the exponent of Fortran, degrees with minutes and seconds, or further signs. `None` for
/// other words.
pub(super) fn other_notation(word: &str) -> Option<TableErrorKind> {
    let value = shortened(word, 40);
    if let Some((write, what, of_format)) = decorated(word) {
        return Some(TableErrorKind::OtherNotation { value, what, write, of_format });
    }
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let unsigned = word.trim_start_matches(['-', '+']);
    if unsigned.is_empty() && word.len() == 1 {
        return Some(TableErrorKind::SignAlone { value });
    }
    let whole = unsigned.split(['.', ',']).next().unwrap_or_default();
    let mut groups = whole.split([' ', '\u{a0}', '\u{2009}', '\u{202f}', '\'']);
    let first = groups.next().is_some_and(|first| first.len() <= 3 && is_digits(first));
    let mut others = groups.peekable();
    if first && others.peek().is_some() && others.all(|group| group.len() == 3 && is_digits(group))
    {
        return Some(TableErrorKind::ThousandsSeparator { value });
    }
    let with_e = word.replace(['D', 'd'], "E");
    if with_e != word && parsed(&with_e).is_some() {
        return Some(TableErrorKind::FortranExponent { value, write: with_e });
    }
    let parts: Vec<f64> = unsigned
        .split([':', '°', '\'', '"', '′', '″', ' '])
        .filter(|part| !part.is_empty())
        .map_while(parsed)
        .collect();
    let is_sexagesimal = unsigned.contains([':', '°'])
        && unsigned.chars().all(|c| c.is_ascii_digit() || ":°'\"′″ .,".contains(c))
        && parts.iter().skip(1).all(|part| (0.0..60.0).contains(part));
    let (degrees, minutes, seconds) = match parts[..] {
        [degrees, minutes] if is_sexagesimal => (degrees, minutes, 0.0),
        [degrees, minutes, seconds] if is_sexagesimal => (degrees, minutes, seconds),
        _ => return None,
    };
    let sign = if word.starts_with('-') { "-" } else { "" };
    let decimal = degrees + minutes / 60.0 + seconds / 3600.0;
    Some(TableErrorKind::Sexagesimal { value, write: format!("{sign}{decimal:.6}") })
}

/// Returns true for a day and a month such as `18. Mrz` or `Mar-18`, into which spreadsheets turn
/// numbers such as 18.3.
pub(super) fn is_spreadsheet_date(word: &str) -> bool {
    let parts: Vec<&str> =
        word.split([' ', '-', '.', '/']).filter(|part| !part.is_empty()).collect();
    let is_month = |part: &&str| MONTHS.split(' ').any(|month| month == part.to_lowercase());
    let is_day = |part: &&str| part.len() <= 4 && part.bytes().all(|byte| byte.is_ascii_digit());
    matches!(parts.as_slice(), [a, b] if is_month(a) && is_day(b) || is_day(a) && is_month(b))
}

/// Returns the unit that follows a number in the same cell, such as `°` in `118.1°`.
pub(super) fn unit_behind(word: &str) -> Option<&'static str> {
    UNITS.into_iter().find(|unit| {
        word.strip_suffix(unit).is_some_and(|number| parsed(number.trim_end()).is_some())
    })
}

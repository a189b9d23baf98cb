//! Values of a problem file together with their places.

use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;
use toml::Spanned;
use toml::de::{DeInteger, DeString, DeTable, DeValue};

use crate::error::{
    BYTE_ORDER_MARKS, InputError, InputErrorKind, Location, binary_format, is_hidden, lines,
};
use crate::files::{read_limited, windows_1252};
use crate::quantity::Unit;

/// Maximum size of a TOML file that is read \[MiB\].
const MAX_TEXT_MIB: u64 = 4;
/// Maximum magnitude of an input number; its square is still finite.
pub(crate) const MAX_MAGNITUDE: f64 = 1e150;

/// Text of an input file and its path.
pub(crate) struct Document {
    pub file: PathBuf,
    pub text: Arc<str>,
}

impl Document {
    /// Reads a text file; `missing` is the error that is returned if the file does not exist.
    pub fn read(file: &Path, missing: InputErrorKind) -> Result<Self, InputError> {
        let text = Self::read_bytes(file, missing)?;
        let text = String::from_utf8(text).map_err(|error| not_utf8(file, error.as_bytes()))?;
        Ok(Self { file: file.to_owned(), text: Arc::from(text) })
    }

    /// Does the same as [`read`](Self::read) for a file that may also be in Windows-1252. Returns
    /// the line too from which on it is, if it is.
    pub fn read_table(
        file: &Path,
        missing: InputErrorKind,
    ) -> Result<(Self, Option<usize>), InputError> {
        let bytes = Self::read_bytes(file, missing)?;
        let (text, line) = match String::from_utf8(bytes) {
            Ok(text) => (text, None),
            Err(error) => {
                let refused = not_utf8(file, error.as_bytes());
                let line = refused.location.line;
                (windows_1252(error.as_bytes()).ok_or(refused)?, line)
            }
        };
        Ok((Self { file: file.to_owned(), text: Arc::from(text) }, line))
    }

    /// Reads a file that is expected to be text, as bytes.
    fn read_bytes(file: &Path, missing: InputErrorKind) -> Result<Vec<u8>, InputError> {
        let expected = missing.expected_file();
        let bytes = read_limited(file, MAX_TEXT_MIB << 20).map_err(|source| {
            Location::file(file).error(match source.kind() {
                io::ErrorKind::NotFound => missing,
                io::ErrorKind::FileTooLarge => InputErrorKind::FileTooLarge { most: MAX_TEXT_MIB },
                _ => InputErrorKind::Unreadable { source },
            })
        })?;
        if BYTE_ORDER_MARKS.iter().any(|mark| bytes.starts_with(mark)) {
            return Err(Location::file(file).at_line(1).error(InputErrorKind::Utf16));
        }
        if let Some(found) = binary_format(&bytes) {
            return Err(Location::file(file).error(InputErrorKind::OtherFormat { found, expected }));
        }
        Ok(bytes)
    }

    /// Parses the text as TOML.
    pub fn table(&self) -> Result<Spanned<DeTable<'_>>, InputError> {
        DeTable::parse(&self.text).map_err(|error| self.syntax_error(&error))
    }

    /// Returns the place of a span of the text.
    pub fn locate(&self, span: Range<usize>) -> Location {
        Location::in_text(&self.file, &self.text, span)
    }
}

/// Returns the error of a file that is not UTF-8, with the first line that is not.
fn not_utf8(file: &Path, bytes: &[u8]) -> InputError {
    let valid = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), str::len);
    let line = lines(bytes.get(..valid).unwrap_or_default());
    Location::file(file).at_line(line).error(InputErrorKind::NotUtf8)
}

/// Value of the problem file with its key and place.
#[derive(Clone)]
pub(crate) struct Item<'a, 'i> {
    pub(super) document: &'a Document,
    pub(super) key: String,
    pub(super) value: &'a DeValue<'i>,
    pub(super) span: Range<usize>,
}

impl<'a, 'i> Item<'a, 'i> {
    /// Returns the value of a key in the section at `path`.
    pub fn of_key(
        document: &'a Document,
        path: &str,
        key: &Spanned<DeString<'i>>,
        value: &'a Spanned<DeValue<'i>>,
    ) -> Self {
        let span = match value.get_ref() {
            DeValue::Array(_) | DeValue::Table(_) => key.span(),
            _ => key.span().start..value.span().end,
        };
        Self { document, key: join(path, key.get_ref()), value: value.get_ref(), span }
    }

    /// Returns the place of the value.
    pub fn location(&self) -> Location {
        self.document.locate(self.span.clone()).with_key(self.key.as_str())
    }

    /// Returns an error at this value.
    pub fn error(&self, kind: impl Into<InputErrorKind>) -> InputError {
        self.location().error(kind)
    }

    /// Returns the error that this value, a lower limit, is above the upper limit `upper`. The
    /// message quotes both entries.
    pub fn crossed_limits_error(&self, upper: &Self) -> InputError {
        self.error(InputErrorKind::LimitsCross { lower: self.written(), upper: upper.written() })
    }

    /// Returns the entry as it is written, on one line; that of a list or table without its value.
    pub fn written(&self) -> String {
        let text = self.document.text.get(self.span.clone()).unwrap_or_default();
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        match self.value {
            DeValue::Array(_) | DeValue::Table(_) => format!("{words} = …"),
            _ => words,
        }
    }

    /// Returns the error for a value of the wrong type.
    pub fn wrong_type(&self, expected: &'static str) -> InputError {
        let found = match self.value {
            DeValue::String(_) => "text",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        let remedy = self.type_remedy(expected);
        self.error(InputErrorKind::WrongType { expected, found, remedy })
    }

    /// Returns true if the value is a table or a list that contains one.
    pub fn holds_tables(&self) -> bool {
        match self.value {
            DeValue::Table(_) => true,
            DeValue::Array(array) => array.iter().any(|element| element.get_ref().is_table()),
            _ => false,
        }
    }

    /// Returns a finite number; integers are accepted.
    pub fn number(&self) -> Result<f64, InputError> {
        let (number, written) = match self.value {
            DeValue::Float(float) => (float.as_str().parse().ok(), float.as_str()),
            DeValue::Integer(integer) => (integer_as_float(integer), integer.as_str()),
            _ => return Err(self.wrong_type("a number")),
        };
        let value = || written.to_owned();
        match number.filter(|number: &f64| number.is_finite()) {
            Some(number) if number.abs() <= MAX_MAGNITUDE => Ok(number),
            Some(_) => Err(self.error(InputErrorKind::MagnitudeTooLarge { value: value() })),
            None => Err(self.error(InputErrorKind::NotFinite { value: value() })),
        }
    }

    /// Returns the text of a number as it is written, or `None` for another value.
    pub fn written_number(&self) -> Option<&'a str> {
        match self.value {
            DeValue::Float(float) => Some(float.as_str()),
            DeValue::Integer(integer) => Some(integer.as_str()),
            _ => None,
        }
    }

    /// Converts the number or numbers of this value from a unit that files do not use to that of
    /// tables, as text. Returns `None` for another value.
    pub(super) fn converted(&self, unit: Unit, suffix: &str) -> Option<String> {
        let number = |item: &Self| {
            let converted = unit.convert_foreign(suffix, item.number().ok()?);
            converted.map(|value| value.to_string())
        };
        match self.value {
            DeValue::Array(_) => {
                let numbers = self.list("").ok()?.iter().map(number).collect::<Option<Vec<_>>>();
                numbers.map(|numbers| format!("[{}]", numbers.join(", ")))
            }
            _ => number(self),
        }
    }

    /// Returns an integer of at least `least`.
    pub fn whole(&self, least: u64) -> Result<u64, InputError> {
        let written = match self.value {
            DeValue::Integer(integer) => {
                match u64::from_str_radix(integer.as_str(), integer.radix()) {
                    Ok(number) if number >= least => return Ok(number),
                    _ => integer.as_str(),
                }
            }
            DeValue::Float(float) => float.as_str(),
            _ => return Err(self.wrong_type("a whole number")),
        };
        Err(self.error(InputErrorKind::NotWhole { value: written.to_owned(), least }))
    }

    /// Returns an integer from 1 to 1000, for example a number of beam elements.
    pub fn small(&self) -> Result<u16, InputError> {
        let number = self.whole(1)?;
        u16::try_from(number)
            .ok()
            .filter(|number| *number <= 1000)
            .ok_or_else(|| self.error(InputErrorKind::TooLarge { value: number, most: 1000 }))
    }

    /// Returns an error if the number `found` exceeds the maximum `most`; `what` names the counted
    /// items in the message.
    pub fn check_count(
        &self,
        what: &'static str,
        found: usize,
        most: usize,
    ) -> Result<(), InputError> {
        if found > most {
            Err(self.error(InputErrorKind::TooMany { what, found, most }))
        } else {
            Ok(())
        }
    }

    /// Returns a value `true` or `false`.
    pub fn boolean(&self) -> Result<bool, InputError> {
        self.value.as_bool().ok_or_else(|| self.wrong_type("true or false"))
    }

    /// Returns text that is neither empty nor contains invisible characters.
    pub fn text(&self) -> Result<&'a str, InputError> {
        let text = self.value.as_str().ok_or_else(|| self.wrong_type("text in quotes"))?;
        match text.chars().find(|&character| is_hidden(character)) {
            _ if text.trim().is_empty() => Err(self.error(InputErrorKind::Empty)),
            Some(hidden) if hidden.is_control() && self.has_escape() => {
                Err(self.error(InputErrorKind::EscapedPath { code: hidden.into() }))
            }
            Some(hidden) => Err(self.error(InputErrorKind::Hidden { code: hidden.into() })),
            None => Ok(text),
        }
    }

    /// Returns true if the value has an escape sequence of a letter, as a path of Windows has.
    fn has_escape(&self) -> bool {
        let written = self.document.text.get(self.span.clone()).unwrap_or_default();
        ["\\t", "\\n", "\\r", "\\b", "\\f", "\\e"].iter().any(|escape| written.contains(escape))
    }

    /// Returns the text, or the first one of a list.
    pub(super) fn first_text(&self) -> Option<&'a str> {
        match self.value {
            DeValue::Array(array) => array.iter().next()?.get_ref().as_str(),
            value => value.as_str(),
        }
    }

    /// Returns text, which may be empty.
    pub fn any_text(&self) -> Result<&'a str, InputError> {
        self.value.as_str().ok_or_else(|| self.wrong_type("text in quotes"))
    }

    /// Returns the elements of a list; their keys are numbers from 1. `expected` describes the list
    /// in the error.
    pub fn list(&self, expected: &'static str) -> Result<Vec<Self>, InputError> {
        let array = self.value.as_array().ok_or_else(|| self.wrong_type(expected))?;
        let element = |(index, value): (usize, &'a Spanned<DeValue<'i>>)| Self {
            document: self.document,
            key: format!("{}[{}]", self.key, index + 1),
            value: value.get_ref(),
            span: value.span(),
        };
        Ok(array.iter().enumerate().map(element).collect())
    }

    /// Returns a list of two numbers.
    pub fn pair(&self) -> Result<[f64; 2], InputError> {
        let elements = self.list("a list of 2 numbers")?;
        if let [x, y] = elements.as_slice() {
            return Ok([x.number()?, y.number()?]);
        }
        let (found, has_close_commas) = (elements.len(), has_close_commas(&elements, 2));
        Err(self.error(InputErrorKind::NotAPair { found, has_close_commas }))
    }

    /// Returns a list of three numbers.
    pub fn vector(&self) -> Result<Vector3<f64>, InputError> {
        let elements = self.list("a list of 3 numbers, [x, y, z]")?;
        if elements.len() != 3 {
            let (found, has_close_commas) = (elements.len(), has_close_commas(&elements, 3));
            return Err(self.error(InputErrorKind::NotAVector { found, has_close_commas }));
        }
        let numbers = elements.iter().map(Self::number).collect::<Result<Vec<_>, _>>()?;
        Ok(Vector3::from_column_slice(&numbers))
    }
}

/// Returns true if a list has up to twice as many numbers as `expected`, and a digit follows the
/// comma behind one of them directly, as in `[0,18, 0, 0]`.
fn has_close_commas(elements: &[Item<'_, '_>], expected: usize) -> bool {
    let is_close = |pair: &[Item<'_, '_>]| match pair {
        [first, second] => {
            let is_whole = |item: &Item<'_, '_>| matches!(item.value, DeValue::Integer(_));
            first.span.end + 1 == second.span.start && is_whole(first) && is_whole(second)
        }
        _ => false,
    };
    (expected + 1..=2 * expected).contains(&elements.len()) && elements.windows(2).any(is_close)
}

/// Converts an integer of any size to a float.
fn integer_as_float(integer: &DeInteger<'_>) -> Option<f64> {
    if integer.radix() == 10 {
        integer.as_str().parse().ok()
    } else {
        u64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|number| number as f64)
    }
}

/// Returns `path.key`; a key that is not a bare TOML key is quoted.
pub(crate) fn join(path: &str, key: &str) -> String {
    let bare =
        !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    let dot = if path.is_empty() { "" } else { "." };
    if bare { format!("{path}{dot}{key}") } else { format!("{path}{dot}\"{key}\"") }
}

/// Reads the name of a fixture or target, which parameter names contain; `what` is used in
/// messages.
pub(super) fn name_of(item: &Item<'_, '_>, what: &'static str) -> Result<String, InputError> {
    let name = item.text()?.trim().to_owned();
    let barred = |c: char| c.is_control() || c.is_whitespace() || ".*[]\"".contains(c);
    if name.is_empty() || name.contains(barred) {
        return Err(item.error(InputErrorKind::NotAFixtureName { what, name }));
    }
    Ok(name)
}

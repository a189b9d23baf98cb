//! Errors in the input, each with file, line and key.

mod causes;
mod clock_offset;
mod file_format;
mod kind;
mod near;
mod no_rows;
mod other_names;
mod phrases;
mod plain;
mod remedy;
mod study;
mod table;
mod urdf;
mod warning;

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[doc(hidden)]
pub use clock_offset::ClockOffset;
pub(crate) use file_format::{JSON, TABLE, TOML, XML, binary_format, text_format};
pub use kind::InputErrorKind;
pub(crate) use near::{nearest, one_typo};
pub(crate) use no_rows::NoRows;
pub(crate) use other_names::other_names;
pub(crate) use plain::typographic;
pub(crate) use plain::{escape_hidden, mask_hidden, one_line};
pub(crate) use study::StudyErrorKind;
pub(crate) use table::JOINED;
#[doc(hidden)]
pub use table::TableErrorKind;
pub(crate) use urdf::UrdfErrorKind;
#[doc(hidden)]
pub use warning::WarningKind;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    causes::{message_with_causes, mistake},
    near::file_like,
    plain::is_hidden,
};

/// Byte-order mark of UTF-8 text.
pub(crate) const BYTE_ORDER_MARK_UTF8: &[u8] = b"\xef\xbb\xbf";
/// Byte-order marks of UTF-16 text, little-endian and big-endian.
pub(crate) const BYTE_ORDER_MARKS: [&[u8]; 2] = [&[0xff, 0xfe], &[0xfe, 0xff]];

/// Place in an input file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Location {
    /// Path of the file.
    pub file: PathBuf,
    /// Line number, counted from 1.
    pub line: Option<usize>,
    /// Key (`joint[2].alpha`) or column (`column x_mm`).
    pub key: Option<String>,
    /// Text around the place, for display with the message.
    #[doc(hidden)]
    pub excerpt: Option<Excerpt>,
}

/// Part of an input file with a marked span.
#[doc(hidden)]
#[derive(Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// Text: a whole problem file or one line of measurements.
    pub text: Arc<str>,
    /// Line of the file on which the text begins, counted from 1.
    pub first_line: usize,
    /// Marked bytes of `text`.
    pub span: Range<usize>,
}

/// Prints only the marked text; a whole file would be too long.
impl fmt::Debug for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Excerpt({:?})", self.text.get(self.span.clone()).unwrap_or_default())
    }
}

impl Location {
    /// Returns the location of a whole file.
    #[doc(hidden)]
    pub fn file(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), line: None, key: None, excerpt: None }
    }

    /// Returns the location of a span of a text file that is in memory.
    pub(crate) fn in_text(file: &Path, text: &Arc<str>, span: Range<usize>) -> Self {
        let line = lines(text.as_bytes().get(..span.start).unwrap_or(text.as_bytes()));
        let excerpt = Excerpt { text: Arc::clone(text), first_line: 1, span };
        Self { file: file.to_owned(), line: Some(line), key: None, excerpt: Some(excerpt) }
    }

    /// Returns this location with a line number, counted from 1.
    #[must_use]
    pub(crate) fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Returns this location with a key or column.
    #[must_use]
    pub(crate) fn with_key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }

    /// Returns the location of a key of the same section, without excerpt.
    pub(crate) fn of_key(&self, key: impl Into<String>) -> Self {
        Self { excerpt: None, ..self.clone() }.with_key(key)
    }

    /// Returns the location of the whole line.
    #[must_use]
    pub(crate) fn of_line(&self) -> Self {
        Self { key: None, excerpt: None, ..self.clone() }
    }

    /// Returns an error at this location.
    pub(crate) fn error(self, kind: impl Into<InputErrorKind>) -> InputError {
        InputError { location: Box::new(self), kind: Box::new(kind.into()) }
    }
}

/// Prints `file:line: key` without the parts that are not set.
impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", one_line(&self.file.display().to_string()))?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(key) = &self.key {
            write!(f, ": {}", one_line(&shortened(key, MAX_KEY_CHARS)))?;
        }
        Ok(())
    }
}

/// Error in the input: place, cause and remedy.
///
/// Both fields are boxed to keep `Result` small.
#[derive(Debug)]
pub struct InputError {
    /// Place of the error.
    pub location: Box<Location>,
    /// Kind of the message, with cause and remedy.
    pub kind: Box<InputErrorKind>,
}

impl std::error::Error for InputError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.kind.source()
    }
}

/// Part of the input that was ignored or looks wrong, without being an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Place of the warning.
    pub location: Location,
    /// Kind of the message, with cause and remedy.
    #[doc(hidden)]
    pub kind: WarningKind,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.location, one_line(&self.kind.to_string()))
    }
}

/// Maximum length of a displayed key \[characters\].
const MAX_KEY_CHARS: usize = 200;

/// Returns the first `max_chars` characters of a text, followed by an ellipsis if more follow.
pub(crate) fn shortened(text: &str, max_chars: usize) -> String {
    match text.char_indices().nth(max_chars) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

/// Returns the number of lines of a text, the last one included even if it is empty.
pub(crate) fn lines(text: &[u8]) -> usize {
    text.split(|&byte| byte == b'\n').count()
}

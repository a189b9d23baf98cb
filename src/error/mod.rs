//! Mistakes in the input, each with the place where it stands.

mod causes;
mod kind;
mod near;
mod plain;
mod urdf;

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use causes::{mistake, with_causes};
pub use kind::{InputErrorKind, NoRows, WarningKind};
pub(crate) use near::{nearest, one_typo};
pub use plain::{is_hidden, one_line, veiled, visible};
pub use urdf::UrdfMistake;

/// How UTF-8 text may begin.
pub(crate) const BYTE_ORDER_MARK_UTF8: &[u8] = b"\xef\xbb\xbf";
/// How UTF-16 text begins, in either order of its bytes.
pub(crate) const BYTE_ORDER_MARKS: [&[u8]; 2] = [&[0xff, 0xfe], &[0xfe, 0xff]];

/// A place in an input file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The file.
    pub file: PathBuf,
    /// Line, counted from 1.
    pub line: Option<usize>,
    /// Key (`joint[2].alpha`) or column (`column x_mm`).
    pub key: Option<String>,
    /// The text that is meant, for showing it.
    pub excerpt: Option<Excerpt>,
}

/// A piece of text of an input file, and a part of it that is meant.
#[derive(Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// The text: a whole problem file, one line of measurements.
    pub text: Arc<str>,
    /// Line of the file on which the text begins, counted from 1.
    pub first_line: usize,
    /// The part that is meant, as bytes of `text`.
    pub span: Range<usize>,
}

/// The part that is meant alone; a whole file would bury it.
impl fmt::Debug for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Excerpt({:?})", self.text.get(self.span.clone()).unwrap_or_default())
    }
}

impl Location {
    /// A whole file.
    pub fn file(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), line: None, key: None, excerpt: None }
    }

    /// A part of a text file that is at hand as a whole.
    pub fn in_text(file: &Path, text: &Arc<str>, span: Range<usize>) -> Self {
        let line = lines(text.as_bytes().get(..span.start).unwrap_or(text.as_bytes()));
        let excerpt = Excerpt { text: Arc::clone(text), first_line: 1, span };
        Self { file: file.to_owned(), line: Some(line), key: None, excerpt: Some(excerpt) }
    }

    /// A line of a file.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// The same place under a key or column.
    #[must_use]
    pub fn with_key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }

    /// A mistake at this place.
    pub fn error(self, kind: InputErrorKind) -> InputError {
        InputError { location: Box::new(self), kind: Box::new(kind) }
    }
}

/// `file:line: key`, without what is not known.
impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", one_line(&self.file.display().to_string()))?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(key) = &self.key {
            write!(f, ": {}", one_line(&shortened(key, KEY)))?;
        }
        Ok(())
    }
}

/// A mistake in the input: where, what, and how to mend it.
///
/// Both parts are boxed, so that a `Result` stays small.
#[derive(Debug)]
pub struct InputError {
    /// Where.
    pub location: Box<Location>,
    /// What.
    pub kind: Box<InputErrorKind>,
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.location, one_line(&self.kind.to_string()))
    }
}

impl std::error::Error for InputError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.kind.source()
    }
}

/// Something in the input that was passed over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Where.
    pub location: Location,
    /// What.
    pub kind: WarningKind,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.location, one_line(&self.kind.to_string()))
    }
}

/// Longest key that is shown [characters].
const KEY: usize = 200;

/// The beginning of a text, with an ellipsis where more follows.
pub(crate) fn shortened(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

/// Number of lines that a text has begun.
pub(crate) fn lines(text: &[u8]) -> usize {
    text.split(|&byte| byte == b'\n').count()
}

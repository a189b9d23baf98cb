//! Report as a list of blocks, which are rendered for terminals, as Markdown and as a page.
//!
//! Texts mark code with [`code`]. Only the page shows figures and folded sections; [`Block::Page`]
//! and [`Block::Words`] restrict blocks to one kind of output.

use std::path::Path;

use super::figures::Drawing;
use crate::results::PlotData;

/// Marks before and after code in texts: control characters, which titles do not contain and
/// terminals remove.
pub(super) const CODE: (char, char) = ('\u{2}', '\u{3}');

/// Block of a report.
#[derive(Debug, Clone)]
pub(super) enum Block<'a> {
    /// Title of the blocks that follow.
    Heading(String),
    /// Paragraph of running text.
    Text(String),
    /// Paragraph with a warning.
    Note(String),
    /// Lines with fixed line breaks, followed by list items.
    Lines(String, Vec<String>),
    /// Bullet list with details.
    List(Vec<Point>),
    /// List numbered from 1, with details.
    Ranking(Vec<Point>),
    /// Table of texts and numbers.
    Table(Table),
    /// Labelled lines to fill in by hand; on the page alone.
    Blanks(Vec<&'static str>),
    /// Errors and facts at the top of the page; on the page alone.
    Headline(Headline),
    /// Figures side by side; on the page alone.
    Figures(Vec<Drawing>),
    /// List of all drawn poses; on the page alone.
    Poses(&'a PlotData),
    /// Section that the page shows on request: title, blocks, and the sentence that stands for them
    /// in print; on the page alone.
    Folded(String, Vec<Block<'a>>, String),
    /// Blocks that only the page shows.
    Page(Vec<Block<'a>>),
    /// Blocks that all outputs except the page show.
    Words(Vec<Block<'a>>),
}

/// Item of a list, with details below it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Point {
    pub text: String,
    pub details: Vec<String>,
    /// Outcome of a test, if the item is one.
    pub mark: Option<Mark>,
}

/// Outcome of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Failed,
    Passed,
    Untested,
}

/// Table; numbers are aligned to the right, the columns in `left` to the left.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Table {
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
    pub left: Vec<usize>,
    /// Notes that explain the table: below it on terminals, above it on the page.
    pub notes: Vec<String>,
    /// Indices of columns that a narrow page omits.
    pub minor: Vec<usize>,
    /// Last column of bars, on the page alone.
    pub bars: Option<(&'static str, Vec<Bar>)>,
}

/// Column of a table: its name with the unit, its alignment, and the cell of each item.
pub(super) struct Column<'a, T> {
    name: &'static str,
    is_left: bool,
    is_minor: bool,
    cell: Box<dyn Fn(&T) -> String + 'a>,
}

impl<'a, T> Column<'a, T> {
    /// Creates a column of numbers, aligned to the right.
    pub fn number(name: &'static str, cell: impl Fn(&T) -> String + 'a) -> Self {
        Self { name, is_left: false, is_minor: false, cell: Box::new(cell) }
    }

    /// Creates a column of words, aligned to the left.
    pub fn words(name: &'static str, cell: impl Fn(&T) -> String + 'a) -> Self {
        Self { is_left: true, ..Self::number(name, cell) }
    }

    /// Marks the column as one that narrow pages omit.
    pub fn minor(self) -> Self {
        Self { is_minor: true, ..self }
    }
}

/// Change of a parameter from nominal in units of its standard error, drawn as a bar.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Bar {
    pub change: Option<f64>,
    /// Active bound: 0 for the lower one, 1 for the upper one; `None` if none is active.
    pub bound: Option<f64>,
}

/// Summary of the outcome with the errors of successive states of the arm.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Headline {
    /// States of the arm in order, each with its error.
    pub states: Vec<(&'static str, String)>,
    /// Unit of the errors.
    pub unit: &'static str,
    /// Description of the rows over which the headline's errors are averaged.
    pub of: String,
    pub facts: Vec<(&'static str, String)>,
    /// True if the errors are of a fit that is not to be trusted, so that the last is no gain.
    pub is_doubtful: bool,
}

impl Block<'_> {
    pub fn heading(text: &str) -> Self {
        Self::Heading(text.to_owned())
    }

    /// Creates a block of the figures that are present.
    pub fn figures(drawn: impl IntoIterator<Item = Option<Drawing>>) -> Self {
        Self::Figures(drawn.into_iter().flatten().collect())
    }

    /// Creates a list of points without details.
    pub fn list(points: impl IntoIterator<Item = String>) -> Self {
        Self::List(points.into_iter().map(Point::from).collect())
    }

    /// Creates lines without points.
    pub fn lines(words: impl Into<String>) -> Self {
        Self::Lines(words.into(), Vec::new())
    }
}

impl From<String> for Point {
    fn from(text: String) -> Self {
        Self { text, ..Self::default() }
    }
}

impl Table {
    pub fn new(header: &[&'static str], rows: Vec<Vec<String>>, left: &[usize]) -> Self {
        Self { header: header.to_vec(), rows, left: left.to_vec(), ..Self::default() }
    }

    /// Creates a table with a row for each item.
    pub fn of<'t, T: 't>(items: impl IntoIterator<Item = &'t T>, columns: &[Column<T>]) -> Self {
        let places = |is: fn(&Column<T>) -> bool| {
            columns.iter().enumerate().filter(|(_, column)| is(column)).map(|(k, _)| k).collect()
        };
        let row = |item: &'t T| columns.iter().map(|column| (column.cell)(item)).collect();
        Self {
            header: columns.iter().map(|column| column.name).collect(),
            rows: items.into_iter().map(row).collect(),
            left: places(|column| column.is_left),
            minor: places(|column| column.is_minor),
            ..Self::default()
        }
    }

    pub fn noted(self, notes: &[&str]) -> Self {
        Self { notes: notes.iter().map(|&note| note.to_owned()).collect(), ..self }
    }
}

/// Creates the opening lines: on terminals below the title, on the page, whose heading is the
/// title, without it.
pub(super) fn opening<'a>(title: &str, words: impl Into<String>) -> [Block<'a>; 2] {
    let words = words.into();
    let titled = Block::lines(format!("{title}\n{words}"));
    let lines = words.lines().filter(|line| !line.is_empty());
    let untitled = lines.map(|line| Block::Text(line.to_owned())).collect();
    [Block::Words(vec![titled]), Block::Page(untitled)]
}

/// Returns the last two parts of a path, which tell files of one name apart.
pub(super) fn last_parts(file: &Path) -> String {
    let parts: Vec<_> = file.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    let first = parts.len().saturating_sub(2);
    parts.get(first..).unwrap_or_default().join("/")
}

/// Encloses words in code marks.
pub(super) fn code(words: &str) -> String {
    format!("{}{words}{}", CODE.0, CODE.1)
}

/// Returns the first `most` words, and a note with the number of omitted ones and the `file` that
/// contains them.
pub(super) fn first_of(
    words: impl IntoIterator<Item = String>,
    most: usize,
    file: &str,
) -> Vec<String> {
    let (mut shown, more) = some_of(words, most);
    shown.extend((more > 0).then(|| format!("and {more} more in {file}")));
    shown
}

/// Joins the first `most` words by `between` and counts the others: "a, b and 3 more".
pub(super) fn named(words: impl IntoIterator<Item = String>, most: usize, between: &str) -> String {
    let (shown, more) = some_of(words, most);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(between) + &more
}

/// Returns the first `most` words and the number of others.
pub(super) fn some_of(
    words: impl IntoIterator<Item = String>,
    most: usize,
) -> (Vec<String>, usize) {
    let mut listed: Vec<String> = words.into_iter().collect();
    let more = listed.len().saturating_sub(most);
    listed.truncate(most);
    (listed, more)
}

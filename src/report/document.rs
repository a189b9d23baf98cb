//! Report as a list of blocks, which are rendered for terminals, as Markdown and as an HTML page.
//!
//! Texts mark code with [`code`]. Only the page shows figures and folded sections; [`Block::Page`]
//! and [`Block::Words`] restrict blocks to the page or to the other outputs.

use std::path::Path;

use super::figures::Drawing;
use crate::results::PlotData;

/// Marks before and after code in texts. They are control characters, which titles do not contain,
/// and which the text for terminals leaves out.
pub(super) const CODE: (char, char) = ('\u{2}', '\u{3}');

/// Part of a report: heading, paragraph, list, table or figures.
#[derive(Debug, Clone)]
pub(super) enum Block<'a> {
    /// Title of the blocks that follow.
    Heading(String),
    /// Paragraph of running text.
    Text(String),
    /// Paragraph with a warning.
    Note(String),
    /// Text with fixed line breaks, followed by list items.
    Lines(String, Vec<String>),
    /// Bullet list with details below each item.
    List(Vec<Point>),
    /// List numbered from 1, with details below each item.
    Ranking(Vec<Point>),
    /// Table of texts and numbers.
    Table(Table),
    /// Labels of empty lines to fill in by hand; on the page alone.
    Blanks(Vec<&'static str>),
    /// Errors and facts at the top of the page; on the page alone.
    Headline(Headline),
    /// Large word at the top of the page, and below it what it is about; on the page alone.
    Outcome { word: &'static str, of: String, is_good: bool },
    /// Figures side by side; on the page alone.
    Figures(Vec<Drawing>),
    /// Section on individual poses: the arm, ranges of joints, the largest residuals; on the page
    /// alone.
    Poses(&'a PlotData),
    /// Section that the page shows on request: title, blocks, and the sentence that replaces the
    /// blocks in print; on the page alone.
    Folded(String, Vec<Block<'a>>, String),
    /// Blocks that only the page shows.
    Page(Vec<Block<'a>>),
    /// Blocks that all outputs except the page show.
    Words(Vec<Block<'a>>),
}

/// Item of a list: its text, and details below it.
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

/// Table of texts. Columns are aligned to the right, except those with the indices `left`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
    pub left: Vec<usize>,
    /// Notes that explain the table: below it on terminals, above it on the page.
    pub notes: Vec<String>,
    /// Indices of columns that narrow pages and terminals omit.
    pub minor: Vec<usize>,
    /// Header and bars of an additional last column, on the page alone.
    pub bars: Option<(&'static str, Vec<Bar>)>,
}

/// Column of a table: its name with the unit, its alignment, and the cell of each item.
pub(super) struct Column<'a, T> {
    name: String,
    is_left: bool,
    is_minor: bool,
    cell: Box<dyn Fn(&T) -> String + 'a>,
}

impl<'a, T> Column<'a, T> {
    /// Creates a column of numbers, aligned to the right.
    pub fn number(name: impl Into<String>, cell: impl Fn(&T) -> String + 'a) -> Self {
        Self { name: name.into(), is_left: false, is_minor: false, cell: Box::new(cell) }
    }

    /// Creates a column of texts, aligned to the left.
    pub fn words(name: impl Into<String>, cell: impl Fn(&T) -> String + 'a) -> Self {
        Self { is_left: true, ..Self::number(name, cell) }
    }

    /// Returns the column as one that narrow pages and terminals omit.
    pub fn minor(self) -> Self {
        Self { is_minor: true, ..self }
    }
}

/// Change of a parameter from nominal, drawn as a bar in a table.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Bar {
    /// Change in units of the standard error; `None` without a standard error.
    pub change: Option<f64>,
    /// Position of the active bound: 0 for the lower one, at the left end of the bar, 1 for the
    /// upper one; `None` if no bound is active.
    pub bound: Option<f64>,
}

/// Summary at the top of a page: errors of successive states of the arm, and facts.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Headline {
    /// States of the arm in order, for example the nominal arm, each with its formatted error.
    pub states: Vec<(&'static str, String)>,
    /// Unit of the errors.
    pub unit: &'static str,
    /// Description of the rows over which the errors are averaged.
    pub of: String,
    /// Labels with their values.
    pub facts: Vec<(&'static str, String)>,
    /// True if the fit is not to be trusted, so that the last error is not emphasised.
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

    /// Creates a bullet list of items without details.
    pub fn list(points: impl IntoIterator<Item = String>) -> Self {
        Self::List(points.into_iter().map(Point::from).collect())
    }

    /// Creates text with fixed line breaks, without list items.
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
    pub fn new(header: &[&str], rows: Vec<Vec<String>>, left: &[usize]) -> Self {
        let header = header.iter().map(|&name| name.to_owned()).collect();
        Self { header, rows, left: left.to_vec(), ..Self::default() }
    }

    /// Creates a table with a row for each of `items`.
    pub fn of<'t, T: 't>(items: impl IntoIterator<Item = &'t T>, columns: &[Column<T>]) -> Self {
        let indices = |is: fn(&Column<T>) -> bool| {
            columns.iter().enumerate().filter(|(_, column)| is(column)).map(|(k, _)| k).collect()
        };
        let row = |item: &'t T| columns.iter().map(|column| (column.cell)(item)).collect();
        Self {
            header: columns.iter().map(|column| column.name.clone()).collect(),
            rows: items.into_iter().map(row).collect(),
            left: indices(|column| column.is_left),
            minor: indices(|column| column.is_minor),
            ..Self::default()
        }
    }

    /// Returns the table with these notes instead of its own.
    pub fn noted(self, notes: &[&str]) -> Self {
        Self { notes: notes.iter().map(|&note| note.to_owned()).collect(), ..self }
    }
}

/// Creates the opening lines of a report. On terminals, they follow the title; on the page they
/// stand alone, because its heading is the title.
pub(super) fn opening<'a>(title: &str, words: impl Into<String>) -> [Block<'a>; 2] {
    let words = words.into();
    let titled = Block::lines(format!("{title}\n{words}"));
    let lines = words.lines().filter(|line| !line.is_empty());
    let untitled = lines.map(|line| Block::Text(line.to_owned())).collect();
    [Block::Words(vec![titled]), Block::Page(untitled)]
}

/// Returns the last two parts of a path, which usually distinguish files of the same name.
pub(super) fn last_parts(file: &Path) -> String {
    let parts: Vec<_> = file.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    let first = parts.len().saturating_sub(2);
    parts.get(first..).unwrap_or_default().join("/")
}

/// Marks a text as code.
pub(super) fn code(words: &str) -> String {
    format!("{}{words}{}", CODE.0, CODE.1)
}

/// Returns the first `max` of some texts. If texts are omitted, adds a note with their number and
/// the `file` that contains them.
pub(super) fn first_of(
    words: impl IntoIterator<Item = String>,
    max: usize,
    file: &str,
) -> Vec<String> {
    let (mut shown, more) = split_at_most(words, max);
    shown.extend((more > 0).then(|| format!("and {more} more in {file}")));
    shown
}

/// Joins the first `max` of some texts by `between` and counts the others: "a, b and 3 more".
pub(super) fn joined(words: impl IntoIterator<Item = String>, max: usize, between: &str) -> String {
    let (shown, more) = split_at_most(words, max);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(between) + &more
}

/// Returns the first `max` of some texts, and the number of the others.
pub(super) fn split_at_most(
    words: impl IntoIterator<Item = String>,
    max: usize,
) -> (Vec<String>, usize) {
    let mut listed: Vec<String> = words.into_iter().collect();
    let more = listed.len().saturating_sub(max);
    listed.truncate(max);
    (listed, more)
}

/// Smallest probability at which a text calls a law, or a cause at a place, more probable than not.
pub(super) const MIN_PROBABLE: f64 = 0.5;

/// Formats a probability (0 to 1) as a percentage, as "over 99 %" or "under 1 %" at the ends.
pub(super) fn percent(probability: f64) -> String {
    match probability {
        p if p > 0.995 => "over 99 %".to_owned(),
        p if p < 0.005 => "under 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}

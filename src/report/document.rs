//! A report in blocks: told once, shown on terminals, as Markdown and as a page.
//!
//! Words come with [`code`] marked. Figures, folds and the like are shown by the page alone;
//! [`Block::Page`] and [`Block::Words`] hold what only one kind of reader gets.

use super::figures::{Drawing, PlotData};

/// Marks of code in words: control characters, so that no title has them on purpose and terminals
/// drop them.
pub(super) const CODE: (char, char) = ('\u{2}', '\u{3}');

/// A part of a report.
#[derive(Debug, Clone)]
pub(super) enum Block<'a> {
    /// Title of what follows.
    Heading(String),
    /// Running text.
    Text(String),
    /// What to beware of.
    Note(String),
    /// Lines that a terminal shows as they are broken here, and points below them.
    Lines(String, Vec<String>),
    /// Points, each with its details.
    List(Vec<Point>),
    /// Points that are numbered from 1.
    Ranking(Vec<Point>),
    /// Numbers.
    Table(Table),
    /// Lines to fill in by hand, each with what goes there; on the page alone.
    Blanks(Vec<&'static str>),
    /// What it came to, at one glance; on the page alone.
    Headline(Headline),
    /// Drawings side by side; on the page alone.
    Figures(Vec<Drawing>),
    /// Every pose that the figures draw, to look at one by one; on the page alone.
    Poses(&'a PlotData),
    /// What a page shows on demand: its title, what it holds, and where it is found on paper; on
    /// the page alone.
    Folded(String, Vec<Block<'a>>, String),
    /// On the page alone.
    Page(Vec<Block<'a>>),
    /// Everywhere but on the page.
    Words(Vec<Block<'a>>),
}

/// A point of a list.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Point {
    pub text: String,
    pub details: Vec<String>,
    /// How a test went, if it is one.
    pub mark: Option<Mark>,
}

/// How a test went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Failed,
    Passed,
    Untested,
}

/// Rows and columns; numbers stand to the right, the columns in `left` to the left.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Table {
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
    pub left: Vec<usize>,
    /// How to read it: below it on terminals, above it on the page.
    pub notes: Vec<String>,
    /// Columns that a narrow page leaves out.
    pub minor: Vec<usize>,
    /// A last column that is drawn, on the page alone.
    pub bars: Option<(&'static str, Vec<Bar>)>,
}

/// A change in units of its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Bar {
    pub change: Option<f64>,
    /// Where it rests: 0 its lower bound, 1 its upper one.
    pub bound: Option<f64>,
}

/// What it came to, at one glance.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Headline {
    /// States of the arm from the first to the last, each with its error.
    pub states: Vec<(&'static str, String)>,
    /// Unit of the errors.
    pub unit: &'static str,
    /// Of what.
    pub of: String,
    pub facts: Vec<(&'static str, String)>,
}

impl Block<'_> {
    pub fn heading(text: &str) -> Self {
        Self::Heading(text.to_owned())
    }

    /// Those figures for which there is something to draw.
    pub fn figures(drawn: impl IntoIterator<Item = Option<Drawing>>) -> Self {
        Self::Figures(drawn.into_iter().flatten().collect())
    }

    /// Points without details.
    pub fn list(points: impl IntoIterator<Item = String>) -> Self {
        Self::List(points.into_iter().map(Point::from).collect())
    }

    /// Lines without points.
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

    pub fn noted(self, notes: &[&str]) -> Self {
        Self { notes: notes.iter().map(|&note| note.to_owned()).collect(), ..self }
    }
}

/// Words as code.
pub(super) fn code(words: &str) -> String {
    format!("{}{words}{}", CODE.0, CODE.1)
}

/// The first `most` of some words, and where the others are.
pub(super) fn first_of(
    words: impl IntoIterator<Item = String>,
    most: usize,
    file: &str,
) -> Vec<String> {
    let (mut shown, more) = some_of(words, most);
    shown.extend((more > 0).then(|| format!("and {more} more in {file}")));
    shown
}

/// "a, b and 3 more": the first `most` of some words.
pub(super) fn named(words: impl IntoIterator<Item = String>, most: usize, between: &str) -> String {
    let (shown, more) = some_of(words, most);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(between) + &more
}

/// The first `most` of some words, and how many more there are.
pub(super) fn some_of(
    words: impl IntoIterator<Item = String>,
    most: usize,
) -> (Vec<String>, usize) {
    let mut all: Vec<String> = words.into_iter().collect();
    let more = all.len().saturating_sub(most);
    all.truncate(most);
    (all, more)
}

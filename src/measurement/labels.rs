//! Builders of word columns.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use super::Labels;
use super::columns::{Column, Columns};
use super::latin::parsed;
use super::role::Role;
use super::table::Table;
use crate::error::{Warning, WarningKind, one_line};

/// Smallest number of rows whose different words in a column are names of poses.
const MIN_LABELLED_ROWS: usize = 2;

/// Collector of one word per row, which stores each distinct word once.
#[derive(Default)]
pub(super) struct LabelsBuilder {
    pub labels: Labels,
    /// Index of each distinct word.
    places: HashMap<String, usize>,
}

impl LabelsBuilder {
    /// Appends the word of the next row.
    pub fn push(&mut self, word: &str) {
        let place = self.places.get(word).copied().unwrap_or_else(|| {
            let place = self.labels.names.len();
            self.labels.names.push(word.to_owned());
            self.places.insert(word.to_owned(), place);
            place
        });
        self.labels.of_row.push(place);
    }
}

/// Collects the words of the rows, in row order.
impl<W: AsRef<str>> FromIterator<W> for Labels {
    fn from_iter<I: IntoIterator<Item = W>>(words: I) -> Self {
        let mut builder = LabelsBuilder::default();
        words.into_iter().for_each(|word| builder.push(word.as_ref()));
        builder.labels
    }
}

impl Columns {
    /// Takes the first unread column with a different word in each row as the names of planned
    /// poses, unless a column has them, and drops the warning that it is ignored.
    pub fn take_labels(&mut self, table: &Table, ignored: &mut Vec<Warning>) {
        let rows = table.beginning.rows();
        let is_label = |place: &usize| {
            let cells = || rows.iter().filter_map(|row| row.get(*place));
            let is_word =
                |cell: &String| parsed(cell).is_none() && cell.chars().any(char::is_alphabetic);
            let is_read = self.read.iter().any(|column| column.place == *place);
            let different: HashSet<&String> = cells().collect();
            !is_read
                && self.marked != Some(*place)
                && !table.is_read_as_date(*place)
                && different.len() == rows.len()
                && cells().all(|cell| is_word(cell) && !table.is_instant(cell))
        };
        if self.has(Role::Pose) || rows.len() < MIN_LABELLED_ROWS {
            return;
        }
        let Some(place) = (0..table.header.len()).find(is_label) else { return };
        let name = table.name_of(place);
        let location = table.column(name);
        ignored.retain_mut(|warning| match &mut warning.kind {
            WarningKind::ColumnIgnored { .. } => warning.location != location,
            WarningKind::Unmapped { names } => {
                names.retain(|other| other != name);
                !names.is_empty()
            }
            _ => true,
        });
        self.read.push(Column { role: Role::Pose, place, to_si: std::convert::identity });
        self.read.sort_by_key(|column| column.role);
    }
}

/// Names of poses collected so far.
pub(super) enum PoseNames {
    /// All names are numbers.
    Numbers(Vec<f64>),
    /// Not all names are numbers.
    Words(LabelsBuilder),
    /// A row has no name.
    Incomplete,
}

impl PoseNames {
    /// Creates an empty collection; `exists` is true if the table has the column `pose`.
    pub fn new(exists: bool) -> Self {
        if exists { Self::Numbers(Vec::new()) } else { Self::Incomplete }
    }

    /// Appends the name of the next row; `None` if its cell is empty.
    pub fn push(&mut self, name: Option<&str>) {
        let number =
            name.and_then(|name| name.parse().ok()).filter(|number: &f64| number.is_finite());
        match (&mut *self, number, name) {
            (Self::Numbers(numbers), Some(number), _) => numbers.push(number),
            (Self::Numbers(numbers), None, Some(name)) => {
                let mut words = LabelsBuilder::default();
                for number in &*numbers {
                    words.push(&number.to_string());
                }
                words.push(name);
                *self = Self::Words(words);
            }
            (Self::Words(words), _, Some(name)) => words.push(name),
            _ => *self = Self::Incomplete,
        }
    }

    /// Returns the names as numbers or as words; neither if a row has no name.
    pub fn finish(self) -> (Option<Vec<f64>>, Option<Labels>) {
        match self {
            Self::Numbers(numbers) => (Some(numbers), None),
            Self::Words(words) => (None, Some(words.labels)),
            Self::Incomplete => (None, None),
        }
    }
}

/// Returns the names of files without extension. Files with equal names keep their folders.
pub(super) fn stems(files: &[PathBuf]) -> Vec<String> {
    let stem = |file: &PathBuf| {
        file.file_stem().map_or_else(String::new, |stem| one_line(&stem.to_string_lossy()))
    };
    let file_stems: Vec<String> = files.iter().map(stem).collect();
    let named = |(file, stem): (&PathBuf, &String)| {
        let shared = file_stems.iter().filter(|other| *other == stem).count() > 1;
        if shared { one_line(&file.with_extension("").to_string_lossy()) } else { stem.clone() }
    };
    files.iter().zip(&file_stems).map(named).collect()
}

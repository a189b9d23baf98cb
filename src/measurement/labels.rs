//! Words of a column as they come.

use std::collections::HashMap;
use std::path::PathBuf;

use super::Labels;
use crate::error::one_line;

/// Words of rows, each kept once.
#[derive(Default)]
pub(super) struct LabelsBuilder {
    pub labels: Labels,
    places: HashMap<String, usize>,
}

impl LabelsBuilder {
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

/// Names of poses: numbers, or else words; none at all where a row has none.
pub(super) enum PoseNames {
    Numbers(Vec<f64>),
    Words(LabelsBuilder),
    Lost,
}

impl PoseNames {
    /// Before the first row, of tables that have the column or not.
    pub fn of(there: bool) -> Self {
        if there { Self::Numbers(Vec::new()) } else { Self::Lost }
    }

    /// Of the next row.
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
            _ => *self = Self::Lost,
        }
    }

    /// The numbers, or the words.
    pub fn finish(self) -> (Option<Vec<f64>>, Option<Labels>) {
        match self {
            Self::Numbers(numbers) => (Some(numbers), None),
            Self::Words(words) => (None, Some(words.labels)),
            Self::Lost => (None, None),
        }
    }
}

/// The names of files without their endings; of those that share one with their folders.
pub(super) fn stems(files: &[PathBuf]) -> Vec<String> {
    let stem = |file: &PathBuf| {
        file.file_stem().map_or_else(String::new, |stem| one_line(&stem.to_string_lossy()))
    };
    let all: Vec<String> = files.iter().map(stem).collect();
    let named = |(file, own): (&PathBuf, &String)| {
        let shared = all.iter().filter(|other| *other == own).count() > 1;
        if shared { one_line(&file.with_extension("").to_string_lossy()) } else { own.clone() }
    };
    files.iter().zip(&all).map(named).collect()
}

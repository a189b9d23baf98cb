//! Names of a table's columns after the map of `[data.columns]`.

use std::path::Path;

use super::table::Table;
use crate::error::{InputError, InputErrorKind};
use crate::problem::{ColumnRule, ColumnSelector, Dialect};

/// Names of a table's columns.
pub(super) struct Names<'a> {
    /// Flexcal's name of each column with the rule that assigns it; the table's name without a
    /// rule.
    pub of_place: Vec<(&'a str, Option<&'a ColumnRule>)>,
    /// Rule for the name of the file.
    pub of_file: Option<&'a ColumnRule>,
    /// True if there is a map.
    pub mapped: bool,
}

impl<'a> Names<'a> {
    /// Applies the map to the columns of a table.
    ///
    /// # Errors
    /// The column of a rule does not exist or is ambiguous.
    pub fn map(table: &'a Table, dialect: &'a Dialect) -> Result<Self, InputError> {
        let mut of_place: Vec<(&str, Option<&ColumnRule>)> =
            table.header.iter().map(|name| (name.as_str(), None)).collect();
        let mut of_file = None;
        for rule in &dialect.columns {
            let place = match &rule.theirs {
                ColumnSelector::File => {
                    of_file = Some(rule);
                    continue;
                }
                ColumnSelector::Place(number) => {
                    Some(number - 1).filter(|place| *place < of_place.len())
                }
                ColumnSelector::Name(name) => {
                    let mut places = (0..)
                        .zip(&table.header)
                        .filter(|(_, header)| *header == name)
                        .map(|(place, _)| place);
                    let first = places.next();
                    if let Some(other) = places.next() {
                        let kind = InputErrorKind::AmbiguousColumn {
                            file: table.file.clone(),
                            place: other + 1,
                        };
                        return Err(rule.location.clone().error(kind));
                    }
                    first
                }
            };
            let Some(entry) = place.and_then(|place| of_place.get_mut(place)) else {
                return Err(no_such(rule, &table.file, &table.header));
            };
            if let Some(first) = entry.1 {
                let first = first.ours.clone();
                return Err(rule.location.clone().error(InputErrorKind::RepeatedColumn { first }));
            }
            *entry = (rule.ours.as_str(), Some(rule));
        }
        Ok(Self { of_place, of_file, mapped: !dialect.columns.is_empty() })
    }

    /// Iterates over flexcal's names of the columns.
    pub fn iter(&self) -> impl Iterator<Item = &'a str> + '_ {
        self.of_place.iter().map(|(name, _)| *name)
    }
}

/// Returns the error of a rule whose column does not exist.
fn no_such(rule: &ColumnRule, file: &Path, header: &[String]) -> InputError {
    let name = match &rule.theirs {
        ColumnSelector::Name(name) => name.clone(),
        ColumnSelector::Place(place) => format!("#{place}"),
        ColumnSelector::File => "#file".to_owned(),
    };
    rule.location.clone().error(InputErrorKind::NoSuchColumn {
        file: file.to_owned(),
        name,
        known: header.to_vec(),
    })
}

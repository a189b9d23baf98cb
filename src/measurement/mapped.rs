//! What the columns of a table are called by flexcal, as `[data.columns]` says.

use std::path::Path;

use super::table::Table;
use crate::error::{InputError, InputErrorKind};
use crate::problem::{ColumnOf, ColumnRule, Dialect};

/// The names of a table's columns.
pub(super) struct Names<'a> {
    /// For each column what flexcal calls it, and the rule that says so; its own name where no rule
    /// does.
    pub of_place: Vec<(&'a str, Option<&'a ColumnRule>)>,
    /// What the name of the file stands for.
    pub of_file: Option<&'a ColumnRule>,
    /// Whether there is a map.
    pub mapped: bool,
}

impl<'a> Names<'a> {
    /// The names that a map gives the columns of a table.
    ///
    /// # Errors
    /// A rule of the map has no column in the table, or several.
    pub fn of(table: &'a Table, dialect: &'a Dialect) -> Result<Self, InputError> {
        let mut of_place: Vec<(&str, Option<&ColumnRule>)> =
            table.header.iter().map(|name| (name.as_str(), None)).collect();
        let mut of_file = None;
        for rule in &dialect.columns {
            let place = match &rule.theirs {
                ColumnOf::File => {
                    of_file = Some(rule);
                    continue;
                }
                ColumnOf::Place(number) => Some(number - 1).filter(|place| *place < of_place.len()),
                ColumnOf::Name(name) => {
                    let mut places = (0..)
                        .zip(&table.header)
                        .filter(|(_, own)| *own == name)
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
            let Some(own) = place.and_then(|place| of_place.get_mut(place)) else {
                return Err(no_such(rule, &table.file, &table.header));
            };
            if let Some(first) = own.1 {
                let first = first.ours.clone();
                return Err(rule.location.clone().error(InputErrorKind::RepeatedColumn { first }));
            }
            *own = (rule.ours.as_str(), Some(rule));
        }
        Ok(Self { of_place, of_file, mapped: !dialect.columns.is_empty() })
    }

    /// What flexcal calls the columns.
    pub fn all(&self) -> impl Iterator<Item = &'a str> + '_ {
        self.of_place.iter().map(|(name, _)| *name)
    }
}

/// The error of a rule whose column the table does not have.
fn no_such(rule: &ColumnRule, file: &Path, header: &[String]) -> InputError {
    let name = match &rule.theirs {
        ColumnOf::Name(name) => name.clone(),
        ColumnOf::Place(place) => format!("#{place}"),
        ColumnOf::File => "#file".to_owned(),
    };
    rule.location.clone().error(InputErrorKind::NoSuchColumn {
        file: file.to_owned(),
        name,
        known: header.to_vec(),
    })
}

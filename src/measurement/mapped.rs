//! Names of a table's columns after the map of `[data.columns]` has been applied.

use super::instants::is_clock;
use super::meaning::{is_numbered_or_position, split_unit};
use super::table::Table;
use crate::error::{InputError, JOINED, TableErrorKind};
use crate::problem::{ColumnRule, ColumnSelector, Dialect};

/// Flexcal's names of a clock.
const CLOCKS: [&str; 3] = ["time", "time_s", "time_ms"];

/// Names of a table's columns, as in the table and in flexcal's vocabulary.
pub(super) struct Names<'a> {
    /// Name of each column in flexcal's vocabulary with the rule that assigns it; the name in the
    /// table and `None` if no rule applies.
    pub of_place: Vec<(&'a str, Option<&'a ColumnRule>)>,
    /// Rule of `[data.columns]` that uses the name of the file.
    pub of_file: Option<&'a ColumnRule>,
    /// True if the rules of `[data.columns]` were applied.
    pub mapped: bool,
    /// First rule whose column does not exist, if the map was not applied because the table has
    /// none of its names.
    pub unused: Option<&'a ColumnRule>,
}

impl<'a> Names<'a> {
    /// Applies the map to the columns of a table.
    ///
    /// A table that has none of the map's names is read by flexcal's names, so that files written
    /// by flexcal are readable whatever the map says. In a table of poses that are not `measured`,
    /// a rule whose column does not exist is skipped: such tables lack the measured columns.
    ///
    /// # Errors
    /// Returns an error if the column of a rule is ambiguous, or does not exist in a table of
    /// measurements.
    pub fn map(table: &'a Table, dialect: &'a Dialect, measured: bool) -> Result<Self, InputError> {
        let mut of_place: Vec<(&str, Option<&ColumnRule>)> =
            table.header.iter().map(|name| (name.as_str(), None)).collect();
        let has = |name: &String| table.header.contains(name);
        let rules = &dialect.columns;
        if let Some(error) = rules.iter().find_map(|rule| reversed(rule, table)) {
            return Err(error);
        }
        // A column of the table says more than the name of its file.
        let of_file = rules.iter().find(|rule| rule.theirs == ColumnSelector::File);
        let of_file = of_file.filter(|rule| !has(&rule.ours));
        let is_foreign = |rule: &&ColumnRule| match &rule.theirs {
            ColumnSelector::Name(name) => has(name),
            ColumnSelector::Place(_) => !has(&rule.ours),
            ColumnSelector::File => rules.len() == 1,
        };
        // A table whose joints, positions and clock have flexcal's names, such as a measured plan, does
        // not have the clock of foreign tables, though one of the names may be the same.
        let is_of_arm = |rule: &&ColumnRule| is_joint(rule) || is_position(rule);
        let mut of_arm = rules.iter().filter(is_of_arm);
        let is_ours = table.header.iter().any(|name| CLOCKS.contains(&name.as_str()))
            && rules.iter().any(|rule| is_of_arm(&rule))
            && of_arm.all(|rule| has(&rule.ours) && !is_foreign(&rule));
        if !rules.iter().any(|rule| is_foreign(&rule)) {
            // The clocks of a joint table may need other rules.
            let is_of_clock =
                |rule: &&ColumnRule| table.appended_columns().is_some() && is_clock(&rule.ours);
            let unused = rules.iter().find(|rule| !has(&rule.ours) && !is_of_clock(rule));
            let unused = unused.filter(|rule| rule.theirs != ColumnSelector::File);
            return Ok(Self { of_place, of_file, mapped: false, unused });
        }
        let is_given_otherwise = |rule: &ColumnRule| {
            rules.iter().any(|other| {
                other.ours == rule.ours
                    && match &other.theirs {
                        ColumnSelector::Name(name) => has(name),
                        ColumnSelector::Place(number) => has(&format!("#{number}")),
                        ColumnSelector::File => false,
                    }
            })
        };
        for rule in rules {
            let place = match &rule.theirs {
                ColumnSelector::File => continue,
                _ if is_ours && is_clock(&rule.ours) => continue,
                ColumnSelector::Place(number) => {
                    Some(number - 1).filter(|place| *place < of_place.len())
                }
                ColumnSelector::Name(name) => only_place(rule, name, table)?,
            };
            let Some(entry) = place.and_then(|place| of_place.get_mut(place)) else {
                // The join has used the clock of the joint table, which stands in no row.
                let is_clock = table.appended_columns().is_some() && is_clock(&rule.ours);
                if !measured || has(&rule.ours) || is_given_otherwise(rule) || is_clock {
                    continue;
                }
                return Err(no_such(rule, rules, table));
            };
            if let Some(first) = entry.1 {
                let first = first.ours.clone();
                return Err(rule.location.clone().error(TableErrorKind::RepeatedColumn { first }));
            }
            *entry = (rule.ours.as_str(), Some(rule));
        }
        Ok(Self { of_place, of_file, mapped: true, unused: None })
    }

    /// Returns the name of each column in flexcal's vocabulary, after the rules of `[data.columns]`
    /// whose columns exist. Rules without a column are skipped, because another table may have it.
    /// Rules by place only apply to tables without a header.
    pub fn map_present(table: &'a Table, dialect: &'a Dialect) -> Vec<&'a str> {
        let ours = |(place, header): (usize, &'a String)| {
            let place = ColumnSelector::Place(place + 1);
            let selector = if *header == place.to_string() {
                place
            } else {
                ColumnSelector::Name(header.clone())
            };
            let rule = dialect.columns.iter().find(|rule| rule.theirs == selector);
            rule.map_or(header.as_str(), |rule| rule.ours.as_str())
        };
        table.header.iter().enumerate().map(ours).collect()
    }

    /// Iterates over flexcal's names of the columns.
    pub fn iter(&self) -> impl Iterator<Item = &'a str> + '_ {
        self.of_place.iter().map(|(name, _)| *name)
    }

    /// Returns (index, name, rule) of the columns, those with a rule first, so that a rule takes
    /// precedence over another column of the same name. The name of the file is listed as a column
    /// after all others.
    pub fn mapped_first(&self) -> Vec<(usize, &'a str, Option<&'a ColumnRule>)> {
        let file = self.of_file.map(|rule| (rule.ours.as_str(), Some(rule)));
        let columns = self.of_place.iter().chain(&file).enumerate();
        let mut columns: Vec<_> =
            columns.map(|(place, &(name, rule))| (place, name, rule)).collect();
        columns.sort_by_key(|(_, _, rule)| rule.is_none());
        columns
    }
}

/// Returns the error of a rule that is written the wrong way round, ours = theirs; `None` for a
/// right rule. In such a rule only the first name is one of flexcal, and the table has a column
/// with the second name and none with the first.
pub(super) fn reversed(rule: &ColumnRule, table: &Table) -> Option<InputError> {
    let ColumnSelector::Name(name) = &rule.theirs else { return None };
    let is_reversed = is_numbered_or_position(name)
        && !is_numbered_or_position(&rule.ours)
        && table.header.contains(&rule.ours)
        && !table.header.contains(name);
    let kind = TableErrorKind::MapReversed { theirs: rule.ours.clone(), ours: name.clone() };
    is_reversed.then(|| rule.location.clone().error(kind))
}

/// Returns the index of the only column named `name`; `None` if there is none. Two such columns are
/// an error, located at `rule`.
fn only_place(rule: &ColumnRule, name: &str, table: &Table) -> Result<Option<usize>, InputError> {
    let mut places =
        (0..).zip(&table.header).filter(|(_, header)| *header == name).map(|(place, _)| place);
    let first = places.next();
    match places.next() {
        Some(other) => Err(rule
            .location
            .clone()
            .error(TableErrorKind::AmbiguousColumn { file: table.file.clone(), place: other + 1 })),
        None => Ok(first),
    }
}

/// Returns true if a rule names the coordinate of a joint by its number, such as `q1_deg`.
fn is_joint(rule: &ColumnRule) -> bool {
    let number = rule.ours.strip_prefix('q').unwrap_or_default();
    number.starts_with(|character: char| character.is_ascii_digit())
}

/// Returns true if a rule names a coordinate of the measured position.
fn is_position(rule: &ColumnRule) -> bool {
    ["x", "y", "z"].contains(&split_unit(&rule.ours).0)
}

/// Returns the error of a rule whose column does not exist.
///
/// A table without any column that rules map to joints, or to positions, is probably one of two
/// tables that belong together.
pub(super) fn no_such(rule: &ColumnRule, rules: &[ColumnRule], table: &Table) -> InputError {
    let name = rule.theirs.to_string();
    let is_of_joint = is_joint(rule);
    let (file, known) = table
        .appended_columns()
        .filter(|_| is_of_joint)
        .unwrap_or((table.file.as_path(), table.header.as_slice()));
    let lacks_each = |is_kind: fn(&ColumnRule) -> bool| {
        let is_absent = |rule: &ColumnRule| match &rule.theirs {
            ColumnSelector::Name(name) => !table.header.contains(name),
            ColumnSelector::Place(_) | ColumnSelector::File => false,
        };
        let mut of_kind = rules.iter().filter(|rule| is_kind(rule));
        is_kind(rule) && of_kind.clone().nth(1).is_some() && of_kind.all(is_absent)
    };
    let remedy = if lacks_each(is_joint) {
        Some(format!("if another table holds the joints, leave it out of files and write {JOINED}"))
    } else if lacks_each(is_position) {
        Some(format!(
            "if these poses are still to be measured, measure them and add x_mm, y_mm and z_mm; if \
             another table holds the positions, name that table alone in files and write {JOINED}"
        ))
    } else {
        None
    };
    rule.location.clone().error(TableErrorKind::NoSuchColumn {
        file: file.to_owned(),
        name,
        known: known.to_vec(),
        remedy,
    })
}

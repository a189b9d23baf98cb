//! Reader of `joints = { files = […], by = … }`: a second table that holds the joint coordinates.

use std::path::{Path, PathBuf};

use super::item::Item;
use super::joint_source::JointSource;
use super::path::without_detours;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Table of joint coordinates that is joined to the table of measured positions.
#[derive(Debug, Clone)]
pub struct JointLog {
    /// Files of the joint table, resolved against the problem's folder.
    pub files: Vec<PathBuf>,
    /// Rule that pairs the rows of both tables.
    pub by: JoinRule,
    /// Place in the file, for errors.
    pub location: Location,
    /// True if the files are given with the measurements, instead of those that the problem names.
    #[doc(hidden)]
    pub is_given: bool,
}

impl JointLog {
    /// Returns the error that one of its files does not exist.
    pub fn missing(&self, file: &Path) -> InputError {
        if self.is_given {
            return Location::file(file).error(InputErrorKind::GivenFileMissing);
        }
        let kind = InputErrorKind::DataFileMissing { path: file.to_owned() };
        self.location.clone().error(kind)
    }
}

/// Rule that pairs the rows of two tables.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum JoinRule {
    /// Pairs rows with the same word in the column `pose`.
    Name,
    /// Pairs the k-th row of one table with the k-th row of the other.
    #[default]
    Order,
    /// Pairs each row with the one nearest in time, at most `tolerance` apart \[s\].
    Time {
        /// Maximum time between two paired rows \[s\].
        tolerance: f64,
        /// Time that is added to the clock of the joint table \[s\].
        offset: f64,
    },
}

/// Largest offset of two clocks that is taken without being declared \[s\]: zones differ by less than
/// a day, and tables of different days are not of one measurement.
const MAX_FOUND_OFFSET: f64 = 86_400.0;

impl JoinRule {
    /// Returns true if rows are joined by time and no offset of the clocks is declared.
    pub(crate) fn has_no_offset(self) -> bool {
        matches!(self, Self::Time { offset, .. } if offset == 0.0)
    }

    /// Returns the rule with the offset of the clocks that an error states, and with its assignment of
    /// a larger tolerance unless that is empty; `None` for rows that are not joined by time.
    pub(crate) fn moved_to(self, [offset, tolerance]: &[String; 2]) -> Option<Self> {
        let Self::Time { tolerance: declared, .. } = self else { return None };
        let stated = tolerance.rsplit(' ').next().and_then(|number| number.parse().ok());
        let offset = offset.parse().ok().filter(|offset: &f64| offset.abs() < MAX_FOUND_OFFSET)?;
        Some(Self::Time { offset, tolerance: stated.unwrap_or(declared) })
    }
}

/// Maximum time between paired rows if the file states none \[s\].
const DEFAULT_TIME_TOLERANCE: f64 = 0.5;

/// Reads the table, and the joint source that its optional key `source` names.
pub(super) fn read(
    item: &Item<'_, '_>,
    folder: &Path,
) -> Result<(JointLog, Option<JointSource>), InputError> {
    let mut section = item.section()?;
    let names = section.require("files", "files = [\"controller.csv\"]")?;
    let names = names.list("a list of file names")?;
    let files = names
        .iter()
        .map(|name| Ok(without_detours(folder.join(name.text()?))))
        .collect::<Result<_, _>>()?;
    let rules = ["name", "order", "time"];
    let word = section.word("by", &["name", "order", "time"], &rules)?;
    let write = rules.map(|rule| format!("by = \"{rule}\"")).join(" or ");
    let word = word.ok_or_else(|| section.missing("by", write))?;
    let not_positive = |value| InputErrorKind::NotPositive { value };
    let by = match word {
        "name" => JoinRule::Name,
        "order" => JoinRule::Order,
        _ => JoinRule::Time {
            tolerance: section
                .positive("tolerance", Unit::Time, not_positive)?
                .unwrap_or(DEFAULT_TIME_TOLERANCE),
            offset: section.number("offset", Unit::Time)?.unwrap_or(0.0),
        },
    };
    let source = section.word("source", &JointSource::WORDS, &JointSource::EACH)?;
    section.finish()?;
    Ok((JointLog { files, by, location: item.location(), is_given: false }, source))
}

//! Reader of `joints = { files = […], by = … }`: a second table that holds the joint coordinates.

use std::path::{Path, PathBuf};

use super::item::Item;
use super::joint_source::JointSource;
use super::path::without_detours;
use crate::error::{ClockOffset, InputError, InputErrorKind, Location};
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
        /// Maximum time between two paired rows \[s\], if it is declared.
        tolerance: Option<f64>,
        /// Time that is added to the clock of the joint table \[s\], if it is declared.
        offset: Option<f64>,
    },
}

/// Largest offset of two clocks that is taken without being declared \[s\]: zones differ by less than
/// a day, and tables of different days are not of one measurement.
const MAX_FOUND_OFFSET: f64 = 86_400.0;

impl JoinRule {
    /// Returns the maximum time between paired rows, and the time that is added to the clock of the
    /// joint table \[s\]; `None` for rows that are not joined by time.
    pub(crate) fn times(self) -> Option<(f64, f64)> {
        let Self::Time { tolerance, offset } = self else { return None };
        Some((tolerance.unwrap_or(DEFAULT_TIME_TOLERANCE), offset.unwrap_or(0.0)))
    }

    /// Returns true if rows are joined by time and no offset of the clocks is declared.
    pub(crate) fn has_no_offset(self) -> bool {
        matches!(self, Self::Time { offset: None, .. })
    }

    /// Returns the rule with the offset of the clocks that was found; `None` for rows that are not
    /// joined by time, and for an offset that may not be taken without being declared.
    pub(crate) fn moved_to(self, found: ClockOffset) -> Option<Self> {
        let Self::Time { tolerance: declared, .. } = self else { return None };
        let is_kept = declared.is_none() || found.tolerance.is_none();
        let may_be_taken = found.is_clear && found.seconds.abs() < MAX_FOUND_OFFSET && is_kept;
        let tolerance = found.tolerance.or(declared);
        may_be_taken.then_some(Self::Time { tolerance, offset: Some(found.seconds) })
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
            tolerance: section.positive("tolerance", Unit::Time, not_positive)?,
            offset: section.number("offset", Unit::Time)?,
        },
    };
    let source = section.word("source", &JointSource::WORDS, &JointSource::EACH)?;
    section.finish()?;
    Ok((JointLog { files, by, location: item.location(), is_given: false }, source))
}

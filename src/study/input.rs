//! Input checks shared by the readers of both kinds of studies.

use std::path::{Path, PathBuf};

use crate::error::{InputError, InputErrorKind, StudyErrorKind};
use crate::problem::Problem;
use crate::problem::item::Item;
use crate::problem::section::Section;
use crate::quantity::Unit;

/// Largest number of poses, held-out poses or repetitions that a file may state.
const MAX_COUNT: u64 = 1_000_000;

/// Reads the problem that a study names; returns it with its text and its file.
pub(super) fn problem_of(
    item: &Item<'_, '_>,
    folder: &Path,
) -> Result<(Problem, String, PathBuf), InputError> {
    let path = path_beside(item, folder)?;
    let (problem, text) = Problem::read_with_text(&path)?;
    let file = if path.is_dir() { path.join("problem.toml") } else { path };
    if !problem.fixtures.is_empty() {
        return Err(item.error(StudyErrorKind::PositionsOnly));
    }
    Ok((problem, text.to_string(), file))
}

/// Returns the path of a file that the study names relative to `folder`, the folder of the study.
pub(super) fn path_beside(item: &Item<'_, '_>, folder: &Path) -> Result<PathBuf, InputError> {
    let path = folder.join(item.text()?);
    if path.exists() { Ok(path) } else { Err(item.error(StudyErrorKind::FileMissing { path })) }
}

/// Reads a number above 0.
pub(super) fn above_zero(item: &Item<'_, '_>) -> Result<f64, InputError> {
    match item.number()? {
        value if value > 0.0 => Ok(value),
        value => Err(item.error(InputErrorKind::NotPositive { value })),
    }
}

/// Reads the length above 0 \[m\] that the study must have; `write` is the remedy if it is missing.
pub(super) fn length(
    root: &mut Section<'_, '_>,
    base: &str,
    write: &str,
) -> Result<f64, InputError> {
    let kind = |value| InputErrorKind::NotPositive { value };
    let length = root.positive(base, Unit::Length, kind)?;
    length.ok_or_else(|| root.missing(&format!("{base}_mm"), write))
}

/// Reads a count, at least one and at most [`MAX_COUNT`].
pub(super) fn count(item: &Item<'_, '_>) -> Result<usize, InputError> {
    let value = item.whole(1)?;
    let fits = usize::try_from(value).ok().filter(|_| value <= MAX_COUNT);
    fits.ok_or_else(|| item.error(InputErrorKind::TooLarge { value, most: MAX_COUNT }))
}

/// Reads a list of distinct values with at least one entry.
pub(super) fn distinct<'a, 'i, T: PartialEq>(
    item: &Item<'a, 'i>,
    read: impl Fn(&Item<'a, 'i>) -> Result<T, InputError>,
) -> Result<Vec<T>, InputError> {
    let items = item.list("a list")?;
    let mut values = Vec::with_capacity(items.len());
    for item in &items {
        let value = read(item)?;
        if values.contains(&value) {
            return Err(item.error(StudyErrorKind::Repeated));
        }
        values.push(value);
    }
    if values.is_empty() { Err(item.error(StudyErrorKind::EmptyList)) } else { Ok(values) }
}

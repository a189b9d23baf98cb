//! Reader of `[remainder]`: a correction that was fitted in addition to the parameters.

use std::path::{Path, PathBuf};

use super::section::Section;
use crate::error::{InputError, Location};

/// Section `[remainder]`: file of a fitted correction and its use.
#[derive(Debug, Clone, PartialEq)]
pub struct RemainderDeclaration {
    /// Path of the `remainder.json`, resolved against the problem's folder.
    pub file: PathBuf,
    /// False if the file says `use = false`, so that predictions are not corrected.
    pub is_used: bool,
    /// Location of the file's name, for errors.
    pub location: Location,
}

/// Reads the section; returns `None` if it is absent.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Option<RemainderDeclaration>, InputError> {
    let problem = root.location().file;
    let Some(mut section) = root.section("remainder")? else { return Ok(None) };
    let item = section.require("file", "file = \"remainder.json\"")?;
    let file = problem.parent().unwrap_or(Path::new("")).join(item.text()?);
    let location = item.location();
    let is_used = section.get("use").map_or(Ok(true), |item| item.boolean())?;
    section.finish()?;
    Ok(Some(RemainderDeclaration { file, is_used, location }))
}

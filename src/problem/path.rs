//! Paths of files that a problem names.

use std::path::{Component, PathBuf};

/// Returns a path without folders that a following `..` leaves again, if the shorter path leads to
/// the same file.
pub(super) fn without_detours(path: PathBuf) -> PathBuf {
    let mut short = PathBuf::new();
    for component in path.components() {
        match (component, short.components().next_back()) {
            (Component::ParentDir, Some(Component::Normal(_))) => {
                short.pop();
            }
            _ => short.push(component),
        }
    }
    let is_same = || Some(short.canonicalize().ok()? == path.canonicalize().ok()?);
    if short != path && is_same() == Some(true) { short } else { path }
}

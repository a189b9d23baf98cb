//! Commit of the git repository that tracks a file.

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::files;

/// Size of an index file that is read \[bytes\].
const MAX_INDEX_BYTES: u64 = 1 << 28;
/// Number of bytes of an index before its first entry: signature, version and number of entries.
const INDEX_HEAD_BYTES: usize = 12;
/// Number of bytes of an index entry before its flags: times, numbers, size and hash (SHA-1).
const BYTES_BEFORE_FLAGS: usize = 60;
/// Flag of an entry that has two more bytes of flags.
const EXTENDED: u16 = 0x4000;

/// Returns the commit at HEAD of the git repository that tracks a file; `None` if no repository
/// does, or HEAD cannot be read.
pub fn commit(file: &Path) -> Option<String> {
    let whole = file.canonicalize().ok()?;
    let git =
        whole.ancestors().skip(1).map(|folder| folder.join(".git")).find(|git| git.exists())?;
    let read = |path: PathBuf| Some(files::read_text(&path).ok()?.trim().to_owned());
    // In a worktree, .git is a file that names a folder. That folder's file commondir names the
    // folder with the references.
    let folder = match read(git.clone()) {
        Some(text) => git.parent()?.join(text.strip_prefix("gitdir: ")?),
        None => git.clone(),
    };
    let name: Vec<&str> = whole
        .strip_prefix(git.parent()?)
        .ok()?
        .iter()
        .map(|part| part.to_str())
        .collect::<Option<_>>()?;
    let index = folder.join("index");
    let is_readable = fs::metadata(&index).is_ok_and(|index| index.len() <= MAX_INDEX_BYTES);
    if !is_readable || !is_tracked(&fs::read(index).ok()?, name.join("/").as_bytes()) {
        return None;
    }
    let head = read(folder.join("HEAD"))?;
    let Some(name) = head.strip_prefix("ref: ") else { return Some(head) };
    let common =
        read(folder.join("commondir")).map_or_else(|| folder.clone(), |common| folder.join(common));
    read(common.join(name)).or_else(|| {
        let packed = read(common.join("packed-refs"))?;
        packed
            .lines()
            .find_map(|line| Some(line.strip_suffix(name)?.strip_suffix(' ')?.trim().to_owned()))
    })
}

/// Returns true if an index of version 2 or 3 has an entry for the file with this name. Names in an
/// index of version 4 are compressed and not read.
fn is_tracked(index: &[u8], name: &[u8]) -> bool {
    let mut left = index.get(INDEX_HEAD_BYTES..).unwrap_or_default();
    while let Some((entry, length)) = next_entry(left) {
        if entry == name {
            return true;
        }
        left = left.get(length..).unwrap_or_default();
    }
    false
}

/// Returns the name of the first entry, and the length of the entry with its padding.
fn next_entry(entries: &[u8]) -> Option<(&[u8], usize)> {
    let flags = entries.get(BYTES_BEFORE_FLAGS..BYTES_BEFORE_FLAGS + 2)?;
    let flags = u16::from_be_bytes(flags.try_into().ok()?);
    let start = BYTES_BEFORE_FLAGS + if flags & EXTENDED == 0 { 2 } else { 4 };
    let rest = entries.get(start..)?;
    let name = rest.get(..rest.iter().position(|&byte| byte == 0)?)?;
    // One to eight zero bytes fill the entry up to a multiple of eight.
    let length = (start + name.len() + 8) / 8 * 8;
    (!name.is_empty()).then_some((name, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_an_index() {
        let mut index = b"DIRC\0\0\0\x02\0\0\0\x02".to_vec();
        for name in ["arm/problem.toml", "b"] {
            let start = index.len();
            index.extend([1; BYTES_BEFORE_FLAGS]);
            index.extend(u16::try_from(name.len()).unwrap().to_be_bytes());
            index.extend(name.as_bytes());
            index.extend(vec![0; 8 - (index.len() - start) % 8]);
        }
        assert!(is_tracked(&index, b"arm/problem.toml") && is_tracked(&index, b"b"));
        assert!(!is_tracked(&index, b"problem.toml") && !is_tracked(b"DIRC", b"b"));
    }
}

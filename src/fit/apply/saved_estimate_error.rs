//! Errors of an `estimate.json` that cannot be used.

use std::io;
use std::path::PathBuf;

use serde::Deserialize;

use crate::error::{JSON, TABLE, one_line, text_format};

/// Name of the format of `estimate.json`, and the newest version that this program can read.
pub(super) const FORMAT: (&str, u32) = ("flexcal-estimate", 2);
/// Maximum size of an `estimate.json` \[MiB\].
pub(super) const MAX_FILE_MIB: u64 = 256;

/// Name and version of the format of a file.
#[derive(Debug, Deserialize)]
pub(super) struct Format {
    pub name: String,
    pub version: u32,
}

/// Beginning of any JSON file that flexcal writes.
#[derive(Debug, Deserialize)]
struct Head {
    format: Format,
}

/// Returns the error of a `text` that cannot be parsed as an estimate. The error names the format
/// of the text if that is recognised.
pub(super) fn not_an_estimate(
    text: &str,
    file: PathBuf,
    source: serde_json::Error,
) -> SavedEstimateError {
    let head = serde_json::from_str(text).ok().map(|Head { format }| format.name);
    match (head, text_format(text)) {
        (Some(name), _) if name != FORMAT.0 => {
            SavedEstimateError::OtherFormat { file, name: one_line(&name) }
        }
        (_, Some(found)) if found != JSON => SavedEstimateError::OtherFile { file, found },
        _ => SavedEstimateError::Syntax { file, source },
    }
}

/// Returns the error of a parameter that the estimate lacks. For a base or a tool it names the
/// sessions or targets that were identified, which `words` returns.
pub(super) fn missing(
    file: PathBuf,
    name: String,
    words: impl Fn(&str) -> Vec<String>,
) -> SavedEstimateError {
    let placements = [("base", "session"), ("tool", "target")];
    let placement = placements.into_iter().find(|(kind, _)| name.starts_with(kind));
    let Some((kind, column)) = placement else {
        return SavedEstimateError::Missing { file, name };
    };
    let known = words(kind);
    let word = name.split_once('[').and_then(|(_, rest)| Some(rest.split_once(']')?.0));
    match word {
        Some(word) => {
            let word = word.to_owned();
            SavedEstimateError::NotIdentified { file, column, word, known }
        }
        None if known.iter().any(|known| !known.is_empty()) => {
            SavedEstimateError::NoSuchColumn { file, column, known }
        }
        None => SavedEstimateError::Missing { file, name },
    }
}

/// Maximum number of sessions or targets that a message names.
const MAX_NAMED_WORDS: usize = 12;

/// Returns a clause that names the identified sessions or targets; empty without names.
fn identified(known: &[String]) -> String {
    let names: Vec<String> = known
        .iter()
        .filter(|name| !name.is_empty())
        .take(MAX_NAMED_WORDS)
        .map(|name| format!("\"{name}\""))
        .collect();
    if names.is_empty() { String::new() } else { format!("; identified are {}", names.join(", ")) }
}

/// Rounds a number to 12 digits, without those that the conversion of units added.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Error of an `estimate.json` that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum SavedEstimateError {
    #[error(
        "{}: no such file; {}",
        file.display(),
        if file.to_string_lossy().contains('*') {
            "a pattern in quotes is not expanded: leave them out"
        } else {
            "flexcal identify PROBLEM writes an estimate.json, into the folder that it names"
        }
    )]
    NoSuchFile { file: PathBuf },
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable { file: PathBuf, source: io::Error },
    #[error(
        "{}: not an estimate.json: {source}{}",
        file.display(),
        if source.is_eof() { "; the file is cut: copy it again" } else { "" }
    )]
    Syntax { file: PathBuf, source: serde_json::Error },
    #[error("{}: format: a file of {name}, not an estimate.json; flexcal identify writes one", file.display())]
    OtherFormat { file: PathBuf, name: String },
    #[error("{}: {found}, not an estimate.json; flexcal identify writes one{}", file.display(), if *found == TABLE { ", and --data names tables" } else { "" })]
    OtherFile { file: PathBuf, found: &'static str },
    #[error("{}: format: version {version}, and this program reads versions up to {}; use a newer flexcal, or identify again", file.display(), FORMAT.1)]
    NewerFormat { file: PathBuf, version: u32 },
    #[error("{}: {key}: changed since flexcal wrote it; identify again, or take it as it is with --trust", file.display())]
    Changed { file: PathBuf, key: String },
    #[error("{}: has no estimate of {name}; identify the same problem and sessions", file.display())]
    Missing { file: PathBuf, name: String },
    #[error("{}: {column} \"{word}\" of the table was not identified{}; identify its rows too, or correct the name", file.display(), identified(known))]
    NotIdentified { file: PathBuf, column: &'static str, word: String, known: Vec<String> },
    #[error("{}: the table has no column {column}{}; add the column, which says whose base or tool holds", file.display(), identified(known))]
    NoSuchColumn { file: PathBuf, column: &'static str, known: Vec<String> },
    #[error("{}: identifies problem {found}, not {expected}; give the estimate.json that flexcal identify wrote for {expected}, or the problem {found}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error("{}: {name} is {} nominally there, {} in the problem; identify again", file.display(), rounded(*found), rounded(*expected))]
    OtherNominal { file: PathBuf, name: String, found: f64, expected: f64 },
    #[error("{}: was identified with another declared arm (a fixed value, a mass, gravity or an effect has changed since); identify again", file.display())]
    OtherArm { file: PathBuf },
    #[error("{}: {part} is declared differently in the problem; identify again without the earlier estimate", file.display())]
    OtherPart { file: PathBuf, part: String },
    #[error("{}: has no estimate of {name}, which is free in the problem; identify again without the earlier estimate", file.display())]
    LacksParameter { file: PathBuf, name: String },
    #[error("{}: {name} was identified, but is not free in the problem; give the problem that was identified (after loop, problem.closed.toml)", file.display())]
    NotFree { file: PathBuf, name: String },
    #[error("{}: {name} stands there twice; keep one of the two", file.display())]
    Twice { file: PathBuf, name: String },
    #[error("{}: {name} has a value larger than 1e150, the largest number that is accepted", file.display())]
    MagnitudeTooLarge { file: PathBuf, name: String },
    #[error("{}: larger than {MAX_FILE_MIB} MiB; is it the right file?", file.display())]
    TooLarge { file: PathBuf },
    #[error("{}: not UTF-8 text, so no estimate.json", file.display())]
    NotUtf8 { file: PathBuf },
}

/// Part of the declared arm in which two estimates differ.
pub(crate) struct DifferingPart {
    /// Name of the part as users read it.
    pub name: String,
    /// True for each of the two estimates whose arm declares the part.
    pub is_declared: [bool; 2],
}

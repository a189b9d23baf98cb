//! Suggestions for misspelt words.

use std::fs;
use std::path::{Path, PathBuf};

use strsim::{damerau_levenshtein, normalized_damerau_levenshtein};

use super::other_names::{other_names, other_word};

/// Minimum similarity of a suggested word: 1 for the same word, 0 for no common letter.
const MIN_SIMILARITY: f64 = 0.6;

/// Maximum length of a word for which a suggestion is searched \[bytes\]; known words are shorter.
const MAX_SUGGESTION_BYTES: usize = 80;

/// Returns the known word most similar to `word`, if its similarity is at least [`MIN_SIMILARITY`];
/// the first of equally similar ones.
pub(crate) fn nearest<T: AsRef<str>>(word: &str, known: impl IntoIterator<Item = T>) -> Option<T> {
    if word.len() > MAX_SUGGESTION_BYTES {
        return None;
    }
    let word = word.to_lowercase();
    let mut best: Option<(f64, T)> = None;
    for candidate in known {
        let similarity = normalized_damerau_levenshtein(&word, &candidate.as_ref().to_lowercase());
        if similarity >= MIN_SIMILARITY
            && best.as_ref().is_none_or(|(highest, _)| similarity > *highest)
        {
            best = Some((similarity, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Returns the path of the file in the folder of `path` whose name is most like that of `path`;
/// `None` if `path` exists or no name is similar.
pub fn file_like(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let read = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let name = path.file_name().filter(|_| !path.exists())?.to_string_lossy().into_owned();
    let entries = fs::read_dir(read).ok()?.flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    nearest(&name, names).map(|name| folder.join(name))
}

/// Returns true if the words differ only by case or by one inserted, missing, replaced or
/// transposed letter.
pub(crate) fn one_typo(word: &str, known: &str) -> bool {
    damerau_levenshtein(&word.to_lowercase(), &known.to_lowercase()) <= 1
}

/// Returns ` (did you mean …?)` if a known word is similar, otherwise an empty text.
pub(super) fn suggestion<T: AsRef<str>>(word: &str, known: impl IntoIterator<Item = T>) -> String {
    did_you_mean(nearest(word, known).as_ref().map(AsRef::as_ref))
}

/// Returns the suggestion for an unknown key: what is `meant` with its value, if that is known; a
/// unit if several known keys differ from it by their unit alone; otherwise the keys that it is
/// another name of, a similar key, or those that a first word is missing to.
pub(super) fn key_suggestion(key: &str, meant: Option<&str>, known: &[String]) -> String {
    if meant.is_some() {
        return did_you_mean(meant);
    }
    let is_with_unit =
        |name: &&String| name.strip_prefix(key).is_some_and(|end| end.starts_with('_'));
    if known.iter().filter(is_with_unit).count() > 1 {
        return format!(" ({key} needs a unit)");
    }
    if key.starts_with("EI_") && known.iter().any(|name| name == "EIy_N_m2") {
        return " (did you mean EIy_N_m2 and EIz_N_m2, equal for a round tube?)".to_owned();
    }
    let others = other_names(key, known);
    if let [_, ..] = others.as_slice() {
        let note = if key.to_lowercase().starts_with("quat") {
            " quaternions are not read here"
        } else {
            ""
        };
        let joiner = match others.as_slice() {
            [first, _] if first.starts_with("min") => " and ",
            _ => " or ",
        };
        return format!(" (did you mean {}?{note})", others.join(joiner));
    }
    let near = suggestion(key, known);
    if !near.is_empty() {
        return near;
    }
    // A key without its first word, such as sigma_mm.
    let is_longer = |name: &&String| {
        let end = name.split_once('_').map_or("", |(_, end)| end);
        let unit = end.strip_prefix(key).and_then(|end| end.strip_prefix('_'));
        end == key || unit.is_some_and(|unit| !["m", "rad"].contains(&unit))
    };
    let longer: Vec<&str> = known.iter().filter(is_longer).map(String::as_str).collect();
    let is_some = !longer.is_empty() && longer.len() <= MAX_LONGER_KEYS;
    if is_some { format!(" (did you mean {}?)", longer.join(" or ")) } else { near }
}

/// Maximum number of longer keys that are suggested.
const MAX_LONGER_KEYS: usize = 6;

/// Characters of regular expressions, none of which is in a name of a parameter.
const EXPRESSION_CHARACTERS: [char; 8] = ['{', '}', '|', '?', '(', ')', '^', '$'];

/// Returns the suggestion for a pattern that matches no parameter: rules without character classes,
/// or else a similar parameter.
pub(super) fn pattern_suggestion(pattern: &str, known: &[String]) -> String {
    if pattern.starts_with("joint[") || pattern.contains(EXPRESSION_CHARACTERS) {
        return " (only * stands for other text: write a rule for each joint)".to_owned();
    }
    if known.iter().any(|name| name.strip_prefix(pattern).is_some_and(|end| end.starts_with('.'))) {
        return format!(" (did you mean \"{pattern}.*\"?)");
    }
    if pattern.starts_with("tool.r") {
        return " (the tool has rotations where orientations are fitted: write \
                orientation_sigma_deg in [data], and measure rx_deg, ry_deg and rz_deg)"
            .to_owned();
    }
    if let Some(joint) = pattern.strip_suffix(".stiffness")
        && known.iter().any(|name| *name == format!("{joint}.alpha"))
    {
        return format!(" ({joint} declares no stiffness_N_m_per_rad: write it in its [[joint]])");
    }
    if let Some(rest) = pattern.strip_prefix("joint0") {
        return format!(" (joints are counted from 1: \"joint1{rest}\" is the first)");
    }
    let brackets = pattern.split_once('[').zip(pattern.split_once(']'));
    if let Some(((head, _), (_, rest))) = brackets
        && known.iter().any(|name| name.strip_prefix(head).is_some_and(|end| end.starts_with('.')))
    {
        return format!(" (nothing here has a name in brackets: \"{head}{rest}\")");
    }
    if let Some(head) = pattern.strip_suffix(".*") {
        let heads = known.iter().filter_map(|name| Some(name.rsplit_once('.')?.0));
        return did_you_mean(nearest(head, heads).map(|head| format!("\"{head}.*\"")).as_deref());
    }
    let Some((part, name)) = pattern.rsplit_once('.') else { return suggestion(pattern, known) };
    let names: Vec<String> = known
        .iter()
        .filter_map(|known| known.strip_prefix(part)?.strip_prefix('.').map(str::to_owned))
        .collect();
    if names.is_empty() || name.contains('*') {
        return suggestion(pattern, known);
    }
    let meant = other_names(name, &names)
        .first()
        .copied()
        .or_else(|| nearest(name, &names).map(String::as_str));
    match meant {
        Some(meant) => format!(" (did you mean {part}.{meant}?)"),
        None => format!(" ({part} has {})", names.join(", ")),
    }
}

/// Returns the suggestion for a name that is no parameter, where no patterns are taken.
pub(super) fn name_suggestion(name: &str, known: &[String]) -> String {
    if name.contains('*') {
        return " (no patterns here: write each name in full)".to_owned();
    }
    suggestion(name, known)
}

/// Returns the `known` words of a key, and the one that another `word` means or is like. Signs
/// stand in quotes.
pub(super) fn known_words(word: &str, known: &[&str]) -> String {
    let are_signs = known.iter().any(|word| !word.starts_with(char::is_alphanumeric));
    let quoted = |word: &str| if are_signs { format!("{word:?}") } else { word.to_owned() };
    let listed: Vec<String> = known.iter().map(|word| quoted(word)).collect();
    let meant = other_word(word, known).or_else(|| nearest(word, known).copied());
    let meant = meant.map_or_else(String::new, |meant| format!("; write {meant:?}"));
    format!("{}{meant}", listed.join(", "))
}

/// Returns ` (is it …?)` with a similar word and its noun; an empty text for `None`.
pub(super) fn is_it_rather(noun: &str, near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!(" (is it {noun}{near}?)"))
}

/// Returns ` (did you mean …?)` for a suggested word; an empty text for `None`.
pub(super) fn did_you_mean(meant: Option<&str>) -> String {
    meant.map_or_else(String::new, |meant| format!(" (did you mean {meant}?)"))
}

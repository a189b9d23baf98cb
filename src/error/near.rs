//! Suggestions for misspelt words.

use strsim::{damerau_levenshtein, normalized_damerau_levenshtein};

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

/// Returns true if the words differ only by case or by one inserted, missing, replaced or
/// transposed letter.
pub(crate) fn one_typo(word: &str, known: &str) -> bool {
    damerau_levenshtein(&word.to_lowercase(), &known.to_lowercase()) <= 1
}

/// Returns ` (did you mean …?)` if a known word is similar, otherwise an empty text.
pub(super) fn suggestion<T: AsRef<str>>(word: &str, known: impl IntoIterator<Item = T>) -> String {
    did_you_mean(nearest(word, known).as_ref().map(AsRef::as_ref))
}

/// Returns ` (is it …?)` with a similar word and its noun; an empty text for `None`.
pub(super) fn is_it_rather(noun: &str, near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!(" (is it {noun}{near}?)"))
}

/// Returns ` (did you mean …?)` for a suggested word; an empty text for `None`.
pub(super) fn did_you_mean(meant: Option<&str>) -> String {
    meant.map_or_else(String::new, |meant| format!(" (did you mean {meant}?)"))
}

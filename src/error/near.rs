//! The known word that an unknown one is meant to be.

use strsim::{damerau_levenshtein, normalized_damerau_levenshtein};

/// How alike two words must be for one to be meant by the other: 1 is the same word, 0 has nothing
/// in common.
const ALIKE: f64 = 0.6;

/// Longer words are not compared: no known one is near [bytes].
const LONGEST: usize = 80;

/// The known word that `word` is most like, if it is like one at all; of equals the first.
pub(crate) fn nearest<T: AsRef<str>>(word: &str, known: impl IntoIterator<Item = T>) -> Option<T> {
    if word.len() > LONGEST {
        return None;
    }
    let word = word.to_lowercase();
    let mut best: Option<(f64, T)> = None;
    for candidate in known {
        let alike = normalized_damerau_levenshtein(&word, &candidate.as_ref().to_lowercase());
        if alike >= ALIKE && best.as_ref().is_none_or(|(most, _)| alike > *most) {
            best = Some((alike, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Whether one letter left out, added, replaced or exchanged with the next, or nothing but
/// capitals, makes one word of another.
pub(crate) fn one_typo(word: &str, known: &str) -> bool {
    damerau_levenshtein(&word.to_lowercase(), &known.to_lowercase()) <= 1
}

/// ` (did you mean …?)`, where a known word is near.
pub(super) fn meant<T: AsRef<str>>(word: &str, known: impl IntoIterator<Item = T>) -> String {
    question(nearest(word, known).as_ref().map(AsRef::as_ref))
}

/// ` (is it …?)`, where something near was found.
pub(super) fn instead(noun: &str, near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!(" (is it {noun}{near}?)"))
}

/// ` (did you mean …?)`, where something is meant.
pub(super) fn question(meant: Option<&str>) -> String {
    meant.map_or_else(String::new, |meant| format!(" (did you mean {meant}?)"))
}

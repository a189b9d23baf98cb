//! Digests in JSON files that flexcal reads back, by which it detects later changes to them.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value, json};

use super::digest;

/// Key of the digests in a file. Its value is an object with one digest for every other key of the
/// file, and under the same key one of all these digests.
pub(crate) const DIGEST_KEY: &str = "digest";
/// Number of hexadecimal digits of a digest, enough to detect accidental changes.
const DIGEST_DIGITS: usize = 16;

/// Treatment of files that were changed since flexcal wrote them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Changes {
    /// A changed file causes an error.
    #[default]
    Refused,
    /// A changed file is read despite the change.
    Accepted,
}

/// First version of a format whose files have digests.
const FIRST_SEALED_VERSION: u32 = 2;

/// Entry of a result file that holds the version of its format.
#[derive(Deserialize)]
struct Format {
    version: u32,
}

/// Returns the JSON object `text` with the digests of its values under an additional last key. A
/// text that is no JSON object is returned unchanged.
pub(crate) fn sealed(text: &str) -> String {
    let Ok(mut digests) = digests(text) else { return text.to_owned() };
    digests.insert(DIGEST_KEY.to_owned(), of_all(&digests));
    let body = text.trim_end().strip_suffix('}').unwrap_or(text).trim_end();
    let digests = serde_json::to_string_pretty(&digests).unwrap_or_default();
    let digests = digests.replace('\n', "\n  ");
    format!("{body},\n  \"{DIGEST_KEY}\": {digests}\n}}\n")
}

/// Returns the first key of a JSON object whose value differs from the one that [`sealed`] wrote,
/// or that was added or removed. If the digests were removed from a file of a format that has them,
/// or if some values are those of another file, returns the key of the digests. Returns `None` if
/// nothing changed.
///
/// # Errors
/// Returns an error if the text is no JSON object.
pub(crate) fn changed_key(text: &str) -> serde_json::Result<Option<String>> {
    let mut found = digests(text)?;
    found.remove(DIGEST_KEY);
    let expected: BTreeMap<String, Box<RawValue>> = serde_json::from_str(text)?;
    let Some(expected) = expected.get(DIGEST_KEY) else {
        let format: Option<Format> =
            expected.get("format").and_then(|format| serde_json::from_str(format.get()).ok());
        let is_sealed = format.is_some_and(|format| format.version >= FIRST_SEALED_VERSION);
        return Ok(is_sealed.then(|| DIGEST_KEY.to_owned()));
    };
    let mut expected: BTreeMap<String, String> =
        serde_json::from_str(expected.get()).unwrap_or_default();
    // Older files have no digest of all digests.
    let whole = expected.remove(DIGEST_KEY);
    let is_changed = |key: &&String| found.get(*key) != expected.get(*key);
    let changed = found.keys().chain(expected.keys()).find(is_changed).cloned();
    let is_mixed = || whole.is_some_and(|whole| whole != of_all(&expected));
    Ok(changed.or_else(|| is_mixed().then(|| DIGEST_KEY.to_owned())))
}

/// Returns one digest of all values, except that under [`DIGEST_KEY`].
pub(crate) fn digest_of_values(mut values: Map<String, Value>) -> String {
    values.remove(DIGEST_KEY);
    of_all(&digests_of(&values))
}

/// Returns the digest of each value of a JSON object. White space and the order of keys do not
/// affect the digests.
fn digests(text: &str) -> serde_json::Result<BTreeMap<String, String>> {
    Ok(digests_of(&serde_json::from_str(text)?))
}

/// Returns the digest of each value.
fn digests_of(values: &Map<String, Value>) -> BTreeMap<String, String> {
    values.iter().map(|(key, value)| (key.clone(), short(&value.to_string()))).collect()
}

/// Returns one digest of the digests of all keys.
fn of_all(digests: &BTreeMap<String, String>) -> String {
    short(&json!(digests).to_string())
}

/// Returns the digest of a text in [`DIGEST_DIGITS`] digits.
fn short(text: &str) -> String {
    digest(text.as_bytes()).get(..DIGEST_DIGITS).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_found_by_its_key() {
        let text = "{\n  \"a\": [1.5e-7, 2],\n  \"b\": {\"c\": \"x\"}\n}\n";
        let whole = sealed(text);
        assert!(whole.ends_with("\n}\n") && whole.contains("\n  \"digest\": {\n    \"a\": \""));
        assert_eq!(changed_key(&whole).unwrap(), None);
        assert_eq!(changed_key(&whole.replace("1.5e-7", "0.00000015")).unwrap(), None);
        assert_eq!(changed_key(text).unwrap(), None, "older files have no digests");
        for (from, to, key) in [
            ("1.5e-7", "1.6e-7", "a"),
            ("\"x\"", "\"y\"", "b"),
            ("  \"b\": {", "  \"d\": 1,\n  \"b\": {", "d"),
            ("  \"a\": [1.5e-7, 2],\n", "", "a"),
        ] {
            let changed = whole.replacen(from, to, 1);
            assert_eq!(changed_key(&changed).unwrap().as_deref(), Some(key), "{changed}");
        }
        // A value together with its digest, as from another file.
        let entry = |whole: &str| {
            whole.lines().find(|line| line.starts_with("    \"a\": ")).unwrap().to_owned()
        };
        let other = sealed(&text.replace("1.5e-7", "1.6e-7"));
        let mixed = whole.replace("1.5e-7", "1.6e-7").replace(&entry(&whole), &entry(&other));
        assert_eq!(changed_key(&mixed).unwrap().as_deref(), Some(DIGEST_KEY), "{mixed}");
    }
}

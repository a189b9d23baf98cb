//! Digests in JSON files that flexcal reads back, by which it detects later changes to them.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::digest;

/// Key of the digests in a file. Its value is an object with one digest for every other key of the
/// file.
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
    let Ok(digests) = digests(text) else { return text.to_owned() };
    let body = text.trim_end().strip_suffix('}').unwrap_or(text).trim_end();
    let digests = serde_json::to_string_pretty(&digests).unwrap_or_default();
    let digests = digests.replace('\n', "\n  ");
    format!("{body},\n  \"{DIGEST_KEY}\": {digests}\n}}\n")
}

/// Returns the first key of a JSON object whose value differs from the one that [`sealed`] wrote,
/// or that was added or removed. If the digests were removed from a file of a format that has them,
/// returns their key. Returns `None` if nothing changed.
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
    let expected: BTreeMap<String, String> =
        serde_json::from_str(expected.get()).unwrap_or_default();
    let is_changed = |key: &&String| found.get(*key) != expected.get(*key);
    Ok(found.keys().chain(expected.keys()).find(is_changed).cloned())
}

/// Returns the digest of each value of a JSON object. White space and the order of keys do not
/// affect the digests.
fn digests(text: &str) -> serde_json::Result<BTreeMap<String, String>> {
    let values: Map<String, Value> = serde_json::from_str(text)?;
    let short = |value: &Value| {
        let digest = digest(value.to_string().as_bytes());
        digest.get(..DIGEST_DIGITS).unwrap_or_default().to_owned()
    };
    Ok(values.iter().map(|(key, value)| (key.clone(), short(value))).collect())
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
    }
}

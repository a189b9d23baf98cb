//! Names of poses that two tables write differently.

use std::collections::HashMap;

use super::table::shortened;

/// Returns a name in lower case, without spaces, marks and the zeros before a number.
fn plain_name(name: &str) -> String {
    let letters: Vec<char> =
        name.to_lowercase().chars().filter(|letter| letter.is_alphanumeric()).collect();
    let runs = letters.chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit());
    runs.map(|run| run.iter().collect::<String>().trim_start_matches('0').to_owned()).collect()
}

/// Returns the pairs of a name in `names` and one in `others` that differ only in case, spaces, marks
/// or leading zeros.
pub(super) fn same_but_for_spelling<'a>(
    names: &'a [String],
    mut others: Vec<&'a str>,
) -> Vec<[&'a str; 2]> {
    others.sort_unstable();
    let plain: HashMap<String, &str> =
        others.into_iter().rev().map(|name| (plain_name(name), name)).collect();
    let pair = |name: &'a String| Some([name.as_str(), *plain.get(&plain_name(name))?]);
    names.iter().filter_map(pair).collect()
}

/// Returns the names of a pair in quotes.
pub(super) fn quoted(pair: [&str; 2]) -> [String; 2] {
    pair.map(|name| format!("\"{}\"", shortened(name)))
}

//! Names of poses that two tables write differently.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::table::shortened;

/// Smallest number of names that are paired by their numbers alone; fewer agree by chance.
const MIN_NUMBERED: usize = 4;

/// Returns a name in lower case, without spaces, marks and the zeros before a number.
fn plain_name(name: &str) -> String {
    let letters: Vec<char> =
        name.to_lowercase().chars().filter(|letter| letter.is_alphanumeric()).collect();
    let runs = letters.chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit());
    runs.map(|run| run.iter().collect::<String>().trim_start_matches('0').to_owned()).collect()
}

/// Returns the pairs of a name in `names` and one in `others` that are the same after `plain`.
fn same_after<'a>(
    plain: [&dyn Fn(&str) -> String; 2],
    names: &'a [String],
    others: &[&'a str],
) -> Vec<[&'a str; 2]> {
    let [plain, other_plain] = plain;
    let of_plain: HashMap<String, &str> =
        others.iter().rev().map(|&name| (other_plain(name), name)).collect();
    let pair = |name: &'a String| Some([name.as_str(), *of_plain.get(&plain(name))?]);
    names.iter().filter_map(pair).collect()
}

/// Returns the pairs of a name in `names` and one in `others` that differ only in case, spaces, marks
/// or leading zeros.
pub(super) fn same_but_for_spelling<'a>(
    names: &'a [String],
    mut others: Vec<&'a str>,
) -> Vec<[&'a str; 2]> {
    others.sort_unstable();
    same_after([&plain_name; 2], names, &others)
}

/// Returns in what most of `names` differ from a name in `others`, and the first such pair; `None`
/// if most differ otherwise.
pub(super) fn usual_difference<'a>(
    names: &'a [String],
    mut others: Vec<&'a str>,
) -> Option<(&'static str, [&'a str; 2])> {
    others.sort_unstable();
    let named: Vec<&str> = names.iter().map(String::as_str).collect();
    let [around, of_others] = [&named, &others].map(|names| common_words(names));
    let within = |name: &str, [before, after]: [usize; 2]| {
        plain_name(name.get(before..name.len() - after).unwrap_or(name))
    };
    let without = |name: &str| within(name, around);
    let others_without = |name: &str| within(name, of_others);
    let most =
        |pairs: Vec<[&'a str; 2]>| pairs.first().copied().filter(|_| 2 * pairs.len() > names.len());
    let by_number = || most(same_number(names, &others)).filter(|_| names.len() >= MIN_NUMBERED);
    let spelled = most(same_after([&plain_name; 2], names, &others));
    let framed = || most(same_after([&without, &others_without], names, &others));
    spelled
        .map(|pair| ("spelling", pair))
        .or_else(|| Some(("a word before or behind all names of a table", framed()?)))
        .or_else(|| Some(("the letters about their number", by_number()?)))
}

/// Returns the lengths of the beginning and of the end that all names share, up to the mark that
/// separates it from the rest.
fn common_words(names: &[&str]) -> [usize; 2] {
    let Some((first, others)) = names.split_first().filter(|(_, others)| !others.is_empty()) else {
        return [0, 0];
    };
    let is_mark = |(_, character): &(usize, char)| !character.is_alphanumeric();
    let starts = first.char_indices().filter(is_mark).map(|(place, mark)| place + mark.len_utf8());
    let ends = first.char_indices().filter(is_mark).map(|(place, _)| place);
    let start = |&place: &usize| others.iter().all(|name| name.starts_with(&first[..place]));
    let end = |&place: &usize| others.iter().all(|name| name.ends_with(&first[place..]));
    let before = starts.filter(start).max().unwrap_or(0);
    let after = ends.filter(|place| *place >= before).find(end).unwrap_or(first.len());
    let shortest = names.iter().map(|name| name.len()).min().unwrap_or(0);
    if before + first.len() - after < shortest { [before, first.len() - after] } else { [0, 0] }
}

/// Splits a name into its last number and the letters before and behind it; `None` without a number.
fn numbered(name: &str) -> Option<(u64, [&str; 2])> {
    let end = name.rfind(|character: char| character.is_ascii_digit())? + 1;
    let digits = |character: char| character.is_ascii_digit();
    let start = name[..end].trim_end_matches(digits).len();
    Some((name[start..end].parse().ok()?, [&name[..start], &name[end..]]))
}

/// Returns the pairs of a name in `names` and one in `others` with the same last number, of those of
/// `others` with the same letters that pair most.
fn same_number<'a>(names: &'a [String], others: &[&'a str]) -> Vec<[&'a str; 2]> {
    let mut of_letters: BTreeMap<[&str; 2], HashMap<u64, &'a str>> = BTreeMap::new();
    for name in others {
        if let Some((number, letters)) = numbered(name) {
            of_letters.entry(letters).or_default().insert(number, name);
        }
    }
    let pairs = |of_number: HashMap<u64, &'a str>| -> Vec<[&'a str; 2]> {
        let pair = |name: &'a String| Some([name.as_str(), *of_number.get(&numbered(name)?.0)?]);
        names.iter().filter_map(pair).collect()
    };
    of_letters.into_values().rev().map(pairs).max_by_key(Vec::len).unwrap_or_default()
}

/// Returns the names of one of the `pairs` of unlike names that are joined by order, if the names of
/// most of the `rows` measured rows occur in the joint table at another row. Counters that begin at
/// different numbers are no names.
pub(super) fn misplaced(pairs: &[[String; 2]], rows: usize) -> Option<[&str; 2]> {
    let difference = |[name, other]: &[String; 2]| {
        Some(name.parse::<i64>().ok()?.wrapping_sub(other.parse().ok()?))
    };
    let first = difference(pairs.first()?);
    if first.is_some() && pairs.iter().all(|pair| difference(pair) == first) {
        return None;
    }
    let of_log: HashSet<&str> = pairs.iter().map(|[_, other]| other.as_str()).collect();
    let misplaced = || pairs.iter().filter(|pair| of_log.contains(&*pair[0]));
    let [name, other] = misplaced().next()?;
    (2 * misplaced().count() > rows).then_some([name, other])
}

/// Returns the names of a pair in quotes.
pub(super) fn quoted(pair: [&str; 2]) -> [String; 2] {
    pair.map(|name| format!("\"{}\"", shortened(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_differ_by_words_or_letters_are_paired() {
        let difference = |names: &[&str], others: &[&'static str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            usual_difference(&names, others.to_vec())
                .map(|(what, pair)| format!("{what}: {} {}", pair[0], pair[1]))
        };
        for (names, others, expected) in [
            (&["P_1", "P_2", "P_3"][..], &["p01", "p02", "p9"][..], "spelling: P_1 p01"),
            (
                &["cal_north", "cal_west", "cal_top"],
                &["West end", "North end", "East end"],
                "a word before or behind all names of a table: cal_north North end",
            ),
            (
                &["pose_001", "pose_002", "pose_003", "pose_004"],
                &["VIA0", "MP1", "VIA1", "MP2", "MP3"],
                "the letters about their number: pose_001 MP1",
            ),
        ] {
            assert_eq!(difference(names, others).as_deref(), Some(expected));
        }
        assert_eq!(difference(&["a", "b", "c"], &["d", "e"]), None);
        assert_eq!(difference(&["a1", "b2", "c3", "d4"], &["d7", "e8"]), None);
        assert_eq!(difference(&["a1", "a2", "a3"], &["b1", "b2", "b3"]), None);
        assert_eq!(common_words(&["é_1", "é_2"]), [3, 0]);
        assert_eq!(common_words(&["_", "_"]), [0, 0]);
    }
}

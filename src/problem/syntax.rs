//! Usual mistakes by which a text is not TOML.

use super::item::Document;
use super::wrong_type::number_and_unit;
use crate::error::{InputErrorKind, JSON, TABLE, TOML, XML, text_format, typographic};

/// Words that stand for true, false or nothing in other formats and languages.
const OTHER_WORDS: [&str; 12] =
    ["true", "false", "yes", "no", "on", "off", "none", "null", "wahr", "falsch", "vrai", "faux"];

/// Sections that are lists: each element begins with its name in two brackets.
const LISTS: [&str; 9] =
    ["joint", "effect", "constraint", "target", "point", "anchor", "surface", "camera", "marker"];

impl Document {
    /// Returns the error of a syntax `error` of the parser, which names the usual mistake if one is
    /// recognised, or the format of the file if that is another one.
    pub(super) fn syntax_error(&self, error: &toml::de::Error) -> InputErrorKind {
        let span = error.span().unwrap_or(self.text.len()..self.text.len());
        let (before, after) = (
            self.text.get(..span.start).unwrap_or_default(),
            self.text.get(span.start..).unwrap_or_default(),
        );
        let line_start = before.rfind('\n').map_or(0, |place| place + 1);
        let (previous_lines, before_in_line) = before.split_at(line_start);
        let has_no_content =
            |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
        if previous_lines.lines().all(has_no_content)
            && let Some(found) = text_format(&self.text).filter(|format| *format != TOML)
        {
            return InputErrorKind::OtherFormat { found, expected: expected_instead_of(found) };
        }
        let near_text: String =
            self.text.get(span).unwrap_or_default().trim().chars().take(40).collect();
        let line_after = after.lines().next().unwrap_or_default();
        let usual = usual_mistake(before_in_line, line_after, error.message());
        let single = single_brackets(previous_lines, before_in_line, line_after);
        let is_repeated = error.message().contains("duplicate key");
        let single = single.filter(|_| is_repeated);
        let first = (usual.is_none() && is_repeated).then(|| {
            let line = line_of_key(previous_lines, &near_text);
            let place =
                line.map_or_else(String::new, |line| format!(", given already on line {line}"));
            (format!("duplicate key{place}"), "delete one of the two")
        });
        let (message, remedy) = single.or(usual).or(first).map_or_else(
            || (error.message().to_owned(), None),
            |(what, remedy)| (what, Some(remedy)),
        );
        InputErrorKind::Syntax { message, near_text, remedy }
    }
}

/// Returns the input that is expected in place of a file of another format, and where files of that
/// format belong.
fn expected_instead_of(format: &str) -> &'static str {
    match format {
        XML => "TOML; flexcal init FILE makes a problem.toml of a URDF",
        TABLE => {
            "TOML; PROBLEM is a problem.toml or its folder, --truth a TRUTH.toml, and tables of \
             rows or poses follow --data or --candidates"
        }
        JSON => {
            "TOML; PROBLEM is a problem.toml or its folder, and --estimate names an estimate.json"
        }
        "a YAML file" => {
            "TOML; PROBLEM is a problem.toml, whose lines are `key = value`, or its folder"
        }
        _ => "TOML; PROBLEM is a problem.toml or its folder",
    }
}

/// Returns the usual mistake that a line shows at the error, with its remedy; `None` if none is
/// recognised. The line is split there into `before` and `after`.
fn usual_mistake(before: &str, after: &str, message: &str) -> Option<(String, &'static str)> {
    let word = after.split([' ', '\t', ',', ']', '}', '#']).next().unwrap_or_default();
    let is_digit = |character: char| character.is_ascii_digit();
    let has_decimal_comma = after
        .strip_prefix(',')
        .is_some_and(|next| next.starts_with(is_digit) && before.ends_with(is_digit))
        || before
            .strip_suffix(',')
            .is_some_and(|number| number.ends_with(is_digit) && after.starts_with(is_digit));
    let is_in_escape = (message.contains("escape") || message.contains("unicode"))
        && (after.starts_with('\\')
            || before.rsplit('"').next().is_some_and(|text| text.contains('\\')));
    let is_expression = word.contains(is_digit)
        && word.contains(['/', '*', '^', 'p'])
        && word.chars().all(|c| is_digit(c) || "+-*/^().piPI".contains(c));
    let mistake = |what: &str, remedy| Some((what.to_owned(), remedy));
    let is_value = before.trim_end().ends_with(['=', '[', ',']);
    let is_bare = is_value
        && word.starts_with(char::is_alphabetic)
        && !word.contains(['"', '\''])
        && (message.contains("must be quoted") || message.starts_with("invalid"));
    let is_rule = before.split('=').next().is_some_and(|key| key.contains(['.', '*']));
    let last_word = before.rsplit(['{', ',']).next().unwrap_or_default().trim();
    let is_colon = last_word.strip_suffix(':').is_some_and(|key| {
        !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "_-\"".contains(c))
    }) && !is_value;
    let is_lone_flag = after.starts_with('}') && ["free", "fixed"].contains(&last_word);
    let has_values_behind = after.trim_start().starts_with(',')
        && before.contains('=')
        && message.contains("expected newline")
        && !before.trim_end().ends_with('=');
    let has_no_value = before.trim_end().ends_with('=')
        && after.split('#').next().is_some_and(|rest| rest.trim().is_empty());
    let is_spaced_list = before.contains('[')
        && after.split([',', ']']).next().is_some_and(|entry| {
            let mut words = entry.split_whitespace();
            entry.split_whitespace().count() > 1 && words.all(|word| word.parse::<f64>().is_ok())
        });
    let is_open_list = message.contains("missing comma between array")
        && before.trim().is_empty()
        && after.contains('=');
    if let Some((what, remedy)) = typographic(word) {
        Some((what, remedy))
    } else if has_no_value {
        mistake("the key has no value", "write one behind the =, or delete the line")
    } else if is_spaced_list {
        mistake("numbers of a list without commas", "separate them by commas, as in [0.18, 0, 0]")
    } else if is_open_list {
        mistake(
            "a list that begins above is not closed",
            "write ] at its end, on a line before this one",
        )
    } else if has_decimal_comma {
        mistake("a decimal comma", "write numbers with a decimal point")
    } else if after.starts_with(['*', '?']) {
        mistake("a pattern without quotes", "write a pattern in quotes, as in \"base.*\"")
    } else if is_in_escape {
        mistake(
            "a \\ in double quotes begins an escape sequence",
            "in a path write / in its place, or put the path in single quotes, as in \
             'C:\\data\\rows.csv'",
        )
    } else if OTHER_WORDS.contains(&word.to_lowercase().as_str()) {
        mistake("a word that TOML does not have", "write true or false, or text in quotes")
    } else if unit_behind(before, after).as_deref() == Some("%") {
        mistake("a percentage", "write a fraction, such as 0.3 for 30 %")
    } else if unit_behind(before, after).is_some() {
        mistake(
            "a unit behind a number",
            "write the number alone; the end of the key states its unit, as in d_m = 0.36 or d_mm \
             = 360",
        )
    } else if is_expression {
        mistake(
            "a calculation",
            "write its result, such as 0.333 for 1/3, or an angle in degrees with a key in _deg",
        )
    } else if message.contains("duplicate key") && before.starts_with('[') {
        let remedy = if before.starts_with("[[") {
            "if it is the first [[…]] of this name, a header above it is misspelt, and parts such as [[joint.body]] then began another \
             section; otherwise write its lines into the first section of this name"
        } else if LISTS.iter().any(|list| word.starts_with(list)) {
            "joints, effects and the like are lists: write two brackets for each of them, as in \
             [[joint]], the first one too"
        } else {
            "write its lines into the first section of this name"
        };
        mistake("the section is given twice", remedy)
    } else if is_lone_flag || (is_rule && is_value && ["free", "fixed"].contains(&word)) {
        mistake(
            "a rule is a table in braces",
            "write { free = true } to free parameters, { fixed = true } to hold them",
        )
    } else if is_bare {
        mistake("text without quotes", "text stands in quotes, as in kind = \"fixed\"")
    } else if has_values_behind {
        mistake(
            "several values or keys on one line",
            "write a list in brackets, as in [\"a.csv\", \"b.csv\"], and each key on its own line",
        )
    } else if message.contains("invalid basic string") && message.contains("expected `\"`") {
        mistake("a quote is opened and not closed", "write \" at the end of the text")
    } else if is_colon {
        mistake("a colon in place of =", "write key = value")
    } else if message.contains("missing assignment") {
        mistake("a key without =", "write key = value, as in { joint = 2 }")
    } else if message.contains("key with no value") && line_has_spaced_key(after) {
        mistake("a key with a space", "put the key in quotes, as in \"Joint 1\" = \"q1_deg\"")
    } else if message.contains("key with no value") {
        mistake(
            "the line is no `key = value`, no [section] and no comment",
            "write it as one, or begin it with #",
        )
    } else {
        None
    }
}

/// Returns the unit behind a number that stands at the place between `before` and `after`.
fn unit_behind(before: &str, after: &str) -> Option<String> {
    let is_end = |c: char| ",=[]{}#".contains(c);
    let start = before.rsplit(is_end).next().unwrap_or_default();
    let end = after.split(is_end).next().unwrap_or_default();
    // A word before a = is a key.
    let is_key = after.strip_prefix(end).is_some_and(|rest| rest.starts_with('='));
    let whole = format!("{start}{end}");
    let (_, unit) = number_and_unit(whole.trim()).filter(|_| !is_key)?;
    Some(unit.to_owned())
}

/// Returns the number of the line above that gives the same key in the same section.
fn line_of_key(previous_lines: &str, key: &str) -> Option<usize> {
    let lines: Vec<&str> = previous_lines.lines().collect();
    let is_header = |line: &&str| line.trim_start().starts_with('[');
    let section = lines.iter().rposition(is_header).map_or(0, |place| place + 1);
    let is_key = |line: &&str| line.split_once('=').is_some_and(|(first, _)| first.trim() == key);
    Some(section + lines.get(section..)?.iter().position(is_key)? + 1)
}

/// Returns the mistake that the first element of a list has one bracket, where the list goes on in
/// the line at the error; `None` if the text before holds no such header.
fn single_brackets(
    previous_lines: &str,
    before: &str,
    after: &str,
) -> Option<(String, &'static str)> {
    let list = LISTS.iter().find(|list| {
        after.trim_start().strip_prefix(*list).is_some_and(|rest| rest.starts_with(']'))
    })?;
    let is_single = |line: &str| line.trim_start().starts_with(&format!("[{list}]"));
    let line = previous_lines.lines().position(is_single)?;
    let remedy = "write two brackets for each joint, effect and the like, the first one too, as in [[joint]]";
    before.trim_start().starts_with("[[").then(|| {
        (format!("line {} begins the first {list} with one bracket, [{list}]", line + 1), remedy)
    })
}

/// Returns true if the first word of a key is followed by more words, and then by an equals sign.
fn line_has_spaced_key(after: &str) -> bool {
    after.split_once('=').is_some_and(|(words, _)| {
        !words.trim().is_empty()
            && words.chars().all(|c| c.is_alphanumeric() || " []()°/%.-".contains(c))
    })
}

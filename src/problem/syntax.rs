//! Usual mistakes by which a text is not TOML.

use super::item::Document;
use super::wrong_type::number_and_unit;
use crate::error::{InputError, InputErrorKind, JSON, TABLE, TOML, XML, text_format, typographic};

/// Words that stand for true, false or nothing in other formats and languages.
const OTHER_WORDS: [&str; 12] =
    ["true", "false", "yes", "no", "on", "off", "none", "null", "wahr", "falsch", "vrai", "faux"];

/// Sections that are lists: each element begins with its name in two brackets.
const LISTS: [&str; 9] =
    ["joint", "effect", "constraint", "target", "point", "anchor", "surface", "camera", "marker"];

impl Document {
    /// Returns the error of a syntax `error` of the parser, which names the usual mistake if one is
    /// recognised, or the format of the file if that is another one.
    pub(super) fn syntax_error(&self, error: &toml::de::Error) -> InputError {
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
            let expected = expected_instead_of(found);
            return self.locate(span).error(InputErrorKind::OtherFormat { found, expected });
        }
        let line_after = after.lines().next().unwrap_or_default();
        if let Some((place, message, remedy)) =
            not_closed(previous_lines, (before_in_line, line_after), error.message())
        {
            let kind = InputErrorKind::Syntax {
                message: message.to_owned(),
                near_text: String::new(),
                remedy: Some(remedy),
            };
            return self.locate(place..place + 1).error(kind);
        }
        let near_text: String =
            self.text.get(span.clone()).unwrap_or_default().trim().chars().take(40).collect();
        let usual = foreign_comment(before_in_line, line_after)
            .or_else(|| usual_mistake(before_in_line, line_after, error.message()));
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
        self.locate(span).error(InputErrorKind::Syntax { message, near_text, remedy })
    }
}

/// Returns the list, inline table or text that an earlier line begins and does not close, where the
/// line at the error, `before` and `after` it, cannot be a part of it: its place, and the mistake
/// with its remedy.
fn not_closed(
    previous_lines: &str,
    (before, after): (&str, &str),
    message: &str,
) -> Option<(usize, &'static str, &'static str)> {
    let line = format!("{before}{after}");
    let line = line.trim_start();
    let is_header =
        line.trim_start_matches('[').starts_with(char::is_alphabetic) && line.starts_with('[');
    let key = line.split_once('=').map(|(key, _)| key.trim());
    let is_key = key.is_some_and(|key| !key.is_empty() && !key.contains(['[', '{', '(', ',']));
    let is_cut = ["missing comma between key", "unclosed inline", "missing key"]
        .iter()
        .any(|words| message.contains(words));
    match open_at_end(previous_lines)? {
        (place, '[') if is_header || is_key => {
            Some((place, "the list that begins here is not closed", "write ] at its end"))
        }
        (place, '{') if is_header || is_cut && (is_key || message.contains("unclosed")) => {
            Some((place, "the { that stands here is not closed", "write } at its end"))
        }
        (place, '"' | '\'') => Some((
            place,
            "the text that begins here is not closed",
            "write the same quote at its end",
        )),
        _ => None,
    }
}

/// Returns the place of the quote that a line leaves open, or else of the innermost bracket of a
/// value that is open at the end of a text of whole lines.
fn open_at_end(text: &str) -> Option<(usize, char)> {
    if ["\"\"\"", "'''"].iter().any(|quotes| text.contains(quotes)) {
        return None;
    }
    let (mut open, mut start) = (Vec::new(), 0);
    for line in text.split_inclusive('\n') {
        let is_header = open.is_empty() && line.trim_start().starts_with('[');
        let (mut quote, mut is_escaped) = (None, false);
        for (place, c) in line.char_indices().take_while(|_| !is_header) {
            match (quote, c) {
                (Some((_, '"')), _) if is_escaped => is_escaped = false,
                (Some((_, '"')), '\\') => is_escaped = true,
                (Some((_, mark)), _) => quote = quote.filter(|_| c != mark),
                (None, '"' | '\'') => quote = Some((start + place, c)),
                (None, '#') => break,
                (None, '[' | '{') => open.push((start + place, c)),
                (None, ']' | '}') => drop(open.pop()),
                _ => {}
            }
        }
        if quote.is_some() {
            return quote;
        }
        start += line.len();
    }
    open.pop()
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
    if let Some(mistake) = typographic(word) {
        return Some(mistake);
    }
    let is_digit = |character: char| character.is_ascii_digit();
    let is_digits = |text: &str| !text.is_empty() && text.chars().all(is_digit);
    let digits_after = after.strip_prefix(',').filter(|_| before.ends_with(is_digit));
    let digits_after = digits_after.or_else(|| {
        Some(after)
            .filter(|_| before.trim_end_matches(',').ends_with(is_digit) && before.ends_with(','))
    });
    let pair = before.rsplit(['=', '{']).next().and_then(|value| value.trim().split_once(','));
    let is_split = message.contains("inline table")
        && pair.is_some_and(|(whole, rest)| [whole, rest].iter().all(|of| is_digits(of)));
    let has_comma = is_split || digits_after.is_some_and(|next| next.starts_with(is_digit));
    let has_point =
        digits_after.is_some_and(|next| next.trim_start_matches(is_digit).starts_with('.'));
    let is_in_escape = (message.contains("escape") || message.contains("unicode"))
        && (after.starts_with('\\')
            || before.rsplit('"').next().is_some_and(|text| text.contains('\\')));
    let value = value_at(before, after).unwrap_or_default();
    let value = value.trim();
    let is_in_list = before.rsplit('=').next().is_some_and(|value| value.contains('['));
    let is_number = |word: &str| word.parse::<f64>().is_ok_and(f64::is_finite);
    let has_numbers = |separator: &[char]| {
        let words: Vec<&str> = value.split(separator).map(str::trim).collect();
        words.len() > 1 && words.iter().all(|word| word.is_empty() || is_number(word))
    };
    let is_expression = value.contains(is_digit)
        && (value.contains(['/', '*', '^', 'p']) || value.contains(" + ") || value.contains(" - "))
        && value.chars().all(|c| is_digit(c) || " +-*/^().piPI".contains(c));
    let has_no_value = before.trim_end().ends_with('=')
        && after.split(['#', ',', '}']).next().is_some_and(|rest| rest.trim().is_empty());
    let line = format!("{before}{after}");
    let marks = ["<<<<<<<", "=======", ">>>>>>>", "|||||||"];
    let unit = number_and_unit(value).map(|(_, unit)| unit);
    let is_repeated_header = message.contains("duplicate key") && before.starts_with('[');
    let mistakes = [
        (
            marks.iter().any(|mark| line.starts_with(mark)),
            "a mark of a conflict between two versions (git)",
            "keep the lines of one version, and delete the marks <<<<<<<, ======= and >>>>>>>",
        ),
        (has_no_value, "the key has no value", "write one behind the =, or delete the line"),
        (
            after.trim_start().starts_with(';') || value.contains(';') && has_numbers(&[';']),
            "a semicolon",
            "separate the numbers of a list by commas, and end a line without a sign",
        ),
        (
            message.contains("unclosed array"),
            "a list, or a text in it, that is not closed",
            "write ] at the end of the list, and the same quote at both ends of each text",
        ),
        (
            value.starts_with('('),
            "a list in round brackets",
            "write square ones, as in [0.18, 0, 0]",
        ),
        (
            is_in_list && has_numbers(&[' ']),
            "numbers of a list without commas",
            "separate them by commas, as in [0.18, 0, 0]",
        ),
        (has_numbers(&[' ']), "spaces within a number", "write its digits without spaces"),
        (has_comma && has_point, "a comma between thousands", "write 1000.5 for 1,000.5"),
        (has_comma, "a decimal comma", "write numbers with a decimal point"),
        (
            after.starts_with(['*', '?']),
            "a pattern without quotes",
            "write a pattern in quotes, as in \"base.*\"",
        ),
        (
            is_in_escape,
            "a \\ in double quotes begins an escape sequence",
            "in a path write / in its place, or put the path in single quotes, as in \
             'C:\\data\\rows.csv'",
        ),
        (
            OTHER_WORDS.contains(&word.to_lowercase().as_str()),
            "a word that TOML does not have",
            "write true or false, or text in quotes",
        ),
        (unit == Some("%"), "a percentage", "write a fraction, such as 0.3 for 30 %"),
        (
            value.contains('O') && is_number(&value.replace('O', "0")),
            "the letter O in a number",
            "write the digit 0",
        ),
        (
            unit.is_some(),
            "a unit behind a number",
            "write the number alone; the end of the key states its unit, as in d_m = 0.36 or d_mm \
             = 360",
        ),
        (
            is_number(value) && format!("x = {value}").parse::<toml::Table>().is_err(),
            "a number as TOML does not have it",
            "write a digit before and behind the point, and no 0 before other digits, as in 0.42, \
             1.0 and 7",
        ),
        (
            is_expression,
            "a calculation",
            "write its result, such as 0.333 for 1/3, or an angle in degrees with a key in _deg",
        ),
        (
            after.starts_with(']') && before.trim_start().starts_with('['),
            "one ] too many",
            "delete it",
        ),
        (is_repeated_header, "the section is given twice", remedy_of_header(before, word)),
    ];
    let mistake = mistakes.into_iter().find(|(is_it, ..)| *is_it);
    let mistake = mistake.map(|(_, what, remedy)| (what.to_owned(), remedy));
    mistake.or_else(|| mistaken_form(before, after, message, word))
}

/// Returns the mistake that a comment of another language begins the line, or stands behind its value
/// or header, at a place between `before` and `after`, with its remedy; `None` without one.
fn foreign_comment(before: &str, after: &str) -> Option<(String, &'static str)> {
    let is_mark = |text: &str| ["//", "/*", "--"].iter().any(|mark| text.starts_with(mark));
    let word = after.split(' ').next().unwrap_or_default().trim_end_matches(',');
    let is_value = word.parse::<f64>().is_ok() || ["true", "false"].contains(&word);
    let has_value = is_value || !before.trim_end().ends_with(['=', '[', '{']);
    let behind = after.strip_prefix(word).filter(|_| is_value).unwrap_or(after);
    let behind = Some(behind.trim_start_matches([' ', '\t', ','])).filter(|_| has_value);
    (is_mark(before.trim_start()) || behind.is_some_and(is_mark)).then(|| {
        let remedy = "TOML has no // comments: begin them with #";
        ("a comment of another language".to_owned(), remedy)
    })
}

/// Returns a usual mistake in the form of a line with its remedy, at a place between `before` and
/// `after` where the parser says `message`; `word` begins there.
fn mistaken_form(
    before: &str,
    after: &str,
    message: &str,
    word: &str,
) -> Option<(String, &'static str)> {
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
    let has_no_equals = message.contains("key with no value");
    let behind_comma = after.trim_start().strip_prefix(',').map(str::trim_start);
    let is_last_comma = behind_comma.is_some_and(|rest| rest.is_empty() || rest.starts_with('#'));
    let mistakes = [
        (
            message.contains("invalid basic string") && message.contains("expected `\"`"),
            "a quote is opened and not closed",
            "write \" at the end of the text",
        ),
        (
            is_lone_flag || (is_rule && is_value && ["free", "fixed"].contains(&word)),
            "a rule is a table in braces",
            "write { free = true } to free parameters, { fixed = true } to hold them",
        ),
        (is_bare, "text without quotes", "text stands in quotes, as in kind = \"fixed\""),
        (
            is_last_comma && message.contains("expected newline"),
            "a comma at the end of the line",
            "remove the comma: what is on the next line needs none",
        ),
        (
            has_values_behind,
            "several values or keys on one line",
            "write a list in brackets, as in [\"a.csv\", \"b.csv\"], and each key on its own line",
        ),
        (is_colon, "a colon in place of =", "write key = value"),
        (
            message.contains("missing assignment"),
            "a key without =",
            "write key = value, as in { joint = 2 }",
        ),
        (
            has_no_equals && line_has_spaced_key(after),
            "a key with a space",
            "join the words of a key by _, as in d_m; the name of a column stands in quotes, as in \
             \"Joint 1\" = \"q1_deg\"",
        ),
        (
            has_no_equals,
            "the line is no `key = value`, no [section] and no comment",
            "write it as one, or begin it with #",
        ),
    ];
    let mistake = mistakes.into_iter().find(|(is_it, ..)| *is_it);
    mistake.map(|(_, what, remedy)| (what.to_owned(), remedy))
}

/// Returns the remedy for a header that is given twice, of which `before` holds the brackets and
/// `word` the name.
fn remedy_of_header(before: &str, word: &str) -> &'static str {
    if before.starts_with("[[") {
        "if it is the first [[…]] of this name, a header above it is misspelt, and parts such as \
         [[joint.body]] then began another section; otherwise write its lines into the first \
         section of this name"
    } else if LISTS.iter().any(|list| word.starts_with(list)) {
        "joints, effects and the like are lists: write two brackets for each of them, as in \
         [[joint]], the first one too"
    } else {
        "write its lines into the first section of this name"
    }
}

/// Returns the value, or the element of a list, at the place between `before` and `after`; `None`
/// for a key.
fn value_at(before: &str, after: &str) -> Option<String> {
    let is_end = |c: char| ",=[]{}#".contains(c);
    let start = before.rsplit(is_end).next().unwrap_or_default();
    let end = after.split(is_end).next().unwrap_or_default();
    // A word before a = is a key.
    let is_key = after.strip_prefix(end).is_some_and(|rest| rest.starts_with('='));
    (!is_key).then(|| format!("{start}{end}"))
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

//! Rendering of blocks as Markdown with GitHub's tables.

use std::fmt::Write as _;

use super::text::{text_blocks, with_outcome};
use crate::error::is_hidden;
use crate::report::document::{Block, CODE, Point, Table};

/// Renders blocks below a title, ending in a line break.
pub(in crate::report) fn markdown(title: &str, blocks: &[Block]) -> String {
    let mut text = format!("# {}\n", escaped(&one_line(title)));
    for block in text_blocks(blocks) {
        text.push('\n');
        // Writing to a String cannot fail.
        match block {
            Block::Heading(words) => _ = writeln!(text, "## {}", escaped(words)),
            Block::Text(words) | Block::Note(words) => _ = writeln!(text, "{}", escaped(words)),
            Block::Lines(words, points) => {
                let _ = writeln!(text, "{}", escaped(&one_line(words)));
                if !points.is_empty() {
                    text.push('\n');
                }
                text.extend(points.iter().map(|words| format!("- {}\n", escaped(words))));
            }
            Block::List(points) => points.iter().for_each(|item| push_item(&mut text, "- ", item)),
            Block::Ranking(points) => {
                points
                    .iter()
                    .enumerate()
                    .for_each(|(k, item)| push_item(&mut text, &format!("{}. ", k + 1), item));
            }
            Block::Table(content) => {
                push_table(&mut text, content);
                if !content.notes.is_empty() {
                    let _ = writeln!(text, "{}\n", escaped(&content.notes.join("\n")));
                }
            }
            // Other blocks are for the page only.
            _ => {}
        }
    }
    text
}

/// Appends a list item with its details; `mark` is its bullet or number.
fn push_item(text: &mut String, mark: &str, point: &Point) {
    let indent = " ".repeat(mark.len());
    let _ = writeln!(text, "{mark}{}", escaped(&with_outcome(point)));
    for detail in &point.details {
        let _ = writeln!(text, "{indent}- {}", escaped(detail));
    }
}

/// Appends a table without its notes.
fn push_table(text: &mut String, table: &Table) {
    let row = |cells: &mut dyn Iterator<Item = String>| {
        format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
    };
    let cell = |cell: &str| escaped(&one_line(cell)).replace('|', "\\|");
    let rule = |k: usize| if table.left.contains(&k) { ":--" } else { "--:" };
    text.push_str(&row(&mut table.header.iter().map(|words| cell(words))));
    text.push_str(&row(&mut (0..table.header.len()).map(|k| rule(k).to_owned())));
    for cells in &table.rows {
        text.push_str(&row(&mut cells.iter().map(|words| cell(words))));
    }
}

fn one_line(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Escapes text for Markdown and puts code spans between backticks.
fn escaped(words: &str) -> String {
    let mut text = String::with_capacity(words.len());
    let mut remaining = words;
    while let Some((before, after)) = remaining.split_once(CODE.0) {
        push_escaped(&mut text, before);
        let (code, after) = after.split_once(CODE.1).unwrap_or((after, ""));
        // Code that contains backticks is fenced by more of them.
        let longest = code.split(|c| c != '`').map(str::len).max().unwrap_or(0);
        let (fence, space) = ("`".repeat(longest + 1), if longest > 0 { " " } else { "" });
        let _ = write!(text, "{fence}{space}{code}{space}{fence}");
        remaining = after;
    }
    push_escaped(&mut text, remaining);
    text
}

/// Appends text without code spans, escaped so that Markdown finds no code, emphasis, tag, entity,
/// link, image, URL or heading in it.
fn push_escaped(text: &mut String, words: &str) {
    let words: Vec<char> = words.chars().filter(|&c| c == '\n' || !is_hidden(c)).collect();
    let is_followed_by =
        |k: usize, word: &str| word.chars().zip(k + 1..).all(|(c, k)| words.get(k) == Some(&c));
    for (k, &c) in words.iter().enumerate() {
        let before = k.checked_sub(1).and_then(|k| words.get(k)).copied();
        let in_word = |c: Option<&char>| c.is_some_and(|c| c.is_alphanumeric());
        // A mark at the start of a line may begin a heading, a list, a quotation, a rule or a
        // fence.
        let starts_line =
            before.map_or(text.is_empty() || text.ends_with(['\n', ' ']), |before| before == '\n');
        let is_markup = match c {
            '*' | '<' | '\\' | '`' | '~' | '@' => true,
            '_' => !(in_word(before.as_ref()) && in_word(words.get(k + 1))),
            '&' => words.get(k + 1).is_some_and(|c| c.is_ascii_alphanumeric() || *c == '#'),
            // End of a link text, of an image text, or of a reference label.
            ']' => ["(", "[", ":"].iter().any(|next| is_followed_by(k, next)),
            '!' => is_followed_by(k, "["),
            ':' => is_followed_by(k, "//"),
            '.' => {
                k >= 3
                    && words
                        .get(k - 3..k)
                        .is_some_and(|www| www.iter().all(|w| w.eq_ignore_ascii_case(&'w')))
            }
            '#' | '>' | '=' => starts_line,
            '+' | '-' => {
                starts_line
                    && words.get(k + 1).is_none_or(|next| next.is_whitespace() || *next == c)
            }
            _ => false,
        };
        if is_markup {
            text.push('\\');
        }
        text.push(c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_contain_no_active_markup() {
        let cases = [
            ("[x](https://a.b)", "[x\\](https\\://a.b)"),
            ("![x][y] and [z]: u", "\\![x\\][y] and [z\\]: u"),
            ("`code` *em* ~~s~~ <b>", "\\`code\\` \\*em\\* \\~\\~s\\~\\~ \\<b>"),
            ("www.a.b _em_ x_mm &lt; &#60; A & B", "www\\.a.b \\_em\\_ x_mm \\&lt; \\&#60; A & B"),
            ("# big", "\\# big"),
            ("- item", "\\- item"),
            ("base[A].x: −0.5 (rank 3)", "base[A].x: −0.5 (rank 3)"),
            ("a\u{1b}[2J\u{202e}b", "a[2Jb"),
        ];
        for (words, expected) in cases {
            assert_eq!(escaped(words), expected);
        }
    }
}

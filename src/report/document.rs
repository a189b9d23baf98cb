//! A story in headings, paragraphs, lists and tables, told once and shown on terminals and as Markdown.
//!
//! Words between backticks are code: Markdown shows them so, a terminal shows them plain.

use std::fmt::Write as _;

use super::quantity::table;

/// Columns that text on a terminal is wrapped to; tables may be wider.
const WIDTH: usize = 110;

/// A part of a story.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Block {
    /// Title of what follows.
    Heading(String),
    /// Running text.
    Text(String),
    /// Points, each with its details.
    List(Vec<Point>),
    /// Points that are numbered from 1.
    Ranking(Vec<Point>),
    /// Numbers.
    Table(Table),
}

/// A point of a list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point {
    pub text: String,
    pub details: Vec<String>,
}

/// Rows and columns; numbers stand to the right, the columns in `left` to the left.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
    pub left: Vec<usize>,
}

impl Block {
    pub fn heading(text: &str) -> Self {
        Self::Heading(text.to_owned())
    }

    /// Points without details.
    pub fn list(points: impl IntoIterator<Item = String>) -> Self {
        Self::List(points.into_iter().map(|text| Point { text, details: Vec::new() }).collect())
    }
}

/// The story for a terminal, ending in a line break.
pub(super) fn to_text(blocks: &[Block]) -> String {
    let mut text = String::new();
    for (k, block) in blocks.iter().enumerate() {
        let follows_heading = k > 0 && matches!(blocks[k - 1], Block::Heading(_));
        if k > 0 && !follows_heading {
            text.push('\n');
        }
        match block {
            Block::Heading(words) => text.push_str(&wrapped(words, "", "")),
            Block::Text(words) => {
                let indent = if follows_heading { "  " } else { "" };
                text.push_str(&wrapped(words, indent, indent));
            }
            Block::List(points) => points.iter().for_each(|point| point_text(&mut text, "- ", point)),
            Block::Ranking(points) => {
                let numbered = points.iter().enumerate();
                numbered.for_each(|(k, point)| point_text(&mut text, &format!("{}. ", k + 1), point));
            }
            Block::Table(Table { header, rows, left }) => text.push_str(&table(header, rows.clone(), left)),
        }
    }
    text
}

fn point_text(text: &mut String, mark: &str, point: &Point) {
    let (first, further) = (format!("  {mark}"), " ".repeat(2 + mark.len()));
    text.push_str(&wrapped(&point.text, &first, &further));
    for detail in &point.details {
        text.push_str(&wrapped(detail, &further, &format!("{further}  ")));
    }
}

/// Lines of words, each ending in a line break; a break in the words stays one.
fn wrapped(words: &str, first: &str, further: &str) -> String {
    let plain = words.replace('`', "");
    let options = textwrap::Options::new(WIDTH).initial_indent(first).subsequent_indent(further).break_words(false);
    textwrap::wrap(&plain, options).iter().flat_map(|line| [line.trim_end(), "\n"]).collect()
}

/// The story as Markdown with GitHub's tables, `title` above it.
pub(super) fn to_markdown(title: &str, blocks: &[Block]) -> String {
    let mut text = format!("# {}\n", escaped(&one_line(title)));
    for block in blocks {
        text.push('\n');
        match block {
            // A text or a String takes whatever is written to it.
            Block::Heading(words) => _ = writeln!(text, "## {}", escaped(words)),
            Block::Text(words) => _ = writeln!(text, "{}", escaped(words)),
            Block::List(points) => points.iter().for_each(|point| point_markdown(&mut text, "- ", point)),
            Block::Ranking(points) => {
                let numbered = points.iter().enumerate();
                numbered.for_each(|(k, point)| point_markdown(&mut text, &format!("{}. ", k + 1), point));
            }
            Block::Table(table) => table_markdown(&mut text, table),
        }
    }
    text
}

fn point_markdown(text: &mut String, mark: &str, point: &Point) {
    let indent = " ".repeat(mark.len());
    let _ = writeln!(text, "{mark}{}", escaped(&point.text));
    for detail in &point.details {
        let _ = writeln!(text, "{indent}- {}", escaped(detail));
    }
}

fn table_markdown(text: &mut String, table: &Table) {
    let row = |cells: &mut dyn Iterator<Item = String>| format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "));
    text.push_str(&row(&mut table.header.iter().map(|cell| in_table(cell))));
    let rule = |k: usize| if table.left.contains(&k) { ":--" } else { "--:" };
    text.push_str(&row(&mut (0..table.header.len()).map(|k| rule(k).to_owned())));
    for cells in &table.rows {
        text.push_str(&row(&mut cells.iter().map(|cell| in_table(cell))));
    }
}

fn in_table(cell: &str) -> String {
    escaped(&one_line(cell)).replace('|', "\\|")
}

fn one_line(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Words with the marks that Markdown would take for its own, code left as it is.
fn escaped(words: &str) -> String {
    let mut text = String::with_capacity(words.len());
    let mut code = false;
    for c in words.chars() {
        code ^= c == '`';
        if !code && matches!(c, '*' | '<' | '\\') {
            text.push('\\');
        }
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_story_is_shown_both_ways() {
        let point = Point { text: "found `a*b`".to_owned(), details: vec!["2 < 3".to_owned()] };
        let rows = vec![vec!["a|b".to_owned(), "1".to_owned()]];
        let story = [
            Block::heading("Found"),
            Block::Ranking(vec![point]),
            Block::Table(Table { header: vec!["name", "value"], rows, left: vec![0] }),
        ];
        assert_eq!(to_text(&story), "Found\n  1. found a*b\n     2 < 3\n\n  name  value\n  a|b       1\n");
        let expected = "# The *arm*\n\n## Found\n\n1. found `a*b`\n   - 2 \\< 3\n\n\
                        | name | value |\n| :-- | --: |\n| a\\|b | 1 |\n";
        assert_eq!(to_markdown("The *arm*", &story), expected.replace("*arm*", "\\*arm\\*"));
    }

    #[test]
    fn long_text_is_wrapped_under_its_mark() {
        let words = "word ".repeat(40);
        let text = to_text(&[Block::list([words])]);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() == 2 && lines[0].starts_with("  - word") && lines[1].starts_with("    word"), "{text}");
    }
}

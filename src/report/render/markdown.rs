//! Blocks as Markdown with GitHub's tables.

use std::fmt::Write as _;

use super::text::{flat, marked};
use crate::report::document::{Block, CODE, Point, Table};

/// Blocks below a title, ending in a line break.
pub(in crate::report) fn markdown(title: &str, blocks: &[Block]) -> String {
    let mut text = format!("# {}\n", escaped(&one_line(title)));
    for block in flat(blocks) {
        text.push('\n');
        // A String takes whatever is written to it.
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
            Block::List(points) => points.iter().for_each(|own| point(&mut text, "- ", own)),
            Block::Ranking(points) => {
                points.iter().enumerate().for_each(|(k, own)| point(&mut text, &format!("{}. ", k + 1), own));
            }
            Block::Table(own) => table(&mut text, own),
            Block::Headline(_) | Block::Figures(_) | Block::Folded(..) | Block::Page(_) | Block::Words(_) => {}
        }
    }
    text
}

fn point(text: &mut String, mark: &str, point: &Point) {
    let indent = " ".repeat(mark.len());
    let _ = writeln!(text, "{mark}{}", escaped(&marked(point)));
    for detail in &point.details {
        let _ = writeln!(text, "{indent}- {}", escaped(detail));
    }
}

fn table(text: &mut String, table: &Table) {
    let row = |cells: &mut dyn Iterator<Item = String>| format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "));
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

/// Words with the marks that Markdown would take for its own, and code between backticks.
fn escaped(words: &str) -> String {
    let mut text = String::with_capacity(words.len());
    let mut rest = words;
    while let Some((before, after)) = rest.split_once(CODE.0) {
        plain(&mut text, before);
        let (code, after) = after.split_once(CODE.1).unwrap_or((after, ""));
        // Code that holds backticks itself stands between more of them.
        let longest = code.split(|c| c != '`').map(str::len).max().unwrap_or(0);
        let (fence, space) = ("`".repeat(longest + 1), if longest > 0 { " " } else { "" });
        let _ = write!(text, "{fence}{space}{code}{space}{fence}");
        rest = after;
    }
    plain(&mut text, rest);
    text
}

fn plain(text: &mut String, words: &str) {
    for c in words.chars().filter(|c| !c.is_control() || *c == '\n') {
        if matches!(c, '*' | '<' | '\\' | '`') {
            text.push('\\');
        }
        text.push(c);
    }
}

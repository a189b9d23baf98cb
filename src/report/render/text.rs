//! Rendering of blocks as text for terminals.

use std::sync::atomic::{AtomicUsize, Ordering};

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Width};
use textwrap::core::display_width;

use crate::report::document::{Block, CODE, Mark, Point, Table};

/// Maximum width of running text \[characters\]; tables may be wider on wide terminals.
const MAX_TEXT_WIDTH: usize = 110;

/// Width of the output of this process \[characters\]: that of its terminal, unlimited without one.
static OUTPUT_WIDTH: AtomicUsize = AtomicUsize::new(usize::MAX);

/// Limits text and tables of all reports of this process to `columns` characters a line.
pub fn limit_text_width(columns: usize) {
    OUTPUT_WIDTH.store(columns, Ordering::Relaxed);
}

/// Returns the width of running text in reports of this process \[characters\].
pub fn text_width() -> usize {
    OUTPUT_WIDTH.load(Ordering::Relaxed).min(MAX_TEXT_WIDTH)
}

/// Renders blocks as text, ending in a line break.
pub(in crate::report) fn text(blocks: &[Block]) -> String {
    text_within(blocks, OUTPUT_WIDTH.load(Ordering::Relaxed))
}

/// Renders blocks as text. Lines have at most `columns` characters, those of running text at most
/// [`MAX_TEXT_WIDTH`].
fn text_within(blocks: &[Block], columns: usize) -> String {
    let width = columns.min(MAX_TEXT_WIDTH);
    let mut text = String::new();
    let mut follows_heading = false;
    for block in text_blocks(blocks) {
        if !text.is_empty() && !follows_heading {
            text.push('\n');
        }
        let indent = if follows_heading { "  " } else { "" };
        follows_heading = matches!(block, Block::Heading(_));
        match block {
            Block::Heading(words) => text.push_str(&wrapped(words, ("", ""), width)),
            Block::Text(words) | Block::Note(words) => {
                text.push_str(&wrapped(words, (indent, indent), width));
            }
            Block::Lines(words, points) => {
                text.extend(words.lines().map(|line| wrapped(line, ("", ""), width)));
                text.extend(points.iter().map(|point| wrapped(point, ("  ", "    "), width)));
            }
            Block::List(points) => {
                for item in points {
                    push_item(&mut text, "- ", item, width);
                }
            }
            Block::Ranking(points) => {
                for (k, item) in points.iter().enumerate() {
                    push_item(&mut text, &format!("{}. ", k + 1), item, width);
                }
            }
            Block::Table(content) => {
                text.push_str(&table(content, columns));
                text.extend(content.notes.iter().map(|note| wrapped(note, ("  ", "  "), width)));
            }
            // Other blocks are for the page only.
            _ => {}
        }
    }
    text
}

/// Returns the blocks that terminals and Markdown show, in order, without nesting.
pub(super) fn text_blocks<'a, 'b>(blocks: &'b [Block<'a>]) -> Vec<&'b Block<'a>> {
    let mut shown = Vec::new();
    for block in blocks {
        match block {
            Block::Words(inner) => shown.extend(text_blocks(inner)),
            Block::Headline(_)
            | Block::Outcome { .. }
            | Block::Blanks(_)
            | Block::Figures(_)
            | Block::Poses(_)
            | Block::Folded(..)
            | Block::Page(_) => {}
            block => shown.push(block),
        }
    }
    shown
}

/// Returns the text of a list item, after the outcome if it is a test.
pub(super) fn with_outcome(point: &Point) -> String {
    let mark = match point.mark {
        Some(Mark::Failed) => "failed: ",
        Some(Mark::Passed) => "passed: ",
        Some(Mark::Untested) | None => "",
    };
    format!("{mark}{}", point.text)
}

/// Appends a list item with its details; `mark` is its bullet or number.
fn push_item(text: &mut String, mark: &str, point: &Point, width: usize) {
    let (first, indent) = (format!("  {mark}"), " ".repeat(2 + mark.len()));
    text.push_str(&wrapped(&with_outcome(point), (&first, &indent), width));
    for detail in &point.details {
        text.push_str(&wrapped(detail, (&indent, &format!("{indent}  ")), width));
    }
}

/// Units that are not separated from their number by a line break.
const UNBROKEN_UNITS: [&str; 6] = ["%", "mm", "°", "σ", "px", "kg"];

/// Replaces the spaces in code by non-breaking spaces if the code fits on a line of `width`
/// characters, so that it can be copied as a whole.
fn unbroken_code(words: &str, width: usize) -> String {
    let part = |(k, part): (usize, &str)| match part.split_once(CODE.1) {
        Some((code, plain)) if k > 0 && code.chars().count() <= width => {
            code.replace(' ', "\u{a0}") + plain
        }
        _ => part.to_owned(),
    };
    words.split(CODE.0).enumerate().map(part).collect()
}

/// Wraps text to `width` characters, each line ending in a line break. `first` and `following` are
/// the indents of the first and of the other lines. Line breaks in the text are kept. Numbers with
/// their units, and code that fits on a line, are not broken.
fn wrapped(words: &str, (first, following): (&str, &str), width: usize) -> String {
    let joined =
        |text: String, unit: &str| text.replace(&format!(" {unit}"), &format!("\u{a0}{unit}"));
    let whole = unbroken_code(words, width.saturating_sub(following.len()));
    let plain = UNBROKEN_UNITS.into_iter().fold(plain(&whole), joined);
    // Names of effects and files are not split, so that they can be copied.
    let options = textwrap::Options::new(width)
        .initial_indent(first)
        .subsequent_indent(following)
        .break_words(false)
        .word_splitter(textwrap::WordSplitter::NoHyphenation);
    let lines = textwrap::wrap(&plain, options);
    lines.iter().map(|line| line.trim_end().replace('\u{a0}', " ") + "\n").collect()
}

/// Removes code marks and other control characters.
fn plain(words: &str) -> String {
    words.chars().filter(|c| !c.is_control() || *c == '\n').collect()
}

/// Renders a table without ruled lines. Cells of a table wider than `width` are wrapped at spaces.
/// If the table is still too wide, minor columns are omitted, and a last line names them.
fn table(table: &Table, width: usize) -> String {
    let mut lines = vec![table.header.clone()];
    lines.extend(table.rows.iter().map(|row| row.iter().map(|cell| plain(cell)).collect()));
    let (widths, omitted) = column_widths(&lines, &table.minor, width);
    let mut shown = comfy_table::Table::new();
    shown.load_style(NOTHING).set_header(lines.remove(0)).add_rows(lines);
    shown.set_content_arrangement(ContentArrangement::Dynamic);
    for ((index, column), &width) in shown.column_iter_mut().enumerate().zip(&widths) {
        let padding = (if index == 0 { 2 } else { 1 }, 1);
        let left = table.left.contains(&index);
        column.set_padding(padding);
        column.set_cell_alignment(if left { CellAlignment::Left } else { CellAlignment::Right });
        let width = u16::try_from(width).unwrap_or(u16::MAX).saturating_add(padding.0 + padding.1);
        let is_omitted = omitted.contains(&index);
        let constraint = ColumnConstraint::Absolute(Width::Fixed(width));
        column.set_constraint(if is_omitted { ColumnConstraint::Hidden } else { constraint });
    }
    let mut text: String = shown.lines().map(|line| line.trim_end().to_owned() + "\n").collect();
    let is_omitted = |(k, _): &(usize, &String)| omitted.contains(k);
    let names = table.header.iter().enumerate().filter(is_omitted).map(|(_, name)| name.as_str());
    let names: Vec<&str> = names.collect();
    if !names.is_empty() {
        let note = format!("omitted on this narrow terminal: {}", names.join("; "));
        text.push_str(&wrapped(&note, ("  ", "  "), width));
    }
    text
}

/// Returns the width of each column, and the indices of the columns of `minor` to omit. A table of
/// `lines` is then at most `width` wide, if possible.
fn column_widths(lines: &[Vec<String>], minor: &[usize], width: usize) -> (Vec<usize>, Vec<usize>) {
    let columns = 0..lines.first().map_or(0, Vec::len);
    let cells = |k: usize| lines.iter().filter_map(move |line| line.get(k));
    let whole = |k| cells(k).map(|cell| display_width(cell)).max().unwrap_or(0);
    let longest_word =
        |k| cells(k).flat_map(|cell| cell.split(' ')).map(display_width).max().unwrap_or(0);
    let mut widths: Vec<usize> = columns.clone().map(whole).collect();
    let least: Vec<usize> = columns.clone().map(longest_word).collect();
    let mut omitted = Vec::new();
    let total = |widths: &[usize], omitted: &[usize]| {
        let shown = columns.clone().filter(|k| !omitted.contains(k));
        shown.map(|k| widths[k] + 2).sum::<usize>() + 1
    };
    for &column in minor.iter().rev() {
        if total(&least, &omitted) > width {
            omitted.push(column);
        }
    }
    while total(&widths, &omitted) > width {
        let shrinkable = columns.clone().filter(|k| !omitted.contains(k) && widths[*k] > least[*k]);
        let Some(widest) = shrinkable.max_by_key(|k| widths[*k]) else { break };
        widths[widest] -= 1;
    }
    (widths, omitted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::code;
    use crate::report::render::markdown::markdown;

    #[test]
    fn blocks_are_shown_as_text_and_markdown() {
        let details = vec!["2 < 3".to_owned()];
        let point =
            Point { text: format!("found {}", code("a*b")), details, mark: Some(Mark::Passed) };
        let rows = vec![vec!["a|b".to_owned(), "1".to_owned()]];
        let story = [
            Block::heading("Found"),
            Block::Ranking(vec![point]),
            Block::Table(Table::new(&["name", "value"], rows, &[0])),
        ];
        let expected =
            "Found\n  1. passed: found a*b\n     2 < 3\n\n  name  value\n  a|b       1\n";
        assert_eq!(text(&story), expected);
        let expected = "# The \\*arm\\*\n\n## Found\n\n1. passed: found `a*b`\n   - 2 \\< 3\n\n\
                        | name | value |\n| :-- | --: |\n| a\\|b | 1 |\n";
        assert_eq!(markdown("The *arm*", &story), expected);
    }

    #[test]
    fn titles_and_names_contain_no_active_markup() {
        let words = format!("link ` is *off*: {}\u{1b}[31m", code("link = \"a`*\""));
        let story = [Block::Text(words)];
        assert_eq!(text(&story), "link ` is *off*: link = \"a`*\"[31m\n");
        let expected = "# A \\` and \\*\n\nlink \\` is \\*off\\*: `` link = \"a`*\" ``[31m\n";
        assert_eq!(markdown("A ` and *", &story), expected);
    }

    #[test]
    fn wide_tables_are_wrapped_and_omit_minor_columns() {
        let rows = vec![vec!["joint = { q = 1 }".to_owned(), "0.25".into(), "17".into()]];
        let mut wide = Table::new(&["name of effect", "mean error", "steps"], rows, &[0]);
        wide.minor = vec![2];
        let whole =
            "  name of effect     mean error  steps\n  joint = { q = 1 }        0.25     17\n";
        assert_eq!(table(&wide, 39), whole);
        let wrapped = "  name of          mean  steps\n  effect          error\n  \
                       joint = {        0.25     17\n  q = 1 }\n";
        assert_eq!(table(&wide, 31), wrapped);
        let least = "  name      mean\n  of       error\n  effect\n  joint     0.25\n  = { q\n  = 1 }\n  \
                     omitted on this\n  narrow\n  terminal: steps\n";
        assert_eq!(table(&wide, 17), least);
    }

    #[test]
    fn long_text_is_wrapped_under_its_mark() {
        let words = "word ".repeat(40);
        let narrow = text_within(&[Block::list([words.clone()])], 50);
        assert!(
            narrow.lines().count() == 5 && narrow.lines().all(|line| line.len() <= 50),
            "{narrow}"
        );
        let text = text(&[Block::list([words])]);
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines.len() == 2
                && lines[0].starts_with("  - word")
                && lines[1].starts_with("    word"),
            "{text}"
        );
    }
}

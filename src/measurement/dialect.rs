//! How a table is written: what sets its columns apart, which line names them, and lines that say
//! nothing.

use std::io::{Read, Result};

use super::lines::Lines;
use crate::error::BYTE_ORDER_MARK_UTF8;
use crate::problem::{ColumnOf, Delimiter, Dialect};

/// What of a table is looked at to find its header [bytes].
pub(super) const LOOKED_AT: u64 = 1 << 16;
/// Lines among which the header is sought.
const LINES: usize = 100;
/// What a line of runs of spaces is rewritten with.
const TAB: u8 = b'\t';

/// How to read a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub delimiter: Delimiter,
    /// Lines before the header.
    pub skipped: usize,
}

impl Layout {
    /// Of a table that begins with `beginning`.
    ///
    /// The header is the first line that holds most of the names of the map, or else the first that
    /// says something; columns are set apart by the one of `,` `;` and tab that it has most of,
    /// else by spaces if it has any.
    pub fn of(beginning: &[u8], dialect: &Dialect) -> Self {
        let text = String::from_utf8_lossy(
            beginning.strip_prefix(BYTE_ORDER_MARK_UTF8).unwrap_or(beginning),
        );
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        let names: Vec<&str> = dialect
            .columns
            .iter()
            .filter_map(|rule| match &rule.theirs {
                ColumnOf::Name(name) => Some(name.as_str()),
                ColumnOf::Place(_) | ColumnOf::File => None,
            })
            .collect();
        let is_comment = |line: &str| {
            dialect.comment.as_ref().is_some_and(|mark| line.trim_start().starts_with(mark))
        };
        let lines = text.split('\n').enumerate().take(LINES);
        let speaking: Vec<(usize, &str)> =
            lines.filter(|(_, line)| !line.trim().is_empty() && !is_comment(line)).collect();
        let apart = |line: &str| dialect.delimiter.unwrap_or_else(|| most_of(line));
        let held = |line: &str| {
            let cells = cells(line, apart(line));
            names.iter().filter(|name| cells.iter().any(|cell| cell == *name)).count()
        };
        // Of equals the first: the last of the lines from the end.
        let counted =
            speaking.iter().rev().map(|&own| (held(own.1), own)).filter(|(count, _)| *count > 0);
        let named = counted.max_by_key(|(count, _)| *count).map(|(_, own)| own);
        match (named, speaking.first()) {
            (Some((skipped, line)), _) => Self { delimiter: apart(line), skipped },
            // Lines that say nothing are passed over anyway.
            (None, Some((_, line))) => Self { delimiter: apart(line), skipped: 0 },
            (None, None) => {
                Self { delimiter: dialect.delimiter.unwrap_or(Delimiter::Byte(b',')), skipped: 0 }
            }
        }
    }

    /// What the reader of cells takes for it.
    pub fn byte(self) -> u8 {
        match self.delimiter {
            Delimiter::Byte(byte) => byte,
            Delimiter::Spaces => TAB,
        }
    }
}

/// What a header sets its columns apart by.
fn most_of(line: &str) -> Delimiter {
    let count = |byte: u8| line.bytes().filter(|own| *own == byte).count();
    // The last of equals is taken.
    let most = [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|byte| count(*byte))
        .filter(|byte| count(*byte) > 0);
    match most {
        Some(byte) => Delimiter::Byte(byte),
        None if line.trim().contains(' ') && !line.contains('"') => Delimiter::Spaces,
        None => Delimiter::Byte(b','),
    }
}

/// Cells of a line without white space and quotes at their ends.
fn cells(line: &str, delimiter: Delimiter) -> Vec<String> {
    let plain = |cell: &str| cell.trim().trim_matches('"').trim().to_owned();
    match delimiter {
        Delimiter::Byte(byte) => line.split(char::from(byte)).map(plain).collect(),
        Delimiter::Spaces => line.split_whitespace().map(plain).collect(),
    }
}

/// Passes a table on with lines before the header and comments made empty, and runs of spaces made
/// tabs.
pub(super) struct Rewritten<R> {
    pub lines: R,
    /// Lines before the header that are still to come.
    skipped: usize,
    comment: Option<Vec<u8>>,
    spaces: bool,
    /// Whether there is anything to do.
    idle: bool,
    /// What was read and not yet passed on, and how far it was.
    ready: Vec<u8>,
    given: usize,
    /// What was read beyond the last line.
    rest: Vec<u8>,
    ended: bool,
}

impl<R: Read> Rewritten<R> {
    pub fn new(lines: R, layout: Layout, comment: Option<&str>) -> Self {
        let spaces = layout.delimiter == Delimiter::Spaces;
        Self {
            lines,
            skipped: layout.skipped,
            comment: comment.map(|mark| mark.as_bytes().to_vec()),
            spaces,
            idle: layout.skipped == 0 && comment.is_none() && !spaces,
            ready: Vec::new(),
            given: 0,
            rest: Vec::new(),
            ended: false,
        }
    }

    /// Makes the next line ready; nothing is at the end.
    fn next_line(&mut self) -> Result<()> {
        (self.ready, self.given) = (Vec::new(), 0);
        let mut chunk = [0; 4096];
        let mut searched = 0;
        let end = loop {
            if let Some(end) = self.rest.iter().skip(searched).position(|byte| *byte == b'\n') {
                break searched + end + 1;
            }
            searched = self.rest.len();
            if self.ended {
                break searched;
            }
            match self.lines.read(&mut chunk)? {
                0 => self.ended = true,
                read => self.rest.extend_from_slice(chunk.get(..read).unwrap_or_default()),
            }
        };
        let line: Vec<u8> = self.rest.drain(..end).collect();
        let text = line.strip_prefix(BYTE_ORDER_MARK_UTF8).unwrap_or(&line).trim_ascii();
        let is_comment = self.comment.as_ref().is_some_and(|mark| text.starts_with(mark));
        if self.skipped > 0 || is_comment {
            self.skipped = self.skipped.saturating_sub(1);
            self.ready = if line.is_empty() { Vec::new() } else { vec![b'\n'] };
        } else if self.spaces {
            self.ready = text
                .split(u8::is_ascii_whitespace)
                .filter(|cell| !cell.is_empty())
                .collect::<Vec<_>>()
                .join(&TAB);
            self.ready.extend((!line.is_empty()).then_some(b'\n'));
        } else {
            self.ready = line;
        }
        Ok(())
    }
}

impl<R: std::io::BufRead> Rewritten<Lines<R>> {
    /// Says that a record begins.
    pub fn start_record(&mut self) {
        self.lines.start_record();
    }
}

impl<R: Read> Read for Rewritten<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        if self.idle {
            return self.lines.read(out);
        }
        if self.given == self.ready.len() {
            self.next_line()?;
        }
        let left = self.ready.get(self.given..).unwrap_or_default();
        let count = left.len().min(out.len());
        if let (Some(out), Some(left)) = (out.get_mut(..count), left.get(..count)) {
            out.copy_from_slice(left);
        }
        self.given += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_says_what_sets_columns_apart() {
        let bytes = Delimiter::Byte;
        for (text, delimiter, skipped) in [
            ("a,b;c,d\n", bytes(b','), 0),
            ("\u{feff}a;b;c\r\n1,5;2;3\r\n", bytes(b';'), 0),
            ("\n\na\tb c\n", bytes(b'\t'), 0),
            ("  a   b  c\n1 2 3\n", Delimiter::Spaces, 0),
            ("a\n", bytes(b','), 0),
            ("", bytes(b','), 0),
        ] {
            assert_eq!(
                Layout::of(text.as_bytes(), &Dialect::default()),
                Layout { delimiter, skipped },
                "{text:?}"
            );
        }
    }

    #[test]
    fn a_misspelt_name_of_the_map_does_not_hide_the_header() {
        let rule = |name: &str| crate::problem::ColumnRule {
            theirs: ColumnOf::Name(name.to_owned()),
            ours: String::new(),
            location: crate::error::Location::file("problem.toml"),
        };
        let dialect =
            Dialect { columns: ["a", "b", "misspelt"].map(rule).to_vec(), ..Dialect::default() };
        let text = "day 1, tool b\nb,c\na;b;c\n1;2;3\n";
        assert_eq!(
            Layout::of(text.as_bytes(), &dialect),
            Layout { delimiter: Delimiter::Byte(b';'), skipped: 2 }
        );
    }

    #[test]
    fn lines_are_counted_through_what_is_left_out() {
        let dialect = Dialect { comment: Some("//".to_owned()), ..Dialect::default() };
        let text = "// a \"b\n  x   y\n\n// c\n 1  2 \n3\t4";
        let layout = Layout::of(text.as_bytes(), &dialect);
        assert_eq!(layout, Layout { delimiter: Delimiter::Spaces, skipped: 0 });
        let mut plain = String::new();
        Rewritten::new(text.as_bytes(), layout, dialect.comment.as_deref())
            .read_to_string(&mut plain)
            .unwrap();
        assert_eq!(plain, "\nx\ty\n\n\n1\t2\n3\t4\n");
    }
}

//! Layout of a table: delimiter, header line and comments.

use std::io::{Read, Result};

use super::latin::{decoded, parsed};
use super::lines::Lines;
use super::meaning::is_numbered_or_position;
use crate::error::BYTE_ORDER_MARK_UTF8;
use crate::problem::{ColumnSelector, Delimiter, Dialect};

/// Size of the beginning of a table in which the header is searched \[bytes\].
pub(super) const HEADER_SEARCH_BYTES: u64 = 1 << 16;
/// Maximum number of lines in which the header is searched.
const MAX_HEADER_LINES: usize = 100;
/// Tab, the delimiter that replaces a run of spaces.
const TAB: u8 = b'\t';

/// Marks that some programs put before the header line, as before a comment.
const HEADER_MARKS: [&str; 3] = ["//", "#", "%"];
/// Minimum number of known column names in a line at which the line is recognised as the header.
const MIN_KNOWN_NAMES: usize = 2;

/// Delimiter of a table, and place of its header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub delimiter: Delimiter,
    /// Number of lines before the header.
    pub skipped: usize,
    /// Number of bytes before the first name of the header: a comment mark with white space.
    pub mark_bytes: usize,
}

impl Layout {
    /// Finds the layout of a table from its `beginning`.
    ///
    /// The header is the line with most names of the map, otherwise the first line with at least
    /// [`MIN_KNOWN_NAMES`] names of flexcal, otherwise the first line with content. A line behind a
    /// comment mark is the header only if no other line has known names, or if rows stand between
    /// it and that line. The delimiter is that of a line `sep=`, else the declared one, else the
    /// most frequent of `,` `;` and tab in the header, otherwise spaces.
    pub fn detect(beginning: &[u8], dialect: &Dialect) -> Self {
        let text = decoded(beginning.strip_prefix(BYTE_ORDER_MARK_UTF8).unwrap_or(beginning));
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        let mut lines: Vec<(usize, &str)> = text
            .split('\n')
            .enumerate()
            .take(MAX_HEADER_LINES)
            .filter(|(_, line)| !line.trim().is_empty())
            .collect();
        let excel = lines.first().and_then(|(_, line)| excel_delimiter(line));
        if excel.is_some() {
            lines.remove(0);
        }
        let declared = excel.or(dialect.delimiter);
        let delimiter_of = |line: &str| match declared {
            Some(declared) if !is_separated_otherwise(line, declared) => declared,
            _ => most_frequent_delimiter(line),
        };
        let names: Vec<&str> = dialect
            .columns
            .iter()
            .filter_map(|rule| match &rule.theirs {
                ColumnSelector::Name(name) => Some(name.as_str()),
                ColumnSelector::Place(_) | ColumnSelector::File => None,
            })
            .collect();
        // Returns the number of names of the map in a line, and the number of all known names.
        let names_in = |line: &str| {
            let cells = cells(line, delimiter_of(line));
            let mapped = names.iter().filter(|name| cells.iter().any(|cell| cell == *name)).count();
            let ours = cells.iter().filter(|cell| is_numbered_or_position(cell)).count();
            (mapped, mapped + ours)
        };
        let is_comment = |line: &str| {
            dialect.comment.as_ref().is_some_and(|mark| line.trim_start().starts_with(mark))
        };
        let candidates: Vec<(usize, &str)> =
            lines.iter().copied().filter(|(_, line)| !is_comment(line)).collect();
        // The iterator is reversed so that the first of equals wins.
        let counted = candidates
            .iter()
            .rev()
            .map(|&candidate| (names_in(candidate.1).0, candidate))
            .filter(|(count, _)| *count > 0);
        let named = counted.max_by_key(|(count, _)| *count).map(|(_, line)| line);
        let has_names = |line: &str| names_in(line).1 >= MIN_KNOWN_NAMES;
        let is_marked = |line: &str| mark_bytes(line, dialect.comment.as_deref()).is_some();
        let first_unmarked = || candidates.iter().copied().find(|(_, line)| !is_marked(line));
        let has_known =
            || candidates.iter().copied().find(|(_, line)| has_names(line) && !is_marked(line));
        // Without known names, as many words as the first row has numbers are its header.
        let selects_places =
            dialect.columns.iter().any(|rule| !matches!(rule.theirs, ColumnSelector::Name(_)));
        let stands_above_numbers = |names: &str| {
            let names = cells(names, delimiter_of(names));
            let Some((_, row)) = first_unmarked().filter(|_| !selects_places) else { return false };
            let row = cells(row, delimiter_of(row));
            let numbers = row.iter().filter(|cell| parsed(cell).is_some()).count();
            let are_words = names.iter().all(|name| parsed(name).is_none());
            names.len() > 2 && names.len() == row.len() && are_words && 2 * numbers > row.len()
        };
        // Returns the bytes of the mark in front of the names of a line.
        let mark_before_names = |line: &str| {
            let mark_bytes = mark_bytes(line, dialect.comment.as_deref())?;
            let names = line.get(mark_bytes..)?;
            (has_names(names) || stands_above_numbers(names)).then_some(mark_bytes)
        };
        let marked = || lines.iter().copied().find(|(_, line)| mark_before_names(line).is_some());
        // If there are rows between a marked header and a later line of names, the marked line is
        // their header, and the later line repeats it.
        let marked_above_rows = || {
            let (first, header) = marked()?;
            let count =
                cells(header.get(mark_before_names(header)?..)?, delimiter_of(header)).len();
            let is_row = |line: &str| {
                let cells = cells(line, delimiter_of(header));
                let is_number = |cell: &String| parsed(cell).is_some();
                cells.len() == count && cells.iter().filter(|cell| is_number(cell)).count() > 1
            };
            let (later, _) = has_known()?;
            let between = |line: &&(usize, &str)| (first + 1..later).contains(&line.0);
            let has_rows = candidates.iter().filter(between).any(|(_, line)| is_row(line));
            has_rows.then_some((first, header))
        };
        let header = marked_above_rows().or(named
            .filter(|(_, line)| has_names(line) && !is_marked(line))
            .or_else(has_known)
            .or_else(marked)
            .or(named)
            .or_else(first_unmarked)
            .or(candidates.first().copied()));
        let Some((line_index, line)) = header else {
            let delimiter = declared.unwrap_or(Delimiter::Byte(b','));
            return Self { delimiter, skipped: 0, mark_bytes: 0 };
        };
        let mark_bytes = mark_before_names(line).unwrap_or(0);
        // Empty and comment lines are skipped anyway.
        let is_first = named.is_none()
            && excel.is_none()
            && mark_bytes == 0
            && candidates.first().is_some_and(|(first, _)| *first == line_index);
        Self {
            delimiter: delimiter_of(line.get(mark_bytes..).unwrap_or_default()),
            skipped: if is_first { 0 } else { line_index },
            mark_bytes,
        }
    }

    /// Returns the delimiter for the CSV reader.
    pub fn byte(self) -> u8 {
        match self.delimiter {
            Delimiter::Byte(byte) => byte,
            Delimiter::Spaces => TAB,
        }
    }
}

/// Returns the delimiter that a line such as `sep=;` of Excel declares; `None` for other lines.
fn excel_delimiter(line: &str) -> Option<Delimiter> {
    let delimiter = line.trim_end().strip_prefix("sep=").unwrap_or_default();
    match (delimiter.as_bytes(), line.trim_end_matches([' ', '"'])) {
        (&[byte], _) => Some(Delimiter::Byte(byte)),
        (_, "sep=\t") => Some(Delimiter::Byte(TAB)),
        _ => None,
    }
}

/// Returns the number of bytes before the content of a line that begins with the declared `comment`
/// mark or with one of [`HEADER_MARKS`]; `None` for other lines.
fn mark_bytes(line: &str, comment: Option<&str>) -> Option<usize> {
    let start = line.len() - line.trim_start().len();
    let text = line.trim_start();
    let mark = comment.into_iter().chain(HEADER_MARKS).find(|mark| text.starts_with(mark))?;
    let content = text.get(mark.len()..)?.trim_start_matches(['/', '#', '%', ' ']);
    // A mark alone in its cell is the name of a column.
    let is_cell = content.starts_with([',', ';', '\t']);
    (!is_cell).then_some(start + text.len() - content.len())
}

/// Returns true if commas separate a header line and the declared delimiter does not occur in it,
/// as in files written by flexcal.
fn is_separated_otherwise(line: &str, declared: Delimiter) -> bool {
    let occurs = match declared {
        Delimiter::Byte(byte) => line.contains(char::from(byte)),
        Delimiter::Spaces => line.trim().contains([' ', '\t']),
    };
    line.contains(',') && !occurs
}

/// Returns the most frequent delimiter of a header line.
fn most_frequent_delimiter(line: &str) -> Delimiter {
    let count = |byte: u8| line.bytes().filter(|&other| other == byte).count();
    // `max_by_key` returns the last of equals.
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

/// Returns the cells of a line without surrounding white space and quotes.
pub(super) fn cells(line: &str, delimiter: Delimiter) -> Vec<String> {
    let plain = |cell: &str| cell.trim().trim_matches('"').trim().to_owned();
    match delimiter {
        Delimiter::Byte(byte) => line.split(char::from(byte)).map(plain).collect(),
        Delimiter::Spaces => line.split_whitespace().map(plain).collect(),
    }
}

/// Reader that empties comments and the lines before the header. If spaces are the delimiter, it
/// replaces runs of spaces by tabs. Line numbers stay the same.
pub(super) struct NormalizedText<R> {
    pub lines: R,
    /// Number of lines before the header that are still unread.
    skipped: usize,
    /// Number of bytes of the mark before the header; 0 after the header has been read.
    mark_bytes: usize,
    /// Mark of comment lines.
    comment: Option<Vec<u8>>,
    /// True if spaces are the delimiter.
    spaces: bool,
    /// True if the text needs no change.
    is_unchanged: bool,
    /// Text of the last normalised line.
    ready: Vec<u8>,
    /// Number of bytes of `ready` that the caller has read.
    given: usize,
    /// Text that was read beyond the end of the last normalised line.
    unread: Vec<u8>,
    /// True if `lines` has been read to its end.
    ended: bool,
}

impl<R: Read> NormalizedText<R> {
    pub fn new(lines: R, layout: Layout, comment: Option<&str>) -> Self {
        let spaces = layout.delimiter == Delimiter::Spaces;
        Self {
            lines,
            skipped: layout.skipped,
            mark_bytes: layout.mark_bytes,
            comment: comment.map(|mark| mark.as_bytes().to_vec()),
            spaces,
            is_unchanged: layout.skipped == 0
                && layout.mark_bytes == 0
                && comment.is_none()
                && !spaces,
            ready: Vec::new(),
            given: 0,
            unread: Vec::new(),
            ended: false,
        }
    }

    /// Normalises the next line into `ready`, which is empty at the end of the text.
    fn next_line(&mut self) -> Result<()> {
        (self.ready, self.given) = (Vec::new(), 0);
        let mut chunk = [0; 4096];
        let mut searched = 0;
        let end = loop {
            if let Some(end) = self.unread.iter().skip(searched).position(|byte| *byte == b'\n') {
                break searched + end + 1;
            }
            searched = self.unread.len();
            if self.ended {
                break searched;
            }
            match self.lines.read(&mut chunk)? {
                0 => self.ended = true,
                read => self.unread.extend_from_slice(chunk.get(..read).unwrap_or_default()),
            }
        };
        let mut line: Vec<u8> = self.unread.drain(..end).collect();
        let is_marked_header = self.skipped == 0 && self.mark_bytes > 0;
        if is_marked_header {
            let bom = line.starts_with(BYTE_ORDER_MARK_UTF8);
            let bom = if bom { BYTE_ORDER_MARK_UTF8.len() } else { 0 };
            line.drain(..(bom + self.mark_bytes).min(line.len()));
            self.mark_bytes = 0;
        }
        let text = line.strip_prefix(BYTE_ORDER_MARK_UTF8).unwrap_or(&line).trim_ascii();
        let is_comment = self.comment.as_ref().is_some_and(|mark| text.starts_with(mark));
        if self.skipped > 0 || (is_comment && !is_marked_header) {
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

impl<R: std::io::BufRead> NormalizedText<Lines<R>> {
    /// Marks the start of a record, from which its length is counted.
    pub fn start_record(&mut self) {
        self.lines.start_record();
    }
}

impl<R: Read> Read for NormalizedText<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        if self.is_unchanged {
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
    fn delimiter_is_found_from_the_header() {
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
                Layout::detect(text.as_bytes(), &Dialect::default()),
                Layout { delimiter, skipped, mark_bytes: 0 },
                "{text:?}"
            );
        }
    }

    #[test]
    fn a_misspelt_name_of_the_map_does_not_hide_the_header() {
        let rule = |name: &str| crate::problem::ColumnRule {
            theirs: ColumnSelector::Name(name.to_owned()),
            ours: String::new(),
            location: crate::error::Location::file("problem.toml"),
        };
        let dialect =
            Dialect { columns: ["a", "b", "misspelt"].map(rule).to_vec(), ..Dialect::default() };
        let text = "day 1, tool b\nb,c\na;b;c\n1;2;3\n";
        assert_eq!(
            Layout::detect(text.as_bytes(), &dialect),
            Layout { delimiter: Delimiter::Byte(b';'), skipped: 2, mark_bytes: 0 }
        );
    }

    #[test]
    fn lines_are_counted_through_what_is_left_out() {
        let dialect = Dialect { comment: Some("//".to_owned()), ..Dialect::default() };
        let text = "// a \"b\n  x   y\n\n// c\n 1  2 \n3\t4";
        let layout = Layout::detect(text.as_bytes(), &dialect);
        assert_eq!(layout, Layout { delimiter: Delimiter::Spaces, skipped: 0, mark_bytes: 0 });
        let mut plain = String::new();
        NormalizedText::new(text.as_bytes(), layout, dialect.comment.as_deref())
            .read_to_string(&mut plain)
            .unwrap();
        assert_eq!(plain, "\nx\ty\n\n\n1\t2\n3\t4\n");
    }
}

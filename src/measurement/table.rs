//! CSV table that is read record by record, with the line numbers of the records.

use std::io::{self, BufReader, Chain, Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use csv::{ByteRecord, Reader, ReaderBuilder};

use super::appended::Appended;
use super::beginning::Beginning;
use super::cell_style::CellStyle;
use super::cell_words::{
    UNITS, has_thousands, is_spreadsheet_date, is_spreadsheet_error, other_notation, unit_behind,
};
use super::cut_end::LastCells;
use super::dialect::{HEADER_SEARCH_BYTES, Layout, NormalizedText};
use super::headerless::is_row_of_numbers;
use super::latin::decoded_record;
use super::lines::{Lines, MAX_RECORD_KIB};
use super::time::DateOrder;
use crate::error::{
    BYTE_ORDER_MARKS, Excerpt, InputError, InputErrorKind, Location, TABLE, TableErrorKind,
    Warning, WarningKind, binary_format, is_hidden, lines, text_format, typographic,
};
use crate::files::{open, unescape_cell};
use crate::problem::item::MAX_MAGNITUDE;
use crate::problem::{ColumnRule, ColumnSelector, Dialect};

/// Maximum number of columns of a table.
const MAX_COLUMNS: usize = 10_000;

/// Description, for messages, of the input that is expected instead of a file of another format.
const A_TABLE: &str = "a table; save or export it as CSV, text with one row per pose";
/// Maximum number of cells into which delimiters divide the first line of a file in another format,
/// such as a key of YAML. Only a line with a distinct mark may have more.
const MAX_CELLS_OF_KEY: usize = 2;

/// Text whose beginning has already been read.
type TextFromStart = Chain<Cursor<Arc<[u8]>>, Box<dyn Read>>;

/// Open CSV file with its current row.
pub(super) struct Table {
    pub file: PathBuf,
    /// Names in the header line without surrounding white space.
    pub header: Vec<String>,
    /// Line of the header, from 1.
    pub(super) header_line: usize,
    reader: Reader<NormalizedText<Lines<BufReader<TextFromStart>>>>,
    /// Cells of the current row.
    pub(super) record: ByteRecord,
    /// Line of the current row, from 1.
    line: usize,
    pub(super) style: CellStyle,
    /// True if the table has no header, and its first record, a row, has not been returned yet.
    starts_with_row: bool,
    /// Order of day and month in dates, by the first lines of the table.
    pub(super) date_order: DateOrder,
    /// Columns of a date and of the time of day beside it; `None` without such columns.
    pub(super) date_columns: Option<[usize; 2]>,
    /// Columns that a joint table appends to this table; `None` if it is not joined.
    pub(super) appended: Option<Appended>,
    /// Beginning of the text, in which the kinds of its numbers are looked up.
    pub(super) beginning: Beginning,
    /// Number of the first line that was decoded from Windows-1252; `None` if there is none.
    decoded_line: Option<usize>,
    /// Digits of the last cells of the rows so far.
    last_cells: LastCells,
}

impl Table {
    /// Opens a file with the given `dialect` and reads its header; `missing` makes the error if the
    /// file does not exist.
    pub fn open(
        file: &Path,
        dialect: &Dialect,
        missing: impl FnOnce() -> InputError,
    ) -> Result<Self, InputError> {
        let input = open(file).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => missing(),
            _ => Location::file(file).error(InputErrorKind::Unreadable { source }),
        })?;
        Self::from_reader(file, dialect, Box::new(input))
    }

    /// Reads the header of a text; `file` names it in messages.
    pub fn from_reader(
        file: &Path,
        dialect: &Dialect,
        mut input: Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let unreadable = |source| Location::file(file).error(InputErrorKind::Unreadable { source });
        let mut beginning = Vec::new();
        input.by_ref().take(HEADER_SEARCH_BYTES).read_to_end(&mut beginning).map_err(unreadable)?;
        let other_format = |found| InputErrorKind::OtherFormat { found, expected: A_TABLE };
        if let Some(found) = binary_format(&beginning) {
            return Err(Location::file(file).error(other_format(found)));
        }
        let layout = Layout::detect(&beginning, dialect);
        let start: Arc<[u8]> = beginning.into();
        let text = Cursor::new(Arc::clone(&start)).chain(input);
        let lines = Lines::new(BufReader::with_capacity(1 << 16, text));
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(layout.byte())
            .from_reader(NormalizedText::new(lines, layout, dialect.comment.as_deref()));
        let mut table = Self {
            file: file.to_owned(),
            header: Vec::new(),
            header_line: 1,
            reader,
            record: ByteRecord::new(),
            line: 1,
            style: CellStyle {
                delimiter: char::from(layout.byte()),
                decimal_comma: dialect.decimal_comma,
            },
            starts_with_row: false,
            date_order: DateOrder::Unknown,
            date_columns: None,
            appended: None,
            beginning: Beginning::new(start, layout, dialect.comment.clone()),
            decoded_line: None,
            last_cells: LastCells::default(),
        };
        if !table.advance()? {
            return Err(Location::file(file).at_line(1).error(TableErrorKind::EmptyTable));
        }
        table.header_line = table.line;
        let header_error = |kind| Location::file(file).at_line(table.line).error(kind);
        if table.record.len() > MAX_COLUMNS {
            let found = table.record.len();
            return Err(header_error(InputErrorKind::TooMany {
                what: "columns",
                found,
                most: MAX_COLUMNS,
            }));
        }
        if BYTE_ORDER_MARKS.iter().any(|mark| table.record.as_slice().starts_with(mark)) {
            return Err(header_error(InputErrorKind::Utf16));
        }
        for cell in &table.record {
            match std::str::from_utf8(cell.trim_ascii()) {
                Ok(name) if !name.contains('\0') => {
                    // A table that was put together or saved twice can have several marks.
                    let name = name.trim_matches('\u{feff}').trim();
                    table.header.push(unescape_cell(name).to_owned());
                }
                // A header that is not text cannot be shown.
                _ => return Err(header_error(InputErrorKind::HeaderNotUtf8)),
            }
        }
        if table.header.first().is_some_and(|first| first.starts_with('|')) {
            return Err(header_error(TableErrorKind::MarkdownTable.into()));
        }
        if is_row_of_numbers(&table.header, &dialect.columns) {
            table.header = (1..=table.header.len()).map(|place| format!("#{place}")).collect();
            table.starts_with_row = true;
        } else if let Some(found) = table.other_format(dialect) {
            return Err(Location::file(file).at_line(table.line).error(other_format(found)));
        }
        table.find_date_order(dialect);
        table.find_date_columns(dialect);
        if let [only] = table.header.as_slice()
            && let Some(found) = only.chars().find(|c| ";\t|".contains(*c))
        {
            return Err(table.error(TableErrorKind::OtherDelimiter { found }));
        }
        Ok(table)
    }

    /// Returns the format of the text if the header is no header of a table, but the first line of
    /// a file in another format.
    fn other_format(&self, dialect: &Dialect) -> Option<&'static str> {
        let has_column = |rule: &ColumnRule| match &rule.theirs {
            ColumnSelector::Name(name) => self.header.contains(name),
            ColumnSelector::Place(_) | ColumnSelector::File => false,
        };
        if dialect.columns.iter().any(has_column) {
            return None;
        }
        let line = self.header.join(" ") + "\n";
        let is_marked = line.starts_with(['<', '{', '[', '-', '%'])
            || self.header.iter().any(|cell| cell == "=");
        text_format(&line).filter(|format| {
            *format != TABLE && (is_marked || self.header.len() <= MAX_CELLS_OF_KEY)
        })
    }

    /// Reads the next row, which must have as many cells as the header; returns false at the end.
    pub fn next_row(&mut self) -> Result<bool, InputError> {
        self.detach_row();
        if !std::mem::take(&mut self.starts_with_row) && !self.advance()? {
            return Ok(false);
        }
        let expected = self.columns_before();
        if self.record.len() != expected {
            let found = self.record.len();
            if found < expected && !self.is_empty_row() && self.is_cut_here()? {
                return Err(self.error(TableErrorKind::RowCut { expected, found }));
            }
            return Err(self.error(if self.is_empty_row() {
                TableErrorKind::EmptyRow
            } else if let Some(mark) = self.comment_mark() {
                TableErrorKind::CommentRow { mark, found, expected }
            } else if found > expected && (expected..found).all(|place| self.cell(place).is_empty())
            {
                TableErrorKind::TrailingDelimiter { expected, found }
            } else if found < expected && self.is_line_of_words() {
                TableErrorKind::TextLine { expected, found }
            } else if let Some(other) = self.other_separator(expected) {
                TableErrorKind::SeparatedOtherwise { found: other, header: self.style.delimiter }
            } else {
                TableErrorKind::RowLength { expected, found }
            }));
        }
        if !self.record.as_slice().is_ascii() {
            for place in 0..self.record.len() {
                self.text(place)?;
            }
        }
        Ok(true)
    }

    /// Returns true if the current record is the last one of a file that ends without a line end.
    /// The record is kept.
    fn is_cut_here(&mut self) -> Result<bool, InputError> {
        let (line, record) = (self.line, self.record.clone());
        let is_last = !self.advance()?;
        (self.line, self.record) = (line, record);
        Ok(is_last && self.reader.get_ref().lines.has_added_line_end)
    }

    /// Reads the next record and its line number; returns false at the end.
    fn advance(&mut self) -> Result<bool, InputError> {
        let first = self.next_line();
        self.reader.get_mut().start_record();
        let found = self.reader.read_byte_record(&mut self.record).map_err(|error| {
            if matches!(error.kind(), csv::ErrorKind::Io(source) if source.kind() == io::ErrorKind::FileTooLarge) {
                let kind = InputErrorKind::LineTooLong { most: MAX_RECORD_KIB };
                return Location::file(&self.file).at_line(first).error(kind);
            }
            let source = io::Error::from(error);
            Location::file(&self.file).error(InputErrorKind::Unreadable { source })
        })?;
        if found {
            self.last_cells.count(&self.record);
            // Every record ends in a line feed. A record without one has a quote that is open to
            // the end of the file.
            self.line = self.next_line().saturating_sub(lines(self.record.as_slice()));
            if self.line < first {
                self.line = first;
                return Err(Location::file(&self.file)
                    .at_line(first)
                    .error(TableErrorKind::OpenQuote));
            }
            if !self.record.as_slice().is_ascii()
                && let Some(record) = decoded_record(&self.record)
            {
                self.record = record;
                self.decoded_line.get_or_insert(self.line);
            }
        }
        Ok(found)
    }

    /// Returns the warnings about the text of the file, after all rows have been read: lines that
    /// were decoded from Windows-1252, and a last number that the end of the file cuts.
    pub fn text_warnings(&self) -> impl Iterator<Item = Warning> {
        let decoded = self.decoded_line.map(|line| (line, WarningKind::ReadAsWindows1252));
        let is_cut =
            self.reader.get_ref().lines.has_added_line_end && self.last_cells.is_last_cut();
        let cut = is_cut.then_some((self.line, WarningKind::FileCut));
        decoded.into_iter().chain(cut).map(|(line, kind)| {
            let location = Location::file(&self.file).at_line(line);
            Warning { location, kind }
        })
    }

    /// Returns the number of the next line to read.
    fn next_line(&self) -> usize {
        usize::try_from(self.reader.position().line()).unwrap_or(usize::MAX)
    }

    /// Reads numbers with decimal points if the first rows show them, although the problem declares
    /// decimal commas. Two tables of one measurement may come from programs with different marks.
    pub fn find_decimal_mark(&mut self) {
        self.style.decimal_comma = self.style.decimal_comma && !self.beginning.has_decimal_points();
    }

    /// Returns the format of the cells in the column with index `place`.
    fn style_of(&self, place: usize) -> CellStyle {
        self.appended_at(place).map_or(self.style, |(appended, _)| appended.format.style)
    }

    /// Returns the order of day and month in dates of the column with index `place`.
    pub fn date_order(&self, place: usize) -> DateOrder {
        self.appended_at(place).map_or(self.date_order, |(appended, _)| appended.format.date_order)
    }

    /// Returns the cells of the current row.
    pub fn cells(&self) -> &ByteRecord {
        &self.record
    }

    /// Returns the line of the current row, counted from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Returns the line of the row that holds the cell in the column with index `place`: a row of
    /// the table, or of the joint table that is joined to it.
    pub fn line_of(&self, place: usize) -> usize {
        let row = self.appended_at(place).and_then(|(appended, _)| appended.row.as_ref());
        row.map_or(self.line, |row| row.line)
    }

    /// Returns a cell of the current row without surrounding white space; empty if there is none.
    pub(super) fn cell(&self, place: usize) -> &[u8] {
        self.record.get(place).unwrap_or_default().trim_ascii()
    }

    /// Returns a cell of the current row as text without surrounding white space.
    pub fn text(&self, place: usize) -> Result<&str, InputError> {
        std::str::from_utf8(self.cell(place))
            .map(unescape_cell)
            .map_err(|_| self.cell_error(place, InputErrorKind::NotUtf8))
    }

    /// Returns the usual mark of comments with which the current row begins, if there is one.
    fn comment_mark(&self) -> Option<&'static str> {
        ["//", "#", "%"].into_iter().find(|mark| self.cell(0).starts_with(mark.as_bytes()))
    }

    /// Returns true if the current row has only white space and separators.
    pub(super) fn is_empty_row(&self) -> bool {
        self.record.iter().all(|cell| cell.trim_ascii().is_empty())
    }

    /// Returns a cell of the current row as text that is not empty.
    pub fn non_empty_text(&self, place: usize) -> Result<&str, InputError> {
        let word = self.text(place)?;
        if word.is_empty() { Err(self.empty_cell(place)) } else { Ok(word) }
    }

    /// Returns a cell of the current row as a word without invisible characters.
    pub fn name(&self, place: usize) -> Result<&str, InputError> {
        let word = self.non_empty_text(place)?;
        match word.chars().find(|&character| is_hidden(character)) {
            Some(hidden) => {
                Err(self.cell_error(place, InputErrorKind::Hidden { code: hidden.into() }))
            }
            None => Ok(word),
        }
    }

    /// Returns a cell of the current row as a finite number.
    pub fn number(&self, place: usize) -> Result<f64, InputError> {
        let word = self.non_empty_text(place)?;
        let value = || shortened(word);
        let CellStyle { delimiter, decimal_comma } = self.style_of(place);
        let has_point = decimal_comma && delimiter != ',' && word.contains('.');
        if has_point && !is_spreadsheet_date(word) {
            return Err(self.cell_error(place, TableErrorKind::DecimalPoint { value: value() }));
        }
        let with_point = (decimal_comma && word.contains(',')).then(|| word.replace(',', "."));
        match with_point.as_deref().unwrap_or(word).parse::<f64>() {
            Ok(number) if number.abs() <= MAX_MAGNITUDE => Ok(number),
            Ok(number) if number.is_finite() => {
                Err(self.cell_error(place, InputErrorKind::MagnitudeTooLarge { value: value() }))
            }
            Ok(_) => Err(self.cell_error(place, InputErrorKind::NotFinite { value: value() })),
            Err(_) if is_spreadsheet_date(word) => {
                Err(self.cell_error(place, TableErrorKind::SpreadsheetDate { value: value() }))
            }
            Err(_) if is_spreadsheet_error(word) => {
                Err(self.cell_error(place, TableErrorKind::SpreadsheetError { value: value() }))
            }
            Err(_) if word == self.name_of(place) => {
                Err(self.error(TableErrorKind::HeaderRepeated))
            }
            Err(_) if !decimal_comma && has_thousands(word) => {
                Err(self.cell_error(place, TableErrorKind::ThousandsSeparator { value: value() }))
            }
            Err(_) if word.contains(',') && !decimal_comma && other_notation(word).is_none() => {
                Err(self.cell_error(place, TableErrorKind::DecimalComma { value: value() }))
            }
            Err(_) if self.is_unit_below_header(word) => {
                Err(self.cell_error(place, TableErrorKind::UnitRow { value: value() }))
            }
            Err(_) => Err(self.cell_error(
                place,
                match (unit_behind(word), other_notation(word), typographic(word)) {
                    (Some(unit), ..) => {
                        TableErrorKind::NumberWithUnit { value: value(), unit: unit.to_owned() }
                    }
                    (None, Some(notation), _) => notation,
                    (None, None, Some((found, remedy))) => {
                        TableErrorKind::Typographic { value: value(), found, remedy }
                    }
                    (None, None, None) => TableErrorKind::NotANumber { value: value() },
                },
            )),
        }
    }

    /// Returns true if the word is a unit, and the current row stands directly below the header.
    fn is_unit_below_header(&self, word: &str) -> bool {
        let unit = word.trim_matches(['[', ']', '(', ')', ' ']);
        self.line == self.header_line + 1 && UNITS.contains(&unit)
    }

    /// Returns the name in the header of the column with index `place`.
    pub fn name_of(&self, place: usize) -> &str {
        self.header.get(place).map_or("", String::as_str)
    }

    /// Creates an error about a cell of the current row.
    pub fn cell_error(&self, place: usize, kind: impl Into<InputErrorKind>) -> InputError {
        let name = self.name_of(place);
        self.location(Some(place)).with_key(format!("column {}", shortened(name))).error(kind)
    }

    /// Creates an error about a cell of the current row, or about the whole row without a cell.
    pub fn error_in(&self, place: Option<usize>, kind: impl Into<InputErrorKind>) -> InputError {
        match place {
            Some(place) => self.cell_error(place, kind),
            None => self.error(kind),
        }
    }

    /// Returns the location of a column in the header line, for errors.
    pub fn column(&self, name: &str) -> Location {
        let place = self.header.iter().position(|header| header == name);
        let appended = place.and_then(|place| self.appended_at(place));
        let (file, line) = appended.map_or((&self.file, self.header_line), |(appended, _)| {
            let (file, line) = &appended.format.header_place;
            (file, *line)
        });
        Location::file(file).at_line(line).with_key(format!("column {}", shortened(name)))
    }

    /// Creates an error about the whole current row.
    pub fn error(&self, kind: impl Into<InputErrorKind>) -> InputError {
        self.location(None).error(kind)
    }

    /// Returns the location of the current row, with its text and, if given, the cell to mark.
    fn location(&self, place: Option<usize>) -> Location {
        let partner = place.and_then(|place| {
            let (appended, place) = self.appended_at(place)?;
            Some((appended.row.as_ref()?, appended.format.style, place))
        });
        let (mut text, mut span) = (String::new(), None);
        let (cells, count, delimiter, place) = match partner {
            Some((row, style, place)) => {
                (&row.cells, row.cells.len(), style.delimiter, Some(place))
            }
            None => (&self.record, self.own_cells(), self.style.delimiter, place),
        };
        for (index, cell) in cells.iter().take(count).enumerate() {
            if index > 0 {
                text.push(delimiter);
            }
            let start = text.len();
            text.push_str(&String::from_utf8_lossy(cell));
            if place == Some(index) {
                span = Some(start..text.len());
            }
        }
        let span = span.unwrap_or(0..text.len());
        let (file, line) =
            partner.map_or((&self.file, self.line), |(row, ..)| (&row.file, row.line));
        let excerpt = Excerpt { text: Arc::from(text), first_line: line, span };
        Location { excerpt: Some(excerpt), ..Location::file(file).at_line(line) }
    }
}

/// Returns the first 40 characters of a text, with a mark if it is longer.
pub(super) fn shortened(text: &str) -> String {
    crate::error::shortened(text, 40)
}

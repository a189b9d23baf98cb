//! Rows of a joint table, and rows of a table with the cells of a joint row behind the others.

use std::path::Path;

use super::appended::{Appended, JointRow, JointTableFormat};
use super::table::Table;
use crate::error::Location;

/// Row of the joint table.
pub(super) struct LogRow {
    pub source: JointRow,
    /// Time of the row \[s\], for a join by time on the clock of the measurements; else NaN.
    pub time: f64,
    /// Number of measured rows whose partner this row is.
    pub uses: usize,
    /// Configuration, shape = (joints) \[rad\] or \[m\]; empty before it is read, and if a
    /// coordinate is missing.
    pub configuration: Vec<f64>,
}

impl LogRow {
    /// Returns the place of the row in its file.
    pub fn place(&self) -> Location {
        Location::file(&self.source.file).at_line(self.source.line)
    }
}

impl Table {
    /// Returns the format of the table as one whose columns are appended to another table.
    pub fn joint_table_format(&self) -> JointTableFormat {
        let header_place = (self.file.clone(), self.header_line);
        let (style, date_order, date_columns) = (self.style, self.date_order, self.date_columns);
        JointTableFormat { style, date_order, date_columns, header_place }
    }

    /// Appends the columns with the indices `places` of a joint table to the header, under the
    /// given names; [`append_row`](Self::append_row) fills them row by row.
    pub fn append_columns(
        &mut self,
        names: impl Iterator<Item = String>,
        places: Vec<usize>,
        format: JointTableFormat,
    ) {
        let columns_before = self.header.len();
        self.appended = Some(Appended { columns_before, places, format, row: None });
        self.header.extend(names);
    }

    /// Appends the cells of a row of the joint table to the current row.
    pub fn append_row(&mut self, row: &JointRow) {
        if let Some(appended) = &mut self.appended {
            for &place in &appended.places {
                self.record.push_field(row.cells.get(place).unwrap_or_default());
            }
            appended.row = Some(row.clone());
        }
    }

    /// Removes the cells of a row of the joint table from the current row.
    pub fn detach_row(&mut self) {
        if let Some(appended) = &mut self.appended
            && appended.row.take().is_some()
        {
            self.record.truncate(appended.columns_before);
        }
    }

    /// Returns the number of columns of the table itself.
    pub fn columns_before(&self) -> usize {
        self.appended.as_ref().map_or(self.header.len(), |appended| appended.columns_before)
    }

    /// Returns the number of cells in the current row that stand in the table itself.
    pub fn own_cells(&self) -> usize {
        let is_joined = |appended: &&Appended| appended.row.is_some();
        let joined = self.appended.as_ref().filter(is_joined);
        joined.map_or(self.record.len(), |appended| appended.columns_before)
    }

    /// Returns the appended columns and the index in the joint table, if the column with index
    /// `place` is one of them; `None` for a column of the table itself.
    pub fn appended_at(&self, place: usize) -> Option<(&Appended, usize)> {
        let appended = self.appended.as_ref()?;
        let index = place.checked_sub(appended.columns_before)?;
        Some((appended, *appended.places.get(index)?))
    }

    /// Returns the file of the appended columns of a joint table, and their names.
    pub fn appended_columns(&self) -> Option<(&Path, &[String])> {
        let appended = self.appended.as_ref()?;
        Some((&appended.format.header_place.0, self.header.get(appended.columns_before..)?))
    }
}

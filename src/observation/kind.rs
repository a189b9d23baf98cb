//! Description of a kind of rows (sensor type), which tables, results and messages use.

use crate::quantity::Unit;

/// Columns, units and words of one kind of rows.
#[derive(Debug)]
pub struct Kind {
    /// Name in files, results and messages.
    pub name: &'static str,
    /// Number of scalars that a row measures, at most three.
    pub numbers: usize,
    /// Unit of the measured scalars: a length, an angle or pixels.
    pub unit: Unit,
    /// Parts of the scene from which a row is predicted.
    pub needs: Needs,
    /// Columns of a row: first those that name its fixtures or frame, then its measured numbers.
    pub fields: &'static [Field],
    /// Declaration in `problem.toml` that gives the columns their meaning; empty if none is needed.
    pub declared_by: &'static str,
    /// Noun for the measured numbers, used in messages about planned rows that lack them.
    pub lacking: &'static str,
    /// Key of the group of residuals in results, such as `tilt`, and the names of their columns.
    pub residuals: (&'static str, &'static [&'static str]),
    /// Label and unit of the errors, in tables and plots.
    pub error_label: &'static str,
    /// Singular and plural noun for the rows, in messages.
    pub row: (&'static str, &'static str),
    /// Plural noun for the measured quantities, in messages.
    pub measured: &'static str,
    /// Columns and declarations to check if the model misfits all rows of this kind.
    pub suspects: &'static str,
}

/// Column of a kind of rows.
#[derive(Debug)]
pub struct Field {
    /// Name of the column, without the suffix of its unit.
    pub name: &'static str,
    /// Noun for the cell's content, with its article, for messages.
    pub noun: &'static str,
    /// Type of the cells.
    pub content: Content,
    /// True if every row of the kind fills the cell; planned rows may leave out their numbers.
    pub required: bool,
}

/// Type of the cells of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Name of a fixture; the table with the column's name declares it.
    Fixture,
    /// Number of a point of the fixture in the preceding column, counted from 0.
    Index,
    /// Name of a frame of the arm; the tool's frame if the cell is empty.
    Frame,
    /// Measured number; 0 if the cell is empty.
    Number(Unit),
    /// Measured number above 0.
    Positive(Unit),
}

/// Parts of a [`Scene`](super::Scene) from which a row is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Requires fixtures alone: the prediction does not depend on the arm's configuration.
    Fixtures,
    /// Requires the target, the base and fixtures.
    Target,
    /// Requires a frame of the arm, and gravity.
    Frame,
    /// Requires fixtures, the frames that carry them, and a point of the second fixture.
    Carriers,
}

impl Kind {
    /// Returns the column called `name`, if this kind of rows has it.
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// Returns the columns that name the fixtures or the frame of a row.
    pub fn references(&self) -> impl Iterator<Item = &'static Field> + use<> {
        self.fields.iter().filter(|field| field.unit().is_none())
    }

    /// Returns the columns of the measured numbers.
    pub fn measured_fields(&self) -> impl Iterator<Item = &'static Field> + use<> {
        self.fields.iter().filter(|field| field.unit().is_some())
    }
}

impl Field {
    /// Creates a column that every row fills.
    pub(super) const fn new(name: &'static str, noun: &'static str, content: Content) -> Self {
        Self { name, noun, content, required: true }
    }

    /// Returns the column with optional cells.
    pub(super) const fn optional(self) -> Self {
        Self { required: false, ..self }
    }

    /// Returns the unit of a measured number; `None` for other columns.
    pub fn unit(&self) -> Option<Unit> {
        match self.content {
            Content::Number(unit) | Content::Positive(unit) => Some(unit),
            Content::Fixture | Content::Index | Content::Frame => None,
        }
    }
}

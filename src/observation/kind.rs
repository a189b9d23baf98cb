//! Description of a kind of rows, which tables, results and messages follow.

use crate::quantity::Unit;

/// Columns, units and words of one kind of rows.
#[derive(Debug)]
pub struct Kind {
    /// Name in files, results and messages.
    pub name: &'static str,
    /// Count of numbers that a row measures, at most three.
    pub numbers: usize,
    /// Unit of these numbers: a length or an angle.
    pub unit: Unit,
    /// Parts of the scene that predict a row.
    pub needs: Needs,
    /// Column that names the fixture or frame measured against; empty if there is none.
    pub reference: &'static str,
    /// Group and columns of the residuals in tables of results.
    pub residuals: (&'static str, &'static [&'static str]),
    /// Label and unit of the errors, in tables and plots.
    pub error_label: &'static str,
    /// Singular and plural noun for the rows, in messages.
    pub row: (&'static str, &'static str),
    /// Plural noun for the measured quantities, in messages.
    pub measured: &'static str,
    /// Entries of the table to check if the model misses all rows of this kind.
    pub suspects: &'static str,
}

/// Parts of a [`Scene`](super::Scene) that predict a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Fixtures alone: the arm's configuration has no part in the prediction.
    Fixtures,
    /// Target, base and fixtures.
    Target,
    /// Frame of the arm and gravity.
    Frame,
}

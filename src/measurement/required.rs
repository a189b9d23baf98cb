//! Check for the columns that rows other than positions need.

use super::columns::Columns;
use super::role::{Role, is_declared, only_fixture};
use super::table::Table;
use crate::error::{InputError, TableErrorKind, nearest};
use crate::observation::{Content, Field, kinds};
use crate::problem::Problem;

impl Columns {
    /// Checks that every declared kind of rows of which the table has some columns has all columns
    /// that it needs. Errors suggest similar names among the `unknown` columns.
    pub fn require_fields(
        &self,
        table: &Table,
        problem: &Problem,
        measured: bool,
        unknown: &[&str],
    ) -> Result<(), InputError> {
        let near = |name: &str| nearest(name, unknown).map(|near| (*near).to_owned());
        let has_field = |field: &&Field| self.has(Role::Field(field.name));
        let declared = kinds().filter(|kind| is_declared(kind, problem));
        for kind in declared.filter(|kind| !kind.declared_by.is_empty()) {
            let has_number = kind.measured_fields().any(|field| has_field(&field));
            let is_named = kind.references().any(|field| {
                field.required && field.content != Content::Index && has_field(&field)
            });
            let lacks = |field: &&Field| {
                let is_needed = field.unit().is_none() || has_number || (measured && is_named);
                field.required
                    && is_needed
                    && !has_field(field)
                    && only_fixture(field, problem).is_none()
            };
            if !has_number && !is_named {
                continue;
            }
            if let Some(field) = kind.fields.iter().find(lacks) {
                let foreign =
                    field.unit().and_then(|unit| self.in_foreign_unit(table, field.name, unit));
                if let Some(error) = foreign {
                    return Err(error);
                }
                let write = field.unit().map_or(field.name.to_owned(), |unit| {
                    format!("{}_{}", field.name, unit.in_tables().suffix)
                });
                let strangers = unknown.iter().map(|name| (*name).to_owned()).collect();
                let (column, near) = (table.column(&write), near(&write));
                let kind = TableErrorKind::MissingColumn { write, near, unknown: strangers };
                return Err(column.error(kind));
            }
        }
        Ok(())
    }
}

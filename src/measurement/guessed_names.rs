//! Guesses what the columns of a table without the expected names are, for messages about missing
//! columns.

use std::collections::BTreeSet;

use super::columns::Columns;
use super::foreign_name::guess;
use super::meaning::{Numbering, split_unit, unit_of};
use super::role::{POSITION, Role};
use super::table::Table;
use crate::error::{InputError, Location, TableErrorKind, Warning, WarningKind};
use crate::problem::{JointSource, Problem};
use crate::quantity::Unit;

impl Columns {
    /// Returns the `unknown` columns without those of words, which are no joints and no positions.
    pub fn of_numbers(&self, unknown: &[&str], table: &Table) -> Vec<String> {
        let unknown: BTreeSet<&str> = unknown.iter().copied().collect();
        let words = table.beginning.word_columns();
        let is_chosen =
            |(place, name): &(usize, &str)| unknown.contains(name) && !words.contains(place);
        let names = self.names().enumerate().filter(is_chosen);
        names.map(|(_, name)| name.to_owned()).collect()
    }

    /// Returns the error that names all missing columns at once, with the map of the `unknown`
    /// columns that are probably meant; or that joints are counted from 2. `None` if one column is
    /// missing, or a missing column of joints or positions is not among the unknown ones.
    pub fn renamed(
        &self,
        table: &Table,
        (problem, numbering): (&Problem, &Numbering),
        (measured, unknown): (bool, &[&str]),
    ) -> Option<InputError> {
        if let Some(error) = self.of_another_table(table, problem, (measured, unknown)) {
            return Some(error);
        }
        if problem.data.joints == JointSource::Read {
            return None;
        }
        let commanded = problem.joints.iter().enumerate();
        let commanded =
            commanded.filter_map(|(index, joint)| Some((index, unit_of(joint.command_kind())?)));
        let commanded: Vec<(usize, Unit)> = commanded.collect();
        let header = || table.header.iter().map(String::as_str);
        let has = |number: usize| header().any(|name| split_unit(name).0 == format!("q{number}"));
        let count = commanded.len();
        let are_read = commanded.iter().all(|(index, _)| self.has(Role::Joint(*index)));
        if count > 1 && !are_read && !has(1) && (2..=count + 1).all(has) && !has(count + 2) {
            let kind = TableErrorKind::JointsFromTwo {
                first: "q2".to_owned(),
                last: format!("q{}", count + 1),
            };
            let location = Location { key: None, ..table.column("") };
            return Some(location.error(kind));
        }
        let joints = commanded.iter().filter(|(index, _)| !self.has(Role::Joint(*index)));
        let mut missing: Vec<(String, Unit)> =
            joints.map(|(index, unit)| (format!("q{}", numbering.number(*index)), *unit)).collect();
        let axes = POSITION.into_iter().zip(["x", "y", "z"]).filter(|(role, _)| !self.has(*role));
        if measured && !self.observes() {
            missing.extend(axes.map(|(_, name)| (name.to_owned(), Unit::Length)));
        }
        // The message about a single column names the similar one.
        if missing.len() < 2 {
            return None;
        }
        let mut map = Vec::new();
        for (base, unit) in &missing {
            let suffix = if *unit == Unit::Length { "mm" } else { "deg" };
            let found = unknown.iter().find_map(|theirs| {
                let (guessed, written) = guess(theirs).filter(|(guessed, _)| guessed == base)?;
                let fits = written.is_none_or(|written| unit.suffix(written).is_some());
                fits.then(|| (*theirs, format!("{guessed}_{}", written.unwrap_or(suffix))))
            });
            map.push(found?);
        }
        let (section, map) = map_of(&map, problem);
        let missing: Vec<String> = missing.into_iter().map(|(base, _)| base).collect();
        let kind = TableErrorKind::MissingColumns { missing, section, map };
        let location = Location { key: None, ..table.column("") };
        Some(location.error(kind))
    }
}

/// Returns the section of a problem file, and what to write there so that each column of another
/// program is read under its name in flexcal.
fn map_of(map: &[(&str, String)], problem: &Problem) -> (&'static str, String) {
    let entries: Vec<String> =
        map.iter().map(|(theirs, ours)| format!("\"{theirs}\" = \"{ours}\"")).collect();
    if problem.data.dialect.columns.is_empty() {
        ("[data]", format!("columns = {{ {} }}", entries.join(", ")))
    } else {
        ("[data.columns]", format!("the lines {}", entries.join(" and ")))
    }
}

impl Columns {
    /// Returns a warning if a table of poses that need not be measured has no column of positions,
    /// but `unknown` ones of numbers that are probably x, y and z.
    ///
    /// # Errors
    /// Returns an error if one of them is in a unit that tables cannot have.
    pub fn unread_positions(
        &self,
        table: &Table,
        problem: &Problem,
        unknown: &[&str],
    ) -> Result<Option<Warning>, InputError> {
        let axes = ["x", "y", "z"];
        if self.observes() || POSITION.into_iter().any(|role| self.has(role)) {
            return Ok(None);
        }
        let foreign = axes.iter().find_map(|axis| self.in_foreign_unit(table, axis, Unit::Length));
        if let Some(error) = foreign {
            return Err(error);
        }
        let names = self.of_numbers(unknown, table);
        let of_axis = |axis: &&str| {
            let found = names.iter().find_map(|theirs| {
                Some((theirs.as_str(), guess(theirs).filter(|(guessed, _)| guessed == axis)?.1))
            });
            let (theirs, unit) = found?;
            Some((theirs, format!("{axis}_{}", unit.unwrap_or("mm"))))
        };
        let map: Option<Vec<(&str, String)>> = axes.iter().map(of_axis).collect();
        Ok(map.map(|map| {
            let (section, map) = map_of(&map, problem);
            let location = Location { key: None, ..table.column("") };
            Warning { location, kind: WarningKind::PositionsNotRead { section, map } }
        }))
    }

    /// Returns the error of a table that has no column of joints or measurements, nor an `unknown`
    /// one of numbers; `None` for other tables.
    fn of_another_table(
        &self,
        table: &Table,
        problem: &Problem,
        (measured, unknown): (bool, &[&str]),
    ) -> Option<InputError> {
        let joints = 0..problem.joints.len();
        let has_joint = joints
            .into_iter()
            .any(|index| self.has(Role::Joint(index)) || self.has(Role::Reading(index)));
        let has_position = POSITION.into_iter().any(|role| self.has(role));
        let is_unlike = |name: &&str| guess(name).is_none();
        if has_joint
            || has_position
            || self.observes()
            || unknown.len() < 2
            || !unknown.iter().all(is_unlike)
            || !self.of_numbers(unknown, table).is_empty()
        {
            return None;
        }
        let count = problem.joints.iter().filter(|joint| joint.takes_command()).count();
        let joints =
            if count > 1 { format!("q1_deg … q{count}_deg") } else { "q1_deg".to_owned() };
        let measured =
            if measured { " and what was measured, such as x_mm, y_mm, z_mm" } else { "" };
        let found = unknown.iter().take(8).map(|name| crate::error::shortened(name, 40)).collect();
        let kind = TableErrorKind::NoneOfColumns { found, needed: format!("{joints}{measured}") };
        Some(Location { key: None, ..table.column("") }.error(kind))
    }
}

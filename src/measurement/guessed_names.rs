//! Guesses what the columns of a table without the expected names are, for messages about missing
//! columns.

use std::collections::BTreeSet;

use super::columns::Columns;
use super::meaning::{Numbering, split_unit, unit_of};
use super::role::{POSITION, Role};
use super::table::Table;
use crate::error::{InputError, Location, TableErrorKind};
use crate::problem::{JointSource, Problem};
use crate::quantity::Unit;

/// Words that other programs write before the number of a joint.
const JOINT_WORDS: [&str; 12] =
    ["j", "q", "a", "ax", "axis", "axe", "achse", "joint", "jt", "gelenk", "theta", "th"];
/// Words that other programs write before the letter of a coordinate.
const POSITION_WORDS: [&str; 10] =
    ["", "pos", "position", "p", "tcp", "target", "point", "meas", "measured", "coord"];

/// Returns a name of flexcal without its unit, such as `q2` or `x`, that a name of another program
/// means, and the suffix of the unit if the name has one.
fn guess(name: &str) -> Option<(String, Option<&'static str>)> {
    let lower = name.to_lowercase();
    let words = lower.split(|letter: char| !letter.is_alphanumeric());
    let (mut unit, mut plain) = (None, String::new());
    for word in words.filter(|word| !word.is_empty()) {
        match word {
            "mm" | "millimeter" | "millimetre" => unit = Some("mm"),
            "m" | "meter" | "metre" => unit = Some("m"),
            "deg" | "degree" | "degrees" | "grad" => unit = Some("deg"),
            "rad" | "radian" | "radians" => unit = Some("rad"),
            word => plain.push_str(word),
        }
    }
    unit = unit.or_else(|| name.contains('°').then_some("deg"));
    let letters = plain.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let number = plain.strip_prefix(letters)?.trim_start_matches('0');
    if !number.is_empty() {
        return JOINT_WORDS.contains(&letters).then(|| (format!("q{number}"), unit));
    }
    let axis = ["x", "y", "z"].into_iter().find(|axis| letters.ends_with(axis))?;
    let before = letters.strip_suffix(axis)?;
    POSITION_WORDS.contains(&before).then(|| (axis.to_owned(), unit))
}

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
        let (section, entries): (_, Vec<String>) = (
            if problem.data.dialect.columns.is_empty() { "[data]" } else { "[data.columns]" },
            map.iter().map(|(theirs, ours)| format!("\"{theirs}\" = \"{ours}\"")).collect(),
        );
        let map = if section == "[data]" {
            format!("columns = {{ {} }}", entries.join(", "))
        } else {
            format!("the lines {}", entries.join(" and "))
        };
        let missing: Vec<String> = missing.into_iter().map(|(base, _)| base).collect();
        let kind = TableErrorKind::MissingColumns { missing, section, map };
        let location = Location { key: None, ..table.column("") };
        Some(location.error(kind))
    }
}

impl Columns {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_programs_are_recognised() {
        for (name, base, unit) in [
            ("J1 [deg]", "q1", Some("deg")),
            ("A06", "q6", None),
            ("Axis 3 (rad)", "q3", Some("rad")),
            ("theta_2", "q2", None),
            ("X (mm)", "x", Some("mm")),
            ("TCP.z [m]", "z", Some("m")),
        ] {
            assert_eq!(guess(name), Some((base.to_owned(), unit)), "{name}");
        }
        for name in ["Name", "RMS", "Timestamp", "Point 3", "rx", "max", "dx1"] {
            assert_eq!(guess(name), None, "{name}");
        }
    }
}

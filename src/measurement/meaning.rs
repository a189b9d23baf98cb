//! Meaning of the names of columns.

use std::collections::BTreeSet;
use std::convert::identity;

use super::foreign_name::guess;
use super::join_key::TIME_UNITS;
use super::role::{POINT, Role, columns_with_unit, columns_without_unit};
use crate::error::{InputError, InputErrorKind, TableErrorKind, WarningKind, nearest};
use crate::problem::{Joint, JointKind, Problem};
use crate::quantity::Unit;

/// Meaning of a column's name.
pub(super) enum Meaning {
    /// Role of a column that is read, with the conversion of its numbers to SI units.
    Read(Role, fn(f64) -> f64),
    /// Column that is ignored, with the warning about it.
    Ignored(WarningKind),
    /// Name without a meaning in this problem.
    Unknown,
}

/// Names of columns that probably hold a quaternion beside joint angles with a unit.
const QUATERNION: [&str; 4] = ["q1", "q2", "q3", "q4"];

/// Assignment of the numbers in column names (`q2`) to joints.
pub(super) struct Numbering {
    /// Index of the joint of each number; number 1 is element 0.
    joints: Vec<usize>,
    /// Name of a column of angles such as `q1_deg`, if q1, q2, q3 and q4 without a unit stand beside
    /// it: they are probably a quaternion.
    beside_quaternion: Option<&'static str>,
}

impl Numbering {
    /// Chooses the numbering that fits the column names: numbers count all joints, or only the
    /// joints that take a command.
    pub fn detect<'a>(names: impl Iterator<Item = &'a str>, problem: &Problem) -> Self {
        let names: BTreeSet<&str> = names.collect();
        let angle = ["q1_deg", "q1_rad"].into_iter().find(|angle| names.contains(angle));
        let is_quaternion = QUATERNION.iter().all(|plain| names.contains(plain));
        let beside_quaternion = angle.filter(|_| is_quaternion);
        let numbers = names.iter().filter_map(|name| numbered(split_unit(name).0, "q"));
        let numbers: Vec<usize> = numbers.collect();
        let by_joint = || (0..problem.joints.len()).collect::<Vec<_>>();
        let moving = problem.joints.iter().enumerate().filter(|(_, joint)| joint.takes_command());
        let moving: Vec<usize> = moving.map(|(index, _)| index).collect();
        let by_number = moving.iter().all(|index| numbers.contains(&(index + 1)));
        let by_order = (1..=moving.len()).all(|number| numbers.contains(&number))
            && numbers.iter().all(|number| (1..=moving.len()).contains(number));
        let joints = if !by_number && by_order { moving } else { by_joint() };
        Self { joints, beside_quaternion }
    }

    /// Returns the index of the joint with a number, from 1; `None` if there is none.
    pub fn joint(&self, number: usize) -> Option<usize> {
        self.joints.get(number.checked_sub(1)?).copied()
    }

    /// Returns the number, from 1, of the joint with an index.
    pub fn number(&self, joint: usize) -> usize {
        self.joints.iter().position(|&index| index == joint).unwrap_or(joint) + 1
    }

    /// Returns the column name that an unknown name probably means, among those that the table
    /// lacks; `None` if none is similar.
    pub fn meant(&self, name: &str, present: &BTreeSet<&str>, problem: &Problem) -> Option<String> {
        if let Some(meant) = self.guessed(name, problem) {
            return Some(meant).filter(|meant| !present.contains(split_unit(meant).0));
        }
        let moving = || {
            problem
                .joints
                .iter()
                .enumerate()
                .filter_map(|(k, joint)| Some((k, joint, unit_of(joint.command_kind())?)))
        };
        let joints = moving().map(|(index, _, unit)| (self.number(index), unit));
        let named = moving().map(|(_, joint, unit)| (joint.name.clone(), unit));
        let plain = columns_without_unit()
            .filter(|(_, role)| role.is_known_to(problem))
            .map(|(name, _)| name.to_owned());
        let approach = joints.clone().map(|(number, _)| format!("approach{number}"));
        let measured = columns_with_unit().filter(|(_, role, ..)| role.is_known_to(problem));
        let measured = measured.map(|(base, _, unit, _)| (base.to_owned(), unit));
        let measured = measured.chain(joints.map(|(number, unit)| (format!("q{number}"), unit)));
        let measured = measured
            .chain(named)
            .flat_map(|(base, unit)| unit.spellings(&base).collect::<Vec<_>>());
        let lacking = |name: &String| !present.contains(split_unit(name).0);
        nearest(name, plain.chain(approach).chain(measured).filter(lacking))
    }

    /// Returns the column of a joint or coordinate that a name of another program means, such as
    /// `q1_deg` for `joint1_deg`; `None` for other names.
    fn guessed(&self, name: &str, problem: &Problem) -> Option<String> {
        let (base, written) = guess(name).filter(|(base, _)| base != name)?;
        let unit = match numbered(&base, "q") {
            Some(number) => unit_of(problem.joints.get(self.joint(number)?)?.command_kind())?,
            None => Unit::Length,
        };
        let written = written.unwrap_or(unit.in_tables().suffix);
        unit.suffix(written).is_some().then(|| format!("{base}_{written}"))
    }

    /// Returns the meaning of a column with the velocity of a joint, such as `qd1_deg_per_s`; `None` for
    /// other columns.
    fn velocity(&self, name: &str, problem: &Problem) -> Option<Result<Meaning, InputErrorKind>> {
        let (base, suffix) = split_unit(name);
        let number = numbered(base, "qd")?;
        let unit = |joint: &usize| unit_of(problem.joints.get(*joint)?.command_kind());
        let Some((joint, unit)) = self.joint(number).and_then(|of| Some((of, unit(&of)?))) else {
            return Some(Ok(Meaning::Ignored(joint_ignored(problem, number))));
        };
        // "qd" is also written for desired angles.
        let of_second = suffix?.strip_suffix("_per_s")?;
        let per_second = unit.suffix(of_second);
        Some(match per_second {
            Some(suffix) => Ok(Meaning::Read(Role::Velocity(joint), suffix.to_si)),
            None => Err(InputErrorKind::NeedsUnit {
                noun: "a velocity",
                write: unit
                    .spellings(base)
                    .map(|of| of + "_per_s")
                    .collect::<Vec<_>>()
                    .join(" or "),
            }),
        })
    }

    /// Returns the meaning of a column's name; an error if its unit is missing or wrong.
    pub fn recognise(&self, name: &str, problem: &Problem) -> Result<Meaning, InputErrorKind> {
        if let Some(meaning) = by_joint_name(name, problem) {
            return meaning;
        }
        let plain = |role| Ok(Meaning::Read(role, identity));
        if let Some((_, role)) =
            columns_without_unit().find(|(known, role)| *known == name && role.is_known_to(problem))
        {
            return plain(role);
        }
        if let Some(number) = numbered(name, "approach") {
            let moves =
                |&joint: &usize| problem.joints.get(joint).is_some_and(Joint::takes_command);
            return match self.joint(number).filter(moves) {
                Some(joint) => plain(Role::Approach(joint)),
                None => Ok(Meaning::Ignored(joint_ignored(problem, number))),
            };
        }
        if let Some(velocity) = self.velocity(name, problem) {
            return velocity;
        }
        let underscored = columns_with_unit().filter(|(known, ..)| known.contains('_'));
        if let Some((base, role, unit, _)) = underscored
            .filter(|(known, role, ..)| name.starts_with(known) && role.is_known_to(problem))
            .last()
        {
            let suffix = name.strip_prefix(base).and_then(|suffix| suffix.strip_prefix('_'));
            let needed =
                || InputErrorKind::NeedsUnit { noun: unit.noun(), write: unit.alternatives(base) };
            let suffix = suffix.and_then(|suffix| unit.suffix(suffix)).ok_or_else(needed)?;
            return Ok(Meaning::Read(role, suffix.to_si));
        }
        let (base, suffix) = split_unit(name);
        let reading = suffix
            .and_then(|suffix| suffix.strip_prefix("read_"))
            .filter(|_| numbered(base, "q").is_some());
        let suffix = reading.or(suffix);
        let measured = columns_with_unit()
            .find(|(known, role, ..)| *known == base && role.is_known_to(problem));
        let (role, unit, strict) = if let Some((_, role, unit, strict)) = measured {
            (role, unit, strict)
        } else {
            let Some(number) = numbered(base, "q") else { return Ok(Meaning::Unknown) };
            let joint = self.joint(number);
            let Some((joint, unit)) = joint.and_then(|joint| {
                Some((joint, unit_of(problem.joints.get(joint)?.command_kind())?))
            }) else {
                return Ok(Meaning::Ignored(joint_ignored(problem, number)));
            };
            (if reading.is_some() { Role::Reading(joint) } else { Role::Joint(joint) }, unit, true)
        };
        let write = || {
            unit.alternatives(&if reading.is_some() {
                format!("{base}_read")
            } else {
                base.to_owned()
            })
        };
        let is_unit = |(unit, _): &&(&str, _)| role == Role::Time && suffix == Some(*unit);
        if let Some((_, to_si)) = TIME_UNITS.iter().find(is_unit) {
            return Ok(Meaning::Read(role, *to_si));
        }
        match suffix {
            Some(suffix) => match unit.suffix(suffix) {
                Some(suffix) => Ok(Meaning::Read(role, suffix.to_si)),
                None if strict && Unit::all_suffixes().any(|known| known == suffix) => {
                    Err(InputErrorKind::WrongUnit {
                        noun: unit.noun(),
                        suffix: suffix.to_owned(),
                        write: write(),
                    })
                }
                None => {
                    let write = write() + &conversion(unit, suffix);
                    Ok(Meaning::Ignored(WarningKind::UnitIgnored { write }))
                }
            },
            None if role == Role::Time => Ok(Meaning::Read(Role::Time, DATE_CONVERSION)),
            None if strict => {
                let quaternion = self.beside_quaternion.filter(|_| QUATERNION.contains(&name));
                let write = quaternion.map_or_else(write, |angle| {
                    format!(
                        "qx, qy, qz and qw in their order if q1 to q4 are a quaternion, as they \
                         seem to be beside {angle}"
                    )
                });
                Err(InputErrorKind::NeedsUnit { noun: unit.noun(), write })
            }
            None => Ok(Meaning::Ignored(WarningKind::UnitIgnored { write: write() })),
        }
    }
}

/// Returns the role if the name of a file may be its value in every row: session, target or point.
/// Returns an error for other roles.
pub(super) fn word_of_row(role: Role) -> Result<Role, InputErrorKind> {
    match role {
        Role::Session | Role::Target | POINT => Ok(role),
        _ => Err(TableErrorKind::UnknownMeaning { meant: Some("session".to_owned()) }.into()),
    }
}

/// Conversion of a column `time` without a unit. Its cells must be dates, so numbers become NaN.
const DATE_CONVERSION: fn(f64) -> f64 = |_| f64::NAN;

/// Returns the meaning of a column named after a joint, such as `shoulder_pan_joint_rad`. `None`
/// for other columns, and for a joint name that several joints or another column have.
fn by_joint_name(name: &str, problem: &Problem) -> Option<Result<Meaning, InputErrorKind>> {
    let base = split_unit(name).0;
    let other =
        columns_without_unit().any(|(known, _)| known == name) || numbered(base, "q").is_some();
    let measured = columns_with_unit().find(|(known, ..)| *known == base);
    if other
        || measured
            .is_some_and(|(known, _, unit, _)| unit.spellings(known).any(|spelled| spelled == name))
    {
        return None;
    }
    let joint_of = |name: &str| {
        let mut joints = problem.joints.iter().enumerate().filter(|(_, joint)| joint.name == name);
        joints.next().filter(|_| joints.next().is_none())
    };
    let unit = |(index, joint): (usize, &Joint)| Some((index, unit_of(joint.command_kind())?));
    if let Some((_, unit)) = joint_of(name).and_then(unit) {
        return Some(Err(InputErrorKind::NeedsUnit {
            noun: unit.noun(),
            write: unit.alternatives(name),
        }));
    }
    let (base, suffix) = name.rsplit_once('_')?;
    let (index, unit) = joint_of(base).and_then(unit)?;
    match unit.suffix(suffix) {
        Some(suffix) => Some(Ok(Meaning::Read(Role::Joint(index), suffix.to_si))),
        None if Unit::all_suffixes().any(|known| known == suffix) => {
            let (suffix, write) = (suffix.to_owned(), unit.alternatives(base));
            Some(Err(InputErrorKind::WrongUnit { noun: unit.noun(), suffix, write }))
        }
        None => None,
    }
}

/// Returns true if the column with the name `meant` may change the results of a fit. Pose names do
/// not, and orientations are not considered.
pub(super) fn affects_results(meant: &str) -> bool {
    let base = split_unit(meant).0;
    base != "pose"
        && !columns_with_unit().any(|(known, role, ..)| known == base && role.is_orientation())
}

/// Returns the unit of a joint's coordinate, or `None` for a fixed joint.
pub(super) fn unit_of(joint: JointKind) -> Option<Unit> {
    match joint {
        JointKind::Revolute => Some(Unit::Angle),
        JointKind::Prismatic => Some(Unit::Length),
        JointKind::Fixed => None,
    }
}

/// Returns the conversion of the numbers of a column with another unit, for a message; empty if the
/// unit is unknown.
fn conversion(unit: Unit, suffix: &str) -> String {
    let symbol = unit.in_tables().suffix;
    match (suffix, unit.convert_foreign(suffix, 1.0)) {
        (_, Some(factor)) => format!(" and convert the numbers: 1 {suffix} is {factor} {symbol}"),
        ("F", None) if symbol == "C" => " and convert the numbers: °C = (°F − 32) / 1.8".to_owned(),
        ("K", None) if symbol == "C" => " and subtract 273.15 from the numbers".to_owned(),
        _ => String::new(),
    }
}

/// Splits a column name into base and unit suffix: `q1_deg` into `q1` and `deg`.
pub(super) fn split_unit(name: &str) -> (&str, Option<&str>) {
    name.split_once('_').map_or((name, None), |(base, suffix)| (base, Some(suffix)))
}

/// Returns the column of the position or of a joint that is missing in a header beside `name`, if
/// there is just one. `present` are the names of the header without their units.
pub(super) fn lacking_neighbour(
    name: &str,
    present: &BTreeSet<&str>,
    problem: &Problem,
) -> Option<String> {
    let (base, Some(unit)) = split_unit(name) else { return None };
    let bases: Vec<String> = if ["x", "y", "z"].contains(&base) {
        ["x", "y", "z"].map(str::to_owned).to_vec()
    } else {
        let commanded = (1..).zip(&problem.joints);
        commanded
            .filter(|(_, joint)| unit_of(joint.command_kind()).is_some())
            .map(|(number, _)| format!("q{number}"))
            .collect()
    };
    let mut missing = bases.iter().filter(|other| !present.contains(other.as_str()));
    match (bases.iter().any(|known| known == base), missing.next(), missing.next()) {
        (true, Some(missing), None) => Some(format!("{missing}_{unit}")),
        _ => None,
    }
}

/// Adds the reason why encoder readings are needed to the error of a missing column; `suffix` is
/// that of their column names, empty for commands.
pub(super) fn asked_for_readings(error: InputError, suffix: &str) -> InputError {
    match *error.kind {
        InputErrorKind::Table(TableErrorKind::MissingColumn { write, near, unknown })
            if !suffix.is_empty() =>
        {
            let write = format!(
                "{write}, or write joints = \"commanded\" in [data], because \"read\" asks for \
                 encoder readings"
            );
            error.location.error(TableErrorKind::MissingColumn { write, near, unknown })
        }
        kind => error.location.error(kind),
    }
}

/// Returns true for the name of a numbered joint or of a coordinate with a unit, such as `q1_deg`
/// or `x_mm`. Such names occur in the header of every table of flexcal.
pub(super) fn is_numbered_or_position(name: &str) -> bool {
    let (base, Some(_)) = split_unit(name) else { return false };
    numbered(base, "q").is_some() || ["x", "y", "z"].contains(&base)
}

/// Returns the number after `prefix` in a column name: 12 in `q12`.
fn numbered(name: &str, prefix: &str) -> Option<usize> {
    let number = name.strip_prefix(prefix)?;
    if number.bytes().all(|byte| byte.is_ascii_digit()) { number.parse().ok() } else { None }
}

/// Returns the warning that the column of a joint, counted from 1, is ignored because it is fixed.
fn joint_ignored(problem: &Problem, joint: usize) -> WarningKind {
    let moves = |joint: &usize| problem.joints.get(joint - 1).is_some_and(Joint::takes_command);
    // In standard form, the last joint is the flange, which no [[joint]] declares.
    let declared = problem.joints.len() - usize::from(problem.standard_rows().is_some());
    WarningKind::JointIgnored { joint, declared, moving: (1..=declared).filter(moves).collect() }
}

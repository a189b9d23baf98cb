//! What the columns of a table stand for.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::identity;

use super::table::Table;
use crate::error::{InputError, InputErrorKind, Warning, WarningKind, nearest, one_typo};
use crate::problem::{HeldOut, JointKind, Problem};
use crate::quantity::Unit;

/// What a column stands for; joints and axes count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Joint(usize),
    Position(usize),
    Sigma,
    Payload,
    Hoist,
    Temperature,
    Time,
    Approach(usize),
    Orientation(usize),
    Split,
    Session,
    Target,
    Pose,
}

/// Unknown columns of which is asked what they are meant to be; who has more means none.
const ASKED: usize = 100;

/// Columns without a unit.
const PLAIN: [(&str, Role); 4] =
    [("split", Role::Split), ("session", Role::Session), ("target", Role::Target), ("pose", Role::Pose)];

/// Columns with a unit, and whether they need one: a column such as `time` may be about something else.
const MEASURED: [(&str, Role, Unit, bool); 11] = [
    ("x", Role::Position(0), Unit::Length, true),
    ("y", Role::Position(1), Unit::Length, true),
    ("z", Role::Position(2), Unit::Length, true),
    ("sigma", Role::Sigma, Unit::Length, true),
    ("rx", Role::Orientation(0), Unit::Angle, true),
    ("ry", Role::Orientation(1), Unit::Angle, true),
    ("rz", Role::Orientation(2), Unit::Angle, true),
    ("payload", Role::Payload, Unit::Mass, false),
    ("hoist", Role::Hoist, Unit::Force, false),
    ("temperature", Role::Temperature, Unit::Temperature, false),
    ("time", Role::Time, Unit::Time, false),
];

/// A column that is read.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub role: Role,
    /// Place in the row, from 0.
    pub place: usize,
    /// Conversion to the SI unit.
    pub to_si: fn(f64) -> f64,
}

/// The columns of one file.
pub(super) struct Columns {
    /// Columns in the order of their roles.
    pub read: Vec<Column>,
    /// Place of the column that marks held-out rows.
    pub marked: Option<usize>,
}

impl Columns {
    /// Finds the columns in a header; what nobody knows is a warning. Positions and the column of held-out rows need not be
    /// there unless the poses are `measured`.
    pub fn find(
        table: &Table,
        problem: &Problem,
        measured: bool,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, InputError> {
        let marked_name = match &problem.data.held_out {
            Some(HeldOut::Column(name)) => Some(name.as_str()),
            None => Some("split"),
            Some(_) => None,
        };
        let numbering = Numbering::of(&table.header, problem);
        let there: BTreeSet<&str> = table.header.iter().map(|name| split_unit(name).0).collect();
        let mut found: BTreeMap<Role, &str> = BTreeMap::new();
        let mut names = BTreeSet::new();
        let mut columns = Self { read: Vec::new(), marked: None };
        let (mut unknown, mut mistyped) = (Vec::new(), None);
        for (place, name) in table.header.iter().enumerate() {
            let error = |kind| table.column(name).error(kind);
            if !name.is_empty() && !names.insert(name) {
                return Err(error(InputErrorKind::RepeatedColumn { first: name.clone() }));
            }
            let is_marked = marked_name == Some(name);
            if is_marked {
                columns.marked = Some(place);
            }
            match numbering.recognise(name, problem).map_err(error)? {
                Meaning::Read(role, to_si) => {
                    if let Some(first) = found.insert(role, name) {
                        return Err(error(InputErrorKind::RepeatedColumn { first: first.to_owned() }));
                    }
                    columns.read.push(Column { role, place, to_si });
                }
                Meaning::Ignored(_) | Meaning::Unknown if is_marked => {}
                Meaning::Ignored(kind) => warnings.push(Warning { location: table.column(name), kind }),
                Meaning::Unknown => {
                    unknown.push(name.as_str());
                    let asked = unknown.len() <= ASKED;
                    let meant = asked.then(|| numbering.meant(name, &there, problem)).flatten();
                    if let Some(meant) = meant.as_ref().filter(|meant| counts(meant) && one_typo(name, meant)) {
                        mistyped =
                            mistyped.or_else(|| Some(error(InputErrorKind::MistypedColumn { meant: meant.clone() })));
                    }
                    let kind = WarningKind::ColumnIgnored { meant };
                    warnings.push(Warning { location: table.column(name), kind });
                }
            }
        }
        columns.read.sort_by_key(|column| column.role);
        columns.require(table, problem, measured, &numbering, &unknown)?;
        mistyped.map_or(Ok(columns), Err)
    }

    /// Whether every column is there that has to be; one of the `unknown` may be meant by it.
    fn require(
        &self,
        table: &Table,
        problem: &Problem,
        measured: bool,
        numbering: &Numbering,
        unknown: &[&str],
    ) -> Result<(), InputError> {
        let near = |name: &str| nearest(name, unknown).map(|near| (*near).to_owned());
        let missing = |base: &str, unit: Unit| {
            let (write, near) = (unit.spelled(base), unit.spellings(base).find_map(|name| near(&name)));
            Err(table.column(base).error(InputErrorKind::MissingColumn { write, near }))
        };
        for (index, joint) in problem.joints.iter().enumerate() {
            if let Some(unit) = unit_of(joint.kind)
                && !self.has(Role::Joint(index))
            {
                return missing(&format!("q{}", numbering.number(index)), unit);
            }
        }
        if !measured {
            return Ok(());
        }
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if !self.has(Role::Position(axis)) {
                return missing(name, Unit::Length);
            }
        }
        if let Some(HeldOut::Column(name)) = &problem.data.held_out
            && self.marked.is_none()
        {
            let write = format!("it, or change held_out in {}", problem.data.held_out_location);
            return Err(table.column(name).error(InputErrorKind::MissingColumn { write, near: near(name) }));
        }
        Ok(())
    }

    pub fn has(&self, role: Role) -> bool {
        self.read.binary_search_by_key(&role, |column| column.role).is_ok()
    }
}

/// What the name of a column means.
enum Meaning {
    Read(Role, fn(f64) -> f64),
    Ignored(WarningKind),
    /// Nothing.
    Unknown,
}

/// Which joint a number in the name of a column means.
struct Numbering {
    /// Joint of each number, from 0.
    joints: Vec<usize>,
}

impl Numbering {
    /// Columns go by the joint's number, or else by its place among the joints that move.
    fn of(header: &[String], problem: &Problem) -> Self {
        let numbers: Vec<usize> = header.iter().filter_map(|name| numbered(split_unit(name).0, "q")).collect();
        let all = || (0..problem.joints.len()).collect::<Vec<_>>();
        let moving = problem.joints.iter().enumerate().filter(|(_, joint)| joint.kind != JointKind::Fixed);
        let moving: Vec<usize> = moving.map(|(index, _)| index).collect();
        let by_number = moving.iter().all(|index| numbers.contains(&(index + 1)));
        let by_order = (1..=moving.len()).all(|number| numbers.contains(&number))
            && numbers.iter().all(|number| (1..=moving.len()).contains(number));
        Self { joints: if !by_number && by_order { moving } else { all() } }
    }

    fn joint(&self, number: usize) -> Option<usize> {
        self.joints.get(number.checked_sub(1)?).copied()
    }

    fn number(&self, joint: usize) -> usize {
        self.joints.iter().position(|&index| index == joint).unwrap_or(joint) + 1
    }

    /// The column that an unknown name is meant to be, of those that the table does not have.
    fn meant(&self, name: &str, there: &BTreeSet<&str>, problem: &Problem) -> Option<String> {
        let joints = problem.joints.iter().enumerate().filter_map(|(index, joint)| Some((index, unit_of(joint.kind)?)));
        let joints = joints.map(|(index, unit)| (self.number(index), unit));
        let plain = PLAIN.iter().map(|(name, _)| (*name).to_owned());
        let approach = joints.clone().map(|(number, _)| format!("approach{number}"));
        let measured = MEASURED.iter().map(|&(base, _, unit, _)| (base.to_owned(), unit));
        let measured = measured.chain(joints.map(|(number, unit)| (format!("q{number}"), unit)));
        let measured = measured.flat_map(|(base, unit)| unit.spellings(&base).collect::<Vec<_>>());
        let lacking = |name: &String| !there.contains(split_unit(name).0);
        nearest(name, plain.chain(approach).chain(measured).filter(lacking))
    }

    /// What the name of a column means.
    fn recognise(&self, name: &str, problem: &Problem) -> Result<Meaning, InputErrorKind> {
        let plain = |role| Ok(Meaning::Read(role, identity));
        if let Some((_, role)) = PLAIN.iter().find(|(known, _)| *known == name) {
            return plain(*role);
        }
        if let Some(number) = numbered(name, "approach") {
            let moves = |&joint: &usize| problem.joints.get(joint).is_some_and(|own| own.kind != JointKind::Fixed);
            return match self.joint(number).filter(moves) {
                Some(joint) => plain(Role::Approach(joint)),
                None => Ok(Meaning::Ignored(WarningKind::JointIgnored { joint: number })),
            };
        }
        let (base, suffix) = split_unit(name);
        let measured = MEASURED.iter().find(|(known, ..)| *known == base);
        let (role, unit, strict) = if let Some(&(_, role, unit, strict)) = measured {
            (role, unit, strict)
        } else {
            let Some(number) = numbered(base, "q") else { return Ok(Meaning::Unknown) };
            let joint = self.joint(number);
            let Some((joint, unit)) = joint.and_then(|joint| Some((joint, unit_of(problem.joints.get(joint)?.kind)?)))
            else {
                return Ok(Meaning::Ignored(WarningKind::JointIgnored { joint: number }));
            };
            (Role::Joint(joint), unit, true)
        };
        let write = || unit.spelled(base);
        match suffix {
            Some(suffix) => match unit.suffix(suffix) {
                Some(suffix) => Ok(Meaning::Read(role, suffix.to_si)),
                None if strict && Unit::all_suffixes().any(|known| known == suffix) => {
                    Err(InputErrorKind::WrongUnit { noun: unit.noun(), suffix: suffix.to_owned(), write: write() })
                }
                None => Ok(Meaning::Ignored(WarningKind::UnitIgnored { write: write() })),
            },
            None if strict => Err(InputErrorKind::NeedsUnit { noun: unit.noun(), write: write() }),
            None => Ok(Meaning::Ignored(WarningKind::UnitIgnored { write: write() })),
        }
    }
}

/// Whether a column that was meant would be missed: a pose's name and orientations decide nothing.
fn counts(meant: &str) -> bool {
    let base = split_unit(meant).0;
    base != "pose" && !MEASURED.iter().any(|(known, role, ..)| *known == base && matches!(role, Role::Orientation(_)))
}

/// What q of a joint is measured in, where it takes one.
fn unit_of(joint: JointKind) -> Option<Unit> {
    match joint {
        JointKind::Revolute => Some(Unit::Angle),
        JointKind::Prismatic => Some(Unit::Length),
        JointKind::Fixed => None,
    }
}

/// `q1_deg` as `q1` and `deg`.
fn split_unit(name: &str) -> (&str, Option<&str>) {
    name.split_once('_').map_or((name, None), |(base, suffix)| (base, Some(suffix)))
}

/// The number in `q12`.
fn numbered(name: &str, prefix: &str) -> Option<usize> {
    let number = name.strip_prefix(prefix)?;
    if number.bytes().all(|byte| byte.is_ascii_digit()) { number.parse().ok() } else { None }
}

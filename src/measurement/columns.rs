//! What the columns of a table stand for.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::identity;

use super::mapped::Names;
use super::role::{MEASURED, PLAIN, Role};
use super::table::Table;
use crate::error::{InputError, InputErrorKind, Location, Warning, WarningKind, nearest, one_typo};
use crate::problem::{ColumnRule, HeldOut, Joint, JointKind, JointSource, Problem};
use crate::quantity::Unit;

/// Unknown columns of which is asked what they are meant to be; who has more means none.
const ASKED: usize = 100;

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
    /// What the name of the file stands for, in every row.
    pub file: Option<Role>,
    /// What flexcal calls each column of the table.
    names: Vec<String>,
}

impl Columns {
    /// Finds the columns in a header; what nobody knows is a warning. Positions and the column of
    /// held-out rows need not be there unless the poses are `measured`.
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
        let named = Names::of(table, &problem.data.dialect)?;
        let numbering = Numbering::of(named.all(), problem);
        let there: BTreeSet<&str> = named.all().map(|name| split_unit(name).0).collect();
        let mut found: BTreeMap<Role, (String, Option<&ColumnRule>)> = BTreeMap::new();
        let mut names = BTreeMap::new();
        let file = named.of_file.map(|rule| (rule.ours.as_str(), Some(rule)));
        let ours = named.all().map(str::to_owned).collect();
        let mut columns = Self { read: Vec::new(), marked: None, file: None, names: ours };
        let (mut unknown, mut mistyped, mut unmapped) = (Vec::new(), None, Vec::new());
        let (mut shifted, mut hidden) = (None, None);
        for (place, &(name, rule)) in named.of_place.iter().chain(&file).enumerate() {
            let location = || rule.map_or_else(|| table.column(name), |rule| rule.location.clone());
            let error = |kind| location().error(kind);
            let own = problem.data.covariates.iter().position(|own| own.name == name);
            let foreign = named.mapped && rule.is_none() && own.is_none();
            let called = called(name, table.header.get(place));
            let first = names.insert(name, called.clone()).filter(|_| !name.is_empty() && !foreign);
            if let Some(first) = first {
                return Err(error(InputErrorKind::RepeatedColumn { first }));
            }
            let is_marked = marked_name == Some(name);
            if is_marked {
                columns.marked = Some(place);
            }
            let meaning = match (numbering.recognise(name, problem), own) {
                (Ok(Meaning::Read(..)), Some(own)) => {
                    let declared = problem.data.covariates.get(own).map(|own| own.location.clone());
                    let kind = InputErrorKind::NoCovariateName { name: name.to_owned() };
                    return Err(declared.unwrap_or_else(location).error(kind));
                }
                (_, Some(own)) => Ok(Meaning::Read(Role::Covariate(own), identity)),
                // What another program calls by our name need not be ours.
                (Err(_), _) if foreign => Ok(Meaning::Unknown),
                (Ok(Meaning::Read(role, _)), _) if foreign && found.contains_key(&role) => {
                    hidden = hidden.or_else(|| Some((found.get(&role)?.1?, name)));
                    Ok(Meaning::Unknown)
                }
                (other, _) => other.map_err(error),
            }?;
            match meaning {
                Meaning::Read(role, _) if place == table.header.len() => {
                    columns.file = Some(word_of_row(role).map_err(error)?);
                }
                Meaning::Read(role, to_si) => {
                    if let Some((first, _)) = found.insert(role, (called, rule)) {
                        return Err(error(InputErrorKind::RepeatedColumn { first }));
                    }
                    columns.read.push(Column { role, place, to_si });
                }
                Meaning::Ignored(_) | Meaning::Unknown if is_marked => {}
                // Numbers count joints otherwise where another name is misspelt.
                Meaning::Ignored(WarningKind::JointIgnored { .. }) if rule.is_some() => {
                    let meant = numbering.meant(name, &there, problem);
                    shifted =
                        shifted.or_else(|| Some(error(InputErrorKind::UnknownMeaning { meant })));
                }
                Meaning::Ignored(WarningKind::UnitIgnored { write }) if rule.is_some() => {
                    return Err(error(InputErrorKind::UnknownMeaning { meant: Some(write) }));
                }
                Meaning::Ignored(_) | Meaning::Unknown if rule.is_some() => {
                    let meant = numbering.meant(name, &there, problem);
                    return Err(error(InputErrorKind::UnknownMeaning { meant }));
                }
                Meaning::Ignored(kind) => warnings.push(Warning { location: location(), kind }),
                Meaning::Unknown if foreign => {
                    unknown.push(name);
                    unmapped.extend((!name.is_empty()).then(|| name.to_owned()));
                }
                Meaning::Unknown => {
                    unknown.push(name);
                    let asked = unknown.len() <= ASKED;
                    let meant = asked.then(|| numbering.meant(name, &there, problem)).flatten();
                    if let Some(meant) =
                        meant.as_ref().filter(|meant| counts(meant) && one_typo(name, meant))
                    {
                        mistyped = mistyped.or_else(|| {
                            Some(error(InputErrorKind::MistypedColumn { meant: meant.clone() }))
                        });
                    }
                    let kind = WarningKind::ColumnIgnored { meant };
                    warnings.push(Warning { location: table.column(name), kind });
                }
            }
        }
        if let (Some(HeldOut::Fraction { .. }), true) =
            (&problem.data.held_out, measured && columns.has_split())
        {
            warnings
                .push(Warning { location: table.column("split"), kind: WarningKind::SplitUnused });
        }
        if !unmapped.is_empty() {
            let location = Location { key: None, ..table.column("") };
            warnings.push(Warning { location, kind: WarningKind::Unmapped { names: unmapped } });
        }
        columns.read.sort_by_key(|column| column.role);
        if let Some(error) = shifted {
            return Err(error);
        }
        let required = columns.require(table, problem, measured, &numbering, &unknown);
        required.map_err(|error| match hidden {
            Some(hidden) => blamed(error, hidden),
            None => error,
        })?;
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
        let missing = |bases: &[&str], unit: Unit| {
            let write =
                bases.iter().map(|base| unit.spelled(base)).collect::<Vec<_>>().join(" or ");
            let near =
                bases.iter().flat_map(|base| unit.spellings(base)).find_map(|name| near(&name));
            let first = bases.first().copied().unwrap_or_default();
            Err(table.column(first).error(InputErrorKind::MissingColumn { write, near }))
        };
        let (source, suffix): (fn(usize) -> Role, _) = match problem.data.joints {
            JointSource::Commanded => (Role::Joint, ""),
            JointSource::Read => (Role::Reading, "_read"),
        };
        for (index, joint) in problem.joints.iter().enumerate() {
            if let Some(unit) = unit_of(joint.commanded())
                && !self.has(source(index))
            {
                let number = format!("q{}{suffix}", numbering.number(index));
                let namesakes =
                    || problem.joints.iter().enumerate().filter(|(_, own)| own.name == joint.name);
                let is_shared = namesakes().nth(1).is_some();
                let of_it = |name: &&&str| {
                    name.strip_prefix(&joint.name).is_some_and(|rest| rest.starts_with('_'))
                };
                if let Some(column) = unknown.iter().find(of_it).filter(|_| is_shared) {
                    let write = namesakes().map(|(own, _)| {
                        unit.spelled(&format!("q{}{suffix}", numbering.number(own)))
                    });
                    let (name, write) = (joint.name.clone(), write.collect());
                    return Err(table
                        .column(column)
                        .error(InputErrorKind::SharedJointName { name, write }));
                }
                let usable = |name: &&str| suffix.is_empty() && !name.contains(' ') && !is_shared;
                let named = Some(joint.name.as_str()).filter(usable);
                return missing(&[&[number.as_str()], named.as_slice()].concat(), unit);
            }
        }
        for (k, own) in problem.data.covariates.iter().enumerate() {
            let used = || {
                problem
                    .effects
                    .iter()
                    .any(|declared| declared.effect.covariate() == Some(own.name.as_str()))
            };
            if !self.has(Role::Covariate(k)) && (measured || used()) {
                let write = format!("it, or take it out of [data.covariates] in {}", own.location);
                return Err(table
                    .column(&own.name)
                    .error(InputErrorKind::MissingColumn { write, near: near(&own.name) }));
            }
        }
        for (has, lacks, write) in [
            (Role::Distance, Role::Anchor, "anchor"),
            (Role::Offset, Role::Surface, "surface"),
            (Role::Anchor, Role::Distance, "distance_mm"),
            (Role::Tilt(0), Role::Tilt(1), "tilt_y_deg"),
            (Role::Tilt(1), Role::Tilt(0), "tilt_x_deg"),
        ] {
            if self.has(has) && !self.has(lacks) && (measured || has != Role::Anchor) {
                let write = write.to_owned();
                return Err(table
                    .column(&write)
                    .error(InputErrorKind::MissingColumn { near: near(&write), write }));
            }
        }
        // One coordinate alone is no position.
        let has_position = (0..3).any(|axis| self.has(Role::Position(axis)));
        if !has_position && (!measured || self.observes()) {
            return self.require_marked(table, problem, measured, near);
        }
        let named_otherwise = Unit::Length.spellings("x").find_map(|name| near(&name)).is_some();
        if let (false, Some((place, write))) =
            (has_position || named_otherwise, self.undeclared(problem, |_| true))
        {
            let name = self.names.get(place).map_or("", String::as_str);
            return Err(table.column(name).error(InputErrorKind::NotDeclared { write }));
        }
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if !self.has(Role::Position(axis)) {
                return missing(&[name], Unit::Length);
            }
        }
        if let (true, true) = self.orientations() {
            return Err(table
                .column("qx")
                .error(InputErrorKind::RepeatedColumn { first: "rx".to_owned() }));
        }
        self.require_marked(table, problem, measured, near)
    }

    /// Whether the column of held-out rows is there that the problem names.
    fn require_marked(
        &self,
        table: &Table,
        problem: &Problem,
        measured: bool,
        near: impl Fn(&str) -> Option<String>,
    ) -> Result<(), InputError> {
        if let Some(HeldOut::Column(name)) = problem.data.held_out.as_ref().filter(|_| measured)
            && self.marked.is_none()
        {
            let write = format!("it, or change held_out in {}", problem.data.held_out_location);
            return Err(table
                .column(name)
                .error(InputErrorKind::MissingColumn { write, near: near(name) }));
        }
        Ok(())
    }

    /// Whether a row may measure something else than a position.
    pub fn observes(&self) -> bool {
        [Role::Point, Role::Anchor, Role::Distance, Role::Surface, Role::Tilt(0), Role::Frame]
            .into_iter()
            .any(|role| self.has(role))
    }

    /// The place of the first column for which the problem lacks a declaration, of those `chosen`,
    /// and what it lacks.
    pub fn undeclared(
        &self,
        problem: &Problem,
        chosen: impl Fn(usize) -> bool,
    ) -> Option<(usize, &'static str)> {
        let lacking =
            |(place, name): (usize, &String)| Some((place, Role::undeclared(name, problem)?));
        self.names.iter().enumerate().filter_map(lacking).find(|&(place, _)| chosen(place))
    }

    /// Whether the row that the table is at measures something else than a position.
    pub fn observes_at(&self, table: &Table) -> bool {
        let filled = |role: Role| {
            self.place(role)
                .is_some_and(|place| table.text(place).is_ok_and(|cell| !cell.is_empty()))
        };
        let roles = [Role::Point, Role::Distance, Role::Surface, Role::Tilt(0)];
        self.file == Some(Role::Point) || roles.into_iter().any(filled)
    }

    /// The number of the row that the table is at in the column of a role \[SI\]; 0 where there is
    /// no such column.
    pub fn length(&self, table: &Table, role: Role) -> Result<f64, InputError> {
        let column = self.read.iter().find(|column| column.role == role);
        column.map_or(Ok(0.0), |column| table.number(column.place).map(column.to_si))
    }

    /// Place of the column of a role.
    pub fn place(&self, role: Role) -> Option<usize> {
        let index = self.read.binary_search_by_key(&role, |column| column.role).ok()?;
        self.read.get(index).map(|column| column.place)
    }

    /// What flexcal calls a column.
    pub fn name_of(&self, column: &Column) -> &str {
        self.names.get(column.place).map_or("", String::as_str)
    }

    /// The fixed point that the row measures, if it is one of those without an arm.
    pub fn nest<'t>(&self, table: &'t Table) -> Option<&'t str> {
        let column = self.read.iter().find(|column| column.role == Role::Nest)?;
        table.text(column.place).ok().filter(|word| !word.is_empty())
    }

    /// Whether there is a whole orientation as angles, and as a quaternion.
    pub fn orientations(&self) -> (bool, bool) {
        let all =
            |count: usize, role: fn(usize) -> Role| (0..count).all(|axis| self.has(role(axis)));
        (all(3, Role::Orientation), all(4, Role::Quaternion))
    }

    /// Whether rows are marked in the column of that name.
    fn has_split(&self) -> bool {
        self.read.iter().any(|column| column.role == Role::Split)
    }

    pub fn has(&self, role: Role) -> bool {
        self.file == Some(role)
            || self.read.binary_search_by_key(&role, |column| column.role).is_ok()
    }
}

/// A name of ours, with theirs where that is another.
fn called(name: &str, theirs: Option<&String>) -> String {
    let theirs = theirs.filter(|theirs| *theirs != name).map(|theirs| format!(" ({theirs})"));
    name.to_owned() + &theirs.unwrap_or_default()
}

/// A column that is missing is the fault of an entry of the map that gives its name to one which
/// the table has itself.
fn blamed(error: InputError, (rule, name): (&ColumnRule, &str)) -> InputError {
    match *error.kind {
        InputErrorKind::MissingColumn { write, .. } => rule
            .location
            .clone()
            .error(InputErrorKind::ColumnHidden { name: name.to_owned(), write }),
        kind => error.location.error(kind),
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
    fn of<'a>(names: impl Iterator<Item = &'a str>, problem: &Problem) -> Self {
        let numbers: Vec<usize> =
            names.filter_map(|name| numbered(split_unit(name).0, "q")).collect();
        let all = || (0..problem.joints.len()).collect::<Vec<_>>();
        let moving = problem
            .joints
            .iter()
            .enumerate()
            .filter(|(_, joint)| joint.commanded() != JointKind::Fixed);
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
        let moving = || {
            problem
                .joints
                .iter()
                .enumerate()
                .filter_map(|(k, own)| Some((k, own, unit_of(own.commanded())?)))
        };
        let joints = moving().map(|(index, _, unit)| (self.number(index), unit));
        let named = moving().map(|(_, joint, unit)| (joint.name.clone(), unit));
        let plain = PLAIN
            .iter()
            .filter(|(_, role)| role.is_known_to(problem))
            .map(|(name, _)| (*name).to_owned());
        let approach = joints.clone().map(|(number, _)| format!("approach{number}"));
        let measured = MEASURED.iter().filter(|(_, role, ..)| role.is_known_to(problem));
        let measured = measured.map(|&(base, _, unit, _)| (base.to_owned(), unit));
        let measured = measured.chain(joints.map(|(number, unit)| (format!("q{number}"), unit)));
        let measured = measured
            .chain(named)
            .flat_map(|(base, unit)| unit.spellings(&base).collect::<Vec<_>>());
        let lacking = |name: &String| !there.contains(split_unit(name).0);
        nearest(name, plain.chain(approach).chain(measured).filter(lacking))
    }

    /// What the name of a column means.
    fn recognise(&self, name: &str, problem: &Problem) -> Result<Meaning, InputErrorKind> {
        if let Some(meaning) = by_joint_name(name, problem) {
            return meaning;
        }
        let plain = |role| Ok(Meaning::Read(role, identity));
        if let Some((_, role)) =
            PLAIN.iter().find(|(known, role)| *known == name && role.is_known_to(problem))
        {
            return plain(*role);
        }
        if let Some(number) = numbered(name, "approach") {
            let moves = |&joint: &usize| {
                problem.joints.get(joint).is_some_and(|own| own.commanded() != JointKind::Fixed)
            };
            return match self.joint(number).filter(moves) {
                Some(joint) => plain(Role::Approach(joint)),
                None => Ok(Meaning::Ignored(WarningKind::JointIgnored { joint: number })),
            };
        }
        if let Some((tilt, suffix)) = [("tilt_x", 0), ("tilt_y", 1)]
            .into_iter()
            .filter(|&(_, axis)| Role::Tilt(axis).is_known_to(problem))
            .find_map(|(base, axis)| Some((Role::Tilt(axis), (base, name.strip_prefix(base)?))))
        {
            let (base, suffix) = suffix;
            let unit = suffix.strip_prefix('_').and_then(|suffix| Unit::Angle.suffix(suffix));
            let needed = || InputErrorKind::NeedsUnit {
                noun: Unit::Angle.noun(),
                write: Unit::Angle.spelled(base),
            };
            return unit.map(|unit| Meaning::Read(tilt, unit.to_si)).ok_or_else(needed);
        }
        let (base, suffix) = split_unit(name);
        let reading = suffix
            .and_then(|suffix| suffix.strip_prefix("read_"))
            .filter(|_| numbered(base, "q").is_some());
        let suffix = reading.or(suffix);
        let measured =
            MEASURED.iter().find(|(known, role, ..)| *known == base && role.is_known_to(problem));
        let (role, unit, strict) = if let Some(&(_, role, unit, strict)) = measured {
            (role, unit, strict)
        } else {
            let Some(number) = numbered(base, "q") else { return Ok(Meaning::Unknown) };
            let joint = self.joint(number);
            let Some((joint, unit)) = joint
                .and_then(|joint| Some((joint, unit_of(problem.joints.get(joint)?.commanded())?)))
            else {
                return Ok(Meaning::Ignored(WarningKind::JointIgnored { joint: number }));
            };
            (if reading.is_some() { Role::Reading(joint) } else { Role::Joint(joint) }, unit, true)
        };
        let write = || {
            unit.spelled(&if reading.is_some() { format!("{base}_read") } else { base.to_owned() })
        };
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
                None => Ok(Meaning::Ignored(WarningKind::UnitIgnored { write: write() })),
            },
            None if role == Role::Time => Ok(Meaning::Read(Role::Time, DATE)),
            None if strict => Err(InputErrorKind::NeedsUnit { noun: unit.noun(), write: write() }),
            None => Ok(Meaning::Ignored(WarningKind::UnitIgnored { write: write() })),
        }
    }
}

/// What the name of the file may stand for: a word.
fn word_of_row(role: Role) -> Result<Role, InputErrorKind> {
    match role {
        Role::Session | Role::Target | Role::Point => Ok(role),
        _ => Err(InputErrorKind::UnknownMeaning { meant: Some("session".to_owned()) }),
    }
}

/// Conversion of a time without a unit: a date, which needs none.
pub(super) const DATE: fn(f64) -> f64 = |_| f64::NAN;

/// What the name of a column means that is the name of a joint, with a unit:
/// `shoulder_pan_joint_rad`. Names that two joints have, and those of other columns, mean no joint.
fn by_joint_name(name: &str, problem: &Problem) -> Option<Result<Meaning, InputErrorKind>> {
    let base = split_unit(name).0;
    let other = PLAIN.iter().any(|(known, _)| *known == name) || numbered(base, "q").is_some();
    let measured = MEASURED.iter().find(|(known, ..)| *known == base);
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
    let unit = |(index, joint): (usize, &Joint)| Some((index, unit_of(joint.commanded())?));
    if let Some((_, unit)) = joint_of(name).and_then(unit) {
        return Some(Err(InputErrorKind::NeedsUnit {
            noun: unit.noun(),
            write: unit.spelled(name),
        }));
    }
    let (base, suffix) = name.rsplit_once('_')?;
    let (index, unit) = joint_of(base).and_then(unit)?;
    match unit.suffix(suffix) {
        Some(suffix) => Some(Ok(Meaning::Read(Role::Joint(index), suffix.to_si))),
        None if Unit::all_suffixes().any(|known| known == suffix) => {
            let (suffix, write) = (suffix.to_owned(), unit.spelled(base));
            Some(Err(InputErrorKind::WrongUnit { noun: unit.noun(), suffix, write }))
        }
        None => None,
    }
}

/// Whether a column that was meant would be missed: a pose's name and orientations decide nothing.
fn counts(meant: &str) -> bool {
    let base = split_unit(meant).0;
    base != "pose"
        && !MEASURED
            .iter()
            .any(|(known, role, ..)| *known == base && matches!(role, Role::Orientation(_)))
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

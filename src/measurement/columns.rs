//! Search of the columns of a table that are read, with their roles.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::identity;

use super::foreign_name::guess;
use super::headerless::{holds_numbers, no_header};
use super::mapped::{Names, no_such};
use super::meaning::{
    Meaning, Numbering, affects_results, asked_for_readings, lacking_neighbour, split_unit,
    unit_of, word_of_row,
};
use super::role::{POINT, POSITION, Role};
use super::shared_name::shared_name;
use super::table::Table;
use crate::error::{
    InputError, InputErrorKind, Location, TableErrorKind, Warning, WarningKind, nearest, one_typo,
};
use crate::observation::{Kind, kinds};
use crate::problem::{ColumnRule, HeldOut, Joint, JointSource, Problem};
use crate::quantity::Unit;

/// Maximum number of unknown columns for which a warning suggests a similar name.
const MAX_SUGGESTIONS: usize = 100;

/// Column whose values are read.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub role: Role,
    /// Index of the column in a row, counted from 0.
    pub place: usize,
    /// Conversion of a number in a cell to SI units.
    pub to_si: fn(f64) -> f64,
}

/// Columns of one file.
pub(super) struct Columns {
    /// Columns sorted by role.
    pub read: Vec<Column>,
    /// Index of the column that marks held-out rows; `None` without such a column.
    pub marked: Option<usize>,
    /// Role whose value in every row is the name of the file; `None` if the name is not used.
    pub file: Option<Role>,
    /// Name of each column of the table in flexcal's vocabulary.
    names: Vec<String>,
}

impl Columns {
    /// Finds the columns in the header of a table. Unknown columns cause warnings. If the poses are
    /// `measured`, columns of measured quantities and of held-out rows are required. If
    /// `is_mapped_whole`, measured poses must have every column of the map.
    #[expect(clippy::too_many_lines, reason = "one column after the other, by what it may mean")]
    pub fn find(
        table: &Table,
        problem: &Problem,
        (measured, is_mapped_whole): (bool, bool),
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, InputError> {
        let marked_name = match &problem.data.held_out {
            Some(HeldOut::Column(name)) => Some(name.as_str()),
            None => Some("split"),
            Some(_) => None,
        };
        let named = Names::map(table, &problem.data.dialect, measured && is_mapped_whole)?;
        let numbering = Numbering::detect(named.iter(), problem);
        let present: BTreeSet<&str> = named.iter().map(|name| split_unit(name).0).collect();
        let mut found: BTreeMap<Role, (String, Option<&ColumnRule>)> = BTreeMap::new();
        let mut names = BTreeMap::new();
        let ours = named.iter().map(str::to_owned).collect();
        let mut columns = Self { read: Vec::new(), marked: None, file: None, names: ours };
        let (mut unknown, mut unmapped, mut mistyped) = (Vec::new(), Vec::new(), None);
        let (mut shifted, mut hidden) = (None, None);
        let is_result_table = named.iter().any(is_unmistakable_result);
        for (place, name, rule) in named.mapped_first() {
            let location = || rule.map_or_else(|| table.column(name), |rule| rule.location.clone());
            let error = |kind: InputErrorKind| location().error(kind);
            let covariate = problem.data.covariates.iter().position(|known| known.name == name);
            let foreign = named.mapped && rule.is_none() && covariate.is_none();
            let called = display_name(name, table.header.get(place));
            let first = names.insert(name, called.clone()).filter(|_| !name.is_empty() && !foreign);
            if let Some(first) = first {
                let missing = lacking_neighbour(name, &present, problem)
                    .filter(|_| rule.is_none() && first == called);
                return Err(error(match missing {
                    Some(missing) => TableErrorKind::RepeatedForAnother { missing }.into(),
                    None => TableErrorKind::RepeatedColumn { first }.into(),
                }));
            }
            let is_marked = marked_name == Some(name);
            if is_marked {
                columns.marked = Some(place);
            }
            let meaning = match (numbering.recognise(name, problem), covariate) {
                (Ok(Meaning::Read(..)), Some(index)) => {
                    let declared =
                        problem.data.covariates.get(index).map(|known| known.location.clone());
                    let kind = InputErrorKind::NoCovariateName { name: name.to_owned() };
                    return Err(declared.unwrap_or_else(location).error(kind));
                }
                (_, Some(index)) => Ok(Meaning::Read(Role::Covariate(index), identity)),
                // In a table of another program, a name of flexcal may mean a different quantity.
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
                        return Err(error(TableErrorKind::RepeatedColumn { first }.into()));
                    }
                    columns.read.push(Column { role, place, to_si });
                }
                Meaning::Ignored(_) | Meaning::Unknown
                    if is_marked || table.is_read_as_date(place) => {}
                // If the name of another joint column is misspelt, the numbers of the columns are
                // assigned to other joints.
                Meaning::Ignored(WarningKind::JointIgnored { .. }) if rule.is_some() => {
                    let meant = numbering.meant(name, &present, problem);
                    shifted = shifted
                        .or_else(|| Some(error(TableErrorKind::UnknownMeaning { meant }.into())));
                }
                Meaning::Ignored(WarningKind::UnitIgnored { write }) if rule.is_some() => {
                    return Err(error(
                        TableErrorKind::UnknownMeaning { meant: Some(write) }.into(),
                    ));
                }
                Meaning::Ignored(_) | Meaning::Unknown if rule.is_some() => {
                    let meant = numbering.meant(name, &present, problem);
                    return Err(error(TableErrorKind::UnknownMeaning { meant }.into()));
                }
                Meaning::Ignored(_) | Meaning::Unknown if is_result_table && is_result(name) => {}
                Meaning::Ignored(kind) => {
                    // A misspelt unit may hide a column.
                    unknown.extend(matches!(kind, WarningKind::UnitIgnored { .. }).then_some(name));
                    warnings.push(Warning { location: location(), kind });
                }
                Meaning::Unknown if foreign => {
                    unknown.push(name);
                    let file = Location { key: None, ..table.column(name) };
                    unmapped.extend((!name.is_empty()).then(|| (file, name.to_owned())));
                }
                Meaning::Unknown => {
                    unknown.push(name);
                    let meant = || numbering.meant(name, &present, problem);
                    let meant = (unknown.len() <= MAX_SUGGESTIONS).then(meant).flatten();
                    let is_typo = |meant: &&String| affects_results(meant) && one_typo(name, meant);
                    if let Some(meant) = meant.as_ref().filter(is_typo) {
                        let kind = TableErrorKind::MistypedColumn { meant: meant.clone() };
                        mistyped.get_or_insert_with(|| error(kind.into()));
                    }
                    let is_read = |column: &Column| {
                        column.place + 1 == place && matches!(column.role, Role::Joint(_))
                    };
                    let is_angle = (name.ends_with("_deg") || name.ends_with("_rad"))
                        && (name.contains("_joint_") || columns.read.iter().any(is_read));
                    let kind = WarningKind::ColumnIgnored { meant, is_angle };
                    warnings.push(Warning { location: table.column(name), kind });
                }
            }
        }
        if measured && ["reached", "miss_mm"].iter().all(|name| named.iter().any(|n| n == *name)) {
            let kind = WarningKind::TargetsAsMeasurements;
            warnings.push(Warning { location: table.column("miss_mm"), kind });
        }
        if let (Some(HeldOut::Fraction { .. }), true) =
            (&problem.data.held_out, measured && columns.has(Role::Split))
        {
            let (location, kind) = (table.column("split"), WarningKind::SplitUnused);
            warnings.push(Warning { location, kind });
        }
        for of_file in unmapped.chunk_by(|(a, _), (b, _)| a.file == b.file) {
            let names = of_file.iter().map(|(_, name)| name.clone()).collect();
            let location = of_file.iter().map(|(location, _)| location.clone()).next();
            let kind = WarningKind::Unmapped { names };
            warnings.extend(location.map(|location| Warning { location, kind }));
        }
        columns.read.sort_by_key(|column| column.role);
        if let Some(error) = shifted {
            return Err(error);
        }
        if let Some(rule) = named.unused.filter(|_| measured) {
            let kind = WarningKind::MapUnused { file: table.file.clone() };
            warnings.push(Warning { location: rule.location.clone(), kind });
        }
        if !measured {
            warnings.extend(columns.unread_positions(table, problem, &unknown)?);
        }
        let required = columns.require(table, problem, measured, &numbering, &unknown);
        required.map_err(|error| match (hidden, named.unused) {
            _ if is_missing_column(&error) && holds_numbers(&table.header) => {
                Location { key: None, ..table.column("") }.error(no_header(&table.header))
            }
            (Some(hidden), _) => with_rule_as_cause(error, hidden),
            (None, Some(rule)) if measured && is_missing_column(&error) => {
                no_such(rule, &problem.data.dialect.columns, table)
            }
            _ if is_missing_column(&error) => {
                columns.renamed(table, (problem, &numbering), (measured, &unknown)).unwrap_or(error)
            }
            _ => error,
        })?;
        mistyped.map_or(Ok(columns), Err)
    }

    /// Returns true if a table has a column of joint coordinates: commands or encoder readings.
    pub fn has_joints(table: &Table, problem: &Problem) -> bool {
        let names = Names::map_present(table, &problem.data.dialect);
        let numbering = Numbering::detect(names.iter().copied(), problem);
        let mut meanings = names.iter().map(|name| numbering.recognise(name, problem));
        meanings.any(|of| matches!(of, Ok(Meaning::Read(Role::Joint(_) | Role::Reading(_), _))))
    }

    /// Checks that all required columns exist. Errors about missing columns suggest similar names
    /// among the `unknown` columns.
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
            if let Some(error) =
                bases.iter().find_map(|base| self.in_foreign_unit(table, base, unit))
            {
                return Err(error);
            }
            let write =
                bases.iter().map(|base| unit.alternatives(base)).collect::<Vec<_>>().join(" or ");
            let mut spellings = bases.iter().flat_map(|base| unit.spellings(base));
            let near = spellings.find_map(|name| near(&name));
            let first = bases.first().copied().unwrap_or_default();
            let kind = TableErrorKind::MissingColumn {
                write,
                near,
                unknown: self.of_numbers(unknown, table),
            };
            Err(table.column(first).error(kind))
        };
        let (source, suffix): (fn(usize) -> Role, _) = match problem.data.joints {
            JointSource::Commanded => (Role::Joint, ""),
            JointSource::Read => (Role::Reading, "_read"),
        };
        for (index, joint) in problem.joints.iter().enumerate() {
            if let Some(unit) = unit_of(joint.command_kind())
                && !self.has(source(index))
            {
                let number = format!("q{}{suffix}", numbering.number(index));
                let is_zero = |name: &&String| split_unit(name).0 == "q0";
                if let Some(zero) = self.names.iter().find(is_zero)
                    && !problem.joints.iter().any(|joint| joint.name == "q0")
                {
                    return Err(table.column(zero).error(TableErrorKind::JointsFromZero));
                }
                if let Some(error) = shared_name(index, (table, problem, numbering), unknown) {
                    return Err(error);
                }
                let is_namesake = |other: &&Joint| other.name == joint.name;
                let is_shared = problem.joints.iter().filter(is_namesake).nth(1).is_some();
                let has_joint = |role: &Role| matches!(role, Role::Joint(_) | Role::Reading(_));
                if measured
                    && unknown.is_empty()
                    && self.in_foreign_unit(table, &number, unit).is_none()
                    && problem.data.dialect.columns.is_empty()
                    && !self.read.iter().any(|column| has_joint(&column.role))
                {
                    let write = unit.alternatives(&number);
                    return Err(table.column(&number).error(TableErrorKind::NoJoints { write }));
                }
                let usable = |name: &&str| suffix.is_empty() && !name.contains(' ') && !is_shared;
                let named = Some(joint.name.as_str()).filter(usable);
                return missing(&[&[number.as_str()], named.as_slice()].concat(), unit)
                    .map_err(|error| asked_for_readings(error, suffix));
            }
        }
        for (k, covariate) in problem.data.covariates.iter().enumerate() {
            let used = || {
                problem
                    .effects
                    .iter()
                    .any(|declared| declared.effect.covariate().as_ref() == Some(&covariate.name))
            };
            if !self.has(Role::Covariate(k)) && (measured || used()) {
                let write =
                    format!("it, or take it out of [data.covariates] in {}", covariate.location);
                let near = near(&covariate.name);
                let kind = TableErrorKind::MissingColumn { write, near, unknown: Vec::new() };
                return Err(table.column(&covariate.name).error(kind));
            }
        }
        self.require_fields(table, problem, measured, unknown)?;
        // A single coordinate is no position.
        let has_position = POSITION.iter().any(|role| self.has(*role));
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
        for (role, name) in POSITION.into_iter().zip(["x", "y", "z"]) {
            if !self.has(role) {
                let is_unmeasured = !has_position && unknown.is_empty();
                return missing(&[name], Unit::Length).map_err(|error| {
                    if is_unmeasured && is_missing_column(&error) {
                        let is_result = error.location.file.ends_with("residuals.csv");
                        let kind = TableErrorKind::NotMeasured { is_result };
                        Location { key: None, ..*error.location }.error(kind)
                    } else {
                        error
                    }
                });
            }
        }
        if let (true, true) = self.orientations() {
            return Err(table
                .column("qx")
                .error(TableErrorKind::RepeatedColumn { first: "rx".to_owned() }));
        }
        self.require_marked(table, problem, measured, near)
    }

    /// Returns the error of a column `base` in a unit that files cannot have; `None` without one.
    pub(super) fn in_foreign_unit(
        &self,
        table: &Table,
        base: &str,
        unit: Unit,
    ) -> Option<InputError> {
        let of_base = |name: &String| {
            let suffix = name.strip_prefix(base).and_then(|rest| rest.strip_prefix('_'));
            let guessed = || guess(name).filter(|(guessed, _)| guessed == base)?.1;
            let suffix = suffix.or_else(guessed).filter(|suffix| unit.suffix(suffix).is_none())?;
            Some((suffix.to_owned(), unit.convert_foreign(suffix, 1.0)?))
        };
        let (name, (suffix, factor)) =
            self.names.iter().find_map(|name| Some((name, of_base(name)?)))?;
        let (write, symbol) = (unit.alternatives(base), unit.in_tables().suffix);
        let write = format!("{write}, and convert the numbers: 1 {suffix} is {factor} {symbol}");
        let kind = InputErrorKind::WrongUnit { noun: unit.noun(), suffix, write };
        Some(table.column(name).error(kind))
    }

    /// Checks that the column of held-out rows exists if the problem names one.
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
            let kind =
                TableErrorKind::MissingColumn { write, near: near(name), unknown: Vec::new() };
            return Err(table.column(name).error(kind));
        }
        Ok(())
    }

    /// Returns true if the table has columns of quantities other than positions.
    pub fn observes(&self) -> bool {
        let is_other = |role: &Role| matches!(role, Role::Field(_)) && !POSITION.contains(role);
        self.read.iter().map(|column| &column.role).chain(&self.file).any(is_other)
    }

    /// Returns the index of the first column for which `is_chosen` is true and that lacks a
    /// declaration in the problem, with the section that would declare it.
    pub fn undeclared(
        &self,
        problem: &Problem,
        is_chosen: impl Fn(usize) -> bool,
    ) -> Option<(usize, &'static str)> {
        let lacking =
            |(place, name): (usize, &String)| Some((place, Role::undeclared(name, problem)?));
        self.names.iter().enumerate().filter_map(lacking).find(|&(place, _)| is_chosen(place))
    }

    /// Returns true if the current row measures a quantity other than a position.
    pub fn observes_at(&self, table: &Table) -> bool {
        let others = || kinds().filter(|kind| !kind.declared_by.is_empty());
        let first_measured = |kind: &Kind| {
            let required = kind.fields.iter().filter(|field| field.required);
            required.max_by_key(|field| field.unit().is_some()).map(|field| field.name)
        };
        let is_filled = |name: &'static str| {
            let column = self.read.iter().find(|column| column.role == Role::Field(name));
            column.is_some_and(|column| is_filled(table, column.place))
        };
        self.file == Some(POINT) || others().filter_map(first_measured).any(is_filled)
    }

    /// Returns the index in a row of the column with a role; `None` if there is none.
    pub fn place(&self, role: Role) -> Option<usize> {
        let index = self.read.binary_search_by_key(&role, |column| column.role).ok()?;
        self.read.get(index).map(|column| column.place)
    }

    /// Iterates over the names of all columns of the table in flexcal's vocabulary.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Returns flexcal's name of a column.
    pub fn name_of(&self, column: &Column) -> &str {
        self.names.get(column.place).map_or("", String::as_str)
    }

    /// Returns the name of the fixed point that the current row measures without the arm; `None`
    /// for other rows.
    pub fn nest<'t>(&self, table: &'t Table) -> Option<&'t str> {
        let column = self.read.iter().find(|column| column.role == Role::Nest)?;
        table.text(column.place).ok().filter(|word| !word.is_empty())
    }

    /// Returns two flags: whether all columns of an orientation exist as angles, and as a
    /// quaternion.
    pub fn orientations(&self) -> (bool, bool) {
        let is_complete =
            |count: usize, role: fn(usize) -> Role| (0..count).all(|axis| self.has(role(axis)));
        (is_complete(3, Role::Orientation), is_complete(4, Role::Quaternion))
    }

    /// Returns true if a column, or the name of the file, has the role.
    pub fn has(&self, role: Role) -> bool {
        self.file == Some(role) || self.place(role).is_some()
    }
}

/// Returns true for the error of a missing column.
fn is_missing_column(error: &InputError) -> bool {
    matches!(*error.kind, InputErrorKind::Table(TableErrorKind::MissingColumn { .. }))
}

/// Returns true for a column name that occurs only in result tables of flexcal.
fn is_unmistakable_result(name: &str) -> bool {
    let level = name.strip_prefix("bound").and_then(|rest| rest.strip_suffix("_mm"));
    let is_bound = level.is_some_and(|level| level.starts_with(|c: char| c.is_ascii_digit()));
    let starts = ["predicted_", "residual_", "miss_"];
    is_bound || starts.iter().any(|start| name.starts_with(start))
}

/// Returns true for a column that flexcal writes to result tables, but does not read.
fn is_result(name: &str) -> bool {
    let others = [
        "file",
        "line",
        "whitened",
        "outlier",
        "held_out",
        "reached",
        "sigma_x_mm",
        "sigma_y_mm",
        "sigma_z_mm",
        "extrapolated",
        "turn_deg",
        "turn_before_deg",
    ];
    is_unmistakable_result(name) || others.contains(&name)
}

/// Returns true if a cell of the current row is not empty.
pub(super) fn is_filled(table: &Table, place: usize) -> bool {
    table.text(place).is_ok_and(|cell| !cell.is_empty())
}

/// Returns flexcal's name of a column, followed by the name in the table if that differs.
fn display_name(name: &str, theirs: Option<&String>) -> String {
    let theirs = theirs.filter(|theirs| *theirs != name).map(|theirs| format!(" ({theirs})"));
    name.to_owned() + &theirs.unwrap_or_default()
}

/// Returns `error`; that of a missing column is located at `rule` instead. The rule of
/// `[data.columns]` gives the name `name` to another column, so that the column of this name is not
/// used.
fn with_rule_as_cause(error: InputError, (rule, name): (&ColumnRule, &str)) -> InputError {
    match *error.kind {
        InputErrorKind::Table(TableErrorKind::MissingColumn { write, .. }) => rule
            .location
            .clone()
            .error(TableErrorKind::MappedNameTaken { name: name.to_owned(), write }),
        kind => error.location.error(kind),
    }
}

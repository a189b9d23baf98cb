//! Quantities that the rows of a table measure, from the columns of each kind of rows; and known
//! distances between points.

use std::path::Path;

use nalgebra::Vector3;

use super::columns::{self, Columns};
use super::role::{POINT, POSITION, Role, is_declared, only_fixture};
use super::table::Table;
use super::{Measurements, narrow};
use crate::error::{InputError, InputErrorKind};
use crate::observation::{Content, Field, Kind, Needs, kinds};
use crate::problem::fixture::unknown;
use crate::problem::frame::frame;
use crate::problem::{Fixture, KnownDistance, Observation, Problem};

/// Quantity that a row measures.
pub(super) struct Observed {
    pub observation: Observation,
    /// True if the row has the measured numbers, false for a planned row.
    pub measured: bool,
}

/// Returns the quantities that the current row measures, in the order of [`Observation`]. A table
/// of positions has one position per row. If the table has to be `measured`, a row without a
/// measured quantity is an error. `missing` is true if the row has the mark of a missing position.
/// `in_point` is the name of the point that the whole file touches.
pub(super) fn of_row(
    table: &Table,
    columns: &Columns,
    (problem, measured, missing): (&Problem, bool, bool),
    in_point: Option<&str>,
) -> Result<Vec<Observed>, InputError> {
    let position = |measured| Observed { observation: Observation::Position, measured };
    if !columns.observes() {
        return Ok(vec![position(columns.has(POSITION[0]))]);
    }
    let filled = |role: Role| columns.place(role).filter(|&place| columns::is_filled(table, place));
    let mut found = Vec::new();
    if !missing && POSITION.iter().any(|role| filled(*role).is_some()) {
        found.push(position(true));
    }
    let cell = |field: &'static Field| {
        let role = Role::Field(field.name);
        let of_file = in_point.filter(|_| role == POINT);
        match filled(role) {
            Some(place) => Some(Cell { field, place: Some(place), stem: "" }),
            None => of_file.map(|stem| Cell { field, place: None, stem }),
        }
    };
    let cells_of = |kind: &Kind| kind.fields.iter().filter_map(cell).collect::<Vec<Cell>>();
    let others = || {
        let others = kinds().filter(|kind| !kind.declared_by.is_empty());
        others.filter(|kind| is_declared(kind, problem))
    };
    for kind in others() {
        let cells = cells_of(kind);
        // Kinds of rows may share a column, which then belongs to the kind with more filled cells.
        // A row with only the number of a point measures nothing.
        let is_taken = |other: &Kind| {
            cells.iter().all(|cell| other.field(cell.field.name).is_some())
                && cells_of(other).len() > cells.len()
        };
        let are_numbers = cells.iter().all(|cell| cell.field.content == Content::Index);
        if are_numbers || others().any(is_taken) {
            continue;
        }
        found.extend(of_kind((table, columns), kind, &cells, (problem, measured))?);
    }
    let filled = |place: usize| columns::is_filled(table, place);
    if let (true, Some((place, write))) = (found.is_empty(), columns.undeclared(problem, filled)) {
        return Err(table.cell_error(place, InputErrorKind::NotDeclared { write }));
    }
    match found.is_empty() {
        true if measured => Err(table.error(InputErrorKind::NothingMeasured)),
        true => Ok(vec![position(false)]),
        false => Ok(found),
    }
}

/// Filled cell of the current row, or the name of the file as its value.
struct Cell<'a> {
    field: &'static Field,
    /// Index of the cell's column; `None` if the name of the file is the value.
    place: Option<usize>,
    /// Name of the file without extension.
    stem: &'a str,
}

/// Returns the observation of a kind from the filled cells of its columns; `None` if the row has no
/// observation of this kind. Measured numbers may be missing unless the table has to be `measured`.
fn of_kind(
    (table, columns): (&Table, &Columns),
    kind: &Kind,
    cells: &[Cell],
    (problem, measured): (&Problem, bool),
) -> Result<Option<Observed>, InputError> {
    let Some(last) = cells.last() else { return Ok(None) };
    let is_filled = |field: &Field| cells.iter().any(|cell| cell.field.name == field.name);
    let of_table = |field: &Field| {
        only_fixture(field, problem).filter(|_| !columns.has(Role::Field(field.name)))
    };
    let mut lacking = kind
        .fields
        .iter()
        .filter(|field| field.required && !is_filled(field) && of_table(field).is_none());
    let has_number = kind.measured_fields().any(is_filled);
    let lacks = match lacking.next().map(|field| (field, field.unit())) {
        Some((field, None)) => Some(field.noun),
        Some((_, Some(_))) if has_number => Some("that of the other axis"),
        Some((_, Some(_))) if measured => Some(kind.lacking),
        _ => None,
    };
    if let (Some(lacks), Some(place)) = (lacks, last.place) {
        let kind = InputErrorKind::IncompleteObservation { has: last.field.noun, lacks };
        return Err(table.cell_error(place, kind));
    }
    let mut indices = Vec::new();
    for field in kind.references() {
        let cell = cells.iter().find(|cell| cell.field.name == field.name);
        indices.push(match (field.content, cell) {
            (Content::Index, Some(Cell { place: Some(place), .. })) => {
                point(table, *place, indices.last().copied(), problem)?
            }
            (Content::Frame, _) => frame_of(table, cell.and_then(|cell| cell.place), problem)?,
            (_, Some(cell)) => {
                let name = cell.place.map_or(Ok(cell.stem), |place| table.name(place))?;
                fixture(table, cell.place, (field.name, name), problem)?
            }
            (_, None) => match of_table(field) {
                Some(only) => only,
                None => return Ok(None),
            },
        });
    }
    let is_measured = kind.measured_fields().all(|field| !field.required || is_filled(field));
    Ok(Observation::new(kind, &indices)
        .map(|observation| Observed { observation, measured: is_measured }))
}

/// Returns the frame that a cell names, `base`, a joint by its name, or `joint3`: 0 is the base, i
/// the frame of joint i. Without a column it is the frame of the joint that the tool is mounted on.
fn frame_of(table: &Table, place: Option<usize>, problem: &Problem) -> Result<usize, InputError> {
    let Some(place) = place else { return Ok(problem.tool.joint + 1) };
    frame(table.name(place)?, &problem.joints, problem.tool.joint)
        .map_err(|kind| table.cell_error(place, kind))
}

/// Returns the number in a cell that selects a point of a marker, counted from 0. `marker` is the
/// index of the fixture.
fn point(
    table: &Table,
    place: usize,
    marker: Option<usize>,
    problem: &Problem,
) -> Result<usize, InputError> {
    let points = marker
        .and_then(|marker| problem.fixtures.get(marker))
        .map_or(0, |known| known.points.len());
    let word = table.name(place)?;
    // Programs that keep all columns as floats write the number 3 as 3.0.
    let of_float = || {
        let value = table.number(place).ok()?;
        (0..points).find(|point| (*point as f64).total_cmp(&value).is_eq())
    };
    let number = word.parse().ok().filter(|number| *number < points).or_else(of_float);
    number.ok_or_else(|| {
        let kind =
            InputErrorKind::NoSuchPoint { word: word.to_owned(), last: points.saturating_sub(1) };
        table.cell_error(place, kind)
    })
}

/// Returns the index of the fixture with a `name` whose kind has the name `word`. `place` is the
/// index of the cell's column, for errors.
fn fixture(
    table: &Table,
    place: Option<usize>,
    (word, name): (&'static str, &str),
    problem: &Problem,
) -> Result<usize, InputError> {
    let of_kind =
        || problem.fixtures.iter().enumerate().filter(|(_, fixture)| fixture.kind.word() == word);
    let found = of_kind().find(|(_, fixture)| fixture.name == name).map(|(index, _)| index);
    found.ok_or_else(|| {
        let names: Vec<&str> = of_kind().map(|(_, fixture)| fixture.name.as_str()).collect();
        let kind = unknown(word, name, &names);
        table.error_in(place, kind)
    })
}

/// Returns an error if the problem declares targets and a table of positions has no column for
/// them. In other tables each row is checked by [`check_target`].
pub(super) fn check_target_column(
    table: &Table,
    columns: &Columns,
    problem: &Problem,
) -> Result<(), InputError> {
    if problem.targets.is_empty() || columns.has(Role::Target) || columns.observes() {
        return Ok(());
    }
    Err(table.column("target").error(problem.unknown_target("")))
}

/// Returns an error if the current row names an undeclared target. A row without a target is
/// allowed only if nothing that it measures needs one. `stem` is the name of the file.
pub(super) fn check_target(
    table: &Table,
    columns: &Columns,
    (stem, observed): (&str, &[Observed]),
    problem: &Problem,
) -> Result<(), InputError> {
    if problem.targets.is_empty() {
        return Ok(());
    }
    let needs_no_target =
        |observed: &Observed| observed.observation.description().needs != Needs::Target;
    let place = columns.place(Role::Target);
    let is_blank = place.map_or(Ok(true), |place| table.text(place).map(str::is_empty))?;
    if is_blank && observed.iter().all(needs_no_target) {
        return Ok(());
    }
    let of_file = if columns.file == Some(Role::Target) { stem } else { "" };
    let word = place.map_or(Ok(of_file), |place| table.name(place))?;
    if problem.targets.iter().any(|target| target.name == word) {
        return Ok(());
    }
    Err(table.error_in(place, problem.unknown_target(word)))
}

/// Appends a row for each known distance between points that are measured or declared. Sets the
/// declared standard deviation in rows that state none.
pub(super) fn add_known_distances(
    measurements: &mut Measurements,
    problem: &Problem,
) -> Result<(), InputError> {
    if measurements.observations.is_empty() || measurements.is_empty() {
        return Ok(());
    }
    if let (Some(of_rows), Some(declared)) = (&mut measurements.target, problem.targets.first()) {
        // Tilts have no target; their rows get a target that other rows measure.
        let is_known = |word: &&String| problem.targets.iter().any(|target| target.name == **word);
        let first = of_rows.names.iter().find(is_known).unwrap_or(&declared.name);
        let words = of_rows
            .of_row
            .iter()
            .map(|&word| of_rows.names.get(word).filter(is_known).unwrap_or(first));
        *of_rows = words.collect();
    }
    let of_table = measurements.len();
    let is_located = |&fixture: &usize, observations: &[Observation]| {
        let is_known = |fixture: &Fixture| fixture.known.iter().all(Option::is_some);
        observations.contains(&Observation::Point(fixture))
            || problem.fixtures.get(fixture).is_some_and(is_known)
    };
    for distance in &problem.distances {
        if distance.between.iter().all(|point| is_located(point, &measurements.observations)) {
            measurements.add_known(distance, &problem.data.location.file);
            let observation = measurements.observation(measurements.len() - 1);
            let name = |point: usize| problem.fixtures.get(point).map(|of| of.name.clone());
            let mut names = distance.between.map(|point| name(point).unwrap_or_default());
            names.sort_unstable();
            measurements.distance_names.push((observation, names));
        }
    }
    let mut kinds: Vec<&str> = Vec::new();
    let mut without = None;
    for row in 0..of_table {
        let observation = measurements.observation(row);
        if !kinds.contains(&observation.kind()) {
            kinds.push(observation.kind());
        }
        if measurements.sigma_of(row).is_none() {
            match problem.sigma_of(observation) {
                Some(sigma) => {
                    let columns = measurements.sigma.iter_mut();
                    columns.filter_map(|column| column.get_mut(row)).for_each(|of| *of = sigma);
                }
                None => without = without.or(Some(observation)),
            }
        }
    }
    if measurements.sigma.iter().flatten().all(|sigma| sigma.is_nan()) {
        measurements.sigma = None;
    }
    match without {
        Some(observation) if kinds.len() > 1 => {
            let Kind { name, unit, .. } = observation.description();
            let write = format!("{name}_sigma_{}", unit.in_tables().suffix);
            Err(problem.data.location.clone().error(InputErrorKind::NoSigmaOfKind { write }))
        }
        _ => Ok(()),
    }
}

impl Measurements {
    /// Checks that each measured fixture with unknown numbers has more measured coordinates than
    /// unknown numbers.
    pub(super) fn check_contacts(&self, problem: &Problem) -> Result<(), InputError> {
        for (index, fixture) in problem.fixtures.iter().enumerate() {
            let is_at_it = |&row: &usize| {
                let observation = self.observation(row);
                observation.fixtures().contains(&Some(index)) && observation.is_of_arm()
            };
            let rows: Vec<usize> = (0..self.len()).filter(is_at_it).collect();
            let Some(&first) = rows.first() else { continue };
            let coordinates = rows.iter().map(|&row| self.observation(row).coordinates());
            let distances = problem.distances.iter().filter(|of| of.between.contains(&index));
            let measured = coordinates.sum::<usize>() + distances.count();
            let numbers = fixture.known.iter().filter(|known| known.is_none()).count();
            if numbers > 0 && measured <= numbers {
                let (what, name) = (fixture.kind.word(), fixture.name.clone());
                let kind = InputErrorKind::TooFewContacts { what, name, rows: rows.len(), numbers };
                return Err(self.location(first).with_key(format!("column {what}")).error(kind));
            }
        }
        Ok(())
    }

    /// Appends a known distance as a row with the conditions of the first row; `file` is the file
    /// that declares it.
    fn add_known(&mut self, distance: &KnownDistance, file: &Path) {
        let place = self.files.iter().position(|known| known == file).unwrap_or_else(|| {
            self.files.push(file.to_owned());
            self.files.len() - 1
        });
        let mut row = self.select(&[0]);
        row.origin = vec![(narrow(place), narrow(distance.location.line.unwrap_or(0)))];
        row.observations =
            vec![Observation::Between(narrow(distance.between[0]), narrow(distance.between[1]))];
        row.positions = vec![distance.length * Vector3::x()];
        row.sigma = Some(vec![distance.sigma]);
        row.nests.clear();
        row.pose = self.pose.as_ref().map(|_| vec![0.0]);
        let (marked, named) = (row.marked_held_out.take(), row.pose_names.take());
        let files = std::mem::take(&mut self.files);
        *self = Self { files, ..self.concatenate(&row) };
        if let (Some(column), Some(marked)) = (&mut self.marked_held_out, marked) {
            column.extend(marked);
        }
        if let (Some(column), Some(named)) = (&mut self.pose_names, named) {
            column.of_row.extend(named.of_row);
        }
    }

    /// Returns the rows whose prediction depends on the arm, without known distances between
    /// points.
    #[must_use]
    pub(crate) fn arm_rows(self) -> Self {
        let rows: Vec<usize> =
            (0..self.len()).filter(|&row| self.observation(row).is_of_arm()).collect();
        if rows.len() == self.len() { self } else { self.select(&rows) }
    }
}

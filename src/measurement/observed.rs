//! Observations other than positions: contacts with points and surfaces, distances to anchors,
//! tilts, known distances between points.

use std::path::Path;

use nalgebra::Vector3;

use super::Measurements;
use super::columns::Columns;
use super::role::Role;
use super::table::Table;
use crate::error::{InputError, InputErrorKind};
use crate::problem::fixture::{frame, unknown};
use crate::problem::{Fixture, KnownDistance, Observation, Problem};

/// Observation of a row with its measured numbers \[m\] or \[rad\]; those of a position are in
/// separate columns.
pub(super) struct Observed {
    pub observation: Observation,
    pub numbers: Vector3<f64>,
    /// True if the numbers have been measured.
    pub measured: bool,
}

impl Observed {
    fn position(measured: bool) -> Self {
        Self { observation: Observation::Position, numbers: Vector3::zeros(), measured }
    }
}

/// Returns all observations of the current row in the order position, point, distance, surface,
/// tilt. A table of positions has one position per row. `in_point` is the point that the whole file
/// measures. A position that is `missing` gives no observation.
pub(super) fn of_row(
    table: &Table,
    columns: &Columns,
    (problem, measured, missing): (&Problem, bool, bool),
    in_point: Option<&str>,
) -> Result<Vec<Observed>, InputError> {
    let has_position = columns.has(Role::Position(0));
    if !columns.observes() {
        return Ok(vec![Observed::position(has_position)]);
    }
    let filled = |role: Role| {
        let place = columns.place(role);
        place.filter(|&place| table.text(place).is_ok_and(|cell| !cell.is_empty()))
    };
    let of_point =
        |name: &str, place: Option<usize>| fixture(table, place, ("point", name), problem);
    let mut found = Vec::new();
    if !missing && (0..3).any(|axis| filled(Role::Position(axis)).is_some()) {
        found.push(Observed::position(true));
    }
    let in_point = match filled(Role::Point) {
        Some(place) => Some((table.name(place)?, Some(place))),
        None => in_point.map(|name| (name, None)),
    };
    if let Some((name, place)) = in_point {
        let observation = Observation::Point(of_point(name, place)?);
        found.push(Observed { observation, numbers: Vector3::zeros(), measured: true });
    }
    let incomplete = |place: usize, has, lacks| {
        Err(table.cell_error(place, InputErrorKind::IncompleteObservation { has, lacks }))
    };
    match (filled(Role::Anchor), filled(Role::Distance)) {
        (Some(place), None) if measured => return incomplete(place, "an anchor", "a distance"),
        (None, Some(place)) => return incomplete(place, "a distance", "an anchor"),
        (Some(place), distance) => {
            let observation = Observation::Distance(fixture(
                table,
                Some(place),
                ("anchor", table.name(place)?),
                problem,
            )?);
            let number =
                distance.map(|_| columns.length(table, Role::Distance)).transpose()?.unwrap_or(0.0);
            if let Some(place) = distance.filter(|_| number <= 0.0) {
                return Err(table.cell_error(place, InputErrorKind::NotPositive { value: number }));
            }
            found.push(Observed {
                observation,
                numbers: number * Vector3::x(),
                measured: distance.is_some(),
            });
        }
        (None, None) => {}
    }
    match (filled(Role::Surface), filled(Role::Offset)) {
        (None, Some(place)) => return incomplete(place, "an offset", "a surface"),
        (Some(place), offset) => {
            let observation = Observation::Surface(fixture(
                table,
                Some(place),
                ("surface", table.name(place)?),
                problem,
            )?);
            let number =
                offset.map(|_| columns.length(table, Role::Offset)).transpose()?.unwrap_or(0.0);
            found.push(Observed { observation, numbers: number * Vector3::x(), measured: true });
        }
        (None, None) => {}
    }
    match (filled(Role::Tilt(0)), filled(Role::Tilt(1)), filled(Role::Frame)) {
        (Some(_), Some(_), frame) => {
            let numbers =
                [columns.length(table, Role::Tilt(0))?, columns.length(table, Role::Tilt(1))?];
            let observation = Observation::Tilt(frame_of(table, frame, problem)?);
            found.push(Observed {
                observation,
                numbers: Vector3::new(numbers[0], numbers[1], 0.0),
                measured: true,
            });
        }
        (None, None, Some(frame)) if !measured => {
            let observation = Observation::Tilt(frame_of(table, Some(frame), problem)?);
            found.push(Observed { observation, numbers: Vector3::zeros(), measured: false });
        }
        (Some(place), None, _) | (None, Some(place), _) => {
            return incomplete(place, "a tilt", "that of the other axis");
        }
        (None, None, Some(place)) => return incomplete(place, "a frame", "its tilts"),
        (None, None, None) => {}
    }
    let filled = |place: usize| table.text(place).is_ok_and(|cell| !cell.is_empty());
    if let (true, Some((place, write))) = (found.is_empty(), columns.undeclared(problem, filled)) {
        return Err(table.cell_error(place, InputErrorKind::NotDeclared { write }));
    }
    match found.is_empty() {
        true if measured => Err(table.error(InputErrorKind::NothingMeasured)),
        true => Ok(vec![Observed::position(false)]),
        false => Ok(found),
    }
}

/// Returns the frame that a cell names: `base`, a joint by its name, or `joint3`; without a column
/// the tool's frame.
fn frame_of(table: &Table, place: Option<usize>, problem: &Problem) -> Result<usize, InputError> {
    let Some(place) = place else { return Ok(problem.tool.joint + 1) };
    frame(table.name(place)?, &problem.joints, problem.tool.joint)
        .map_err(|kind| table.cell_error(place, kind))
}

/// Returns the fixture that a cell names.
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
        match place {
            Some(place) => table.cell_error(place, kind),
            None => table.error(kind),
        }
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
/// allowed only if it measures tilts alone. `stem` is the name of the file.
pub(super) fn check_target(
    table: &Table,
    columns: &Columns,
    (stem, observed): (&str, &[Observed]),
    problem: &Problem,
) -> Result<(), InputError> {
    if problem.targets.is_empty() {
        return Ok(());
    }
    let place = columns.place(Role::Target);
    let is_blank = place.map_or(Ok(true), |place| table.text(place).map(str::is_empty))?;
    if is_blank && observed.iter().all(|observed| observed.observation.is_angle()) {
        return Ok(());
    }
    let of_file = if columns.file == Some(Role::Target) { stem } else { "" };
    let word = place.map_or(Ok(of_file), |place| table.name(place))?;
    if problem.targets.iter().any(|target| target.name == word) {
        return Ok(());
    }
    let kind = problem.unknown_target(word);
    Err(match place {
        Some(place) => table.cell_error(place, kind),
        None => table.error(kind),
    })
}

/// Appends a row for each known distance between points and sets the standard deviation of every
/// row.
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
            match problem.data.sigma_of(observation) {
                Some(sigma) => measurements.set_sigma(row, sigma),
                None => without = without.or(Some(observation)),
            }
        }
    }
    if measurements.sigma.iter().flatten().all(|sigma| sigma.is_nan()) {
        measurements.sigma = None;
    }
    match without {
        Some(observation) if kinds.len() > 1 => {
            let unit = if observation.is_angle() { "deg" } else { "mm" };
            let write = format!("{}_sigma_{unit}", observation.kind());
            Err(problem.data.location.clone().error(InputErrorKind::NoSigmaOfKind { write }))
        }
        _ => Ok(()),
    }
}

impl Measurements {
    /// Checks that each unknown fixture has more measurements than unknown coordinates.
    pub(super) fn enough_contacts(&self, problem: &Problem) -> Result<(), InputError> {
        for (index, fixture) in problem.fixtures.iter().enumerate() {
            let rows: Vec<usize> = (0..self.len())
                .filter(|&row| self.observation(row).fixture() == Some(index))
                .collect();
            let Some(&first) = rows.first() else { continue };
            let known = problem
                .distances
                .iter()
                .filter(|distance| distance.between.contains(&index))
                .count();
            let measured =
                rows.iter().map(|&row| self.observation(row).coordinates()).sum::<usize>() + known;
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
        let narrow = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
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

    /// Returns the rows in which the arm takes part, without known distances between points.
    #[must_use]
    pub(crate) fn arm_rows(self) -> Self {
        let rows: Vec<usize> =
            (0..self.len()).filter(|&row| self.observation(row).is_of_arm()).collect();
        if rows.len() == self.len() { self } else { self.select(&rows) }
    }

    fn set_sigma(&mut self, row: usize, value: f64) {
        if let Some(sigma) = self.sigma.as_mut().and_then(|column| column.get_mut(row)) {
            *sigma = value;
        }
    }
}

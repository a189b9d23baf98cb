//! What rows measure besides positions: contacts with points and surfaces, distances to anchors,
//! known distances between points.

use std::path::Path;

use nalgebra::Vector3;

use super::Measurements;
use super::columns::Columns;
use super::role::Role;
use super::table::Table;
use crate::error::{InputError, InputErrorKind};
use crate::problem::fixture::{frame, unknown};
use crate::problem::{Fixture, KnownDistance, Observation, Problem};

/// Something that a row measures, and its numbers \[m\]; those of a position are in its own
/// columns.
pub(super) struct Observed {
    pub observation: Observation,
    pub numbers: Vector3<f64>,
    /// Whether they have been measured.
    pub measured: bool,
}

impl Observed {
    fn position(measured: bool) -> Self {
        Self { observation: Observation::Position, numbers: Vector3::zeros(), measured }
    }
}

/// Everything that the row measures which the table is at, in the order position, point, distance,
/// surface; a table of positions alone measures one in every row, and `in_point` is where the whole
/// file is. A position that is `lost` is none.
pub(super) fn of_row(
    table: &Table,
    columns: &Columns,
    (problem, measured, lost): (&Problem, bool, bool),
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
    let mut all = Vec::new();
    if !lost && (0..3).any(|axis| filled(Role::Position(axis)).is_some()) {
        all.push(Observed::position(true));
    }
    let in_point = match filled(Role::Point) {
        Some(place) => Some((table.name(place)?, Some(place))),
        None => in_point.map(|name| (name, None)),
    };
    if let Some((name, place)) = in_point {
        let observation = Observation::Point(of_point(name, place)?);
        all.push(Observed { observation, numbers: Vector3::zeros(), measured: true });
    }
    let lone = |place: usize, has, lacks| {
        Err(table.cell_error(place, InputErrorKind::HalfObserved { has, lacks }))
    };
    match (filled(Role::Anchor), filled(Role::Distance)) {
        (Some(place), None) if measured => return lone(place, "an anchor", "a distance"),
        (None, Some(place)) => return lone(place, "a distance", "an anchor"),
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
            all.push(Observed {
                observation,
                numbers: number * Vector3::x(),
                measured: distance.is_some(),
            });
        }
        (None, None) => {}
    }
    match (filled(Role::Surface), filled(Role::Offset)) {
        (None, Some(place)) => return lone(place, "an offset", "a surface"),
        (Some(place), offset) => {
            let observation = Observation::Surface(fixture(
                table,
                Some(place),
                ("surface", table.name(place)?),
                problem,
            )?);
            let number =
                offset.map(|_| columns.length(table, Role::Offset)).transpose()?.unwrap_or(0.0);
            all.push(Observed { observation, numbers: number * Vector3::x(), measured: true });
        }
        (None, None) => {}
    }
    match (filled(Role::Tilt(0)), filled(Role::Tilt(1)), filled(Role::Frame)) {
        (Some(_), Some(_), frame) => {
            let numbers =
                [columns.length(table, Role::Tilt(0))?, columns.length(table, Role::Tilt(1))?];
            let observation = Observation::Tilt(frame_of(table, frame, problem)?);
            all.push(Observed {
                observation,
                numbers: Vector3::new(numbers[0], numbers[1], 0.0),
                measured: true,
            });
        }
        (None, None, Some(frame)) if !measured => {
            let observation = Observation::Tilt(frame_of(table, Some(frame), problem)?);
            all.push(Observed { observation, numbers: Vector3::zeros(), measured: false });
        }
        (Some(place), None, _) | (None, Some(place), _) => {
            return lone(place, "a tilt", "that of the other axis");
        }
        (None, None, Some(place)) => return lone(place, "a frame", "its tilts"),
        (None, None, None) => {}
    }
    let filled = |place: usize| table.text(place).is_ok_and(|cell| !cell.is_empty());
    if let (true, Some((place, write))) = (all.is_empty(), columns.undeclared(problem, filled)) {
        return Err(table.cell_error(place, InputErrorKind::NotDeclared { write }));
    }
    match all.is_empty() {
        true if measured => Err(table.error(InputErrorKind::NothingMeasured)),
        true => Ok(vec![Observed::position(false)]),
        false => Ok(all),
    }
}

/// The frame that a cell names: `base`, a joint by its name, or `joint3`; that of the tool without
/// a word.
fn frame_of(table: &Table, place: Option<usize>, problem: &Problem) -> Result<usize, InputError> {
    let Some(place) = place else { return Ok(problem.tool.joint + 1) };
    frame(table.name(place)?, &problem.joints, problem.tool.joint)
        .map_err(|kind| table.cell_error(place, kind))
}

/// The fixture that a cell names.
fn fixture(
    table: &Table,
    place: Option<usize>,
    (word, name): (&'static str, &str),
    problem: &Problem,
) -> Result<usize, InputError> {
    let of_kind = || problem.fixtures.iter().enumerate().filter(|(_, own)| own.kind.word() == word);
    let found = of_kind().find(|(_, own)| own.name == name).map(|(index, _)| index);
    found.ok_or_else(|| {
        let names: Vec<&str> = of_kind().map(|(_, own)| own.name.as_str()).collect();
        let kind = unknown(word, name, &names);
        match place {
            Some(place) => table.cell_error(place, kind),
            None => table.error(kind),
        }
    })
}

/// Refuses a table of positions without a column of targets where the problem declares some; where
/// rows may measure something else each of them decides.
pub(super) fn names_targets(
    table: &Table,
    columns: &Columns,
    problem: &Problem,
) -> Result<(), InputError> {
    if problem.targets.is_empty() || columns.has(Role::Target) || columns.observes() {
        return Ok(());
    }
    Err(table.column("target").error(problem.unknown_target("")))
}

/// Refuses the row that the table is at, in a file with this `stem`, where it names a target that
/// the problem does not declare among others, or names none and measures more than tilts.
pub(super) fn known_target(
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
    if is_blank && observed.iter().all(|own| own.observation.is_angle()) {
        return Ok(());
    }
    let of_file = if columns.file == Some(Role::Target) { stem } else { "" };
    let word = place.map_or(Ok(of_file), |place| table.name(place))?;
    if problem.targets.iter().any(|own| own.name == word) {
        return Ok(());
    }
    let kind = problem.unknown_target(word);
    Err(match place {
        Some(place) => table.cell_error(place, kind),
        None => table.error(kind),
    })
}

/// Adds the known distances between points as rows of their own, behind the others, and settles the
/// σ of every row.
pub(super) fn complete(
    measurements: &mut Measurements,
    problem: &Problem,
) -> Result<(), InputError> {
    if measurements.observations.is_empty() || measurements.is_empty() {
        return Ok(());
    }
    if let (Some(of_rows), Some(declared)) = (&mut measurements.target, problem.targets.first()) {
        // Tilts are of no target: their rows go with one that others measure.
        let is_known = |word: &&String| problem.targets.iter().any(|own| own.name == **word);
        let first = of_rows.names.iter().find(is_known).unwrap_or(&declared.name);
        let words = of_rows
            .of_row
            .iter()
            .map(|&word| of_rows.names.get(word).filter(is_known).unwrap_or(first));
        *of_rows = words.collect();
    }
    let of_table = measurements.len();
    let touched = |&fixture: &usize, all: &[Observation]| {
        let is_known = |own: &Fixture| own.known.iter().all(Option::is_some);
        all.contains(&Observation::Point(fixture))
            || problem.fixtures.get(fixture).is_some_and(is_known)
    };
    for distance in &problem.distances {
        if distance.between.iter().all(|point| touched(point, &measurements.observations)) {
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
    /// Whether rows tell more of every fixture that is not known than where it is.
    pub(super) fn enough_contacts(&self, problem: &Problem) -> Result<(), InputError> {
        for (index, fixture) in problem.fixtures.iter().enumerate() {
            let rows: Vec<usize> = (0..self.len())
                .filter(|&row| self.observation(row).fixture() == Some(index))
                .collect();
            let Some(&first) = rows.first() else { continue };
            let known = problem.distances.iter().filter(|own| own.between.contains(&index)).count();
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

    /// Adds a known distance as a row, under the conditions of the first one; `file` declares it.
    fn add_known(&mut self, distance: &KnownDistance, file: &Path) {
        let place = self.files.iter().position(|own| own == file).unwrap_or_else(|| {
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
        let all = std::mem::take(&mut self.files);
        *self = Self { files: all, ..self.and(&row) };
        if let (Some(own), Some(marked)) = (&mut self.marked_held_out, marked) {
            own.extend(marked);
        }
        if let (Some(own), Some(named)) = (&mut self.pose_names, named) {
            own.of_row.extend(named.of_row);
        }
    }

    /// The rows in which the arm takes part: known distances between points left out.
    #[must_use]
    pub fn of_the_arm(self) -> Self {
        let rows: Vec<usize> =
            (0..self.len()).filter(|&row| self.observation(row).is_of_arm()).collect();
        if rows.len() == self.len() { self } else { self.select(&rows) }
    }

    fn set_sigma(&mut self, row: usize, value: f64) {
        if let Some(own) = self.sigma.as_mut().and_then(|all| all.get_mut(row)) {
            *own = value;
        }
    }
}

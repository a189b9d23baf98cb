//! What `predict` says and writes, and the residuals of `identify` and `loop` as a table.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{UnitQuaternion, Vector3};

use super::document::{Block, Table};
use super::json::{Spread, Summary, object, to_text};
use super::quantity::{fixed, mm};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::identify::{ErrorSummary, ErrorsBySession, PointSpread, Prediction, Residual};
use crate::measurement::Measurements;
use crate::problem::{Fixture, Observation, Problem};

/// Columns of a predicted orientation, a rotation vector.
const PREDICTED_TURN: &str = "predicted_rx_deg,predicted_ry_deg,predicted_rz_deg";

object! {
    Document<'a>(errors: &'a ErrorsBySession, spreads: &'a [PointSpread]) {
        all: Summary = Summary::of(&errors.all),
        sessions: BTreeMap<String, Summary> =
            errors.sessions.iter().map(|(name, own)| (name.clone(), Summary::of(own))).collect(),
        #[serde(skip_serializing_if = "BTreeMap::is_empty")]
        spread: BTreeMap<&'a str, Spread> = spreads.iter().map(|own| (own.point.as_str(), Spread::of(own))).collect(),
    }
}

/// Errors of all rows and of each session, and the spread at each point, as JSON text, ending in a line break.
pub fn errors_json(errors: &ErrorsBySession, spreads: &[PointSpread]) -> String {
    to_text(&Document::of(errors, spreads))
}

/// Predicted positions as CSV: file and line of each row, what names it, its commands, and where the arm will be.
pub fn predictions_csv(problem: &Problem, rows: &Measurements, prediction: &Prediction) -> String {
    let (names, joints) = (RowNames::of(problem, rows), table::commands(problem));
    let mut header = names.header();
    header.extend(joints.iter().map(|(_, name, _)| name.clone()));
    header.extend(table::names("predicted_x_mm,predicted_y_mm,predicted_z_mm"));
    header.extend(prediction.orientations.iter().flat_map(|_| table::names(PREDICTED_TURN)));
    let line = |(row, position): (usize, &Vector3<f64>)| {
        let mut cells = names.cells(row);
        cells.extend(joints.iter().map(|&(j, _, factor)| fixed(rows.configuration(row)[j] * factor, 7)));
        cells.extend(position.iter().map(|x| fixed(x * 1e3, 6)));
        cells.extend(
            prediction.orientations.iter().flat_map(|all| all[row].iter().map(|turn| fixed(turn.to_degrees(), 7))),
        );
        cells
    };
    csv(header, prediction.positions.iter().enumerate().map(line))
}

/// What an arm leaves of measurements as CSV, a row for each thing that theirs measure; `whitened` is the length of the residual in
/// units of σ.
pub fn residuals_csv(problem: &Problem, rows: &Measurements, residuals: &[Residual]) -> String {
    let names = RowNames::of(problem, rows);
    let mut header = names.header();
    let turned = residuals.iter().any(|residual| residual.orientation.is_some());
    let kinds = columns_of_kinds(rows);
    let named = |word: &str, unit: &str, all: &[&str]| {
        all.iter().map(|name| format!("{word}_{name}_{unit}")).collect::<Vec<_>>()
    };
    let turns: &[&str] = if turned { &["rx", "ry", "rz"] } else { &[] };
    for word in ["predicted", "residual"] {
        for (kind, columns) in &kinds {
            header.extend(named(word, if *kind == "tilt" { "deg" } else { "mm" }, columns));
        }
        header.extend(named(word, "deg", turns));
    }
    header.extend(table::names("whitened,outlier,held_out"));
    let line = |residual: &Residual| {
        let row = residual.row;
        let mut cells = names.cells(row);
        let own = columns_of(rows.observation(row));
        let numbers = |cells: &mut Vec<String>, values: &Vector3<f64>| {
            for (kind, columns) in &kinds {
                let cell =
                    |axis: usize| if *kind == own.0 { fixed(in_unit(own.0, values[axis]), 6) } else { String::new() };
                cells.extend((0..columns.len()).map(cell));
            }
        };
        let degrees = |cells: &mut Vec<String>, turn: Option<Vector3<f64>>| {
            let cell = |k: usize| turn.map_or(String::new(), |turn| fixed(turn[k].to_degrees(), 7));
            cells.extend((0..turns.len()).map(cell));
        };
        numbers(&mut cells, &residual.predicted);
        let predicted = residual
            .orientation
            .zip(rows.orientations.as_ref())
            .map(|(turn, measured)| (UnitQuaternion::from_scaled_axis(-turn) * measured[row]).scaled_axis());
        degrees(&mut cells, predicted);
        numbers(&mut cells, &residual.position);
        degrees(&mut cells, residual.orientation);
        cells.push(fixed(residual.length(), 4));
        cells.extend([residual.outlier, residual.held_out].map(|word| word.to_string()));
        cells
    };
    csv(header, residuals.iter().map(line))
}

/// A number in the unit of its column: degrees of tilts, else millimetres.
fn in_unit(kind: &str, value: f64) -> f64 {
    if kind == "tilt" { value.to_degrees() } else { value * 1e3 }
}

/// The columns of a kind of rows, and how that is called: positions and contacts with points share theirs.
fn columns_of(observation: Observation) -> (&'static str, &'static [&'static str]) {
    match observation {
        Observation::Position | Observation::Point(_) => ("position", &["x", "y", "z"]),
        Observation::Distance(_) | Observation::Between(..) => ("distance", &["distance"]),
        Observation::Surface(_) => ("offset", &["offset"]),
        Observation::Tilt(_) => ("tilt", &["tilt_x", "tilt_y"]),
    }
}

/// The columns that some rows need.
fn columns_of_kinds(rows: &Measurements) -> Vec<(&'static str, &'static [&'static str])> {
    let mut all: Vec<(&'static str, &'static [&'static str])> = Vec::new();
    for own in rows.kinds().into_iter().map(columns_of) {
        if !all.contains(&own) {
            all.push(own);
        }
    }
    if all.is_empty() { vec![columns_of(Observation::Position)] } else { all }
}

/// What came of a prediction, in words.
pub fn prediction_text(problem: &Problem, arm: &str, prediction: &Prediction) -> String {
    let mut words = format!("{}\n{} poses predicted for {arm}", problem.title, prediction.positions.len());
    let lost = prediction.positions.iter().filter(|position| !position.iter().all(|x| x.is_finite())).count();
    if lost > 0 {
        let _ = write!(words, "; {lost} of them have no equilibrium");
    }
    let mut blocks = vec![Block::lines(words)];
    if !prediction.placed.is_empty() {
        let names = prediction.placed.join(", ");
        blocks.push(Block::lines(format!("Fitted to these rows, with the arm as it is: {names}")));
    }
    if let Some(errors) = &prediction.errors {
        let row = |name: &str, of: &ErrorSummary| {
            let values = [of.mean.norm, of.rms.norm, of.max.norm].map(|value| mm(value, 4));
            [vec![name.to_owned(), of.n.to_string()], values.to_vec()].concat()
        };
        let mut rows = vec![row("all rows", &errors.all)];
        rows.extend(errors.sessions.iter().map(|(name, own)| row(&format!("session {name}"), own)));
        blocks.push(Block::Table(Table::new(&["error, mm", "poses", "mean", "rms", "max"], rows, &[0])));
    }
    text(&blocks)
}

/// The columns by which a row is known: file, line, and the words and numbers of its table that name it.
struct RowNames<'a> {
    rows: &'a Measurements,
    /// What contacts speak of, and the columns that name it.
    fixtures: &'a [Fixture],
    words: Vec<&'static str>,
}

impl<'a> RowNames<'a> {
    fn of(problem: &'a Problem, rows: &'a Measurements) -> Self {
        let fixtures = &problem.fixtures;
        let mut words = Vec::new();
        for fixture in (0..rows.len()).filter_map(|row| fixtures.get(rows.observation(row).fixture()?)) {
            if !words.contains(&fixture.kind.word()) {
                words.push(fixture.kind.word());
            }
        }
        Self { rows, fixtures, words }
    }

    fn header(&self) -> Vec<String> {
        let Measurements { pose, pose_names, target, .. } = self.rows;
        let there = [
            ("pose", pose.is_some() || pose_names.is_some()),
            ("session", table::sessions(self.rows).is_some()),
            ("target", target.is_some()),
        ];
        let own = there.into_iter().filter(|(_, there)| *there).map(|(name, _)| name);
        ["file", "line"].into_iter().chain(own).chain(self.words.iter().copied()).map(str::to_owned).collect()
    }

    fn cells(&self, row: usize) -> Vec<String> {
        let Measurements { pose, pose_names, target, .. } = self.rows;
        let place = self.rows.location(row);
        let mut cells = vec![place.file.display().to_string(), place.line.unwrap_or(0).to_string()];
        cells.extend(pose.as_ref().map(|all| all[row].to_string()));
        cells.extend(pose_names.as_ref().map(|all| table::word(all, row)));
        cells.extend(
            [table::sessions(self.rows), target.as_ref()].into_iter().flatten().map(|all| table::word(all, row)),
        );
        let own = self.rows.observation(row).fixture().and_then(|own| self.fixtures.get(own));
        let named =
            |word: &str| own.filter(|own| own.kind.word() == word).map_or(String::new(), |own| own.name.clone());
        cells.extend(self.words.iter().map(|word| named(word)));
        cells
    }
}

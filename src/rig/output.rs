//! Output of a simulation: table of measurements and its truth.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::draw::{Row, Simulation};
use super::effect::{Cause, Shape, TrueEffect, keys};
use super::parameters::TrueParameter;
use crate::files::{Format, PROGRAM, csv};
use crate::observation::{Field, Kind, kinds};
use crate::problem::fixture::reference_cells;
use crate::problem::{Joint, JointKind, Observation};
use crate::quantity::Unit;

/// Name of the format of `truth.json`.
pub const TRUTH_FORMAT: &str = "flexcal-truth";

/// Content of a `truth.json`.
#[derive(Serialize, JsonSchema)]
pub struct SavedTruth<'a> {
    format: Format,
    program: &'static str,
    problem: &'a str,
    seed: u64,
    poses: usize,
    held_out: usize,
    position_sigma_mm: f64,
    segments: usize,
    effects: Vec<Value>,
    parameters: Vec<Parameter<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct Parameter<'a> {
    name: &'a str,
    unit: Cow<'static, str>,
    nominal: f64,
    #[serde(rename = "true")]
    value: f64,
}

impl Simulation {
    /// Returns the text of `measurements.csv`.
    pub fn csv(&self) -> String {
        let kinds: Vec<&Kind> = self.kinds().collect();
        let columns = (self.names_targets(), kinds.as_slice());
        let rows = self.pose_numbers().into_iter().zip(&self.rows);
        csv(self.header(columns), rows.map(|(pose, row)| self.cells(pose, row, columns)))
    }

    /// Returns the number of the pose of each row, from 1. The rows of all points of one image have
    /// the same number.
    fn pose_numbers(&self) -> Vec<usize> {
        let is_point = |row: &Row| matches!(row.observation, Observation::Pixel(..));
        let mut before: Option<&Row> = None;
        let number = |pose: &mut usize, row| {
            let is_same = before.is_some_and(|before: &Row| {
                is_point(row)
                    && is_point(before)
                    && before.conditions.time.to_bits() == row.conditions.time.to_bits()
                    && before.conditions.configuration == row.conditions.configuration
            });
            before = Some(row);
            *pose += usize::from(!is_same);
            Some(*pose)
        };
        self.rows.iter().scan(0, number).collect()
    }

    /// Returns the number of poses.
    pub(crate) fn poses(&self) -> usize {
        self.pose_numbers().last().copied().unwrap_or(0)
    }

    /// Returns the commanded joints: index, and true for a revolute joint.
    fn moving(&self) -> impl Iterator<Item = (usize, bool)> {
        let joints = self.joints.iter().map(Joint::command_kind).enumerate();
        joints
            .filter(|(_, kind)| *kind != JointKind::Fixed)
            .map(|(index, kind)| (index, kind == JointKind::Revolute))
    }

    /// Returns true if rows name their targets.
    fn names_targets(&self) -> bool {
        self.rows.iter().any(|row| !row.target.is_empty())
    }

    /// Returns the column names of `measurements.csv`; there is a column of targets if
    /// `names_targets`, and there are columns of each of the `kinds`.
    fn header(&self, (names_targets, kinds): (bool, &[&Kind])) -> Vec<String> {
        let first = self.rows.first().map(|row| row.conditions.clone()).unwrap_or_default();
        let mut names = vec!["pose".to_owned(), self.split_column.clone()];
        let unit = |turns| if turns { "deg" } else { "m" };
        names.extend(self.moving().map(|(index, turns)| format!("q{}_{}", index + 1, unit(turns))));
        let columns = [
            (self.truth.orientation_sigma.is_some(), "rx_deg"),
            (self.truth.orientation_sigma.is_some(), "ry_deg"),
            (self.truth.orientation_sigma.is_some(), "rz_deg"),
            (first.payload.is_some(), "payload_kg"),
            (first.hoist.is_some(), "hoist_N"),
            (first.temperature.is_some(), "temperature_C"),
            (true, "time_s"),
        ];
        names.extend(names_targets.then(|| "target".to_owned()));
        for kind in kinds {
            names.extend(kind.references().map(|field| field.name.to_owned()));
            let suffix = kind.unit.in_tables().suffix;
            names.extend(measured(kind).map(|field| format!("{}_{suffix}", field.name)));
        }
        names.extend(
            columns.into_iter().filter(|(exists, _)| *exists).map(|(_, name)| name.to_owned()),
        );
        names.extend(self.covariates.iter().cloned());
        if first.approach.is_some() {
            names.extend(self.moving().map(|(index, _)| format!("approach{}", index + 1)));
        }
        names
    }

    /// Returns the cells of a row in the order of the header; `pose` is the number of its pose.
    fn cells(
        &self,
        pose: usize,
        row: &Row,
        (names_targets, kinds): (bool, &[&Kind]),
    ) -> Vec<String> {
        let conditions = &row.conditions;
        let split = if row.held_out { "validation" } else { "identification" };
        let mut cells = vec![pose.to_string(), split.to_owned()];
        cells.extend(self.moving().map(|(index, turns)| {
            match conditions.configuration.get(index).copied().unwrap_or(0.0) {
                q if turns => format!("{:.6}", q.to_degrees()),
                q => format!("{q:.9}"),
            }
        }));
        cells.extend(names_targets.then(|| row.target.clone()));
        self.push_measured_cells(row, kinds, &mut cells);
        let turn =
            row.orientation.map(|orientation| orientation.scaled_axis().map(f64::to_degrees));
        let has_orientations = self.truth.orientation_sigma.is_some();
        let angles = turn.map_or([const { String::new() }; 3], |turn| {
            turn.map(|angle| format!("{angle:.7}")).into()
        });
        cells.extend(angles.into_iter().filter(|_| has_orientations));
        cells.extend(conditions.payload.map(|mass| mass.to_string()));
        cells.extend(conditions.hoist.map(|force| format!("{force:.3}")));
        cells.extend(conditions.temperature.map(|temperature| format!("{temperature:.2}")));
        cells.push(format!("{:.1}", conditions.time));
        cells.extend(conditions.covariates.iter().map(f64::to_string));
        if let Some(approach) = &conditions.approach {
            cells.extend(
                self.moving().map(|(index, _)| approach.get(index).unwrap_or(&0.0).to_string()),
            );
        }
        cells
    }

    /// Returns the kinds of rows in the table.
    fn kinds(&self) -> impl Iterator<Item = &'static Kind> {
        kinds().filter(|kind| self.rows.iter().any(|row| row.observation.kind() == kind.name))
    }

    /// Appends the measured values of a row to `cells`. The columns of the other `kinds` of rows in
    /// the table get empty cells.
    fn push_measured_cells(&self, row: &Row, kinds: &[&Kind], cells: &mut Vec<String>) {
        for kind in kinds {
            let is_of_kind = row.observation.kind() == kind.name;
            let cell = |text: String| if is_of_kind { text } else { String::new() };
            for field in kind.references() {
                let mut words = reference_cells(&self.rig.arm, row.observation);
                let word = words.find(|(reference, _)| reference.name == field.name);
                cells.push(cell(word.map(|(_, word)| word).unwrap_or_default()));
            }
            let decimals = if kind.unit == Unit::Length { 6 } else { 7 };
            for (_, value) in measured(kind).zip(&row.position) {
                cells.push(cell(format!("{:.*}", decimals, value * kind.unit.in_tables().factor)));
            }
        }
    }

    /// Returns the text of `truth.json`.
    #[doc(hidden)]
    pub fn truth_json(&self) -> String {
        let document = SavedTruth {
            format: Format::current(TRUTH_FORMAT),
            program: PROGRAM,
            problem: &self.problem,
            seed: self.seed,
            poses: self.poses(),
            held_out: self.held_out(),
            position_sigma_mm: self.truth.noise_sigma * 1e3,
            segments: self.truth.segments,
            effects: self
                .truth
                .effects
                .iter()
                .map(|effect| effect_json(effect, &self.joints))
                .collect(),
            parameters: self.parameters.iter().map(parameter).collect(),
        };
        // Numbers and texts always have a JSON form.
        serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
    }

    /// Returns the names of the true effects as in files; `outside-catalogue` for one that is not
    /// in the catalogue.
    pub(crate) fn effect_names(&self) -> Vec<String> {
        let name = |effect| {
            effect_json(effect, &self.joints)
                .get("effect")
                .and_then(Value::as_str)
                .unwrap_or_default()
                .to_owned()
        };
        self.truth.effects.iter().map(name).collect()
    }

    /// Returns the number of held-out poses.
    pub(crate) fn held_out(&self) -> usize {
        let rows = self.pose_numbers().into_iter().zip(&self.rows);
        let mut held_out: Vec<usize> =
            rows.filter(|(_, row)| row.held_out).map(|(pose, _)| pose).collect();
        held_out.dedup();
        held_out.len()
    }
}

fn parameter(parameter: &TrueParameter) -> Parameter<'_> {
    Parameter {
        name: &parameter.name,
        unit: parameter.unit.symbol(),
        nominal: parameter.nominal,
        value: parameter.value,
    }
}

/// Returns an effect as JSON: its name, arguments and values.
fn effect_json(effect: &TrueEffect, joints: &[Joint]) -> Value {
    let mut entry = match effect.cause() {
        Cause::Outside { joint, shape } => json!({
            "effect": "outside-catalogue",
            "where": format!("joint {joint}"),
            "depends_on": [format!("q{joint}")],
            "shape": match shape { Shape::Bump => "bump", Shape::Step => "step" },
        }),
        Cause::Catalogued(effect) => serde_json::to_value(effect).unwrap_or_default(),
    };
    let names = keys(effect.cause(), joints);
    let values: Map<String, Value> = names
        .iter()
        .zip(effect.values())
        .map(|((name, unit), value)| (format!("{name}_{}", unit.si_suffix()), json!(value)))
        .collect();
    if let Some(entry) = entry.as_object_mut() {
        entry.insert("values".to_owned(), Value::Object(values));
    }
    entry
}

/// Returns the columns of the numbers that every row of a kind measures.
fn measured(kind: &Kind) -> impl Iterator<Item = &'static Field> {
    kind.measured_fields().filter(|field| field.required)
}

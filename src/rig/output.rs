//! Output of a simulation: table of measurements and its truth.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::draw::{Row, Simulation};
use super::effect::{Cause, Shape, TrueEffect, keys};
use super::parameters::TrueParameter;
use crate::files::csv;
use crate::problem::fixture::frame_word;
use crate::problem::{Joint, JointKind, Observation};

#[derive(Serialize)]
struct Document<'a> {
    format: Value,
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

#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    unit: &'static str,
    nominal: f64,
    #[serde(rename = "true")]
    value: f64,
}

impl Simulation {
    /// Returns the text of `measurements.csv`.
    pub fn csv(&self) -> String {
        let rows = self.rows.iter().enumerate().map(|(index, row)| self.cells(index + 1, row));
        csv(self.header(), rows)
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

    fn header(&self) -> Vec<String> {
        let first = self.rows.first().map(|row| row.conditions.clone()).unwrap_or_default();
        let mut names = vec!["pose".to_owned(), self.split_column.clone()];
        let unit = |turns| if turns { "deg" } else { "m" };
        names.extend(self.moving().map(|(index, turns)| format!("q{}_{}", index + 1, unit(turns))));
        let has = |word| self.rows.iter().any(|row| self.word(row) == word);
        let columns = [
            (has(""), "x_mm"),
            (has(""), "y_mm"),
            (has(""), "z_mm"),
            (has("point"), "point"),
            (has("anchor"), "anchor"),
            (has("anchor"), "distance_mm"),
            (has("surface"), "surface"),
            (has("frame"), "frame"),
            (has("frame"), "tilt_x_deg"),
            (has("frame"), "tilt_y_deg"),
            (self.truth.orientation_sigma.is_some(), "rx_deg"),
            (self.truth.orientation_sigma.is_some(), "ry_deg"),
            (self.truth.orientation_sigma.is_some(), "rz_deg"),
            (first.payload.is_some(), "payload_kg"),
            (first.hoist.is_some(), "hoist_N"),
            (first.temperature.is_some(), "temperature_C"),
            (true, "time_s"),
        ];
        names.extend(self.names_targets().then(|| "target".to_owned()));
        names.extend(
            columns.into_iter().filter(|(exists, _)| *exists).map(|(_, name)| name.to_owned()),
        );
        names.extend(self.covariates.iter().cloned());
        if first.approach.is_some() {
            names.extend(self.moving().map(|(index, _)| format!("approach{}", index + 1)));
        }
        names
    }

    fn cells(&self, pose: usize, row: &Row) -> Vec<String> {
        let conditions = &row.conditions;
        let split = if row.held_out { "validation" } else { "identification" };
        let mut cells = vec![pose.to_string(), split.to_owned()];
        cells.extend(self.moving().map(|(index, turns)| {
            match conditions.configuration.get(index).copied().unwrap_or(0.0) {
                q if turns => format!("{:.6}", q.to_degrees()),
                q => format!("{q:.9}"),
            }
        }));
        cells.extend(self.names_targets().then(|| row.target.clone()));
        self.observed(row, &mut cells);
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

    /// Returns the word of the fixture that a row measures against; empty for a position.
    fn word(&self, row: &Row) -> &'static str {
        if row.observation.is_angle() {
            return "frame";
        }
        row.observation
            .fixture()
            .and_then(|fixture| self.fixtures.get(fixture))
            .map_or("", |fixture| fixture.kind.word())
    }

    /// Adds the measured values, in the columns of all kinds of measurement in the table.
    fn observed(&self, row: &Row, cells: &mut Vec<String>) {
        let has = |word| self.rows.iter().any(|row| self.word(row) == word);
        let name = row
            .observation
            .fixture()
            .and_then(|fixture| self.fixtures.get(fixture))
            .map_or("", |fixture| fixture.name.as_str());
        let row_word = self.word(row);
        let cell = |word: &str, text: String| if row_word == word { text } else { String::new() };
        if has("") {
            cells.extend(row.position.iter().map(|x| cell("", format!("{:.6}", x * 1e3))));
        }
        for word in ["point", "anchor", "surface"].into_iter().filter(|word| has(word)) {
            cells.push(cell(word, name.to_owned()));
            if word == "anchor" {
                cells.push(cell(word, format!("{:.6}", row.position.x * 1e3)));
            }
        }
        if has("frame") {
            let tool = self.rig.arm.tool.joint;
            let word = |frame| frame_word(frame, &self.joints, tool);
            cells.push(if let Observation::Tilt(frame) = row.observation {
                word(frame)
            } else {
                String::new()
            });
            let angle = |angle: f64| cell("frame", format!("{:.7}", angle.to_degrees()));
            cells.extend([angle(row.position.x), angle(row.position.y)]);
        }
    }

    /// Returns the text of `truth.json`.
    pub(crate) fn truth_json(&self) -> String {
        let document = Document {
            format: serde_json::json!({ "name": "flexcal-truth", "version": 2 }),
            program: concat!("flexcal ", env!("CARGO_PKG_VERSION")),
            problem: &self.problem,
            seed: self.seed,
            poses: self.rows.len(),
            held_out: self.held_out(),
            position_sigma_mm: self.truth.noise_sigma * 1e3,
            segments: self.truth.segments,
            effects: self
                .truth
                .effects
                .iter()
                .map(|effect| described(effect, &self.joints))
                .collect(),
            parameters: self.parameters.iter().map(parameter).collect(),
        };
        // Numbers and texts always have a JSON form.
        serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
    }

    /// Returns the names of the true effects.
    pub(crate) fn effect_names(&self) -> Vec<String> {
        let name = |effect| {
            described(effect, &self.joints)
                .get("effect")
                .and_then(Value::as_str)
                .unwrap_or_default()
                .to_owned()
        };
        self.truth.effects.iter().map(name).collect()
    }

    /// Returns the number of held-out rows.
    pub(crate) fn held_out(&self) -> usize {
        self.rows.iter().filter(|row| row.held_out).count()
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
fn described(effect: &TrueEffect, joints: &[Joint]) -> Value {
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

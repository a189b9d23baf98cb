//! Exported tables, multiplied out again.

use std::collections::HashMap;

use flexcal::export::{Geometry, GeometryChoice, StandardTable, modified_dh};
use flexcal::fit::Placement;
use flexcal::model::Model;
use flexcal::urdf::{YamlFormat, joint_origins, yaml};
use nalgebra::{Matrix4, Vector3};

use super::arm::{Kind, origin, shift, turn};
use super::case::Case;
use super::checks::{Verdict, ensure};
use super::fitted::Fitted;
use super::world::World;

/// Largest difference between two frames \[1\] or \[m\].
const SAME_FRAME: f64 = 1e-9;

/// Entry of a YAML file: its name and its numbers by key.
type Entry = (String, HashMap<String, Vec<f64>>);

/// Returns the entries of a file in their order, with `base:` and `tool:` beside those of the list.
fn entries(text: &str) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
        let Some((key, value)) = line.rsplit_once(':') else { continue };
        let (key, value) = (key.trim().trim_matches('"'), value.trim());
        if value.is_empty() {
            entries.push((key.to_owned(), HashMap::new()));
            continue;
        }
        let numbers =
            value.trim_matches(['[', ']']).split(',').map(|cell| cell.trim().parse().unwrap());
        if let Some((_, numbers_of)) = entries.last_mut() {
            numbers_of.insert(key.to_owned(), numbers.collect());
        }
    }
    entries.retain(|(_, numbers)| !numbers.is_empty());
    entries
}

fn number((_, numbers): &Entry, key: &str) -> f64 {
    numbers.get(key).map_or(0.0, |values| values[0])
}

fn six((_, numbers): &Entry, angles: &str) -> Option<[f64; 6]> {
    let (at, turned) = (numbers.get("xyz_m")?, numbers.get(angles)?);
    Some([at[0], at[1], at[2], turned[0], turned[1], turned[2]])
}

/// Returns the motion of a joint along or about z, without its constant part.
fn motion(kind: Kind, q: f64) -> Matrix4<f64> {
    match kind {
        Kind::Revolute => turn(Vector3::z(), q),
        Kind::Prismatic => shift(Vector3::z() * q),
        Kind::Fixed => Matrix4::identity(),
    }
}

/// Checks the tables of the identified geometry against the arm with the estimated parameters.
pub fn exports_agree(case: &Case, fit: &Fitted, world: &World) -> Verdict {
    let placement = Placement::of(&fit.data.measurements);
    let said = |error: &dyn std::fmt::Display| format!("no export: {error}");
    let model = Model::new(&fit.problem, &placement.bases, &placement.targets)
        .map_err(|error| said(&error))?;
    let x = fit.saved.vector(&fit.problem, &model).map_err(|error| said(&error))?;
    let fitted = (&fit.saved, fit.correction.as_ref());
    let geometry =
        Geometry::new(&fit.problem, fitted, (&model, &x), None, &GeometryChoice::Identified);
    let arm = geometry.map_err(|error| said(&error))?.arm;
    let kinds: Vec<Kind> = world.arm.joints.iter().map(|joint| joint.kind).collect();
    let modified = entries(&modified_dh(&fit.problem, &arm));
    let standard = StandardTable::new(&fit.problem, &arm).map_err(|error| said(&error))?.yaml();
    let ros = joint_origins(&fit.problem, &arm, YamlFormat::Ros).map_err(|error| said(&error))?;
    let ros = entries(&yaml(&ros, YamlFormat::Ros));
    for row in case.rows.iter().step_by(5) {
        let truth = world.arm.frames(&row.q).pop().unwrap_or_default()[1];
        let tables = [
            ("mdh", of_modified(&modified, &kinds, &row.q)),
            ("dh", of_standard(&entries(&standard), &kinds, &row.q)),
            ("ros-yaml", of_origins(&ros, &kinds, &row.q)),
        ];
        for (name, tip) in tables {
            let off = (tip - truth).abs().max();
            ensure!(off <= SAME_FRAME, "the table {name} is {off} off the identified geometry");
        }
    }
    Ok(())
}

fn of_modified(table: &[Entry], kinds: &[Kind], q: &[f64]) -> Matrix4<f64> {
    let mut tip = Matrix4::identity();
    for ((entry, &kind), &q) in table.iter().zip(kinds).zip(q) {
        if let Some(placed) = six(entry, "rpy_rad") {
            tip *= origin(&placed);
        }
        tip *= turn(Vector3::x(), number(entry, "alpha_rad"))
            * shift(Vector3::x() * number(entry, "a_m"))
            * turn(Vector3::z(), number(entry, "theta_rad"))
            * shift(Vector3::z() * number(entry, "d_m"))
            * motion(kind, q)
            * turn(Vector3::y(), number(entry, "beta_rad"));
    }
    tip
}

fn of_standard(table: &[Entry], kinds: &[Kind], q: &[f64]) -> Matrix4<f64> {
    let end = |name: &str| {
        let entry = table.iter().find(|(of, numbers)| of == name && numbers.contains_key("xyz_m"));
        entry
            .and_then(|entry| six(entry, "rpy_rad"))
            .map_or(Matrix4::identity(), |placed| origin(&placed))
    };
    let rows = table.iter().filter(|(_, numbers)| numbers.contains_key("theta_rad"));
    let moving = kinds.iter().zip(q).filter(|(kind, _)| **kind != Kind::Fixed);
    let mut tip = end("base");
    for (row, (&kind, &q)) in rows.zip(moving) {
        tip *= turn(Vector3::z(), number(row, "theta_rad"))
            * shift(Vector3::z() * number(row, "d_m"))
            * motion(kind, q)
            * shift(Vector3::x() * number(row, "a_m"))
            * turn(Vector3::x(), number(row, "alpha_rad"))
            * turn(Vector3::y(), number(row, "beta_rad"));
    }
    tip * end("tool")
}

fn of_origins(table: &[Entry], kinds: &[Kind], q: &[f64]) -> Matrix4<f64> {
    let keys = ["x", "y", "z", "roll", "pitch", "yaw"];
    let mut moving = kinds.iter().zip(q).filter(|(kind, _)| **kind != Kind::Fixed);
    let mut tip = Matrix4::identity();
    for entry in table {
        tip *= origin(&keys.map(|key| number(entry, key)));
        if let Some((&kind, &q)) = moving.next() {
            tip *= motion(kind, q);
        }
    }
    tip
}

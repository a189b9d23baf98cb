//! Data for the script of a report page: poses with their residuals, and centre lines of the arm.

use nalgebra::Vector3;
use serde::Serialize;

use super::cause::Point;
use super::data::PlotData;
use crate::model::CentreLine;
use crate::results::tables::CommandedJoint;

/// Data for the script of a report page.
#[derive(Debug, Serialize)]
pub struct ScriptData {
    /// Name, unit and index of each joint that takes a command.
    joints: Vec<(String, String, usize)>,
    poses: Vec<Entry>,
    /// For each effect found: label of its regressor, and the rows (from 0) with its values.
    traced: Vec<(String, Vec<(usize, f64)>)>,
    /// Reachable positions without a fitted pose nearby \[mm\].
    uncovered: Vec<[f64; 3]>,
}

/// Row of the measurements in the data of the script; lengths in mm, commands in ° or mm.
#[derive(Debug, Serialize)]
struct Entry {
    row: usize,
    place: String,
    held_out: bool,
    /// Kind of measurement; absent for positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<&'static str>,
    /// Number of rows that the sampled row represents; absent if it represents only itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    n: Option<f64>,
    q: Vec<f64>,
    position: [f64; 3],
    before: [f64; 3],
    after: [f64; 3],
    /// Centre line of the arm without deflections: x, y, z of each point in turn. Absent without
    /// equilibrium.
    #[serde(skip_serializing_if = "Option::is_none")]
    rigid: Option<Vec<i64>>,
    /// Deflections of the points of the centre line: x, y, z of each point in turn. Absent for a
    /// rigid arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    give: Option<Vec<f64>>,
}

/// Rounds a value to a number of decimals. NaN stays NaN, which JSON writes as null.
fn rounded(value: f64, decimals: i32) -> f64 {
    let power = 10.0_f64.powi(decimals);
    let rounded = (value * power).round() / power;
    // Adding zero turns −0 into 0.
    rounded + 0.0
}

/// Converts a vector from m to mm, rounded to a number of decimals.
fn millimetres(length: &Vector3<f64>, decimals: i32) -> [f64; 3] {
    [length.x, length.y, length.z].map(|x| rounded(x * 1e3, decimals))
}

/// Returns the centre line of the arm without deflections \[mm\]: x, y, z of each point in turn.
fn rigid_points(arm: &CentreLine) -> Vec<i64> {
    #[expect(clippy::cast_possible_truncation, reason = "millimetres of an arm")]
    let rounded = |x: f64| (x * 1e3).round() as i64;
    arm.rigid.iter().flat_map(|at| [at.x, at.y, at.z]).map(rounded).collect()
}

/// Returns the deflections of the points of the centre line \[mm\]: x, y, z of each point in turn.
fn deflections(arm: &CentreLine) -> Vec<f64> {
    arm.bent
        .iter()
        .zip(&arm.rigid)
        .flat_map(|(bent, rigid)| millimetres(&(bent - rigid), 2))
        .collect()
}

impl ScriptData {
    /// Collects the data of the rows that a page shows.
    pub fn of(data: &PlotData) -> Self {
        let joint = |command: &CommandedJoint| (command.name(), command.symbol(), command.joint);
        let entry = |((&row, &count), arm): ((&usize, &f64), &Option<CentreLine>)| {
            let residual = &data.residuals[row];
            let observation = &residual.observation;
            let coordinate = |command: &CommandedJoint| {
                rounded(residual.configuration[command.joint] * command.factor(), 5)
            };
            Entry {
                row,
                place: residual.place.clone(),
                held_out: residual.held_out,
                kind: Some(observation.kind()).filter(|_| !observation.is_position()),
                n: Some(count).filter(|count| *count > 1.0),
                q: data.commands.iter().map(coordinate).collect(),
                position: millimetres(&residual.position, 2),
                before: millimetres(&residual.before, 4),
                after: millimetres(&residual.error, 4),
                rigid: arm.as_ref().map(rigid_points),
                give: arm.as_ref().filter(|arm| arm.bent != arm.rigid).map(deflections),
            }
        };
        let traced = data.causes.iter().map(|cause| {
            let value = |point: &Point| {
                let row = point.row.filter(|row| data.shown.binary_search(row).is_ok())?;
                Some((row, rounded(point.x * cause.across.factor, 4)))
            };
            (cause.across.label.clone(), cause.points.iter().filter_map(value).collect())
        });
        Self {
            joints: data.commands.iter().map(joint).collect(),
            poses: data.shown.iter().zip(&data.stand_for).zip(&data.arms).map(entry).collect(),
            traced: traced.collect(),
            uncovered: data.coverage.uncovered.iter().map(|at| millimetres(at, 0)).collect(),
        }
    }
}

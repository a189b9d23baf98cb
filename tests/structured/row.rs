//! One row of a table of measurements.

use nalgebra::{Rotation3, Vector3};

use super::sight::Sight;

/// Row: conditions and measurement; SI units, °C.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Command of each joint; 0 where it takes none.
    pub q: Vec<f64>,
    /// Session; "" without sessions.
    pub session: String,
    /// Word that chooses the tool: the target, else the session, else "".
    pub tool: String,
    /// Word of the column `target`, if there is one.
    pub target: Option<String>,
    pub payload: Option<f64>,
    pub temperature: f64,
    /// Time, and time since the first row of the session \[s\].
    pub time: f64,
    pub elapsed: f64,
    /// Side from which each joint came: −1, 0, 1.
    pub approach: Vec<f64>,
    pub covariate: f64,
    pub sight: Sight,
    /// Measured numbers: a position, or what else the row measures, followed by zeros.
    pub position: Vector3<f64>,
    pub orientation: Option<Rotation3<f64>>,
    /// True if the table marks the row as held out.
    pub marked: bool,
    /// Line of the table, from 1.
    pub line: usize,
}

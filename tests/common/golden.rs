//! Rows of `tests/golden`, positions of an independent simulator.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use flexcal::problem::{PoseConditions, PoseView};
use nalgebra::Vector3;

use super::arms::golden;

/// Row of `tests/golden`: conditions, and the columns in groups of three [m].
#[derive(Clone)]
pub struct GoldenRow {
    pub q: Vec<f64>,
    pub payload: f64,
    pub hoist: f64,
    pub values: Vec<Vector3<f64>>,
}

impl GoldenRow {
    pub fn setup(&self) -> PoseView<'_> {
        PoseView {
            payload: Some(&self.payload),
            hoist: Some(&self.hoist),
            ..PoseView::from_configuration(&self.q)
        }
    }

    pub fn conditions(&self) -> PoseConditions {
        self.setup().to_owned()
    }
}

/// Reads the rows of a file in `tests/golden`.
pub fn golden_rows(name: &str) -> Vec<GoldenRow> {
    let row = |record: csv::StringRecord| {
        let v: Vec<f64> = record.iter().map(|cell| cell.parse().unwrap()).collect();
        GoldenRow {
            q: v[..4].iter().map(|q| q.to_radians()).collect(),
            payload: v[4],
            hoist: v[5],
            values: v[6..].chunks(3).map(|v| Vector3::new(v[0], v[1], v[2]) * 1e-3).collect(),
        }
    };
    let mut table = csv::Reader::from_path(golden(name)).unwrap();
    table.records().map(|record| row(record.unwrap())).collect()
}

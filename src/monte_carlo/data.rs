//! The measurements of one repetition.

use std::path::PathBuf;

use nalgebra::{DVector, Vector3};
use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::plan::{Campaign, Cell, Source};
use crate::identify::Placement;
use crate::measurement::{Dataset, Labels, Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;
use crate::simulate::{self, Draw, Rig, Row, TrueParameter, Truth};

/// Measurements whose truth is known.
pub(super) struct Data {
    /// The held-out poses, then those to identify with.
    pub dataset: Dataset,
    /// True x of each free parameter; `None` where the truth does not say.
    pub truth: Vec<Option<f64>>,
}

impl Campaign {
    /// The measurements of a repetition, counted from 0; `None` where the true arm does not come to rest in some pose.
    ///
    /// Held-out poses come first, so that they are the same for every number of poses; noise of another σ is the same
    /// noise scaled.
    pub(super) fn data(&self, cell: &Cell, repetition: usize) -> Option<Data> {
        let truth = Truth { noise_sigma: cell.sigma, ..self.truth.clone() };
        let Draw { arm, parameters, mut rows } =
            simulate::draw(&self.problem, &truth, self.held_out + cell.poses, self.seed_of(repetition));
        let true_x = self.parameters.iter().map(|parameter| {
            let known = |known: &&TrueParameter| known.name == parameter.name;
            Some(parameter.deviation(parameters.iter().find(known)?.value))
        });
        let true_x = true_x.collect();
        let seen = match self.source {
            Source::Model => by_model(arm, &rows)?,
            Source::Rig => by_rig(arm, &truth, &rows)?,
        };
        for (row, seen) in rows.iter_mut().zip(seen) {
            row.position += seen;
        }
        let split =
            Split { held_out: (0..self.held_out).collect(), identification: (self.held_out..rows.len()).collect() };
        Some(Data { dataset: Dataset::new(table(&rows), split), truth: true_x })
    }

    /// A seed of its own for each repetition.
    fn seed_of(&self, repetition: usize) -> u64 {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(repetition as u64);
        random.next_u64()
    }
}

/// Positions that the model predicts for an arm as declared [m].
fn by_model(mut arm: Problem, rows: &[Row]) -> Option<Vec<Vector3<f64>>> {
    (arm.parameters, arm.constraints) = (Vec::new(), Vec::new());
    let model = Model::new(&arm, &[String::new()], &[String::new()]).ok()?;
    let mut table = table(rows);
    table.positions.fill(Vector3::zeros());
    let all: Vec<usize> = (0..rows.len()).collect();
    let errors = Placement::of(&table).position_errors(&model, &DVector::zeros(0), &table, &all);
    errors.into_iter().map(|error| error.iter().all(|x| x.is_finite()).then_some(-error)).collect()
}

/// Positions on the virtual test rig [m].
fn by_rig(arm: Problem, truth: &Truth, rows: &[Row]) -> Option<Vec<Vector3<f64>>> {
    let rig = Rig::new(arm, truth.effects.clone()).with_segments(truth.segments);
    rows.iter().map(|row| rig.position(&row.conditions).ok()).collect()
}

/// What the virtual test rig measured, as a table of measurements.
pub fn table(rows: &[Row]) -> Measurements {
    let of = |value: fn(&Row) -> Option<f64>| rows.iter().map(value).collect::<Option<Vec<f64>>>();
    let approach: Vec<f64> = rows.iter().flat_map(|row| row.conditions.approach.iter().flatten().copied()).collect();
    Measurements {
        files: vec![PathBuf::from("simulated")],
        origin: (1_u32..).take(rows.len()).map(|line| (0, line)).collect(),
        joints: rows.first().map_or(0, |row| row.conditions.configuration.len()),
        configurations: rows.iter().flat_map(|row| row.conditions.configuration.iter().copied()).collect(),
        positions: rows.iter().map(|row| row.position).collect(),
        sigma: None,
        payload: of(|row| row.conditions.payload),
        hoist: of(|row| row.conditions.hoist),
        temperature: of(|row| row.conditions.temperature),
        time: rows.iter().map(|row| row.conditions.time).collect(),
        time_measured: true,
        approach: (!approach.is_empty()).then_some(approach),
        session: Labels { names: vec![String::new()], of_row: vec![0; rows.len()] },
        target: None,
        marked_held_out: None,
    }
}

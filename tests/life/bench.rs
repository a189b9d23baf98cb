//! Arms of the virtual rig that are measured, change, and are measured again.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::path::Path;

use flexcal::fit::{Identification, Options, SavedEstimate, identify};
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{PoseConditions, Problem};
use flexcal::remainder;
use flexcal::results::{Document as _, IdentificationResult};
use flexcal::rig::{Rig, Truth, draw};
use nalgebra::Vector3;

use crate::common::arms::parse;

/// Problem with the truth from which its arms are drawn.
pub struct Bench {
    pub problem: Problem,
    pub truth: Truth,
}

impl Bench {
    pub fn new() -> Self {
        let problem = parse(include_str!("arm.toml"));
        let truth = Truth::parse(include_str!("truth.toml"), Path::new("TRUTH.toml"), &problem);
        Self { truth: truth.unwrap(), problem }
    }

    /// Draws a true arm.
    pub fn arm(&self, seed: u64) -> Problem {
        draw(&self.problem, &self.truth, 1, seed).arm
    }

    /// Measures an arm in random poses; `noise` multiplies the declared noise.
    pub fn measure(&self, arm: &Problem, poses: usize, seed: u64, noise: f64) -> Measurements {
        self.measure_at(arm, None, (poses, seed, noise))
    }

    /// Measures an arm; the table states the temperature [°C].
    pub fn measure_at(
        &self,
        arm: &Problem,
        temperature: Option<f64>,
        (poses, seed, noise): (usize, u64, f64),
    ) -> Measurements {
        let rig = Rig::new(arm.clone(), Vec::new());
        let rows = draw(&self.problem, &self.truth, poses, seed).rows;
        let measured = |row: &flexcal::rig::Row| {
            let conditions = PoseConditions { temperature, ..row.conditions.clone() };
            rig.position(&conditions).unwrap() + row.position * noise
        };
        let positions: Vec<Vector3<f64>> = rows.iter().map(measured).collect();
        let configurations = rows.iter().map(|row| row.conditions.configuration.clone());
        let mut rows = Dataset::builder(configurations, positions).measurements().unwrap();
        rows.temperature = temperature.map(|t| vec![t; rows.len()]);
        rows
    }

    /// Measures an arm whose joint 2 turns by `amplitude` sin 6q more than its encoder shows, which
    /// no parameter describes [rad]; each of the `configurations` is measured once.
    pub fn measure_bent(
        &self,
        arm: &Problem,
        configurations: &[Vec<f64>],
        (amplitude, seed): (f64, u64),
    ) -> Measurements {
        let rig = Rig::new(arm.clone(), Vec::new());
        let drawn = draw(&self.problem, &self.truth, configurations.len(), seed).rows;
        let measured = |(row, shown): (&flexcal::rig::Row, &Vec<f64>)| {
            let mut configuration = shown.clone();
            configuration[1] += amplitude * (6.0 * shown[1]).sin();
            let conditions = PoseConditions { configuration, ..row.conditions.clone() };
            rig.position(&conditions).unwrap() + row.position
        };
        let positions: Vec<Vector3<f64>> = drawn.iter().zip(configurations).map(measured).collect();
        Dataset::builder(configurations.iter().cloned(), positions).measurements().unwrap()
    }

    /// Returns random configurations.
    pub fn configurations(&self, poses: usize, seed: u64) -> Vec<Vec<f64>> {
        let rows = draw(&self.problem, &self.truth, poses, seed).rows;
        rows.into_iter().map(|row| row.conditions.configuration).collect()
    }

    /// Fits all rows.
    pub fn calibrate(&self, rows: &Measurements) -> Identification {
        identify(&self.problem, &whole(rows), &Options::default()).unwrap()
    }

    /// Returns the estimate as it is saved after a calibration.
    pub fn saved(&self, found: &Identification, rows: &Measurements) -> SavedEstimate {
        let mut result = IdentificationResult::new(&self.problem, found);
        if let Some(fitted) = remainder::uncertainty(found, &self.problem, &whole(rows)).unwrap() {
            result = result.with_predictions(found, &fitted);
        }
        SavedEstimate::parse(&result.to_json(), Path::new("estimate.json")).unwrap()
    }

    /// Returns the root mean square error of an identified arm in other poses, without noise [m].
    pub fn error(&self, found: &Identification, arm: &Problem) -> f64 {
        let rows = self.measure(arm, 200, 987_654, 0.0);
        let predicted = found.predict(&self.problem, &rows).unwrap();
        let squares = predicted.iter().zip(&rows.positions).map(|(a, b)| (a - b).norm_squared());
        (squares.sum::<f64>() / rows.len() as f64).sqrt()
    }
}

/// Returns rows of which none is held out.
pub fn whole(rows: &Measurements) -> Dataset {
    let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
    Dataset::new(rows.clone(), split)
}

/// Returns an arm whose joint, counted from 1, has another zero.
pub fn with_zero(arm: &Problem, joint: usize, degrees: f64) -> Problem {
    let mut arm = arm.clone();
    arm.joints[joint - 1].theta += degrees.to_radians();
    arm
}

/// Returns an arm whose links are longer by a strain.
pub fn warmed(arm: &Problem, strain: f64) -> Problem {
    let mut arm = arm.clone();
    for joint in &mut arm.joints {
        (joint.a, joint.d) = (joint.a * (1.0 + strain), joint.d * (1.0 + strain));
    }
    arm
}

/// Returns an arm whose tool sits elsewhere in the last frame by `moved` [m].
pub fn with_tool(arm: &Problem, moved: Vector3<f64>) -> Problem {
    let mut arm = arm.clone();
    arm.tool.target += moved;
    arm
}

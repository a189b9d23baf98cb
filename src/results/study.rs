//! Results of the command `study`: study.json and misprints.json.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::summary::Summary;
use crate::paper::Misprint;
use crate::study::{
    self, AlternativeModel, Case, CellResult, HeldOutError, MisprintStudy, ParameterResult,
    Replica, ReplicaResults, Results, Study,
};

/// Results of many fits to simulated measurements with known truth. SI units unless a key names
/// another.
#[derive(Debug, Serialize, JsonSchema)]
pub struct StudyResult {
    pub study: String,
    pub problem: String,
    /// Source of the simulated measurements.
    pub data: &'static str,
    pub seed: u64,
    pub repetitions: usize,
    pub held_out_poses: usize,
    pub cells: Vec<Cell>,
}

/// Results of the fits of one cell: one noise level, number of poses, strategy and solver.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Cell {
    pub position_sigma_mm: f64,
    pub identification_poses: usize,
    pub strategy: &'static str,
    pub solver: &'static str,
    pub fits: u64,
    pub failed: u64,
    pub failure_rate: f64,
    /// Number of fits that are not trusted, by the code of the first error.
    pub failures: BTreeMap<String, u64>,
    pub held_out_mm: HeldOut,
    /// Mean reduced χ² over the fits.
    pub reduced_chi2: Option<f64>,
    /// Share of estimates within 1.96 standard errors of the truth.
    pub coverage: Option<f64>,
    pub largest_bias: Option<LargestBias>,
    pub iterations_mean: Option<f64>,
    pub iterations_max: Option<f64>,
    pub parameters: Vec<ParameterResult>,
}

/// Held-out errors over the fits of a cell.
#[derive(Debug, Serialize, JsonSchema)]
pub struct HeldOut {
    /// Mean error over fits and poses \[mm\].
    pub mean: Option<f64>,
    /// Rms error over fits and poses \[mm\].
    pub rms: Option<f64>,
    /// Standard deviation over fits of the rms error of one fit \[mm\].
    pub rms_sd: Option<f64>,
    pub rms_max: Option<f64>,
}

/// Parameter with the largest ratio of bias to standard deviation of its estimates.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LargestBias {
    pub parameter: String,
    pub bias_sd: f64,
}

/// Study of the misprints of Chen et al. (2021).
#[derive(Debug, Serialize, JsonSchema)]
pub struct MisprintResult {
    pub study: String,
    pub problem: String,
    pub seed: u64,
    pub specimens: usize,
    pub identification_poses: usize,
    pub held_out_poses: usize,
    pub position_sigma_mm: f64,
    /// Mean held-out error that a rigid fit leaves. The elasticity of the simulated arms is scaled
    /// until it is reached.
    pub rigid_leaves_mm: f64,
    pub misprints: Vec<MisprintSize>,
    pub cases: Vec<StudiedCase>,
}

/// Largest change of the end point's position by a misprint.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MisprintSize {
    pub misprint: &'static str,
    pub place: &'static str,
    pub moves_mm: f64,
}

/// Simulated arms with one ratio of link to joint flexibility, under one load.
#[derive(Debug, Serialize, JsonSchema)]
pub struct StudiedCase {
    pub links_over_joints: f64,
    pub payload_kg: Option<f64>,
    #[serde(rename = "hoist_N")]
    pub hoist: Option<f64>,
    pub specimens: Vec<Specimen>,
}

/// Held-out errors of one simulated arm after each procedure; null if an iteration did not
/// converge.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Specimen {
    pub scale: f64,
    pub before: Summary,
    pub rigid: Option<Summary>,
    pub geometry_only: Summary,
    pub joint: Summary,
    pub joint_both_loads: Summary,
    pub readings: Vec<Reading>,
    pub rivals: Vec<Rival>,
}

/// Held-out errors of one reading (printed or corrected formulas), by the source of the stiffness.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Reading {
    pub reading: String,
    pub stiffness_known: Option<Summary>,
    pub as_declared: Option<Summary>,
    pub from_positions: Option<Summary>,
    pub from_load_differences: Option<Summary>,
}

/// Held-out errors of an alternative model.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Rival {
    pub rival: &'static str,
    pub held_out: Option<Summary>,
}

impl StudyResult {
    /// Collects the results of a study, without durations.
    pub fn new(study: &Study, results: &Results) -> Self {
        Self {
            study: study.name.clone(),
            problem: study.problem.name.clone(),
            data: study.source.as_str(),
            seed: study.seed,
            repetitions: study.repetitions,
            held_out_poses: study.held_out,
            cells: results.cells.iter().map(|cell| Cell::new(study, cell)).collect(),
        }
    }
}

impl Cell {
    fn new(study: &Study, result: &CellResult) -> Self {
        let CellResult { cell, tally, .. } = result;
        let in_mm = |length: Option<f64>| length.map(|length| length * 1e3);
        let rms = &tally.held_out_rms;
        let bias = result.largest_bias(study);
        Self {
            // Rounding restores the declared number: 0.1 mm, not 0.10000000000000001 mm.
            position_sigma_mm: (cell.sigma * 1e15).round() / 1e12,
            identification_poses: cell.poses,
            strategy: cell.strategy.as_str(),
            solver: cell.solver.as_str(),
            fits: tally.fits,
            failed: tally.failed(),
            failure_rate: result.failure_rate(),
            failures: tally.failures.clone(),
            held_out_mm: HeldOut {
                mean: in_mm(tally.held_out_mean.mean()),
                rms: in_mm(rms.rms()),
                rms_sd: in_mm(rms.deviation()),
                rms_max: in_mm(rms.largest()),
            },
            reduced_chi2: tally.reduced_chi2.mean(),
            coverage: result.coverage(),
            largest_bias: bias.map(|(parameter, bias_sd)| LargestBias { parameter, bias_sd }),
            iterations_mean: tally.iterations.mean(),
            iterations_max: tally.iterations.largest(),
            parameters: result.parameters(study).collect(),
        }
    }
}

impl MisprintResult {
    /// Collects the results of a study of the misprints.
    pub fn new(study: &MisprintStudy, found: &ReplicaResults) -> Self {
        let size = |(misprint, size): (&Misprint, &f64)| MisprintSize {
            misprint: misprint.as_str(),
            place: misprint.place(),
            moves_mm: size * 1e3,
        };
        let case = |case: &Case| StudiedCase {
            links_over_joints: case.links_over_joints,
            payload_kg: case.load.and_then(|load| load.payload),
            hoist: case.load.and_then(|load| load.hoist),
            specimens: found.of_case(case).map(|replica| Specimen::new(replica, found)).collect(),
        };
        Self {
            study: study.name.clone(),
            problem: study.problem.name.clone(),
            seed: study.seed,
            specimens: study.specimens,
            identification_poses: study.identification,
            held_out_poses: study.held_out,
            position_sigma_mm: study.truth.noise_sigma * 1e3,
            rigid_leaves_mm: study.rigid_leaves * 1e3,
            misprints: Misprint::EACH.iter().zip(&found.sizes).map(size).collect(),
            cases: study.cases.iter().map(case).collect(),
        }
    }
}

impl Specimen {
    fn new(replica: &Replica, found: &ReplicaResults) -> Self {
        let summary = |left: &HeldOutError| left.as_ref().map(Summary::of);
        let reading = |(named, [known, declared, positions, differences]): (
            &study::NamedReading,
            &[HeldOutError; 4],
        )| Reading {
            reading: named.name.clone(),
            stiffness_known: summary(known),
            as_declared: summary(declared),
            from_positions: summary(positions),
            from_load_differences: summary(differences),
        };
        let rivals = AlternativeModel::EACH.into_iter().zip(&replica.by_alternative);
        Self {
            scale: replica.scale,
            before: Summary::of(&replica.before),
            rigid: summary(&replica.rigid),
            geometry_only: Summary::of(&replica.geometry_only),
            joint: Summary::of(&replica.joint),
            joint_both_loads: Summary::of(&replica.joint_twice),
            readings: found.readings.iter().zip(&replica.by_reading).map(reading).collect(),
            rivals: rivals
                .map(|(rival, error)| Rival { rival: rival.as_str(), held_out: summary(error) })
                .collect(),
        }
    }
}

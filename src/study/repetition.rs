//! One repetition of a study: simulated measurements, their fit and its deviation from the truth.

use std::path::PathBuf;

use nalgebra::{DVector, Vector3};
use rand::Rng as _;

use super::definition::{Cell, Source, Study};
use super::effects::Strengths;
use super::tally::{Fitted, ParameterScore, Score};
use crate::fit::{FindingCode, Identification, IdentifyError, Options, Placement, identify};
use crate::measurement::{Dataset, Labels, Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;
use crate::random::stream;
use crate::rig::{self, Draw, Rig, Row, TrueEffect, TrueParameter};

/// Simulated measurements of one repetition, with their truth.
struct Data {
    /// Measurements: held-out poses first, then identification poses.
    dataset: Dataset,
    /// True deviation x of each free parameter; `None` if the truth does not give it.
    truth: Vec<Option<f64>>,
}

/// Returns the problem of a study with the noise level of a cell declared, and with measured
/// positions only.
pub(super) fn problem_of(study: &Study, cell: &Cell) -> Problem {
    let mut problem = study.problem.positions_alone();
    problem.data.position_sigma = Some(cell.sigma);
    problem
}

/// Simulates and fits one repetition (counted from 0); returns its score and the duration of the
/// fit \[s\].
pub(super) fn fit(
    study: &Study,
    problem: &Problem,
    cell: &Cell,
    repetition: usize,
) -> (Score, f64) {
    let Some(data) = data(study, cell, repetition) else {
        return (Score::Failed("no-equilibrium"), 0.0);
    };
    let options = Options { strategy: cell.strategy, solver: cell.solver, ..Options::default() };
    match identify(problem, &data.dataset, &options) {
        // The inputs agree with each other, so the only input error is a nominal arm without
        // equilibrium in some pose.
        Err(IdentifyError::Input(_)) => (Score::Failed("no-equilibrium"), 0.0),
        Err(_) => (Score::Failed("cannot-be-fitted"), 0.0),
        Ok(identification) => (score(study, &data, &identification), identification.seconds),
    }
}

/// Simulates the measurements of one repetition (counted from 0); `None` if the true arm has no
/// equilibrium in some pose.
///
/// Held-out poses come first, so that they are the same for every number of identification poses.
/// Another σ only scales the noise.
fn data(study: &Study, cell: &Cell, repetition: usize) -> Option<Data> {
    let truth = study.truth.with_noise(cell.sigma);
    let seed = stream(study.seed, repetition as u64).next_u64();
    let Draw { arm, parameters, mut rows } =
        rig::draw(&study.problem, &truth, study.held_out + cell.poses, seed);
    let strengths = Strengths::draw(study, seed);
    let true_x = study.parameters.iter().map(|parameter| {
        let is_same = |truth: &&TrueParameter| truth.name == parameter.name;
        let value = parameters
            .iter()
            .find(is_same)
            .map(|truth| truth.value)
            .or_else(|| strengths.get(&parameter.name));
        Some(parameter.deviation(value?))
    });
    let true_x = true_x.collect();
    let positions = match study.source {
        Source::Model => by_model(arm, &strengths, &rows)?,
        Source::Rig => {
            by_rig(arm, [truth.effects, strengths.for_rig(study)].concat(), truth.segments, &rows)?
        }
    };
    for (row, position) in rows.iter_mut().zip(positions) {
        row.position += position;
    }
    let split = Split {
        held_out: (0..study.held_out).collect(),
        identification: (study.held_out..rows.len()).collect(),
    };
    Some(Data { dataset: Dataset::new(table(&rows), split), truth: true_x })
}

/// Returns the position that the model predicts in each row for the true arm with the true effect
/// values, measuring frame \[m\]; `None` if a row has no equilibrium or a parameter no true value.
fn by_model(mut arm: Problem, strengths: &Strengths, rows: &[Row]) -> Option<Vec<Vector3<f64>>> {
    // Without rules, parameters of effects are free and those of the arm fixed.
    (arm.parameters, arm.constraints) = (Vec::new(), Vec::new());
    let model = Model::new(&arm, &[String::new()], &arm.target_words()).ok()?;
    let x = model.parameters.iter().map(|free| Some(free.deviation(strengths.get(&free.name)?)));
    let x = DVector::from_vec(x.collect::<Option<Vec<f64>>>()?);
    let mut table = table(rows);
    table.positions.fill(Vector3::zeros());
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let errors = Placement::of(&table).position_errors(&model, &x, &table, &all_rows);
    errors.into_iter().map(|error| error.iter().all(|x| x.is_finite()).then_some(-error)).collect()
}

/// Returns the position that the virtual test rig measures in each row, without noise, measuring
/// frame \[m\]; `None` if a row has no equilibrium.
fn by_rig(
    arm: Problem,
    effects: Vec<TrueEffect>,
    segments: usize,
    rows: &[Row],
) -> Option<Vec<Vector3<f64>>> {
    let rig = Rig::new(arm, effects).with_segments(segments);
    let table = table(rows);
    let position =
        |(k, row): (usize, &Row)| Some(rig.pose_of(&row.target, &table.conditions(k)).ok()?.0);
    rows.iter().enumerate().map(position).collect()
}

/// Returns the rows of the virtual test rig as a table of measurements.
pub fn table(rows: &[Row]) -> Measurements {
    let column =
        |value: fn(&Row) -> Option<f64>| rows.iter().map(value).collect::<Option<Vec<f64>>>();
    let approach: Vec<f64> =
        rows.iter().flat_map(|row| row.conditions.approach.iter().flatten().copied()).collect();
    Measurements {
        files: vec![PathBuf::from("simulated")],
        origin: (1_u32..).take(rows.len()).map(|line| (0, line)).collect(),
        joints: rows.first().map_or(0, |row| row.conditions.configuration.len()),
        configurations: rows
            .iter()
            .flat_map(|row| row.conditions.configuration.iter().copied())
            .collect(),
        positions: rows.iter().map(|row| row.position).collect(),
        position_measured: true,
        payload: column(|row| row.conditions.payload),
        hoist: column(|row| row.conditions.hoist),
        temperature: column(|row| row.conditions.temperature),
        time: rows.iter().map(|row| row.conditions.time).collect(),
        time_measured: true,
        approach: (!approach.is_empty()).then_some(approach),
        covariates: rows.iter().flat_map(|row| row.conditions.covariates.iter().copied()).collect(),
        session: Labels { names: vec![String::new()], of_row: vec![0; rows.len()] },
        target: rows
            .iter()
            .any(|row| !row.target.is_empty())
            .then(|| rows.iter().map(|row| &row.target).collect()),
        ..Measurements::default()
    }
}

/// Compares a fit with the truth. A fit with an error among its findings counts as failed.
fn score(study: &Study, data: &Data, identification: &Identification) -> Score {
    if let Some(error) = identification.first_error() {
        return Score::Failed(match error.code {
            FindingCode::TooFewEquations => "too-few-equations",
            FindingCode::NotConverged | FindingCode::HeldOutNotConverged => "not-converged",
            FindingCode::MissesMeasurements if !identification.termination.converged() => {
                "not-converged"
            }
            FindingCode::MissesMeasurements | FindingCode::NoBetterThanNominal => "misses-the-data",
            FindingCode::BeyondPrior => "beyond-its-prior",
            FindingCode::BeyondArmSize => "beyond-the-arm",
            FindingCode::OtherSize => "another-size",
            FindingCode::BaseNotDetermined => "undetermined",
            FindingCode::HeldOutCopied | FindingCode::HeldOutMissed | FindingCode::HeldOutWorse => {
                "misses-held-out-poses"
            }
            other => other.entry().code,
        });
    }
    let held_out = &identification.fitted.held_out;
    if !held_out.rms.norm.is_finite() {
        return Score::Failed("no-equilibrium");
    }
    // Parameters that the model of the strategy lacks keep their nominal value.
    let estimate = |name: &str| {
        let estimates = identification.estimates.iter().zip(&identification.x);
        estimates.into_iter().find(|(estimate, _)| estimate.name == name)
    };
    let parameters = study.parameters.iter().zip(&data.truth).map(|(parameter, truth)| {
        let (x, std_error) = match estimate(&parameter.name) {
            Some((estimate, x)) => {
                // The deviation of a stiffness is a logarithm.
                let scale = if estimate.unit.is_relative() { estimate.estimate } else { 1.0 };
                (*x, estimate.std_error.map(|error| error / scale))
            }
            None => (0.0, None),
        };
        truth.map(|truth| ParameterScore { error: x - truth, std_error })
    });
    Score::Fitted(Fitted {
        held_out_mean: held_out.mean.norm,
        held_out_rms: held_out.rms.norm,
        reduced_chi2: identification.reduced_chi2,
        iterations: identification.iterations,
        parameters: parameters.collect(),
    })
}

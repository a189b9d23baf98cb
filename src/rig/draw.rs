//! Measurements of the true arm in poses drawn at random.

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::parameters::{self, TrueParameter};
use super::truth::Truth;
use super::{NoRest, Rig};
use crate::problem::pattern::matches;
use crate::problem::{
    Fixture, HeldOut, Joint, JointKind, Observation, Past, PoseConditions, Problem,
};
use crate::random::{normal, stream};

/// Streams of random numbers of one seed, so that none shifts when another is used more.
const DEVIATIONS: u64 = 0;
const POSES: u64 = 1;
const NOISE: u64 = 2;
const SPLIT: u64 = 3;
const EFFECTS: u64 = 4;
const TURNS: u64 = 5;
/// The first of as many as there are poses.
const CONTACTS: u64 = 1000;

/// A simulated measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What was set.
    pub conditions: PoseConditions,
    /// Name of the target that is measured; empty where the problem declares none.
    pub target: String,
    /// What is measured.
    pub observation: Observation,
    /// What the tracker read, measuring frame, or a distance; 0 of a contact \[m\].
    pub position: Vector3<f64>,
    /// The orientation that it read, measuring frame, where it reads any.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// Whether the row is held out.
    pub held_out: bool,
}

/// Simulated measurements and what is true about them.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Name of the problem.
    pub problem: String,
    /// The declared joints.
    pub joints: Vec<Joint>,
    /// What the rows measure against.
    pub fixtures: Vec<Fixture>,
    /// Seed of every random number.
    pub seed: u64,
    /// What was true.
    pub truth: Truth,
    /// Every parameter with its true value.
    pub parameters: Vec<TrueParameter>,
    /// The true arm.
    pub rig: Rig,
    /// The measurements in order of time.
    pub rows: Vec<Row>,
    /// Name of the column that marks held-out rows.
    pub split_column: String,
    /// Names of the columns of the problem's own covariates, where the poses have them.
    pub(super) covariates: Vec<String>,
}

/// Why there are no measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// One of the poses has no equilibrium.
    #[error("pose {pose} of the simulation: {source}; check stiffnesses, masses and the truth")]
    NoRest {
        /// Number of the pose, from 1.
        pose: usize,
        /// Why.
        source: NoRest,
    },
    /// The arm does not come to what it is to touch.
    #[error(
        "pose {pose} of the simulation: the arm does not come to what it is to touch; check its true place and the ranges"
    )]
    OutOfReach {
        /// Number of the pose, from 1.
        pose: usize,
    },
}

/// What chance decides, before anything is measured.
#[derive(Debug, Clone)]
pub struct Draw {
    /// The problem with true values instead of nominal ones.
    pub arm: Problem,
    /// Every parameter with its true value.
    pub parameters: Vec<TrueParameter>,
    /// The poses in order of time, no row held out; `position` and `orientation` are the noise
    /// alone \[m\].
    pub rows: Vec<Row>,
}

/// Draws the true arm, `poses` poses and their noise.
///
/// More poses leave the arm and the first poses as they are; another σ of the noise scales it and
/// changes nothing else.
pub fn draw(problem: &Problem, truth: &Truth, poses: usize, seed: u64) -> Draw {
    drawn(problem, truth, draw_poses(problem, truth, poses, stream(seed, POSES)), seed)
}

/// The same in given poses.
fn drawn(problem: &Problem, truth: &Truth, mut rows: Vec<Row>, seed: u64) -> Draw {
    let (arm, parameters) = true_arm(problem, truth, stream(seed, DEVIATIONS));
    let mut noise = stream(seed, NOISE);
    let kinds = truth.observations(&problem.fixtures, rows.len());
    for (row, observation) in rows.iter_mut().zip(kinds) {
        row.observation = observation;
        let sigma = truth.sigma_of(observation);
        row.position = Vector3::from_fn(|_, _| normal(&mut noise) * sigma);
    }
    if let Some(sigma) = truth.orientation_sigma {
        let mut noise = stream(seed, TURNS);
        for row in &mut rows {
            let turn = Vector3::from_fn(|_, _| normal(&mut noise) * sigma);
            row.orientation = Some(UnitQuaternion::from_scaled_axis(turn));
        }
    }
    Draw { arm, parameters, rows }
}

/// Measures the true arm in `poses` poses; the same for the same `seed`, however many threads there
/// are.
///
/// # Errors
/// The arm is too soft for its loads.
pub fn simulate(
    problem: &Problem,
    truth: &Truth,
    poses: usize,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    measured(problem, truth, draw(problem, truth, poses, seed), seed)
}

/// The same in given poses, each of the target with its name, one after the other; what they do not
/// say of temperature and sides is drawn where the truth has it.
///
/// # Errors
/// The arm is too soft for its loads.
pub fn simulate_poses(
    problem: &Problem,
    truth: &Truth,
    poses: Vec<(PoseConditions, String)>,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    let mut rows = draw_poses(problem, truth, poses.len(), stream(seed, POSES));
    for (row, (given, target)) in rows.iter_mut().zip(poses) {
        row.target = target;
        let drawn = std::mem::take(&mut row.conditions);
        row.conditions = PoseConditions {
            temperature: given.temperature.or(drawn.temperature),
            approach: given.approach.clone().or(drawn.approach),
            covariates: if given.covariates.is_empty() {
                drawn.covariates
            } else {
                given.covariates.clone()
            },
            time: drawn.time,
            elapsed: drawn.elapsed,
            ..given
        };
    }
    measured(problem, truth, drawn(problem, truth, rows, seed), seed)
}

/// Measures what was drawn.
fn measured(
    problem: &Problem,
    truth: &Truth,
    draw: Draw,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    let Draw { arm, parameters, mut rows } = draw;
    let poses = rows.len();
    let rig = Rig::new(arm, truth.effects.clone()).with_segments(truth.segments);
    hold_out(&mut rows, truth.held_out.count(poses), &mut stream(seed, SPLIT));
    let measure =
        |(row, stream_of): (&mut Row, u64)| rig.measure(row, truth, &mut stream(seed, stream_of));
    let streams: Vec<u64> = (CONTACTS..).take(poses).collect();
    let seen: Vec<_> = if truth.has_memory() {
        let mut past = Past::default();
        let after_those = |(row, stream_of): (&mut Row, u64)| {
            row.conditions.past = std::mem::take(&mut past);
            let seen = measure((row, stream_of));
            past = std::mem::take(&mut row.conditions.past);
            row.conditions.append_to(&mut past);
            seen
        };
        rows.iter_mut().zip(streams).map(after_those).collect()
    } else {
        rows.par_iter_mut().zip(streams).map(measure).collect()
    };
    for (index, seen) in seen.into_iter().enumerate() {
        let pose = index + 1;
        let found = seen.map_err(|source| SimulationError::NoRest { pose, source })?;
        found.ok_or(SimulationError::OutOfReach { pose })?;
    }
    let known = rows.first().is_some_and(|row| !row.conditions.covariates.is_empty());
    let names =
        problem.data.covariates.iter().filter(|_| known).map(|own| own.name.clone()).collect();
    let split_column = match &problem.data.held_out {
        Some(HeldOut::Column(name)) => name.clone(),
        _ => "split".to_owned(),
    };
    Ok(Simulation {
        problem: problem.name.clone(),
        joints: problem.joints.clone(),
        fixtures: problem.fixtures.clone(),
        seed,
        truth: truth.clone(),
        parameters,
        rig,
        rows,
        split_column,
        covariates: names,
    })
}

/// Standard normal numbers for the strengths of effects, in a stream of their own.
pub(crate) fn standard_normals(count: usize, seed: u64) -> Vec<f64> {
    let mut random = stream(seed, EFFECTS);
    (0..count).map(|_| normal(&mut random)).collect()
}

/// A command as the file of measurements will hold it.
pub(super) fn rounded_command(kind: JointKind, q: f64) -> f64 {
    match kind {
        JointKind::Revolute => rounded(q.to_degrees(), 6).to_radians(),
        _ => rounded(q, 9),
    }
}

pub(super) fn between(random: &mut ChaCha8Rng, (from, to): (f64, f64)) -> f64 {
    from + (to - from) * random.random::<f64>()
}

/// The arm with its true parameters: given ones, else drawn ones, else nominal.
fn true_arm(
    problem: &Problem,
    truth: &Truth,
    mut random: ChaCha8Rng,
) -> (Problem, Vec<TrueParameter>) {
    let mut arm = problem.clone();
    let mut all = Vec::new();
    parameters::visit(&mut arm, |name, unit, value| {
        let nominal = *value;
        // Drawn for every parameter, so that a rule for one does not change another.
        let drawn = normal(&mut random);
        if let Some(given) = truth.parameters.iter().rev().find(|given| given.name == name) {
            *value = parameters::deviated(unit, nominal, given.value);
        } else if let Some(sigma) = truth
            .random
            .iter()
            .rev()
            .find(|rule| matches(&rule.pattern, &name))
            .and_then(|rule| rule.sigma(unit))
        {
            *value = parameters::spread(unit, nominal, sigma, drawn);
        }
        all.push(TrueParameter { name, unit, nominal, value: *value });
    });
    (arm, all)
}

/// Draws poses; every number is rounded to what the file of measurements will hold.
fn draw_poses(problem: &Problem, truth: &Truth, poses: usize, mut random: ChaCha8Rng) -> Vec<Row> {
    let ranges = &truth.poses;
    let mut rows: Vec<Row> = Vec::with_capacity(poses);
    let mut time = 0.0;
    let (targets, round) = (problem.target_words(), truth.rows_per_target(&problem.fixtures));
    for row in 0..poses {
        // Positions before the first round are of one target after the other.
        let turn = row.checked_sub(truth.positions).map_or(row, |place| place / round);
        let mut conditions: PoseConditions = PoseConditions::default();
        for (joint, range) in problem.joints.iter().zip(&ranges.joints) {
            let q = if joint.command_kind() == JointKind::Fixed {
                0.0
            } else {
                between(&mut random, *range)
            };
            conditions.configuration.push(rounded_command(joint.kind, q));
        }
        let choice = random.random::<f64>() * ranges.payloads.len() as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded down to an index"
        )]
        let choice = choice as usize;
        conditions.payload = ranges.payloads.get(choice).copied();
        conditions.hoist = ranges.hoist.map(|range| rounded(between(&mut random, range), 3));
        conditions.temperature =
            ranges.temperature.map(|range| rounded(between(&mut random, range), 2));
        time = rounded(time + between(&mut random, truth.time_step), 1);
        conditions.time = time;
        conditions.elapsed = time - rows.first().map_or(time, |row| row.conditions.time);
        if ranges.approach {
            let side = |kind| if kind == JointKind::Fixed { 0.0 } else { 1.0 };
            let sides = problem.joints.iter().map(|joint| side(joint.command_kind()));
            let signed = sides.map(|side| if random.random::<bool>() { side } else { -side });
            conditions.approach = Some(signed.collect());
        }
        conditions.covariates =
            ranges.covariates.iter().map(|&range| between(&mut random, range)).collect();
        rows.push(Row {
            conditions,
            target: targets.get(turn % targets.len()).cloned().unwrap_or_default(),
            observation: Observation::Position,
            position: Vector3::zeros(),
            orientation: None,
            held_out: false,
        });
    }
    rows
}

/// Holds out `count` rows chosen at random.
fn hold_out(rows: &mut [Row], count: usize, random: &mut ChaCha8Rng) {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.shuffle(random);
    for index in order.into_iter().take(count) {
        rows[index].held_out = true;
    }
}

/// `value` to so many decimals: the number that is read back from its text.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

//! Simulated measurements of the true arm in random poses.

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::parameters::{self, TrueParameter};
use super::truth::Truth;
use super::{NoEquilibrium, Rig};
use crate::problem::pattern::matches;
use crate::problem::{HeldOut, Joint, JointKind, Observation, Past, PoseConditions, Problem};
use crate::random::{normal, stream};

/// Random stream of the parameter deviations. Each quantity has a separate stream, so that drawing
/// more numbers of one kind does not change the others.
const DEVIATION_STREAM: u64 = 0;
/// Random stream of the poses.
const POSE_STREAM: u64 = 1;
/// Random stream of the position noise.
const POSITION_NOISE_STREAM: u64 = 2;
/// Random stream of the choice of held-out rows.
const SPLIT_STREAM: u64 = 3;
/// Random stream of the effect values.
const EFFECT_STREAM: u64 = 4;
/// Random stream of the orientation noise.
const ORIENTATION_NOISE_STREAM: u64 = 5;
/// First random stream of contact searches and images; each pose has one stream.
const FIRST_CONTACT_STREAM: u64 = 1000;

/// Simulated measurement of one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Commands, payload, temperature and other conditions of the pose.
    pub conditions: PoseConditions,
    /// Name of the measured target; empty if the problem declares none.
    pub target: String,
    /// Kind of measurement of the row.
    pub observation: Observation,
    /// Measured position, measuring frame \[m\]; 0 for a contact. Other kinds of rows use the first
    /// components: a distance \[m\], two tilts \[rad\], or two pixels.
    pub position: Vector3<f64>,
    /// Measured orientation, measuring frame; `None` if it is not measured.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// True if the row is held out.
    pub held_out: bool,
}

/// Simulated measurements with their truth.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Name of the problem.
    pub problem: String,
    /// Joints that the problem declares.
    pub(crate) joints: Vec<Joint>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Description of the true arm from which it was drawn.
    pub truth: Truth,
    /// All parameters with their true values.
    #[doc(hidden)]
    pub parameters: Vec<TrueParameter>,
    /// Test rig with the true arm.
    #[doc(hidden)]
    pub rig: Rig,
    /// Measurements in order of time.
    #[doc(hidden)]
    pub rows: Vec<Row>,
    /// Name of the column that marks held-out rows.
    pub split_column: String,
    /// Names of the problem's covariates, which are columns; empty if the poses have none.
    pub(super) covariates: Vec<String>,
}

/// Error that prevents simulated measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// One of the poses has no equilibrium.
    #[error("pose {pose} of the simulation: {source}; check stiffnesses, masses and the truth")]
    NoEquilibrium {
        /// Number of the pose, from 1.
        pose: usize,
        /// Cause of the error.
        source: NoEquilibrium,
    },
    /// The arm does not reach a fixture that it should touch.
    #[error(
        "pose {pose} of the simulation: the arm does not reach the fixture it should touch; check \
         its true position and the ranges"
    )]
    OutOfReach {
        /// Number of the pose, from 1.
        pose: usize,
    },
    /// No configuration shows a point of a marker to a camera.
    #[error(
        "pose {pose} of the simulation: no configuration was found that shows a point of a marker to a camera; check the true poses of \
         cameras and markers, and the ranges"
    )]
    NothingInView {
        /// Number of the pose, from 1.
        pose: usize,
    },
}

/// Drawn true arm, poses and noise, before any measurement.
#[derive(Debug, Clone)]
pub struct Draw {
    /// Problem with true values in place of nominal ones.
    pub arm: Problem,
    /// All parameters with their true values.
    pub parameters: Vec<TrueParameter>,
    /// Poses in order of time, none held out; `position` and `orientation` hold the noise alone.
    pub rows: Vec<Row>,
}

/// Draws the true arm, `poses` poses and their noise.
///
/// More poses do not change the arm or the first poses. Another σ scales the noise and changes
/// nothing else.
pub fn draw(problem: &Problem, truth: &Truth, poses: usize, seed: u64) -> Draw {
    draw_in(problem, truth, draw_poses(problem, truth, poses, stream(seed, POSE_STREAM)), seed)
}

/// Draws the true arm and the noise of given poses.
fn draw_in(problem: &Problem, truth: &Truth, mut rows: Vec<Row>, seed: u64) -> Draw {
    let (arm, parameters) = true_arm(problem, truth, stream(seed, DEVIATION_STREAM));
    let mut noise = stream(seed, POSITION_NOISE_STREAM);
    let kinds = truth.observations(&problem.fixtures, rows.len());
    for (row, observation) in rows.iter_mut().zip(kinds) {
        row.observation = observation;
        let sigma = truth.sigma_of(observation);
        row.position = Vector3::from_fn(|_, _| normal(&mut noise) * sigma);
    }
    if let Some(sigma) = truth.orientation_sigma {
        let mut noise = stream(seed, ORIENTATION_NOISE_STREAM);
        for row in &mut rows {
            let turn = Vector3::from_fn(|_, _| normal(&mut noise) * sigma);
            row.orientation = Some(UnitQuaternion::from_scaled_axis(turn));
        }
    }
    Draw { arm, parameters, rows }
}

/// Measures the true arm in `poses` random poses. The result depends on `seed`, not on the number
/// of threads.
///
/// # Errors
/// Returns an error if a pose has no equilibrium, or if the arm does not reach a fixture.
pub fn simulate(
    problem: &Problem,
    truth: &Truth,
    poses: usize,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    simulate_counted(problem, truth, SimulatedPoses::Random(poses), seed, &|| ())
}

/// Poses of a simulation.
#[derive(Debug, Clone)]
pub enum SimulatedPoses {
    /// Number of poses, which are drawn at random.
    Random(usize),
    /// Given poses, each with the name of its target.
    Given(Vec<(PoseConditions, String)>),
}

/// Measures the true arm as [`simulate`] and [`simulate_poses`] do, and calls `measured` after each
/// pose, possibly from several threads.
///
/// # Errors
/// Returns an error if a pose has no equilibrium, or if the arm does not reach a fixture.
pub fn simulate_counted(
    problem: &Problem,
    truth: &Truth,
    poses: SimulatedPoses,
    seed: u64,
    measured: &(dyn Fn() + Sync),
) -> Result<Simulation, SimulationError> {
    match poses {
        SimulatedPoses::Random(poses) => {
            let drawn = draw(problem, truth, poses, seed);
            measure(problem, truth, (drawn, true), seed, measured)
        }
        SimulatedPoses::Given(mut poses) => {
            if problem.fixtures.iter().any(|fixture| fixture.sigma.is_some()) {
                // Rows of several points of one image are one pose.
                poses.dedup_by(|next, pose| {
                    next.0.configuration == pose.0.configuration
                        && next.0.time.to_bits() == pose.0.time.to_bits()
                });
            }
            let drawn = draw_in(problem, truth, given_rows(problem, truth, poses, seed), seed);
            measure(problem, truth, (drawn, false), seed, measured)
        }
    }
}

/// Measures the true arm in given poses, each with the name of its target, one after the other.
/// Temperatures and approach sides that the poses lack are drawn if the truth has them.
///
/// # Errors
/// Returns an error if a pose has no equilibrium, or if the arm does not reach a fixture.
pub fn simulate_poses(
    problem: &Problem,
    truth: &Truth,
    poses: Vec<(PoseConditions, String)>,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    simulate_counted(problem, truth, SimulatedPoses::Given(poses), seed, &|| ())
}

/// Returns given poses as rows. Times are drawn; temperatures, approach sides and covariates are
/// drawn if a pose lacks them.
fn given_rows(
    problem: &Problem,
    truth: &Truth,
    poses: Vec<(PoseConditions, String)>,
    seed: u64,
) -> Vec<Row> {
    let mut rows = draw_poses(problem, truth, poses.len(), stream(seed, POSE_STREAM));
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
    rows
}

/// Measures a drawn arm in the drawn poses; calls `measured` after each pose. If `may_move` is
/// true, other configurations are drawn for images that show nothing; otherwise they have no rows.
fn measure(
    problem: &Problem,
    truth: &Truth,
    (draw, may_move): (Draw, bool),
    seed: u64,
    measured: &(dyn Fn() + Sync),
) -> Result<Simulation, SimulationError> {
    let Draw { arm, parameters, rows: mut poses } = draw;
    let rig = Rig::new(arm, truth.effects.clone()).with_segments(truth.segments);
    let count = poses.len();
    hold_out(&mut poses, truth.held_out.count(count), &mut stream(seed, SPLIT_STREAM));
    let is_image = |row: &Row| matches!(row.observation, Observation::Pixel(..));
    let measure_row = |(row, stream_of): (&mut Row, u64)| {
        let random = &mut stream(seed, stream_of);
        let outcome = if is_image(row) {
            rig.take_images(row, truth, may_move, random)
        } else {
            rig.measure(row, truth, random).map(|found| found.map(|()| Vec::new()))
        };
        measured();
        outcome
    };
    let streams: Vec<u64> = (FIRST_CONTACT_STREAM..).take(count).collect();
    let outcomes: Vec<_> = if truth.has_memory() {
        let mut past = Past::default();
        let measure_after_past = |(row, stream_of): (&mut Row, u64)| {
            row.conditions.past = std::mem::take(&mut past);
            let outcome = measure_row((row, stream_of));
            past = std::mem::take(&mut row.conditions.past);
            row.conditions.append_to(&mut past);
            outcome
        };
        poses.iter_mut().zip(streams).map(measure_after_past).collect()
    } else {
        poses.par_iter_mut().zip(streams).map(measure_row).collect()
    };
    let mut rows = Vec::with_capacity(count);
    for ((pose, row), outcome) in (1..).zip(poses).zip(outcomes) {
        let points = outcome.map_err(|source| SimulationError::NoEquilibrium { pose, source })?;
        match points {
            Some(points) if is_image(&row) => rows.extend(points),
            Some(_) => rows.push(row),
            None if !is_image(&row) => return Err(SimulationError::OutOfReach { pose }),
            None if may_move => return Err(SimulationError::NothingInView { pose }),
            None => {}
        }
    }
    if rows.is_empty() && count > 0 {
        return Err(SimulationError::NothingInView { pose: 1 });
    }
    let has_covariates = rows.first().is_some_and(|row| !row.conditions.covariates.is_empty());
    let covariates = problem.data.covariates.iter().filter(|_| has_covariates);
    let covariates = covariates.map(|covariate| covariate.name.clone()).collect();
    let split_column = match &problem.data.held_out {
        Some(HeldOut::Column(name)) => name.clone(),
        _ => "split".to_owned(),
    };
    Ok(Simulation {
        problem: problem.name.clone(),
        joints: problem.joints.clone(),
        seed,
        truth: truth.clone(),
        parameters,
        rig,
        rows,
        split_column,
        covariates,
    })
}

/// Returns `count` standard normal numbers for drawing effect values, from a stream that nothing
/// else uses.
pub(crate) fn standard_normals(count: usize, seed: u64) -> Vec<f64> {
    let mut random = stream(seed, EFFECT_STREAM);
    (0..count).map(|_| normal(&mut random)).collect()
}

/// Rounds a command to the digits of the measurement file.
pub(super) fn rounded_command(kind: JointKind, q: f64) -> f64 {
    match kind {
        JointKind::Revolute => rounded(q.to_degrees(), 6).to_radians(),
        _ => rounded(q, 9),
    }
}

/// Returns a uniform random number between two limits.
pub(super) fn between(random: &mut ChaCha8Rng, (from, to): (f64, f64)) -> f64 {
    from + (to - from) * random.random::<f64>()
}

/// Returns the arm with its true parameters. A value given in the truth takes precedence over a
/// drawn one, and a drawn one over the nominal value.
fn true_arm(
    problem: &Problem,
    truth: &Truth,
    mut random: ChaCha8Rng,
) -> (Problem, Vec<TrueParameter>) {
    let mut arm = problem.clone();
    let mut parameters = Vec::new();
    parameters::visit(&mut arm, |name, unit, value| {
        let nominal = *value;
        // A number is drawn for every parameter, so that a rule for one parameter does not change
        // the others.
        let drawn = normal(&mut random);
        if let Some(given) = truth.parameters.iter().rev().find(|given| given.name == name) {
            *value = parameters::true_value(unit, nominal, given.value);
        } else if let Some(sigma) = truth
            .random
            .iter()
            .rev()
            .find(|rule| matches(&rule.pattern, &name))
            .and_then(|rule| rule.sigma(unit))
        {
            *value = parameters::random_value(unit, nominal, sigma, drawn);
        }
        parameters.push(TrueParameter { name, unit, nominal, value: *value });
    });
    (arm, parameters)
}

/// Draws poses; every number is rounded to the digits of the measurement file.
fn draw_poses(problem: &Problem, truth: &Truth, poses: usize, mut random: ChaCha8Rng) -> Vec<Row> {
    let ranges = &truth.poses;
    let mut rows: Vec<Row> = Vec::with_capacity(poses);
    let mut time = 0.0;
    let (targets, round) = (problem.target_words(), truth.rows_per_target(&problem.fixtures));
    for row in 0..poses {
        // All rows before the first round of fixtures measure positions of the targets in turn.
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

/// Marks `count` random rows as held out.
fn hold_out(rows: &mut [Row], count: usize, random: &mut ChaCha8Rng) {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.shuffle(random);
    for index in order.into_iter().take(count) {
        rows[index].held_out = true;
    }
}

/// Rounds `value` to a number of decimals, as reading it back from its text does.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

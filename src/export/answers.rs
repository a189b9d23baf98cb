//! Poses with the results of this library, against which the generated C code is tested.

use nalgebra::{DVector, UnitQuaternion, Vector3};
use rand::RngExt as _;

use super::error::ExportError;
use crate::fit::{self, Placement, SavedEstimate};
use crate::measurement::{Dataset, Measurements};
use crate::model::Model;
use crate::problem::{Joint, JointKind, Problem};
use crate::random::stream;
use crate::remainder::{self, Correction};
use crate::spatial::rotation_axes;

/// Seed of the random poses.
const SEED: u64 = 0x6578_706f_7274;
/// Largest magnitude of a random command, \[rad\] of a revolute and \[m\] of a prismatic joint.
const MAX_COMMAND: (f64, f64) = (3.0, 0.5);
/// Half-width of the range of random temperatures about the reference \[K\].
const TEMPERATURE_HALF_WIDTH: f64 = 10.0;
/// Half-width of the range of random hoist forces about the declared one, as a fraction of it.
const HOIST_HALF_WIDTH: f64 = 0.1;
/// Longest random time of a pose after the first one \[s\].
const MAX_TIME: f64 = 3600.0;

/// Poses of a test, with the results that this library computes for them.
#[derive(Debug, Clone)]
pub struct Answers {
    /// Names of the bases, in the order of the generated code.
    pub bases: Vec<String>,
    /// Names of the targets, in the order of the generated code.
    pub targets: Vec<String>,
    /// Input and output numbers of each pose, in the order that the test program reads.
    pub rows: Vec<Vec<f64>>,
    /// True if the fitted rows had directions of approach, so that those of a pose that states none
    /// are unknown, and not that of the moment of the loads.
    pub(super) has_approach: bool,
}

/// Draws `count` poses within the limits of the joints and predicts them with the identified arm.
/// For the first `commands` poses, the command is also computed by which the identified arm reaches
/// the position of the nominal arm. Poses without equilibrium are left out.
///
/// Returns the answers, with the model and full parameter vector for their bases and targets.
///
/// # Errors
/// Returns an error if the estimate belongs to another problem, or if a joint's limits exclude each
/// other.
pub fn answers(
    problem: &Problem,
    estimate: &SavedEstimate,
    correction: Option<&Correction>,
    (count, commands): (usize, usize),
) -> Result<(Answers, Model, DVector<f64>), ExportError> {
    let rows = random_rows(problem, estimate, count)?;
    let placement = Placement::of(&rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let x = estimate.vector(problem, &model)?;
    let positions = match correction {
        Some(correction) => {
            remainder::predict(problem, estimate, correction, &rows, None)?.prediction.positions
        }
        None => fit::predict(problem, Some(estimate), &rows, None)?.positions,
    };
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(&rows, &all_rows, 1.0);
    estimate.count_time_in(&placement, &mut poses);
    let axes = model.orientations(&poses, x.as_slice());
    let few = rows.select(&all_rows[..commands.min(rows.len())]);
    let goals = fit::waypoints(problem, &model, &x, &few).ok();
    let found = match (&goals, correction) {
        (None, _) => Vec::new(),
        (Some(goals), Some(correction)) => {
            let fitted = (estimate, &x);
            let found = remainder::compensate(problem, &model, fitted, goals, correction)?;
            found.into_iter().map(|(command, _)| command).collect()
        }
        (Some(goals), None) => fit::compensate(problem, &model, &x, goals)?,
    };
    let mut numbers = Vec::new();
    for (row, pose) in poses.iter().enumerate() {
        let setup = &pose.setup;
        let (position, turn) = (positions[row], axes[row]);
        if !position.iter().chain(turn.iter()).all(|value| value.is_finite()) {
            continue;
        }
        let reference = problem.data.reference_temperature.unwrap_or(0.0);
        let flag = |is_set: bool| f64::from(u8::from(is_set));
        let mut line = vec![
            pose.base as f64,
            pose.target as f64,
            setup.payload.copied().unwrap_or(problem.tool.payload_mass),
            setup.hoist.copied().unwrap_or(0.0),
            flag(setup.hoist.is_some()),
            setup.temperature.copied().unwrap_or(reference),
            setup.elapsed,
            setup.time,
            flag(setup.approach.is_some()),
        ];
        line.extend(setup.configuration);
        line.extend(setup.approach.map_or(vec![0.0; rows.joints], <[f64]>::to_vec));
        line.extend(setup.covariates);
        line.resize(9 + 2 * rows.joints + problem.data.covariates.len(), 0.0);
        line.extend(position.iter());
        line.extend(axis_components(&turn));
        if let (Some(command), Some(goals)) = (found.get(row), &goals) {
            let orientation = goals.orientation(row).map(UnitQuaternion::scaled_axis);
            line.extend(goals.positions[row].iter());
            line.push(flag(orientation.is_some()));
            line.extend(axis_components(&orientation.unwrap_or_default()));
            line.push(flag(command.is_reached()));
            line.extend(&command.configuration);
        } else {
            line.resize(line.len() + 13, 0.0);
            line.push(-1.0);
            line.resize(line.len() + rows.joints, 0.0);
        }
        numbers.push(line);
    }
    let Placement { bases, targets, .. } = placement;
    let has_approach = estimate.has_approach;
    Ok((Answers { bases, targets, rows: numbers, has_approach }, model, x))
}

/// Returns the nine components of the axes of a frame that is rotated by the rotation vector `turn`
/// \[rad\], axis by axis.
fn axis_components(turn: &Vector3<f64>) -> Vec<f64> {
    rotation_axes(turn).iter().flat_map(|axis| axis.iter().copied()).collect()
}

/// Returns the range from which commands of a joint are drawn \[rad\] or \[m\]: the limits of the
/// joint, cut to ±[`MAX_COMMAND`].
pub(super) fn command_range(joint: &Joint) -> (f64, f64) {
    let wide = if joint.kind == JointKind::Prismatic { MAX_COMMAND.1 } else { MAX_COMMAND.0 };
    let (low, high) = joint.limits;
    (low.max(-wide), high.min(wide))
}

/// Draws `count` poses with random commands and conditions. Bases and targets alternate from row to
/// row.
pub(super) fn random_rows(
    problem: &Problem,
    estimate: &SavedEstimate,
    count: usize,
) -> Result<Measurements, ExportError> {
    let mut random = stream(SEED, 0);
    let mut between = |(low, high): (f64, f64)| low + (high - low) * random.random::<f64>();
    let configurations: Vec<Vec<f64>> = (0..count)
        .map(|_| {
            let commanded = |joint: &Joint| match joint.command_kind() {
                JointKind::Fixed => 0.0,
                _ => between(command_range(joint)),
            };
            problem.joints.iter().map(commanded).collect()
        })
        .collect();
    let mut list = |range: (f64, f64)| (0..count).map(|_| between(range)).collect::<Vec<f64>>();
    let first = estimate.start_times.as_ref().map_or(0.0, |starts| starts.first);
    let mut time = list((first, first + MAX_TIME));
    // Commands count the time from the first row, predictions from the first pose of the fit; the
    // first row therefore has the time of that pose.
    if let Some(time) = time.first_mut() {
        *time = first;
    }
    let mut rows = Dataset::poses(configurations).time(time);
    rows = rows.payload(list((0.0, problem.tool.payload_mass)));
    let hoists = || problem.joints.iter().filter_map(|joint| joint.beam.as_ref()?.hoist.as_ref());
    if let Some(hoist) = hoists().next() {
        let spread = HOIST_HALF_WIDTH * hoist.force;
        rows = rows.hoist(list((hoist.force - spread, hoist.force + spread)));
    }
    let reference = problem.data.reference_temperature.unwrap_or(20.0);
    rows = rows.temperature(list((
        reference - TEMPERATURE_HALF_WIDTH,
        reference + TEMPERATURE_HALF_WIDTH,
    )));
    if problem.effects.iter().any(|declared| declared.effect.has_sides()) {
        let columns: Vec<Vec<f64>> = problem.joints.iter().map(|_| list((-1.0, 1.0))).collect();
        let sides = |row: usize| columns.iter().map(|c| c[row].signum()).collect::<Vec<f64>>();
        rows = rows.approach((0..count).map(sides));
    }
    let covariates = problem.data.covariates.len();
    if covariates > 0 {
        let columns: Vec<Vec<f64>> = (0..covariates).map(|_| list((-1.0, 1.0))).collect();
        rows = rows
            .covariates((0..count).map(|row| columns.iter().map(|c| c[row]).collect::<Vec<f64>>()));
    }
    let words = |names: &[String], each: usize| {
        (0..count).map(|row| names[(row / each) % names.len()].clone()).collect::<Vec<String>>()
    };
    let [sessions, tools] = ["base", "tool"].map(|of| estimate.words(of));
    let declared: Vec<String> = problem.targets.iter().map(|target| target.name.clone()).collect();
    // Without a column of targets each session has its own tool.
    let targets = if declared.is_empty() && tools != sessions { tools } else { declared };
    if sessions != [String::new()] {
        rows = rows.session(words(&sessions, 1));
    }
    if !targets.is_empty() {
        rows = rows.target(words(&targets, sessions.len()));
    }
    Ok(rows.measurements()?)
}

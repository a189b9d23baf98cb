//! Checks of the numbers in the table: positions that a controller computed instead of an
//! instrument, and commands with few digits.

use nalgebra::DMatrix;
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::doubted_columns::column_name;
use super::finding::{Finding, FindingCode};
use super::row_kind::{RowKind, format_error};
use crate::numeric::levels;

/// Largest rms error of the registered nominal arm, relative to its reach, at which the positions
/// of the table were computed. Errors of built arms are a hundred times as large.
const MAX_COMPUTED_ERROR: f64 = 1e-5;
/// Largest rms error of the registered nominal arm, relative to the declared σ of a coordinate, at
/// which the positions of the table were computed.
const MAX_COMPUTED_SIGMAS: f64 = 0.2;
/// Minimum number of measured coordinates for each free parameter of bases and tools, at which
/// positions are examined. Fewer coordinates fit by registration alone.
const MIN_COORDINATES: usize = 3;
/// Trial steps of commands of revolute joints \[deg\], the largest first.
const STEPS_DEG: [f64; 7] = [1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01];
/// Largest distance of a command from a multiple of a step, relative to the step, at which it is
/// one.
const MAX_OFF_STEP: f64 = 1e-5;
/// Minimum number of different commands of a joint from which its step is determined.
const MIN_COMMANDS: usize = 10;
/// Smallest rms residual of the fit, in units of the declared σ, for which rounded commands are
/// considered as the cause.
const MIN_SIGMAS: f64 = 3.0;
/// Range of the ratio of the rms position error by rounded commands to the rms residual, in which
/// rounding may be the cause of the residual.
const ROUNDING_RATIOS: std::ops::Range<f64> = 0.5..2.0;

/// Smallest share of the squared residual along the motion of a joint whose rounded commands cause
/// it; chance gives a third.
const MIN_SHARE_ALONG: f64 = 0.8;
/// Largest turn of a joint by rounding, in half steps, with room for the other errors.
const MAX_HALF_STEPS: f64 = 1.3;
/// Smallest share of rows within that turn.
const MIN_SHARE_WITHIN: f64 = 0.9;

/// Checks that the positions were measured: the registered nominal arm does not predict them to
/// 10 µm per metre of its reach and a fifth of the declared σ.
pub(super) fn positions_are_measured(fit: &CheckedFit) -> Option<Finding> {
    let RowKind { observation, rows, declared_sigma, .. } = fit.leading();
    let placed = fit.fitting.placements().len();
    let rms = fit.registered.identification.rms.norm;
    let limit = MAX_COMPUTED_ERROR * fit.model().reach();
    let is_below_noise = declared_sigma.is_none_or(|sigma| rms < MAX_COMPUTED_SIGMAS * sigma);
    let is_computed = observation.is_position()
        && 3 * rows.len() > MIN_COORDINATES * placed.max(1)
        && rms < limit
        && is_below_noise;
    if !is_computed {
        return None;
    }
    let text = format!(
        "the nominal arm predicts the positions to {}: they were computed from the joint angles, \
         as a controller does, not measured",
        format_error("position", rms, 5)
    );
    Some(Finding::new(FindingCode::PositionsComputed, [rms.into()], text))
}

/// Checks that the commands of the joints have enough digits: the error by rounding them is not of
/// the size of the residual.
pub(super) fn commands_have_digits(fit: &CheckedFit) -> Option<Finding> {
    let kind = fit.leading();
    let sigma = kind.declared_sigma.filter(|_| kind.observation.is_position())?;
    let rms = fit.rms_at(&kind.rows, &fit.end.x);
    if rms < MIN_SIGMAS * kind.observation.expected_norm() * sigma {
        return None;
    }
    let steps: Vec<(usize, f64)> = revolute_joints(fit)
        .filter_map(|joint| Some((joint, command_step(fit, &kind.rows, joint)?)))
        .collect();
    let is_of_all = steps.len() == revolute_joints(fit).count();
    if steps.is_empty() {
        return None;
    }
    let poses = fit.fitting.poses(&kind.rows);
    let slopes = fit.model().command_jacobian(fit.problem, poses, &fit.end.x);
    // A number that is rounded to a step errs by a uniform distribution of variance step²/12.
    let squares = |(joint, step): &(usize, f64)| {
        let lever: f64 = slopes.iter().map(|slope| slope.column(*joint).norm_squared()).sum();
        step.powi(2) / 12.0 * lever / slopes.len().max(1) as f64
    };
    let rounding = steps.iter().map(squares).sum::<f64>().sqrt();
    if !ROUNDING_RATIOS.contains(&(rounding / rms)) {
        return None;
    }
    if !is_of_all {
        return rounded_alone(fit, &kind, (&steps, &slopes), (rounding, rms));
    }
    let coarsest = steps.iter().map(|(_, step)| step.to_degrees()).fold(0.0, f64::max);
    let text = format!(
        "the commands of each joint are multiples of a step of up to {coarsest}°; if the table \
         rounds them, that alone moves the target by {} rms, as large as the residual of {}",
        format_error("position", rounding, 3),
        format_error("position", rms, 3)
    );
    let numbers = [json!(coarsest), rounding.into(), rms.into()];
    Some(Finding::new(FindingCode::CommandsRounded, numbers, text))
}

/// Reports the rounding of some joints whose columns are coarser than the others. The residual
/// must lie along the motions of these joints, and within half a step in most rows.
fn rounded_alone(
    fit: &CheckedFit,
    kind: &RowKind,
    (steps, slopes): (&[(usize, f64)], &[DMatrix<f64>]),
    (rounding, rms): (f64, f64),
) -> Option<Finding> {
    let errors = fit.errors_at(&kind.rows, &fit.end.x);
    let [(joint, step)] = *steps else { return None };
    let (mut along, mut all, mut within) = (0.0, 0.0, 0);
    for (error, slope) in errors.iter().zip(slopes) {
        let motion = slope.column(joint);
        let turn = error.dot(&motion) / motion.norm_squared().max(f64::MIN_POSITIVE);
        along += turn.powi(2) * motion.norm_squared();
        all += error.norm_squared();
        within += usize::from(turn.abs() <= MAX_HALF_STEPS * step / 2.0);
    }
    if along < MIN_SHARE_ALONG * all || (within as f64) < MIN_SHARE_WITHIN * errors.len() as f64 {
        return None;
    }
    let name = column_name(fit.table(), joint);
    let text = format!(
        "column {name} holds multiples of {}° alone, unlike the other joints; such rounding moves \
         the target by {} rms, as large as the residual of {}, which lies along this joint's motion",
        step.to_degrees(),
        format_error("position", rounding, 3),
        format_error("position", rms, 3)
    );
    let numbers = [json!(step.to_degrees()), rounding.into(), rms.into()];
    Some(Finding::new(FindingCode::CommandsRounded, numbers, text))
}

/// Returns the indices of the joints with a command that is an angle.
fn revolute_joints<'f>(fit: &'f CheckedFit) -> impl Iterator<Item = usize> + 'f {
    let is_revolute = |joint: &usize| fit.turns(*joint);
    (0..fit.problem.joints.len()).filter(is_revolute)
}

/// Returns the largest trial step \[rad\] of which all commands of a joint are multiples; `None` if
/// they are multiples of no trial step, or if too few commands differ.
fn command_step(fit: &CheckedFit, rows: &[usize], joint: usize) -> Option<f64> {
    let measurements = fit.table();
    let command = |&row: &usize| measurements.configurations[row * measurements.joints + joint];
    let degrees = levels(rows.iter().map(|row| command(row).to_degrees()));
    if degrees.len() < MIN_COMMANDS {
        return None;
    }
    let is_step = |step: &&f64| {
        degrees.iter().all(|q| (q / **step - (q / **step).round()).abs() < MAX_OFF_STEP)
    };
    STEPS_DEG.iter().find(is_step).map(|step| step.to_radians())
}

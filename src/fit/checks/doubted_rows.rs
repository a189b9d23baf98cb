//! Check of a fit that is far off: some rows do not belong to the arm that most rows fit.

use std::collections::BTreeSet;

use nalgebra::{DVector, Vector3};
use serde_json::json;

use super::checked_fit::{Check, CheckedFit};
use super::doubted_columns::{column_name, moving};
use super::finding::{Finding, FindingCode};
use super::misfit::{MAX_MISS, MAX_UNREPORTED_RESIDUAL, Misfit};
use super::row_kind::format_error;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::{Measurements, Split};
use crate::model::Pose;
use crate::problem::JointKind;

/// Number of successive rows of each base to which the nominal arm is registered in a trial. They
/// determine base and tool.
const WINDOW: usize = 12;
/// Maximum number of trials, at evenly spaced places of the table.
const MAX_TRIALS: usize = 12;
/// Largest ratio of the error of a row to the rms error of the fit at which the row fits a trial.
const MAX_RATIO: f64 = 0.2;
/// Largest error of a row that fits, as a multiple of the rms error that is not reported as a misfit.
const MAX_OF_RMS: f64 = 2.5;
/// Smallest share of the rows that fit without the others if no mistake in the others is found. With
/// fewer, the others may be right.
const MIN_SHARE: f64 = 0.6;
/// Number of registrations to the rows that fit the one before.
const PASSES: usize = 3;
/// Units of a length that a table may confuse: factors of the measured numbers, with their words.
const LENGTH_FACTORS: [(f64, &str); 6] = [
    (1e3, "multiply them by 1000"),
    (1e-3, "divide them by 1000"),
    (10.0, "multiply them by 10"),
    (0.1, "divide them by 10"),
    (25.4, "multiply them by 25.4"),
    (1.0 / 25.4, "divide them by 25.4"),
];

/// Names of the coordinates of a position.
const NAMES: [&str; 3] = ["x", "y", "z"];

/// Checks, if the fit is far off, that most rows do not fit the nominal arm without the others.
pub(super) struct RowsBelongTogether;

impl Check for RowsBelongTogether {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let positions = fit.fitting.measurements.leading().is_position();
        let missed = Misfit.check(fit).into_iter().next().filter(|_| positions);
        let before = missed.and_then(|found| found.number("rms"));
        before.and_then(|before| doubted(fit, before)).into_iter().collect()
    }
}

/// Errors of the nominal arm after its registration to some rows.
struct Trial {
    /// Full parameter vector of the registered arm.
    x: DVector<f64>,
    /// Measured minus predicted position of every examined row \[m\].
    errors: Vec<Vector3<f64>>,
    /// Places of the rows that fit, in the list of examined rows.
    near: Vec<usize>,
}

/// Returns the finding on rows without which the nominal arm fits; `before` is the rms error of the
/// fit \[m\].
fn doubted(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let kind = fit.kind(fit.fitting.measurements.leading());
    let rows = &kind.rows;
    let noise = kind.declared_sigma.map_or(0.0, |sigma| MAX_UNREPORTED_RESIDUAL * sigma);
    let unreported = (MAX_MISS * kind.spread).max(noise);
    let limit = (MAX_RATIO * before).min(MAX_OF_RMS * unreported);
    let registered = |chosen: &[usize]| -> Option<Trial> {
        let chosen: Vec<usize> = chosen.iter().map(|&place| rows[place]).collect();
        let x = registration(fit, chosen)?;
        let errors = fit.fitting.position_errors(rows, &x);
        let near = |place: &usize| errors[*place].norm() < limit;
        let near = (0..rows.len()).filter(near).collect();
        Some(Trial { x, errors, near })
    };
    let windows = windows(fit, rows);
    let trials = windows.iter().filter_map(|window| registered(window));
    let mut trial = trials.max_by_key(|trial| trial.near.len())?;
    for _ in 0..PASSES {
        trial = registered(&trial.near)?;
    }
    // Fewer rows than those of a trial do not tell the arm from others.
    if trial.near.len() < WINDOW {
        return None;
    }
    let apart: Vec<usize> = (0..rows.len()).filter(|row| !trial.near.contains(row)).collect();
    let squares = trial.near.iter().map(|&place| trial.errors[place].norm_squared());
    let after = (squares.sum::<f64>() / trial.near.len().max(1) as f64).sqrt();
    let is_explained = after < unreported;
    let are_few = (trial.near.len() as f64) < MIN_SHARE * rows.len() as f64;
    let (&first, &last) = (apart.first()?, apart.last()?);
    if !is_explained || apart.len() < 2 {
        return None;
    }
    let measurements = fit.fitting.measurements;
    let place = |place: usize| measurements.location(rows[place]).to_string();
    let pairs = apart.iter().map(|&place| {
        let measured = measurements.positions[rows[place]];
        (measured, measured - trial.errors[place])
    });
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = pairs.collect();
    let is_run = last + 1 - first == apart.len() && apart.len() >= WINDOW;
    let chosen: Vec<usize> = apart.iter().map(|&place| rows[place]).collect();
    let stands_elsewhere = || {
        let rms = registration_error(fit, measurements, &chosen).filter(|_| is_run)?;
        (rms < limit).then(|| {
            "they fit by themselves where base or target stand elsewhere: if the instrument, the base or \
             the target was moved, give them another word in the column session"
                .to_owned()
        })
    };
    let in_other_unit = || {
        let fits = |&(factor, _): &(f64, &str)| {
            let mut converted = measurements.clone();
            for &row in &chosen {
                converted.positions[row] *= factor;
            }
            registration_error(fit, &converted, &chosen).is_some_and(|rms| rms < limit)
        };
        let mut factors = LENGTH_FACTORS.into_iter().filter(|_| chosen.len() >= WINDOW);
        factors.find(fits).map(|(_, words)| format!("their positions are in another unit: {words}"))
    };
    let kept: Vec<usize> = trial.near.iter().map(|&place| rows[place]).collect();
    let cause = other_session(fit, &trial.x, &chosen, limit)
        .or_else(|| mistake(&pairs, limit))
        .or_else(|| other_joint_angles(fit, &trial.x, &chosen, limit))
        .or_else(|| mistaken_joints(fit, &trial.x, &chosen, limit))
        .or_else(stands_elsewhere)
        .or_else(in_other_unit)
        .or_else(|| of_other_target(fit, &chosen, &kept).filter(|_| !are_few));
    if cause.is_none() && are_few {
        return None;
    }
    let cause = cause.unwrap_or_else(|| {
        "check whether they are of this arm, with the same tool and instrument".to_owned()
    });
    let listed = if last + 1 - first == apart.len() && apart.len() > 2 {
        format!("the rows from {} to {}", place(first), place(last))
    } else {
        let shown: Vec<String> = apart.iter().take(4).map(|&row| place(row)).collect();
        let more = apart.len() - shown.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("the rows {}{more}", shown.join(", "))
    };
    let text = format!(
        "{listed} ({} of {}) contradict the others, which the nominal arm misses by {} instead of {}: \
         {cause}",
        apart.len(),
        rows.len(),
        format_error("position", after, 3),
        format_error("position", before, 1)
    );
    let lines: Vec<_> = apart.iter().map(|&row| json!(place(row))).collect();
    let numbers = [json!(lines), rows.len().into(), before.into(), after.into()];
    Some(Finding::new(FindingCode::RowsDoubted, numbers, text))
}

/// Registers the nominal arm to the `chosen` identification rows alone.
fn registration(fit: &CheckedFit, chosen: Vec<usize>) -> Option<DVector<f64>> {
    let split = Split { identification: chosen, held_out: Vec::new() };
    registered(fit, fit.fitting.measurements, &split, |fitting| fitting.registered().ok())
}

/// Returns the rms error of the nominal arm after its registration to the `chosen` rows of
/// `measurements` alone \[m\].
fn registration_error(
    fit: &CheckedFit,
    measurements: &Measurements,
    chosen: &[usize],
) -> Option<f64> {
    let split = Split { identification: chosen.to_vec(), held_out: Vec::new() };
    registered(fit, measurements, &split, |fitting| {
        let x = fitting.registered().ok()?;
        Some(fit.rms(chosen, &fitting.position_errors(chosen, &x)))
    })
}

/// Calls `evaluate` with the fit of the identification rows of `split` alone.
fn registered<R>(
    fit: &CheckedFit,
    measurements: &Measurements,
    split: &Split,
    evaluate: impl FnOnce(&Fitting) -> R,
) -> R {
    let Fitting { placement, model, .. } = *fit.fitting;
    let held_out_only = placement.held_out_only(model, measurements, split);
    let declared = fit.fitting.with_declared_noise();
    let fitting = Fitting { split, measurements, turn_sigma: None, held_out_only, ..declared };
    evaluate(&fitting)
}

/// Returns the words for positions of the `chosen` rows that belong to the joint angles of other
/// rows of the table, to `limit` \[m\] with the registered arm `x`. A shift leaves a row without a
/// position.
fn other_joint_angles(
    fit: &CheckedFit,
    x: &DVector<f64>,
    chosen: &[usize],
    limit: f64,
) -> Option<String> {
    let table = fit.fitting.measurements;
    let is_position = |row: &usize| table.observation(*row).is_position();
    let every_row: Vec<usize> = (0..table.len()).filter(is_position).collect();
    let errors = fit.fitting.position_errors(&every_row, x);
    let predicted: Vec<(usize, Vector3<f64>)> = every_row
        .iter()
        .zip(errors)
        .map(|(&row, error)| (row, table.positions[row] - error))
        .collect();
    let base_of = |row: usize| fit.fitting.placement.base_of(row);
    let source = |row: &usize| {
        let distance = |of: &&(usize, Vector3<f64>)| (of.1 - table.positions[*row]).norm();
        let of_base = predicted.iter().filter(|of| base_of(of.0) == base_of(*row));
        let nearest = of_base.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (nearest.0 != *row && distance(&nearest) < limit).then_some((*row, nearest.0))
    };
    let sources: Vec<(usize, usize)> = chosen.iter().filter_map(source).collect();
    if sources.len() < chosen.len().saturating_sub(1).max(2) {
        return None;
    }
    let are_shifted =
        |by: isize| sources.iter().all(|&(row, of)| row.checked_add_signed(by) == Some(of));
    let are_exchanged = || {
        let others: BTreeSet<usize> = sources.iter().map(|&(_, of)| of).collect();
        others.len() == sources.len() && others.iter().all(|of| chosen.contains(of))
    };
    if are_shifted(-1) {
        Some("their positions belong to the joint angles of the row before".to_owned())
    } else if are_shifted(1) {
        Some("their positions belong to the joint angles of the row after".to_owned())
    } else {
        are_exchanged().then(|| "their positions belong to each other's joint angles".to_owned())
    }
}

/// Returns the words for `chosen` rows that are those of other targets than all rows that are
/// `kept`; `None` if they have a target in common.
fn of_other_target(fit: &CheckedFit, chosen: &[usize], kept: &[usize]) -> Option<String> {
    let placement = fit.fitting.placement;
    let of =
        |rows: &[usize]| rows.iter().map(|&row| placement.target_of(row)).collect::<BTreeSet<_>>();
    let (apart, others) = (of(chosen), of(kept));
    // Without declared targets each session has one.
    if placement.targets == placement.bases {
        return None;
    }
    let names: Vec<&str> = apart.iter().map(|&target| placement.targets[target].as_str()).collect();
    apart.is_disjoint(&others).then(|| {
        format!(
            "they are those of target {}: check its place, its unit, and where its branch of the \
             arm begins",
            names.join(" and ")
        )
    })
}

/// Returns sets of places in `rows`: in each set, successive rows of every base, of all targets or of
/// one target alone.
fn windows(fit: &CheckedFit, rows: &[usize]) -> Vec<Vec<usize>> {
    let placement = fit.fitting.placement;
    let of_base = |base: usize| -> Vec<usize> {
        (0..rows.len()).filter(|&place| placement.base_of(rows[place]) == base).collect()
    };
    let groups: Vec<Vec<usize>> = (0..placement.bases.len()).map(of_base).collect();
    let of_target = |target: usize| -> Vec<usize> {
        let is_of_target = |place: &usize| placement.target_of(rows[*place]) == target;
        groups.iter().flatten().copied().filter(is_of_target).take(2 * WINDOW).collect()
    };
    let several = placement.targets.len() > 1 && placement.targets != placement.bases;
    let targets = if several { placement.targets.len() } else { 0 };
    let trials = MAX_TRIALS.min((rows.len() + 1).saturating_sub(WINDOW));
    let window = |trial: usize| {
        let part = |group: &Vec<usize>| {
            let last = group.len().saturating_sub(WINDOW);
            let from = last * trial / (trials - 1).max(1);
            group.iter().copied().skip(from).take(WINDOW).collect::<Vec<_>>()
        };
        groups.iter().flat_map(part).collect()
    };
    let by_target = (0..targets).map(of_target).filter(|places| places.len() >= WINDOW);
    (0..trials).map(window).chain(by_target).collect()
}

/// Returns the words for `chosen` rows that fit the bases of other sessions to `limit` \[m\], with
/// the registered arm `x`.
fn other_session(
    fit: &CheckedFit,
    x: &DVector<f64>,
    chosen: &[usize],
    limit: f64,
) -> Option<String> {
    let Fitting { placement, model, .. } = *fit.fitting;
    let poses = fit.fitting.poses(chosen);
    let mut sessions = BTreeSet::new();
    for pose in &poses {
        let others = (0..placement.bases.len()).filter(|base| *base != pose.base);
        let moved: Vec<Pose> = others
            .map(|base| {
                // Without a column target each session has its target.
                let has_target =
                    placement.targets.get(pose.target) == placement.bases.get(pose.base);
                let target = placement.bases.get(base).filter(|_| has_target);
                let target =
                    target.and_then(|word| placement.targets.iter().position(|of| of == word));
                Pose { base, target: target.unwrap_or(pose.target), ..*pose }
            })
            .collect();
        let errors = model.residuals(moved.clone(), x);
        let place = errors.iter().position(|error| error.norm() < limit)?;
        sessions.insert(placement.bases[moved[place].base].as_str());
    }
    let sessions: Vec<&str> = sessions.into_iter().collect();
    Some(format!(
        "they fit in session {} instead: correct the column session",
        sessions.join(" or ")
    ))
}

/// Returns the words for a mistake in the joint columns that explains the positions of the `chosen`
/// rows to `limit` \[m\], with the registered arm `x`: angles in another unit, or the sign of a
/// joint.
fn mistaken_joints(
    fit: &CheckedFit,
    x: &DVector<f64>,
    chosen: &[usize],
    limit: f64,
) -> Option<String> {
    let table = fit.fitting.measurements;
    let joints: Vec<usize> = moving(fit).collect();
    let is_turning =
        |joint: &usize| fit.problem.joints[*joint].command_kind() == JointKind::Revolute;
    let turning: Vec<usize> = joints.iter().copied().filter(is_turning).collect();
    let fits = |changed: &[usize], factor: f64| {
        let mut corrected = table.clone();
        for &row in chosen {
            for &joint in changed {
                corrected.configurations[row * table.joints + joint] *= factor;
            }
        }
        let fitting = Fitting { measurements: &corrected, ..fit.fitting.with_declared_noise() };
        fit.rms(chosen, &fitting.position_errors(chosen, x)) < limit
    };
    let in_degrees = 1_f64.to_radians();
    if fits(&turning, in_degrees.recip()) {
        return Some("their joint angles are in radians, unlike those of the others".to_owned());
    }
    if fits(&turning, in_degrees) {
        return Some("their joint angles are in degrees, unlike those of the others".to_owned());
    }
    let joint = joints.into_iter().find(|&joint| fits(&[joint], -1.0))?;
    Some(format!("their {} has the other sign", column_name(table, joint)))
}

/// Function of a measured and a predicted position that returns the corrected measurement.
type Correction<'a> = dyn Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64> + 'a;

/// Returns the words for a mistake that explains pairs of measured and predicted positions to
/// `limit` \[m\].
fn mistake(pairs: &[(Vector3<f64>, Vector3<f64>)], limit: f64) -> Option<String> {
    let fits = |corrected: &Correction| {
        let square = |(measured, predicted): &(Vector3<f64>, Vector3<f64>)| {
            (corrected(measured, predicted) - predicted).norm_squared()
        };
        (pairs.iter().map(square).sum::<f64>() / pairs.len() as f64).sqrt() < limit
    };
    let sign = (0..3).find(|&axis| {
        fits(&|measured, _| {
            let mut corrected = *measured;
            corrected[axis] = -corrected[axis];
            corrected
        })
    });
    if let Some(axis) = sign {
        return Some(format!("their {} has the other sign", NAMES[axis]));
    }
    let exchanged = [(0, 1), (0, 2), (1, 2)].into_iter().find(|&(first, second)| {
        fits(&|measured, _| {
            let mut corrected = *measured;
            corrected.swap_rows(first, second);
            corrected
        })
    });
    if let Some((first, second)) = exchanged {
        return Some(format!("their {} and {} are exchanged", NAMES[first], NAMES[second]));
    }
    let mut factors = LENGTH_FACTORS.into_iter();
    if let Some((_, words)) = factors.find(|(factor, _)| fits(&|measured, _| measured * *factor)) {
        return Some(format!("their positions are in another unit: {words}"));
    }
    let axis = (0..3).find(|&axis| {
        fits(&|measured, predicted| {
            let mut corrected = *measured;
            corrected[axis] = predicted[axis];
            corrected
        })
    });
    axis.map(|axis| format!("their {} alone is wrong", NAMES[axis]))
}

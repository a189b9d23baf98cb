//! Check of a fit that is far off: some rows do not belong to the arm that most rows fit.

use std::collections::BTreeSet;

use nalgebra::{DVector, Vector3};
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misfit::{misfit, unreported};
use super::mistaken_rows::MistakenRows;
use super::row_kind::{format_error, listed, listed_up_to};
use crate::numeric::{median, root_mean};

/// Number of successive rows of each base to which the nominal arm is registered in a trial. They
/// determine base and tool.
const WINDOW: usize = 12;
/// Maximum number of trials, at evenly spaced places of the table.
const MAX_TRIALS: usize = 12;
/// Largest ratio of the error of a row to the rms error of the fit at which the row fits a trial.
const MAX_RATIO: f64 = 0.2;
/// Largest error of a row that fits, as a multiple of the rms error that is not reported as a misfit.
const MAX_OF_RMS: f64 = 2.5;
/// Maximum number of rows that the text lists.
const MAX_LISTED: usize = 4;
/// Largest ratio of the error of a row that fits to the median error of all rows.
const MAX_RATIO_TO_MEDIAN: f64 = 4.0;
/// Smallest share of the rows that fit without the others if no mistake in the others is found. With
/// fewer, the others may be right.
const MIN_SHARE: f64 = 0.6;
/// Number of registrations to the rows that fit the one before.
const PASSES: usize = 3;

/// Words for rows of which no mistake is found.
const OPEN_CAUSE: &str = "check whether they are of this arm, with the same tool and instrument";

/// Returns true if a finding is on rows of which no mistake is found.
pub(super) fn is_open(found: &Finding) -> bool {
    found.code == FindingCode::RowsDoubted && found.text.ends_with(OPEN_CAUSE)
}

/// Checks, if the fit is far off, that most rows do not fit the nominal arm without the others.
pub(super) fn rows_belong_together(fit: &CheckedFit) -> Option<Finding> {
    let positions = fit.table().leading().is_position();
    let missed = misfit(fit).into_iter().next().filter(|_| positions);
    let before = missed.and_then(|found| found.number("rms"));
    before.and_then(|before| doubted(fit, before))
}

/// Errors of the nominal arm after its registration to some rows.
struct Trial {
    /// Full parameter vector of the registered arm.
    x: DVector<f64>,
    /// Measured minus predicted position of every examined row \[m\].
    errors: Vec<Vector3<f64>>,
    /// Places of the rows that fit, in the list of examined rows.
    near: Vec<usize>,
    /// Largest error of a row that fits \[m\].
    limit: f64,
}

/// Returns the finding on rows without which the nominal arm fits; `before` is the rms error of the
/// fit \[m\].
fn doubted(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let kind = fit.leading();
    let rows = &kind.rows;
    let unreported = unreported(&kind);
    let limit = (MAX_RATIO * before).min(MAX_OF_RMS * unreported);
    let registered = |chosen: &[usize], is_first: bool| -> Option<Trial> {
        let chosen: Vec<usize> = chosen.iter().map(|&place| rows[place]).collect();
        let table = fit.table();
        let x = fit.with_rows(table, &chosen, |fitting| fitting.registered().ok())?;
        let errors = fit.errors_at(rows, &x);
        // Few wrong rows leave a small rms error, which the nominal arm may exceed in many rows.
        let usual = MAX_RATIO_TO_MEDIAN * median(errors.iter().map(nalgebra::Matrix::norm))?;
        let limit = if is_first { limit } else { limit.max(usual.min(before)) };
        let near = |place: &usize| errors[*place].norm() < limit;
        let near = (0..rows.len()).filter(near).collect();
        Some(Trial { x, errors, near, limit })
    };
    let windows = windows(fit, rows);
    let trials = windows.iter().filter_map(|window| registered(window, true));
    let mut trial = trials.max_by_key(|trial| trial.near.len())?;
    for _ in 0..PASSES {
        trial = registered(&trial.near, false)?;
    }
    // Fewer rows than those of a trial do not tell the arm from others.
    if trial.near.len() < WINDOW {
        return None;
    }
    let apart: Vec<usize> = (0..rows.len()).filter(|row| !trial.near.contains(row)).collect();
    let squares = trial.near.iter().map(|&place| trial.errors[place].norm_squared());
    let after = root_mean(squares);
    let is_explained = after < unreported;
    let are_few = (trial.near.len() as f64) < MIN_SHARE * rows.len() as f64;
    let (&first, &last) = (apart.first()?, apart.last()?);
    if !is_explained || apart.len() < 2 {
        return None;
    }
    let measurements = fit.table();
    let place = |place: usize| measurements.location(rows[place]).to_string();
    let chosen: Vec<usize> = apart.iter().map(|&place| rows[place]).collect();
    let kept: Vec<usize> = trial.near.iter().map(|&place| rows[place]).collect();
    let cause = MistakenRows { fit, x: &trial.x, rows: &chosen, limit: trial.limit }
        .cause()
        .or_else(|| of_other_target(fit, &chosen, &kept).filter(|_| !are_few));
    if cause.is_none() && are_few {
        return None;
    }
    let cause = cause.unwrap_or_else(|| OPEN_CAUSE.to_owned());
    let named = if last + 1 - first == apart.len() && apart.len() > 2 {
        format!("the rows from {} to {}", place(first), place(last))
    } else {
        let places: Vec<String> = apart.iter().map(|&row| place(row)).collect();
        format!("the rows {}", listed_up_to(&places, MAX_LISTED))
    };
    let is_position = |row: &usize| measurements.observation(*row).is_position();
    let held_out: Vec<usize> =
        fit.fitting.split.held_out.iter().copied().filter(is_position).collect();
    let errors = fit.errors_at(&held_out, &trial.x);
    let far = held_out.iter().zip(&errors).filter(|(_, of)| of.norm() > before.max(trial.limit));
    let far: Vec<String> = far.map(|(&row, _)| measurements.location(row).to_string()).collect();
    let far = if far.is_empty() {
        String::new()
    } else {
        format!(", and {} of the held-out rows", listed(&far))
    };
    let text = format!(
        "{named} ({} of {}{far}) contradict the others: without them the nominal arm misses by {} instead of \
         {}; {cause}",
        apart.len(),
        rows.len(),
        format_error("position", after, 3),
        format_error("position", before, 1)
    );
    let lines: Vec<_> = apart.iter().map(|&row| json!(place(row))).collect();
    let numbers = [json!(lines), rows.len().into(), before.into(), after.into()];
    Some(Finding::new(FindingCode::RowsDoubted, numbers, text))
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

//! Search for a joint column that does not hold the coordinate of its joint: the positions fit if
//! the coordinate is found from each position instead.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use super::checked_fit::CheckedFit;
use super::misfit::unreported;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::Measurements;
use crate::numeric::{root_mean, spaced};

/// Maximum number of rows, evenly spaced, with which the search is made.
const MAX_ROWS: usize = 60;
/// Minimum number of rows of the search. One number of each row is found from it.
const MIN_ROWS: usize = 20;
/// Number of trial coordinates of a joint, over a turn or over the range of its commands.
const TRIALS: usize = 48;
/// Number of registrations of the nominal arm, each with the coordinates found before.
const PASSES: usize = 8;
/// Number of Newton steps of the coordinates after each search.
const STEPS: usize = 4;
/// Change of a coordinate for its derivative \[rad\] or \[m\].
const DIFFERENCE: f64 = 1e-5;
/// Largest ratio of the error with the coordinates of a joint found from the positions to that of
/// the fit, at which its column is wrong.
const MAX_RATIO: f64 = 0.1;
/// Largest ratio of this error to that with any other joint. Two joints with parallel axes next to
/// each other explain about the same.
const MAX_RATIO_TO_OTHERS: f64 = 0.3;

/// Joint column that does not hold the coordinate of its joint.
pub(super) struct Unrelated {
    /// Index of the joint.
    pub joint: usize,
    /// Error of the registered nominal arm with the coordinate found from each position, or taken from
    /// the row beside \[m\].
    pub after: f64,
    /// How the coordinate was found.
    pub with: String,
    /// What is wrong with the column.
    pub what: String,
}

/// Largest difference of a found coordinate from one that the column explains \[rad\].
const MAX_DIFFERENCE: f64 = 0.1;
/// Smallest share of the rows that a relation explains.
const MIN_RELATED_SHARE: f64 = 0.9;
/// Smallest share of the rows in which a relation changes the coordinate.
const MIN_CHANGED_SHARE: f64 = 0.05;

/// Returns an angle between −π and π.
fn wrapped(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

/// Returns true if an angle is nearly a whole number of turns.
fn is_near(angle: f64) -> bool {
    wrapped(angle).abs() < MAX_DIFFERENCE
}

/// Minimum number of rows in which a column holds one number.
const MIN_HELD: usize = 4;

/// Returns how the numbers of a `column` in all rows of a `table` \[rad\] differ from the coordinates
/// of its turning joint that were `found` in some rows, in words. Each row is given with its index, its
/// number and the found coordinate.
fn relation(table: &Measurements, found: &[(usize, f64, f64)], column: &[f64]) -> Option<String> {
    // The angle by which most differences agree.
    let from_own: Vec<f64> = found.iter().map(|of| of.2 - of.1).collect();
    let near = |angle: &&f64| from_own.iter().filter(|other| is_near(*other - **angle)).count();
    let zero = from_own.iter().max_by_key(near).map_or(0.0, |angle| wrapped(*angle));
    related(table, found, column).or_else(|| {
        // The pose of the base may make up for an angle that all coordinates have in common.
        let aligned: Vec<(usize, f64, f64)> = found
            .iter()
            .map(|&(row, command, coordinate)| (row, command, coordinate - zero))
            .collect();
        related(table, &aligned, column)
    })
}

/// Does the work of [`relation`] for numbers of their own rows.
fn related(table: &Measurements, found: &[(usize, f64, f64)], column: &[f64]) -> Option<String> {
    let in_rows = |first: usize, last: usize| {
        format!("in the rows from {} to {}", table.location(first), table.location(last))
    };
    let count = found.len() as f64;
    let is_same = |&(_, command, coordinate): &(usize, f64, f64)| is_near(coordinate - command);
    let explains = |is_changed: &dyn Fn(&(usize, f64, f64)) -> bool| {
        let changed: Vec<usize> = found
            .iter()
            .filter(|of| !is_same(of) && is_changed(of))
            .map(|(row, ..)| *row)
            .collect();
        let same = found.iter().filter(|of| is_same(of)).count();
        let is_enough = changed.len() as f64 >= MIN_CHANGED_SHARE * count
            && (same + changed.len()) as f64 >= MIN_RELATED_SHARE * count;
        is_enough.then_some(changed)
    };
    if let Some(reversed) = explains(&|(_, command, coordinate)| is_near(coordinate + command)) {
        if found.iter().all(|(_, command, _)| *command >= 0.0) {
            return Some("the sign of its numbers is lost, none of which is negative".to_owned());
        }
        let (&first, &last) = (reversed.first()?, found.last().map(|(row, ..)| row)?);
        let kept =
            found.iter().filter(|of| of.0 >= first && is_same(of) && of.1.abs() > MAX_DIFFERENCE);
        let is_run = reversed.contains(&last) && kept.count() == 0;
        return Some(if is_run {
            format!("from about {} on, the column counts the other way", table.location(first))
        } else {
            "some of its numbers have the other sign".to_owned()
        });
    }
    // The longest run of equal numbers, in which the coordinates are others.
    let runs = column.chunk_by(|one, next| one.total_cmp(next).is_eq()).map(<[f64]>::len);
    let runs = runs.scan(0, |first, length| {
        *first += length;
        Some(*first - length..*first)
    });
    let longest = runs.max_by_key(ExactSizeIterator::len).filter(|run| run.len() >= MIN_HELD);
    if let Some(run) = longest
        && explains(&|(row, ..)| run.contains(row)).is_some()
    {
        let rows = in_rows(run.start, run.end - 1);
        return Some(format!("it holds one number {rows}, as if the log had frozen"));
    }
    // Each row that differs proposes the angle by which all of them do.
    let changed = || found.iter().filter(|of| !is_same(of));
    let offset = changed()
        .map(|of| wrapped(of.2 - of.1))
        .max_by_key(|angle| changed().filter(|of| is_near(of.2 - of.1 - angle)).count())?;
    let rows = explains(&|(_, command, coordinate)| is_near(coordinate - command - offset))?;
    let (&first, &last) = (rows.first()?, rows.last()?);
    if !found.iter().any(|of| (first..=last).contains(&of.0) && is_same(of)) {
        let size = if offset > 0.0 { "small" } else { "large" };
        let by = offset.abs().to_degrees();
        let rows = in_rows(first, last);
        return Some(format!("{rows} its numbers are too {size} by {by:.0}°"));
    }
    is_near(offset - PI).then(|| {
        "some of its numbers are half a turn off, as angles that were wrapped to 180°".to_owned()
    })
}

/// Returns the only joint whose column does not hold its coordinate, if the positions fit with that
/// coordinate found from each of them; `before` is the rms error of the fit \[m\] and `joints` are
/// the indices of the joints with commands. The search is local, so it can miss such a column.
pub(super) fn unrelated(fit: &CheckedFit, before: f64, joints: &[usize]) -> Option<Unrelated> {
    let kind = fit.leading();
    let rows = spaced(kind.rows.clone(), MAX_ROWS);
    if rows.len() < MIN_ROWS {
        return None;
    }
    let limit = (MAX_RATIO * before).min(unreported(&kind));
    if let Some(late) = of_neighbour(fit, &rows, joints).filter(|late| late.after < limit) {
        return Some(late);
    }
    let error = |&joint: &usize| {
        let (error, found) = error_without(fit, &rows, joint)?;
        Some((joint, error, found))
    };
    let mut errors: Vec<(usize, f64, Vec<f64>)> = joints.iter().filter_map(error).collect();
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let &(joint, after, ref found) = errors.first()?;
    let is_alone = errors.get(1).is_none_or(|next| after < MAX_RATIO_TO_OTHERS * next.1);
    let command = |row: usize| fit.table().configuration(row)[joint];
    let pairs = rows.iter().zip(found).map(|(&row, &coordinate)| (row, command(row), coordinate));
    let column: Vec<f64> = (0..fit.table().len()).map(command).collect();
    let is_turning = fit.turns(joint);
    (after < limit && is_alone).then(|| {
        let table = fit.table();
        let what = relation(table, &pairs.collect::<Vec<_>>(), &column).filter(|_| is_turning);
        Unrelated {
            joint,
            after,
            with: format!("joint {} found from each position", joint + 1),
            what: what.unwrap_or_else(|| {
                "the column may hold a speed, a deviation or another axis".to_owned()
            }),
        }
    })
}

/// Returns the column of which each number belongs to the row before, or after, with the smallest
/// error of the registered nominal arm.
fn of_neighbour(fit: &CheckedFit, rows: &[usize], joints: &[usize]) -> Option<Unrelated> {
    let table = fit.table();
    let moved = |&(joint, by, side): &(usize, isize, &str)| {
        let source = |row: usize| row.checked_add_signed(by).filter(|row| *row < table.len());
        let pairs = rows.iter().filter_map(|&row| {
            let coordinate = table.configuration(source(row)?)[joint];
            Some((row, coordinate))
        });
        let (rows, coordinates): (Vec<usize>, Vec<f64>) = pairs.unzip();
        let mut corrected = table.clone();
        set(&mut corrected, &rows, (joint, &coordinates));
        Some(Unrelated {
            joint,
            after: fit.registration_error(&corrected, &rows)?,
            with: "its numbers moved by a row".to_owned(),
            what: format!("each of its numbers belongs to the row {side}"),
        })
    };
    let columns = joints.iter().flat_map(|&joint| [(joint, 1, "before"), (joint, -1, "after")]);
    columns.filter_map(|of| moved(&of)).min_by(|a, b| a.after.total_cmp(&b.after))
}

/// Returns the rms error of the registered nominal arm in `rows` with the coordinates of a joint
/// found from the positions \[m\], and these coordinates.
fn error_without(fit: &CheckedFit, rows: &[usize], joint: usize) -> Option<(f64, Vec<f64>)> {
    let Fitting { placement, model, measurements, .. } = *fit.fitting;
    let mut table = measurements.clone();
    let is_turning = fit.turns(joint);
    let commands = || rows.iter().map(|&row| measurements.configuration(row)[joint]);
    let least = commands().fold(f64::INFINITY, f64::min);
    let most = commands().fold(f64::NEG_INFINITY, f64::max);
    // A sliding joint may have moved as far again as its column says, to either side.
    let (from, range) =
        if is_turning { (-PI, TAU) } else { (2.0 * least - most, 3.0 * (most - least)) };
    let mut found: Vec<f64> = commands().collect();
    let mut last = f64::INFINITY;
    for pass in 0..PASSES {
        set(&mut table, rows, (joint, &found));
        // A target that is free moves to the axis of a joint whose column says nothing, so that the
        // joint has no effect: it keeps its declared place at first.
        let x = fit.with_rows(&table, rows, |fitting| {
            if pass < PASSES / 2 { Some(fitting.located()) } else { fitting.registered().ok() }
        })?;
        let errors_at = |coordinates: &[f64]| {
            let mut table = measurements.clone();
            set(&mut table, rows, (joint, coordinates));
            placement.position_errors(model, &x, &table, rows)
        };
        if pass < PASSES / 2 {
            let mut best = lengths(&errors_at(&found));
            for trial in 0..TRIALS {
                let coordinate = from + range * trial as f64 / TRIALS as f64;
                let errors = lengths(&errors_at(&vec![coordinate; rows.len()]));
                for ((best, error), found) in best.iter_mut().zip(errors).zip(&mut found) {
                    if error < *best {
                        (*best, *found) = (error, coordinate);
                    }
                }
            }
        }
        for _ in 0..STEPS {
            let errors = errors_at(&found);
            let moved: Vec<f64> = found.iter().map(|coordinate| coordinate + DIFFERENCE).collect();
            for ((found, error), other) in found.iter_mut().zip(&errors).zip(errors_at(&moved)) {
                let slope = (other - error) / DIFFERENCE;
                *found -= error.dot(&slope) / slope.norm_squared().max(f64::MIN_POSITIVE);
            }
        }
        last = root_mean(errors_at(&found).iter().map(Vector3::norm_squared));
    }
    last.is_finite().then_some((last, found))
}

/// Writes the coordinates of a joint into `rows` of a table.
fn set(table: &mut Measurements, rows: &[usize], (joint, coordinates): (usize, &[f64])) {
    let joints = table.joints;
    for (&row, coordinate) in rows.iter().zip(coordinates) {
        table.configurations[row * joints + joint] = *coordinate;
    }
}

/// Returns the lengths of errors.
fn lengths(errors: &[Vector3<f64>]) -> Vec<f64> {
    errors.iter().map(Vector3::norm).collect()
}

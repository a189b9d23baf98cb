//! Constant difference between the clocks of two tables that are joined by time.

use crate::error::{Location, Warning, WarningKind};
use crate::problem::JoinRule;

/// Maximum time between paired rows when a shift between the clocks is searched, unless the problem
/// allows more \[s\].
const PAIR_GAP: f64 = 0.5;
/// Maximum number of rows of the joint table for which a shift is searched. A table with more rows
/// is a continuous log, in which every shift finds partners.
const MAX_LOG_ROWS: usize = 2000;
/// Maximum number of measured rows with which a shift is tested.
const MAX_TESTED_ROWS: usize = 200;
/// Maximum number of measured rows from which shifts are tried: the differences of their times to
/// those of all rows of the joint table.
const TRIAL_ROWS: usize = 8;
/// Smallest number of pairs of rows with which a shift is accepted.
const MIN_PAIRS: usize = 5;
/// Smallest fraction of the tested rows that a shift must pair.
const MIN_PAIRED_FRACTION: f64 = 0.8;
/// Largest number of pairs that another shift may have, as a fraction of those of the best shift.
/// If poses follow each other at equal intervals, several shifts pair nearly all rows and none is
/// certain.
const MAX_RIVAL_FRACTION: f64 = 0.7;

/// Returns the shift \[s\] that must be added to the times of a joint table, so that its rows pair
/// best with the rows measured at `times` \[s\].
///
/// `log` are the times of the joint table in ascending order \[s\]. Rows pair if their times differ
/// by at most `tolerance` \[s\], or by half a second if that is more. Returns `None` if no shift
/// pairs most rows, or if several do.
pub(super) fn best_shift(times: &[f64], log: &[f64], tolerance: f64) -> Option<f64> {
    let gap = tolerance.max(PAIR_GAP);
    if log.len() > MAX_LOG_ROWS {
        return None;
    }
    let tested = evenly(times, MAX_TESTED_ROWS);
    let count = |shift: f64| {
        let mut partners: Vec<usize> =
            pairs(&tested, (log, gap), shift).map(|(_, row)| row).collect();
        partners.sort_unstable();
        partners.dedup();
        partners.len()
    };
    let shifts_of = |time: f64| log.iter().map(move |logged| time - logged);
    let shifts = evenly(times, TRIAL_ROWS).into_iter().flat_map(shifts_of);
    let counted: Vec<(usize, f64)> = shifts.map(|shift| (count(shift), shift)).collect();
    let &(most, best) = counted.iter().max_by_key(|(pairs, _)| *pairs)?;
    let is_rival = |&&(pairs, shift): &&(usize, f64)| {
        (shift - best).abs() > 2.0 * gap && pairs as f64 > MAX_RIVAL_FRACTION * most as f64
    };
    let is_clear = most >= MIN_PAIRS && most as f64 >= MIN_PAIRED_FRACTION * tested.len() as f64;
    if !is_clear || counted.iter().any(|counted| is_rival(&counted)) {
        return None;
    }
    let mut differences: Vec<f64> = pairs(&tested, (log, gap), best)
        .filter_map(|(time, row)| log.get(row).map(|logged| time - logged))
        .collect();
    differences.sort_by(f64::total_cmp);
    differences.get(differences.len() / 2).copied()
}

/// Unit of the differences between time zones \[s\].
const QUARTER_HOUR: f64 = 900.0;
/// Largest deviation from a whole number of quarter hours that a change of the time zone leaves
/// \[s\].
const MAX_OFF_QUARTER: f64 = 2.0;

/// Returns the whole quarters of an hour \[s\] that must be added to `times` \[s\], those of the
/// rows without a partner, so that they have partners in `log`. `None` if no such shift is certain.
fn zone_change(times: &[f64], log: &[f64]) -> Option<f64> {
    let shift = -best_shift(times, log, PAIR_GAP)?;
    let whole = (shift / QUARTER_HOUR).round() * QUARTER_HOUR;
    (whole != 0.0 && (shift - whole).abs() < MAX_OFF_QUARTER).then_some(whole)
}

/// Returns a warning, located at the row `first` without a partner, if the rows measured at `times`
/// without a partner in `log` have one at another hour of the clock. `None` unless both tables are
/// joined by time.
pub(super) fn clock_jump(
    rule: JoinRule,
    (times, log): (&[f64], &[f64]),
    first: Option<&Location>,
) -> Option<Warning> {
    let JoinRule::Time { tolerance, .. } = rule else { return None };
    let is_unpaired = |time: &&f64| nearest(log, **time).is_some_and(|(_, gap)| gap > tolerance);
    let times: Vec<f64> = times.iter().filter(is_unpaired).copied().collect();
    let shift = zone_change(&times, log)?;
    let kind = WarningKind::ClockJump {
        rows: times.len(),
        hours: format!("{} h", shift.abs() / 3600.0),
        by: if shift > 0.0 { "forward" } else { "back" },
    };
    Some(Warning { location: first?.clone(), kind })
}

/// Returns at most `most` of the times, evenly spaced.
fn evenly(times: &[f64], most: usize) -> Vec<f64> {
    times.iter().copied().step_by(times.len().div_ceil(most).max(1)).collect()
}

/// Iterates over the measured times that have a partner in `log`, at most `most` \[s\] away, if
/// `shift` \[s\] is added to the times of the log. Each is returned with the index of its partner.
fn pairs(
    times: &[f64],
    (log, most): (&[f64], f64),
    shift: f64,
) -> impl Iterator<Item = (f64, usize)> {
    times.iter().filter_map(move |&time| {
        let (row, gap) = nearest(log, time - shift)?;
        (gap <= most).then_some((time, row))
    })
}

/// Returns the index of the entry of `log` that is nearest to `time`, and the time between them
/// \[s\]; `None` if `log` is empty. `log` must be in ascending order.
pub(super) fn nearest(log: &[f64], time: f64) -> Option<(usize, f64)> {
    let after = log.partition_point(|logged| *logged < time);
    let around = [after.checked_sub(1), Some(after)].into_iter().flatten();
    let gap = |row: usize| log.get(row).map(|logged| (row, (logged - time).abs()));
    around.filter_map(gap).min_by(|(_, a), (_, b)| a.total_cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shift_of_a_clock_is_found_only_if_it_is_certain() {
        let uneven: Vec<f64> =
            (0..30).map(|k| f64::from(k * 8) + f64::from(k * k % 31) / 4.0).collect();
        let late: Vec<f64> = uneven.iter().map(|time| time + 47.03).collect();
        let shift = best_shift(&late, &uneven, 0.0).unwrap_or(0.0);
        assert!((shift - 47.03).abs() < 1e-9, "{shift}");
        // Stamps that scatter by more than half a second need a tolerance.
        let slow: Vec<f64> = uneven.iter().map(|time| 6.0 * time).collect();
        let scattered =
            |k: usize, time: &f64| time + 73.4 + if k.is_multiple_of(2) { 1.4 } else { 0.0 };
        let late: Vec<f64> = slow.iter().enumerate().map(|(k, time)| scattered(k, time)).collect();
        assert_eq!(best_shift(&late, &slow, 0.5), None);
        let shift = best_shift(&late, &slow, 2.0).unwrap_or(0.0);
        assert!((shift - 74.1).abs() < 0.8, "{shift}");
        let even: Vec<f64> = (0..30).map(|k| f64::from(k * 8)).collect();
        let late: Vec<f64> = even.iter().map(|time| time + 47.03).collect();
        assert_eq!(best_shift(&late, &even, 0.0), None);
        assert_eq!(best_shift(&[], &even, 0.0), None);
        let late: Vec<f64> = uneven.iter().map(|time| time + 3600.3).collect();
        assert_eq!(zone_change(&late, &uneven), Some(-3600.0));
        let late: Vec<f64> = uneven.iter().map(|time| time + 47.03).collect();
        assert_eq!(zone_change(&late, &uneven), None);
    }
}

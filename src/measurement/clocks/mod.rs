//! Constant difference between the clocks of two tables that are joined by time.

mod stops;

use super::paired_times::median;
use crate::error::{Location, Warning, WarningKind};
use crate::problem::JoinRule;
use crate::quantity::format::two_digits;
use stops::{PAIR_GAP, Rest, nearest_rest, several_rows};
pub(super) use stops::{Stops, moving_arm};

/// Largest such time with which a shift is searched if smaller ones find none \[s\]: readings may
/// follow a stop by a varying time. Each is twice the one before.
const MAX_PAIR_GAP: f64 = 32.0;
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
/// The same for rows that are paired over more than [`PAIR_GAP`], where fewer pair by chance.
const MIN_WIDE_PAIRS: usize = 10;
/// Smallest fraction of the tested rows that a shift must pair.
const MIN_PAIRED_FRACTION: f64 = 0.8;
/// Largest number of pairs that another shift may have, as a fraction of those of the best shift.
/// If poses follow each other at equal intervals, several shifts pair nearly all rows and none is
/// certain.
const MAX_RIVAL_FRACTION: f64 = 0.7;

/// Smallest fraction of the tested rows that a shift must pair with rests. Positions are measured
/// while the arm rests.
const MIN_RESTING_FRACTION: f64 = 0.97;
/// Largest number of rests that another shift may pair, as a fraction of those of the best shift.
const MAX_RESTING_RIVAL_FRACTION: f64 = 0.95;

/// Difference between the clocks of two tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClockShift {
    /// Time that must be added to the times of the joint table \[s\].
    pub seconds: f64,
    /// Largest time between rows that the shift pairs \[s\]; 0 if they fall into rests.
    pub gap: f64,
    /// True if it was found by stops of several rows each, of which it is certain.
    pub is_of_stops: bool,
}

/// Largest time between rows that an undeclared offset of the clocks pairs, as a fraction of the time
/// between two rows of the joint table: rows of other poses are seldom so near.
const MAX_CLEAR_GAP: f64 = 0.25;
/// Smallest ratio to that time of the time to any other row.
const MIN_CLEAR_RATIO: f64 = 2.0;
/// Smallest number of measured rows with which such an offset is taken.
const MIN_CLEAR_ROWS: usize = 10;

impl ClockShift {
    /// Returns true if so many rows measured at `times` \[s\] are so near their partners in `log`,
    /// a table of the `stops`, that the shift may be taken without being declared.
    pub fn is_clear(self, times: &[f64], (log, stops): (&[f64], &Stops)) -> bool {
        if self.is_of_stops {
            return true;
        }
        let is_close = median_step(log).is_some_and(|step| self.gap <= MAX_CLEAR_GAP * step);
        // The stop that is next nearest to each must not be its partner as well.
        let is_only = |time: &f64| {
            let time = time - self.seconds;
            let partner = nearest_rest(&stops.runs, time).filter(|(_, gap)| *gap <= self.gap);
            partner.is_none_or(|(place, _)| {
                let around = [place.checked_sub(1), Some(place + 1)].into_iter().flatten();
                let mut others = around.filter_map(|other| stops.runs.get(other));
                others.all(|other| {
                    (other.first - time).max(time - other.last) > MIN_CLEAR_RATIO * self.gap
                })
            })
        };
        is_close && times.len() >= MIN_CLEAR_ROWS && times.iter().all(is_only)
    }
}

/// Returns the median time between two rows of a joint table \[s\].
pub(super) fn median_step(log: &[f64]) -> Option<f64> {
    median(log.iter().zip(log.iter().skip(1)).map(|(a, b)| b - a).collect())
}

/// Returns the shift of the times of a joint table with which its rows pair best with the rows
/// measured at `times` \[s\].
///
/// `log` are the times of the joint table in ascending order \[s\], and `stops` those in which the
/// arm stands. The least time between paired rows that makes a shift certain is taken. Returns `None`
/// if no shift pairs most rows, or if several do.
pub(super) fn best_shift(times: &[f64], (log, stops): (&[f64], &Stops)) -> Option<ClockShift> {
    let resting = (MIN_PAIRS, MIN_RESTING_FRACTION, MAX_RESTING_RIVAL_FRACTION);
    if let Some(seconds) = shift_to(times, (&stops.rests, PAIR_GAP), resting) {
        return Some(ClockShift { seconds, gap: 0.0, is_of_stops: false });
    }
    shift_by_stops(times, log, &stops.runs).or_else(|| shift_by_rows(times, log))
}

/// Returns the shift of a joint table with several rows for each stop, found by the first row of each.
///
/// Every offset with which all measured rows fall into their stops gives them the same joint
/// coordinates; the middle one is returned. Returns `None` if there is no such offset, or if the
/// shift would not be clear by a table of the first rows alone.
fn shift_by_stops(times: &[f64], log: &[f64], runs: &[Rest]) -> Option<ClockShift> {
    if runs.len() == log.len() {
        return None;
    }
    // Single rows are logged on the way if there is a longer stop for nearly every measured row.
    let several = several_rows(runs);
    let is_logged_on_the_way = several.len() as f64 >= MIN_PAIRED_FRACTION * times.len() as f64;
    let stops = if is_logged_on_the_way { several.as_slice() } else { runs };
    let first: Vec<f64> = stops.iter().map(|stop| stop.first).collect();
    let rows = stops.iter().map(|stop| Rest { last: stop.first, ..*stop }).collect();
    let rows = Stops { runs: rows, rests: Vec::new() };
    let is_clear = |shift: &ClockShift| shift.is_clear(times, (&first, &rows));
    let arrival = shift_by_rows(times, &first).filter(is_clear)?;
    let paired: Vec<(f64, Rest)> = times
        .iter()
        .filter_map(|&time| {
            let (stop, gap) = nearest(&first, time - arrival.seconds)?;
            Some((time, *stops.get(stop)?)).filter(|_| gap <= arrival.gap)
        })
        .collect();
    let least = paired.iter().map(|(time, stop)| time - stop.last).fold(f64::MIN, f64::max);
    let most = paired.iter().map(|(time, stop)| time - stop.first).fold(f64::MAX, f64::min);
    let seconds = f64::midpoint(least, most);
    let gaps = paired.iter().filter_map(|(time, _)| Some(nearest(log, time - seconds)?.1));
    let gap = gaps.fold(0.0, f64::max);
    (least <= most).then_some(ClockShift { seconds, gap, is_of_stops: true })
}

/// Returns the shift with which the rows of a joint table pair best with the rows measured at
/// `times` \[s\]; `None` if none is certain.
fn shift_by_rows(times: &[f64], log: &[f64]) -> Option<ClockShift> {
    if log.len() > MAX_LOG_ROWS {
        return None;
    }
    let rows: Vec<Rest> = log.iter().map(|&time| Rest { first: time, last: time }).collect();
    let gaps = std::iter::successors(Some(PAIR_GAP), |gap| Some(2.0 * gap));
    gaps.take_while(|gap| *gap <= MAX_PAIR_GAP).find_map(|most| {
        let least = if most > PAIR_GAP { MIN_WIDE_PAIRS } else { MIN_PAIRS };
        let limits = (least, MIN_PAIRED_FRACTION, MAX_RIVAL_FRACTION);
        let seconds = shift_to(times, (&rows, most), limits)?;
        let gaps = times.iter().filter_map(|time| Some(nearest(log, time - seconds)?.1));
        let gap = gaps.filter(|gap| *gap <= 2.0 * most).fold(0.0, f64::max);
        Some(ClockShift { seconds, gap, is_of_stops: false })
    })
}

/// Returns the shift \[s\] with which at least `least_pairs` of the `times`, and the share `least` of
/// them, fall into different `rests`, or within `gap` \[s\] of them; `None` if fewer do, or if another
/// shift pairs more than the share `most_of_rival` of them.
fn shift_to(
    times: &[f64],
    (rests, gap): (&[Rest], f64),
    (least_pairs, least, most_of_rival): (usize, f64, f64),
) -> Option<f64> {
    let tested = evenly(times, MAX_TESTED_ROWS);
    let count = |shift: f64| {
        let mut partners: Vec<usize> =
            pairs(&tested, (rests, gap), shift).map(|(_, rest)| rest).collect();
        partners.sort_unstable();
        partners.dedup();
        partners.len()
    };
    let shifts_of = |time: f64| rests.iter().map(move |rest| time - rest.middle());
    let shifts = evenly(times, TRIAL_ROWS).into_iter().flat_map(shifts_of);
    let counted: Vec<(usize, f64)> = shifts.map(|shift| (count(shift), shift)).collect();
    let &(most, best) = counted.iter().max_by_key(|(pairs, _)| *pairs)?;
    let mut lengths: Vec<f64> = rests.iter().map(|rest| rest.last - rest.first).collect();
    lengths.sort_by(f64::total_cmp);
    let apart = 2.0 * gap + lengths.get(lengths.len() / 2)?;
    let is_rival = |&&(pairs, shift): &&(usize, f64)| {
        (shift - best).abs() > apart && pairs as f64 > most_of_rival * most as f64
    };
    let is_clear = most >= least_pairs && most as f64 >= least * tested.len() as f64;
    if !is_clear || counted.iter().any(|counted| is_rival(&counted)) {
        return None;
    }
    let differences = pairs(&tested, (rests, gap), best)
        .filter_map(|(time, rest)| rests.get(rest).map(|rest| time - rest.middle()));
    median(differences.collect())
}

/// Unit of the differences between time zones \[s\].
const QUARTER_HOUR: f64 = 900.0;
/// Largest deviation from a whole number of quarter hours that a change of the time zone leaves
/// \[s\].
const MAX_OFF_QUARTER: f64 = 2.0;

/// Returns the whole quarters of an hour \[s\] that must be added to `times` \[s\], those of the
/// rows without a partner, so that they have partners in `log`. `None` if no such shift is certain.
fn zone_change(times: &[f64], log: &[f64]) -> Option<f64> {
    let shift = -best_shift(times, (log, &Stops::default()))?.seconds;
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
    let (tolerance, _) = rule.times()?;
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

/// Iterates over the measured times that have a partner among `rests`, at most `most` \[s\] away, if
/// `shift` \[s\] is added to the times of the log. Each is returned with the index of its partner.
fn pairs(
    times: &[f64],
    (rests, most): (&[Rest], f64),
    shift: f64,
) -> impl Iterator<Item = (f64, usize)> {
    times.iter().filter_map(move |&time| {
        let (rest, gap) = nearest_rest(rests, time - shift)?;
        (gap <= most).then_some((time, rest))
    })
}

/// Largest number of rows by which positions and configurations are compared as shifted.
const MAX_SHIFTED_ROWS: i8 = 3;

/// Returns for each number of rows, by which positions may come after their configurations, the shift
/// \[s\] of the log that pairs them so: the median time from the row of the log, which is the partner
/// of an earlier measured row, to the measured row. Rows measured at `times` are partners of rows of
/// the log within the `tolerance` \[s\].
pub(super) fn shifts_by_rows(times: &[f64], log: &[f64], tolerance: f64) -> Vec<(i8, f64)> {
    let partner = |&time: &f64| nearest(log, time).filter(|(_, gap)| *gap <= tolerance);
    let pairs = times.iter().filter_map(|time| Some((*time, *log.get(partner(time)?.0)?)));
    let pairs: Vec<(f64, f64)> = pairs.collect();
    if pairs.len() < MIN_WIDE_PAIRS {
        return Vec::new();
    }
    let shift = |by: i8| {
        let logged = |row: usize| pairs.get(row.checked_add_signed(-isize::from(by))?);
        let rows = pairs.iter().enumerate();
        let apart = rows.filter_map(|(row, (time, _))| Some(time - logged(row)?.1));
        Some((by, median(apart.collect())?))
    };
    (-MAX_SHIFTED_ROWS..=MAX_SHIFTED_ROWS).filter_map(shift).collect()
}

/// Returns a time \[s\] rounded up to two digits.
pub(super) fn rounded_up(time: f64) -> String {
    let digit = 10_f64.powf(time.log10().floor() - 1.0);
    two_digits((time / digit - 1e-6).ceil() * digit, 6)
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
        let shift = |times: &[f64], log: &[f64]| {
            best_shift(times, (log, &Stops::default()))
                .map_or([f64::NAN; 2], |shift| [shift.seconds, shift.gap])
        };
        let [seconds, gap] = shift(&late, &uneven);
        assert!((seconds - 47.03).abs() < 1e-9 && gap < 1e-9, "{seconds} {gap}");
        // Stamps that scatter by more than half a second.
        let slow: Vec<f64> = uneven.iter().map(|time| 6.0 * time).collect();
        let scattered =
            |k: usize, time: &f64| time + 73.4 + if k.is_multiple_of(2) { 1.4 } else { 0.0 };
        let late: Vec<f64> = slow.iter().enumerate().map(|(k, time)| scattered(k, time)).collect();
        let [seconds, gap] = shift(&late, &slow);
        assert!((seconds - 74.1).abs() < 0.8 && (0.7..1.5).contains(&gap), "{seconds} {gap}");
        let even: Vec<f64> = (0..30).map(|k| f64::from(k * 8)).collect();
        let late: Vec<f64> = even.iter().map(|time| time + 47.03).collect();
        assert!(shift(&late, &even)[0].is_nan() && shift(&[], &even)[0].is_nan());
        let late: Vec<f64> = uneven.iter().map(|time| time + 3600.3).collect();
        assert_eq!(zone_change(&late, &uneven), Some(-3600.0));
        let late: Vec<f64> = uneven.iter().map(|time| time + 47.03).collect();
        assert_eq!(zone_change(&late, &uneven), None);
    }
}

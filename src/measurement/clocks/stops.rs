//! Times in which the arm stands by a joint table.

use csv::ByteRecord;

use super::super::paired_times::TimedPair;
use crate::error::{Warning, WarningKind};

/// Maximum time between paired rows when a shift between the clocks is searched \[s\].
pub(super) const PAIR_GAP: f64 = 0.5;
/// Smallest number of rests by which the clock of a continuous log is found.
const MIN_RESTS: usize = 5;
/// Smallest number of rows of a continuous log for each of its rests. A table with fewer has one row
/// or some repeated ones for each pose.
const MIN_ROWS_PER_REST: usize = 5;
/// Largest difference of a joint coordinate between two rows of a log in which the arm rests, by the
/// unit at the end of its column's name; readings of encoders scatter by less.
const MAX_RESTING_CHANGES: [(&str, f64); 4] =
    [("_deg", 0.01), ("_rad", 2e-4), ("_mm", 0.05), ("_m", 5e-5)];
/// The same for tables in which no name of a column ends with a unit.
const MAX_RESTING_CHANGE: f64 = 0.01;
/// Time \[s\] in which the arm rests by a joint table; both ends are equal for a single row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rest {
    pub first: f64,
    pub last: f64,
}

impl Rest {
    pub fn middle(&self) -> f64 {
        f64::midpoint(self.first, self.last)
    }
}

/// Times \[s\] in which the arm stands by a joint table, in ascending order.
#[derive(Debug, Default)]
pub(crate) struct Stops {
    /// Runs of rows with the same joint coordinates, single rows included.
    pub(super) runs: Vec<Rest>,
    /// Runs of several rows, if the table logs all the time, also while the arm moves.
    pub(super) rests: Vec<Rest>,
}

impl Stops {
    /// Finds the stops of a joint table, whose rows are given in the order of their times \[s\].
    pub fn of<'r>(
        rows: impl Iterator<Item = (f64, &'r ByteRecord)>,
        names: &[String],
        key: Option<usize>,
    ) -> Self {
        let (runs, count) = runs(rows, names, key);
        let mut rests = several_rows(&runs);
        if rests.len() < MIN_RESTS || count < MIN_ROWS_PER_REST * rests.len() {
            rests.clear();
        }
        Self { runs, rests }
    }

    /// Returns the index of the run of rows that is nearest to `time`.
    pub fn nearest(&self, time: f64) -> Option<usize> {
        nearest_rest(&self.runs, time).map(|(run, _)| run)
    }
}

/// Returns the runs that have several rows.
pub(super) fn several_rows(runs: &[Rest]) -> Vec<Rest> {
    runs.iter().copied().filter(|run| run.first < run.last).collect()
}

/// Returns the runs of rows with the same joint coordinates, and the number of rows. The rows are
/// given in the order of their times \[s\], each with its cells; the column `key` holds the times.
/// Columns whose `names` end with a unit of joint coordinates decide, or all if there are none.
fn runs<'r>(
    rows: impl Iterator<Item = (f64, &'r ByteRecord)>,
    names: &[String],
    key: Option<usize>,
) -> (Vec<Rest>, usize) {
    let limit = |name: &String| {
        let of_unit = MAX_RESTING_CHANGES.iter().find(|(unit, _)| name.ends_with(unit));
        of_unit.map(|(_, most)| *most)
    };
    let is_any_joint = names.iter().any(|name| limit(name).is_some());
    // Largest change of each column that is compared.
    let limits: Vec<Option<f64>> = names
        .iter()
        .enumerate()
        .map(|(place, name)| {
            let other = (!is_any_joint && Some(place) != key).then_some(MAX_RESTING_CHANGE);
            limit(name).or(other)
        })
        .collect();
    let number = |cell: &[u8]| str::from_utf8(cell).ok()?.trim().parse::<f64>().ok();
    let is_same = |one: &[u8], other: &[u8], most: f64| match (number(one), number(other)) {
        (Some(one), Some(other)) => (one - other).abs() <= most,
        _ => one == other,
    };
    let is_resting = |one: &ByteRecord, other: &ByteRecord| {
        let mut pairs = one.iter().zip(other).zip(&limits);
        pairs.all(|((one, other), most)| most.is_none_or(|most| is_same(one, other, most)))
    };
    let (mut rests, mut count): (Vec<Rest>, usize) = (Vec::new(), 0);
    let mut current: Option<(Rest, &ByteRecord)> = None;
    for (time, cells) in rows {
        count += 1;
        current = match current {
            Some((rest, first)) if is_resting(first, cells) => {
                Some((Rest { last: time, ..rest }, first))
            }
            ended => {
                rests.extend(ended.map(|(rest, _)| rest));
                Some((Rest { first: time, last: time }, cells))
            }
        };
    }
    rests.extend(current.map(|(rest, _)| rest));
    (rests, count)
}

/// Returns the index of the rest that is nearest to `time`, and the time between them \[s\]; `None`
/// without rests, which must be in ascending order.
pub(super) fn nearest_rest(rests: &[Rest], time: f64) -> Option<(usize, f64)> {
    let after = rests.partition_point(|rest| rest.last < time);
    let around = [after.checked_sub(1), Some(after)].into_iter().flatten();
    let gap = |place: usize| {
        let rest = rests.get(place)?;
        Some((place, (rest.first - time).max(time - rest.last).max(0.0)))
    };
    around.filter_map(gap).min_by(|(_, a), (_, b)| a.total_cmp(b))
}

/// Maximum number of rows that a warning lists behind the first.
const MAX_LISTED_ROWS: usize = 10;

/// Returns the warning that the arm moved at the times \[s\] of some rows with a partner, by a log
/// that is continuous, with the offset of its clock with which the arm rests at all of them; `None`
/// if it rests at each, or if more rows than not are measured so and no other offset is certain.
/// `best_shift` returns a shift \[s\] of the log, and its offset in words.
pub(crate) fn moving_arm(
    (pairs, stops): (&[TimedPair], &Stops),
    best_shift: impl FnOnce() -> Option<(f64, String)>,
) -> Option<Warning> {
    let is_moving = |pair: &&TimedPair, shift: f64| {
        let rest = nearest_rest(&stops.rests, pair.measured - shift);
        rest.is_some_and(|(_, gap)| gap > PAIR_GAP)
    };
    let moving: Vec<&TimedPair> = pairs.iter().filter(|pair| is_moving(pair, 0.0)).collect();
    let (first, others) = moving.split_first()?;
    let shift = if others.is_empty() { None } else { best_shift() };
    let rests_then = |shift: f64| !pairs.iter().any(|pair| is_moving(&pair, shift));
    let offset = shift.filter(|(shift, _)| rests_then(*shift)).map(|(_, words)| words);
    let is_usual = 2 * moving.len() > pairs.len() && offset.is_none();
    let others = others.iter().take(MAX_LISTED_ROWS).map(|pair| pair.place.to_string()).collect();
    let (rows, of) = (moving.len(), pairs.len());
    let kind = WarningKind::MovedAtTime { rows, of, others, offset };
    (!is_usual).then(|| Warning { location: first.place.clone(), kind })
}

#[cfg(test)]
mod tests {
    use super::super::best_shift;
    use super::*;
    use crate::error::Location;

    #[test]
    fn the_clock_of_a_continuous_log_is_found_by_its_rests() {
        // The arm moves for 8 s, and rests for 7 to 22 s; twice a second a row is logged.
        let mut rows: Vec<(f64, ByteRecord)> = Vec::new();
        let (mut time, mut measured) = (1000.0, Vec::new());
        for pose in 0..40_i32 {
            let rest = 14 + pose * pose * 7 % 31;
            for k in 0..16 + rest {
                let at = 30 * pose - 2 * (16 - k).max(0);
                rows.push((time, ByteRecord::from(vec![time.to_string(), at.to_string()])));
                time += 0.5;
            }
            measured.push(time - f64::from(rest) / 4.0 + f64::from(pose % 5 - 2) + 3641.7);
        }
        let names = ["time", "q1"].map(str::to_owned);
        let stops = Stops::of(rows.iter().map(|(time, cells)| (*time, cells)), &names, Some(0));
        assert_eq!(stops.rests.len(), 40);
        let log: Vec<f64> = rows.iter().map(|(time, _)| *time).collect();
        let shift = best_shift(&measured, (&log, &stops)).unwrap().seconds;
        let place = || Location::file(std::path::Path::new("rows.csv"));
        let pair =
            |measured| TimedPair { measured, logged: 0.0, place: place(), log_place: place() };
        let moved = |shift: f64| {
            let times: Vec<f64> = measured.iter().map(|time| time - shift).collect();
            let best = || {
                let shift = best_shift(&times, (&log, &stops))?.seconds;
                Some((shift, format!("{shift:.0}")))
            };
            let pairs: Vec<TimedPair> = times.iter().copied().map(pair).collect();
            moving_arm((&pairs, &stops), best).map(|warning| warning.kind)
        };
        assert_eq!(moved(shift), None);
        assert!((shift - 3641.7).abs() < 3.0, "{shift}");
        let later = moved(shift + 3.0);
        assert!(matches!(
            later,
            Some(WarningKind::MovedAtTime { rows: 2.., of: 40, offset: Some(_), .. })
        ));
        // With rows that are measured while the arm moves, no offset makes it rest at all of them.
        let mut times: Vec<f64> = measured.iter().map(|time| time - shift).collect();
        for (time, rest) in times.iter_mut().zip(&stops.rests).take(3) {
            *time = rest.first - 4.0;
        }
        let best = || Some((1.0, "1".to_owned()));
        let pairs: Vec<TimedPair> = times.iter().copied().map(pair).collect();
        let kind = moving_arm((&pairs, &stops), best).map(|warning| warning.kind);
        let others = vec!["rows.csv".to_owned(); 2];
        let expected = WarningKind::MovedAtTime { rows: 3, of: 40, others, offset: None };
        assert_eq!(kind, Some(expected));
        // One row for each pose is no continuous log.
        let few = rows.iter().step_by(40).map(|(time, cells)| (*time, cells));
        assert_eq!(Stops::of(few, &names, Some(0)).rests, []);
        // An arm that moves by 0.005 rad from row to row does not rest.
        let radians = ["time", "q1_rad"].map(str::to_owned);
        let cells = |k: i32| vec![k.to_string(), (0.005 * f64::from(k)).to_string()];
        let slow: Vec<ByteRecord> = (0..200).map(|k| ByteRecord::from(cells(k))).collect();
        let timed = slow.iter().enumerate().map(|(k, cells)| (k as f64, cells));
        assert_eq!(Stops::of(timed, &radians, Some(0)).rests, []);
    }

    /// Numbers below 1 that look random.
    fn random(seed: u32) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 24)
        }
    }

    #[test]
    fn several_rows_a_stop_give_no_wrong_offset() {
        let names = ["time", "q1_deg"].map(str::to_owned);
        let (mut found, mut taken) = (0, 0);
        for case in 0..200_u32 {
            let mut draw = random(case.wrapping_mul(2_654_435_761));
            let is_periodic = case % 4 == 3;
            let (rest, travel) = (2.0 + 8.0 * draw(), 1.0 + 6.0 * draw());
            let spread = if is_periodic { 0.02 } else { 0.2 + 1.8 * draw() };
            let step = [0.2, 0.5, 1.5][case as usize % 3];
            let (at_once, lost, extra) = (draw() < 0.5, 0.1 * draw(), 0.6 * draw());
            let offset = 2000.0 * draw() - 1000.0;
            let (mut time, mut rows, mut measured) = (0.0, Vec::new(), Vec::new());
            for stop in 0..60_u32 {
                let moving = travel * (1.0 + spread * draw());
                if case % 2 == 0 {
                    rows.push((time + 0.5 * moving, -f64::from(stop) - 0.5));
                }
                time += moving;
                let stays = rest * (1.0 + spread * draw());
                let is_logged = draw() >= lost;
                let mut at = time + 0.1 * draw();
                while is_logged && at < time + stays {
                    rows.push((at, f64::from(stop)));
                    at += step;
                }
                let after = if at_once { 1.0_f64.min(0.5 * stays) } else { draw() * stays };
                if draw() >= extra && (is_logged || is_periodic) {
                    measured.push((time + after + offset, f64::from(stop)));
                }
                time += stays;
            }
            let cells = |at: f64| ByteRecord::from(vec![String::new(), at.to_string()]);
            let rows: Vec<_> = rows.into_iter().map(|(time, at)| (time, at, cells(at))).collect();
            let timed = rows.iter().map(|(time, _, cells)| (*time, cells));
            let stops = Stops::of(timed, &names, Some(0));
            let log: Vec<f64> = rows.iter().map(|(time, ..)| *time).collect();
            let times: Vec<f64> = measured.iter().map(|(time, _)| *time).collect();
            let Some(shift) = super::super::shift_by_stops(&times, &log, &stops.runs) else {
                continue;
            };
            found += 1;
            taken += usize::from(at_once);
            let wrong = measured.iter().filter(|(time, stop)| {
                let (row, gap) = super::super::nearest(&log, time - shift.seconds).unwrap();
                gap <= shift.gap && (rows[row].1 - stop).abs() > 0.1
            });
            let (wrong, off) = (wrong.count(), shift.seconds - offset);
            assert!(wrong <= measured.len() / 20, "{case}: {wrong} of {}, {off} s", measured.len());
        }
        assert!(found > 20 && taken > 15, "{found} {taken}");
    }
}

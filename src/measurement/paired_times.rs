//! Times of rows that two tables pair by their order.

use crate::error::{Location, Warning, WarningKind};

/// Minimum number of timed pairs whose times are compared.
const MIN_PAIRS: usize = 4;
/// Minimum number of pairs that must contradict the order. A single one may be caused by a pause
/// between arrival and measurement.
const MIN_CONTRADICTED: usize = 2;
/// Time between the rows of a pair, without the offset of the clocks, above which the pair may
/// contradict the order. It is a fraction of the median time between rows of the joint table.
const MIN_GAP_RATIO: f64 = 0.75;
/// Time from the measured row to the nearest row of the joint table, below which a pair may
/// contradict the order. It is a fraction of the time to the row with which it is paired.
const MAX_NEAREST_RATIO: f64 = 0.5;

/// Times of the two rows of a pair, each on the clock of its table, and their places in the files.
pub(super) struct TimedPair {
    /// Time of the measured row \[s\].
    pub measured: f64,
    /// Time of the row of the joint table \[s\].
    pub logged: f64,
    /// Place of the measured row.
    pub place: Location,
    /// Place of the row of the joint table.
    pub log_place: Location,
}

/// Returns the median of some values, the upper one of two middle values; `None` without values.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Returns a warning if measured rows are paired by order with rows of the joint table of other
/// times, while rows of their times exist. It is located at the first such measured row.
pub(super) fn order_contradicted(pairs: &[TimedPair]) -> Option<Warning> {
    let timed = || pairs.iter().filter(|pair| (pair.measured - pair.logged).is_finite());
    if timed().count() < MIN_PAIRS {
        return None;
    }
    let offset = median(timed().map(|pair| pair.measured - pair.logged).collect())?;
    let mut by_log_time: Vec<&TimedPair> = timed().collect();
    by_log_time.sort_by(|a, b| a.logged.total_cmp(&b.logged));
    let steps = by_log_time.iter().zip(by_log_time.iter().skip(1));
    let spacing = median(steps.map(|(a, b)| b.logged - a.logged).collect())?;
    let gap = |pair: &TimedPair, logged: f64| (pair.measured - logged - offset).abs();
    let is_apart =
        |pair: &TimedPair| spacing > 0.0 && gap(pair, pair.logged) > MIN_GAP_RATIO * spacing;
    // A row that is measured after a pause is near a row of the joint table whose pair is right.
    let is_contradicted = |pair: &&TimedPair| {
        if !is_apart(pair) {
            return false;
        }
        let after = by_log_time.partition_point(|other| other.logged < pair.measured - offset);
        let beside = by_log_time.iter().skip(after.saturating_sub(1)).take(2);
        let nearest = beside.min_by(|a, b| gap(pair, a.logged).total_cmp(&gap(pair, b.logged)));
        nearest.is_some_and(|nearest| {
            is_apart(nearest)
                && gap(pair, nearest.logged) < MAX_NEAREST_RATIO * gap(pair, pair.logged)
        })
    };
    let contradicted: Vec<&TimedPair> = timed().filter(is_contradicted).collect();
    let first = contradicted.first()?;
    let kind = WarningKind::OrderContradictedByTimes {
        rows: contradicted.len(),
        partner: first.log_place.to_string(),
        gap: format!("{:.1}", gap(first, first.logged)),
    };
    (contradicted.len() >= MIN_CONTRADICTED)
        .then(|| Warning { location: first.place.clone(), kind })
}

/// Returns true if all times \[s\] are whole minutes.
pub(super) fn are_whole_minutes(mut times: impl Iterator<Item = f64>) -> bool {
    /// Largest deviation from a whole minute that counts as rounding \[s\].
    const MAX_ROUNDING: f64 = 1e-3;
    times.all(|time| (time / 60.0 - (time / 60.0).round()).abs() * 60.0 < MAX_ROUNDING)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn pair(measured: f64, logged: f64) -> TimedPair {
        let place = || Location::file(Path::new("rows.csv")).at_line(2);
        TimedPair { measured, logged, place: place(), log_place: place() }
    }

    #[test]
    fn only_several_rows_of_other_times_contradict_the_order() {
        let rows = |measured: &dyn Fn(usize) -> f64| {
            let pairs: Vec<TimedPair> =
                (0..20).map(|row| pair(measured(row), 60.0 * row as f64)).collect();
            order_contradicted(&pairs).map(|warning| warning.kind)
        };
        let minute = |row: usize| 60.0 * row as f64;
        assert_eq!(rows(&|row| 7.0e8 + minute(row) + (row % 7) as f64 * 5.0), None);
        assert_eq!(rows(&|row| minute(row) + if row == 5 { 50.0 } else { 9.0 }), None);
        // Pauses between arrival and measurement, at two and at five rows.
        assert_eq!(rows(&|row| minute(row) + if row % 9 == 5 { 55.0 } else { 5.0 }), None);
        assert_eq!(rows(&|row| minute(row) + if row % 4 == 1 { 55.0 } else { 5.0 }), None);
        assert_eq!(rows(&|_| f64::NAN), None);
        let lost = rows(&|row| minute(if row < 15 { row } else { row + 1 }) + 9.0);
        assert!(
            matches!(lost, Some(WarningKind::OrderContradictedByTimes { rows: 4, .. })),
            "{lost:?}"
        );
        assert!(rows(&|row| minute(row * 7 % 20)).is_some());
        assert!(are_whole_minutes([0.0, 120.0, 1.7e9 - 20.0].into_iter()));
        assert!(!are_whole_minutes([0.0, 61.0].into_iter()));
    }
}

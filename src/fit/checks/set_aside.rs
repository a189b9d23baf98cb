//! Check of the rows that a robust loss treats as outliers: are they a random selection of the
//! rows?
//!
//! A robust loss limits the influence of gross errors. A cause that acts in some rows only, such as
//! a station that moves, then disappears from the residual, because its rows become outliers. Such
//! rows depend on time, session or a joint; gross errors do not.

use serde_json::json;
use statrs::distribution::{ContinuousCDF as _, Normal};
use statrs::function::factorial::ln_binomial;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::outliers::Outlier;
use crate::least_squares::Loss;
use crate::measurement::Measurements;

/// Largest share of the rows that may be outliers of a robust loss without a test of the cause.
const MAX_UNTESTED_SHARE: f64 = 0.05;
/// Smallest number of outliers for which the normal approximation of a rank sum holds.
const MIN_OUTLIERS: usize = 10;
/// Probability below which the outliers are not a random selection, after correction for the number
/// of tests.
const MAX_CHANCE_PROBABILITY: f64 = 1e-3;

/// Quantity on which it depends whether a row is an outlier.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Selection {
    /// Name of the quantity: `time`, `joint 2`, `session B`, …
    pub quantity: String,
    /// Probability that a random selection of rows depends so clearly on the quantity, times the
    /// number of tests.
    pub p_value: f64,
}

/// Returns the quantity (time, a joint, a session, payload or temperature) on which it depends
/// which of `rows` are outliers. `None` if there are few outliers, if most rows are outliers, or if
/// the outliers are a random selection.
pub(crate) fn selection(
    table: &Measurements,
    rows: &[usize],
    outliers: &[Outlier],
) -> Option<Selection> {
    let count = outliers.len();
    let is_many = count >= MIN_OUTLIERS && count as f64 > MAX_UNTESTED_SHARE * rows.len() as f64;
    if !is_many || 2 * count > rows.len() {
        return None;
    }
    let is_outlier: Vec<bool> = rows
        .iter()
        .map(|row| outliers.binary_search_by_key(row, |outlier| outlier.row).is_ok())
        .collect();
    let pick = |column: &dyn Fn(usize) -> f64| rows.iter().map(|&row| column(row)).collect();
    let mut quantities: Vec<(String, Vec<f64>)> =
        vec![("time".to_owned(), pick(&|row| table.time[row]))];
    for joint in 0..table.joints {
        let values = pick(&|row| table.configuration(row)[joint]);
        quantities.push((format!("joint {}", joint + 1), values));
    }
    for (session, name) in table.session.names.iter().enumerate() {
        let values = pick(&|row| f64::from(u8::from(table.session.of_row[row] == session)));
        quantities.push((format!("session {name}"), values));
    }
    for (name, column) in [("payload", &table.payload), ("temperature", &table.temperature)] {
        quantities.extend(column.iter().map(|column| (name.to_owned(), pick(&|row| column[row]))));
    }
    quantities.retain(|(_, values)| values.iter().any(|value| value.total_cmp(&values[0]).is_ne()));
    let tests = 2.0 * quantities.len() as f64;
    let best = quantities
        .into_iter()
        .map(|(quantity, values)| {
            let p_value = tests
                * rank_sum_p_value(&values, &is_outlier).min(runs_p_value(&values, &is_outlier));
            Selection { quantity, p_value }
        })
        .min_by(|a, b| a.p_value.total_cmp(&b.p_value))?;
    (best.p_value < MAX_CHANCE_PROBABILITY).then_some(best)
}

/// Returns the two-sided p-value of the rank sum of the `marked` values; equal values share their
/// mean rank [Mann & Whitney 1947].
fn rank_sum_p_value(values: &[f64], marked: &[bool]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let n = values.len() as f64;
    let (mut sum, mut ties, mut first) = (0.0, 0.0, 0);
    while first < order.len() {
        let equal = order[first..]
            .iter()
            .take_while(|&&k| values[k].total_cmp(&values[order[first]]).is_eq());
        let count = equal.count();
        let of_tie = order[first..first + count].iter().filter(|&&k| marked[k]).count() as f64;
        let (t, middle) = (count as f64, first as f64 + 0.5 * (count as f64 + 1.0));
        sum += of_tie * middle;
        ties += t * t * t - t;
        first += count;
    }
    let k = marked.iter().filter(|marked| **marked).count() as f64;
    let variance = k * (n - k) / 12.0 * (n + 1.0 - ties / (n * (n - 1.0)));
    2.0 * upper_tail((sum - 0.5 * k * (n + 1.0)).abs() / variance.sqrt())
}

/// Returns the probability that a random selection of as many values forms so few runs of `marked`
/// and other values in ascending order [Wald & Wolfowitz 1940]; 1 if two values are equal.
fn runs_p_value(values: &[f64], marked: &[bool]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    if order.windows(2).any(|pair| values[pair[0]].total_cmp(&values[pair[1]]).is_eq()) {
        return 1.0;
    }
    let runs = 1 + order.windows(2).filter(|pair| marked[pair[0]] != marked[pair[1]]).count();
    let marked = marked.iter().filter(|marked| **marked).count() as u64;
    let count = values.len() as u64;
    // Logarithm of the number of ways to divide `of` values into `parts` runs; `None` without any.
    let ways =
        |parts: u64, of: u64| (1..=of).contains(&parts).then(|| ln_binomial(of - 1, parts - 1));
    let both = |a: Option<f64>, b: Option<f64>| {
        a.zip(b).map_or(0.0, |(a, b)| (a + b - ln_binomial(count, marked)).exp())
    };
    let exactly = |runs: u64| {
        let (a, b) = (runs / 2, runs - runs / 2);
        both(ways(a, marked), ways(b, count - marked))
            + both(ways(b, marked), ways(a, count - marked))
    };
    (2..=runs as u64).map(exactly).sum::<f64>().min(1.0)
}

/// Returns the probability that a standard normal number exceeds `z`.
fn upper_tail(z: f64) -> f64 {
    Normal::new(0.0, 1.0).map_or(1.0, |normal| normal.sf(z))
}

/// Checks that the rows which a robust loss treats as outliers are a random selection, which does
/// not depend on time, session, a joint or a load.
pub(super) fn set_aside_by_chance(fit: &CheckedFit) -> Option<Finding> {
    let rows = fit.rows();
    if fit.fitting.loss == Loss::Squares {
        return None;
    }
    let found = selection(fit.table(), rows, fit.outliers);
    let finding = |Selection { quantity, p_value }: Selection| {
        let (count, of) = (fit.outliers.len(), rows.len());
        let text = format!(
            "the robust loss sets {count} of {of} rows aside, and {quantity} decides which: a \
             cause acts in them"
        );
        let numbers = [count.into(), of.into(), json!(quantity), p_value.into()];
        Finding::new(FindingCode::RowsSetAside, numbers, text)
    };
    found.map(finding)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_follows_a_quantity_is_told_from_chance() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let marked =
            |is_marked: fn(usize) -> bool| -> Vec<bool> { (0..100).map(is_marked).collect() };
        let (late, block, scattered) =
            (marked(|k| k >= 75), marked(|k| (40..60).contains(&k)), marked(|k| k * 37 % 100 < 20));
        let rank_sum = |marked: &[bool]| rank_sum_p_value(&values, marked);
        let runs = |marked: &[bool]| runs_p_value(&values, marked);
        assert!(rank_sum(&late) < 1e-10 && runs(&late) < 1e-10);
        assert!(rank_sum(&block) > 0.5 && runs(&block) < 1e-10);
        assert!(rank_sum(&scattered) > 0.05 && runs(&scattered) > 0.05);
    }
}

//! Confidence interval of the gain on held-out poses.

use crate::select::settings::{INTERVAL_LEVEL, RESAMPLES};
use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::super::data::{Data, bits};
use crate::numeric::{Interval, mean_interval};

/// Returns the mean of |`before`| − |`after`|, the errors of the held-out rows of the leading kind
/// \[m\] or \[rad\], with a bootstrap interval over configurations. If no row is held out, the
/// errors are those of all identification rows.
pub(super) fn gain(data: &Data, before: &[Vector3<f64>], after: &[Vector3<f64>]) -> Interval {
    let kind = data.measurements.leading().kind();
    let held_out = &data.split.held_out;
    let rows = if held_out.is_empty() { data.rows() } else { held_out };
    let mut groups: BTreeMap<Vec<u64>, Vec<f64>> = BTreeMap::new();
    for ((&row, before), after) in rows.iter().zip(before).zip(after) {
        if data.measurements.observation(row).kind() != kind {
            continue;
        }
        let gain = before.norm() - after.norm();
        groups.entry(bits(data.measurements.configuration(row))).or_default().push(gain);
    }
    let sums: Vec<(f64, f64)> =
        groups.values().map(|gains| (gains.iter().sum::<f64>(), gains.len() as f64)).collect();
    mean_interval(&sums, RESAMPLES, INTERVAL_LEVEL, data.rules.seed)
}

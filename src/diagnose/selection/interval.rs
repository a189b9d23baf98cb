//! How sure the gain on held-out poses is.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::super::data::{Data, bits};

/// An estimate with the interval that covers it in 95 of 100 cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Mean reduction of the distance to what was measured on held-out poses \[m\]; bootstrap over configurations [Efron 1979].
pub(super) fn gain(data: &Data, before: &[Vector3<f64>], after: &[Vector3<f64>]) -> Interval {
    let (rows, draws) = (&data.split.held_out, data.rules.resamples);
    let mut groups: BTreeMap<Vec<u64>, Vec<f64>> = BTreeMap::new();
    for ((&row, before), after) in rows.iter().zip(before).zip(after) {
        let gain = before.norm() - after.norm();
        groups.entry(bits(data.measurements.configuration(row))).or_default().push(gain);
    }
    let sums: Vec<(f64, f64)> = groups.values().map(|gains| (gains.iter().sum::<f64>(), gains.len() as f64)).collect();
    let mean = |drawn: &mut dyn Iterator<Item = (f64, f64)>| {
        let (sum, count) = drawn.fold((0.0, 0.0), |(sum, count), (s, c)| (sum + s, count + c));
        sum / f64::max(count, 1.0)
    };
    let value = mean(&mut sums.iter().copied());
    let mut rng = ChaCha8Rng::seed_from_u64(data.rules.seed);
    let mut means: Vec<f64> =
        (0..draws).map(|_| mean(&mut (0..sums.len()).map(|_| sums[rng.random_range(0..sums.len())]))).collect();
    means.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a count")]
    let beyond = ((1.0 - data.rules.covered) / 2.0 * draws as f64) as usize;
    Interval { value, low: means[beyond], high: means[draws - 1 - beyond] }
}

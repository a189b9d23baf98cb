//! Whether residuals follow one another.

use nalgebra::Vector3;

use super::outcome::{Sequence, Untestable};
use super::statistic::Sample;
use super::{FitResidual, LEAST_POSES};

/// Most lags of the autocorrelation, and poses of a session per lag [Hyndman and Athanasopoulos 2018, section 5.4].
const MOST_LAGS: usize = 10;
const POSES_PER_LAG: usize = 5;

/// Poses of each session in some order; nothing follows across sessions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Order {
    sessions: Vec<Vec<usize>>,
    lags: usize,
}

/// The poses `kept` (which count from 0 anew) in the order of time, and in that of the rows where it is another.
pub(super) fn sequences(fit: &FitResidual, kept: &[usize]) -> Vec<(Sequence, Result<Order, Untestable>)> {
    let by_rows = Order::of(fit, kept);
    if !kept.iter().all(|&pose| fit.time[pose].is_finite()) {
        return vec![(Sequence::Time, Err(Untestable::NotFinite)), (Sequence::Rows, by_rows)];
    }
    let by_time = by_rows.clone().map(|mut order| {
        for session in &mut order.sessions {
            session.sort_by(|&a, &b| fit.time[kept[a]].total_cmp(&fit.time[kept[b]]));
        }
        order
    });
    let same = by_rows == by_time;
    let mut all = vec![(Sequence::Time, by_time)];
    if !same {
        all.push((Sequence::Rows, by_rows));
    }
    all
}

impl Order {
    fn of(fit: &FitResidual, kept: &[usize]) -> Result<Self, Untestable> {
        let mut by_session = std::collections::BTreeMap::<usize, Vec<usize>>::new();
        for (number, &pose) in kept.iter().enumerate() {
            by_session.entry(fit.session[pose]).or_default().push(number);
        }
        let sessions: Vec<Vec<usize>> = by_session.into_values().collect();
        let longest = sessions.iter().map(Vec::len).max().unwrap_or(0);
        if longest < LEAST_POSES {
            return Err(Untestable::TooFewPoses);
        }
        Ok(Self { sessions, lags: (longest / POSES_PER_LAG).min(MOST_LAGS) })
    }

    /// Poses that are `lag` steps apart, earlier and later, of all sessions.
    fn pairs<'a>(
        &'a self,
        sample: &'a Sample,
        lag: usize,
    ) -> impl Iterator<Item = (&'a Vector3<f64>, &'a Vector3<f64>)> {
        let within = move |session: &'a Vec<usize>| session.iter().zip(session.iter().skip(lag));
        self.sessions.iter().flat_map(within).map(|(&a, &b)| (&sample.centred[a], &sample.centred[b]))
    }

    /// Share of steps at which a coordinate keeps its sign: few runs, many kept signs [Wald and Wolfowitz 1940].
    pub fn kept_signs(&self, sample: &Sample) -> f64 {
        let (mut steps, mut kept) = (0_u32, 0_u32);
        for (a, b) in self.pairs(sample, 1) {
            steps += 3;
            kept += (0..3).map(|k| u32::from((a[k] > 0.0) == (b[k] > 0.0))).sum::<u32>();
        }
        f64::from(kept) / f64::from(steps.max(1))
    }

    /// Q = 3 n (n + 2) Σₖ ρₖ² / nₖ,  ρₖ = Σ yₜ·yₜ₊ₖ / Σ |yₜ|²                        [Ljung and Box 1978]
    ///
    /// over lags k of which there are nₖ pairs among n poses, sessions pooled; the scalar products add the autocovariances
    /// of the three coordinates, hence the 3. About χ² with as many degrees of freedom as lags.
    pub fn ljung_box(&self, sample: &Sample) -> f64 {
        let n = sample.centred.len() as f64;
        let variance = sample.squares.trace();
        let of_lag = |lag: usize| {
            let (mut pairs, mut sum) = (0.0, 0.0);
            for (a, b) in self.pairs(sample, lag) {
                pairs += 1.0;
                sum += a.dot(b);
            }
            (sum / variance).powi(2) / f64::max(pairs, 1.0)
        };
        if variance > 0.0 { 3.0 * n * (n + 2.0) * (1..=self.lags).map(of_lag).sum::<f64>() } else { 0.0 }
    }
}

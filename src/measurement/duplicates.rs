//! Warning about rows that are probably copies of others.

use std::collections::HashMap;

use super::Measurements;
use crate::error::{Warning, WarningKind};

/// Maximum number of copies that the warning names in addition to the first.
const MAX_NAMED_COPIES: usize = 3;
/// Largest resolution of the measured coordinates, in units of σ, at which equal coordinates are
/// unlikely to occur by chance.
const FINE_RESOLUTION: f64 = 0.1;
/// Largest resolution of the measured coordinates at which equal coordinates are unlikely to occur
/// by chance, if σ is unknown \[m\].
const FINE_RESOLUTION_WITHOUT_SIGMA: f64 = 1e-6;
/// Resolutions that are tried, coarsest first \[m\].
const RESOLUTIONS: [f64; 8] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Tolerance, as a fraction of a step, within which a number counts as a multiple of the step.
const MULTIPLE_TOLERANCE: f64 = 1e-3;

impl Measurements {
    /// Returns a warning if rows equal earlier ones to the last digit, which is improbable for
    /// measured rows.
    ///
    /// `sigma` is the declared standard deviation of a coordinate \[m\]. If the resolution is not
    /// much finer than σ, whole positions may repeat by chance. Rows then count as copies only if
    /// their times are equal, too.
    pub(crate) fn repeated_rows(&self, sigma: Option<f64>) -> Option<Warning> {
        let fine = sigma.map_or(FINE_RESOLUTION_WITHOUT_SIGMA, |sigma| FINE_RESOLUTION * sigma);
        let by_time = self.time_measured && self.step().is_some_and(|step| step > fine);
        let mut first_rows: HashMap<Vec<u64>, usize> = HashMap::with_capacity(self.len());
        let mut repeated = Vec::new();
        for row in 0..self.len() {
            // Rows of other kinds have few coordinates, which may repeat by chance.
            let by_time = by_time || !self.observation(row).is_position();
            let first = *first_rows.entry(self.bits(row, by_time)).or_insert(row);
            if first != row {
                repeated.push((row, first));
            }
        }
        let &(row, first) = repeated.first()?;
        let others = repeated
            .iter()
            .skip(1)
            .take(MAX_NAMED_COPIES)
            .map(|&(row, _)| self.location(row).to_string())
            .collect();
        let kind = WarningKind::RowsRepeated {
            rows: repeated.len(),
            first: self.location(first).to_string(),
            others,
        };
        Some(Warning { location: self.location(row), kind })
    }

    /// Returns the coarsest of [`RESOLUTIONS`] of which all measured coordinates are multiples
    /// \[m\]; `None` if there is none.
    fn step(&self) -> Option<f64> {
        let numbers = || self.positions.iter().flatten();
        let is_whole = |step: f64| {
            numbers().all(|x| (x / step - (x / step).round()).abs() < MULTIPLE_TOLERANCE)
        };
        RESOLUTIONS.into_iter().find(|step| is_whole(*step))
    }

    /// Returns the bit patterns of all numbers of a row, and the indices of its words, by which
    /// rows are compared. The time is included if it was measured and `by_time` is true.
    fn bits(&self, row: usize, by_time: bool) -> Vec<u64> {
        let columns =
            [&self.sigma, &self.payload, &self.hoist, &self.temperature].into_iter().flatten();
        let numbers =
            self.configuration(row).iter().chain(self.positions.get(row).into_iter().flatten());
        let numbers = numbers.chain(columns.filter_map(|column| column.get(row)));
        let time = self.time.get(row).filter(|_| self.time_measured && by_time);
        let approach = self
            .approach
            .iter()
            .flat_map(|column| column.iter().skip(row * self.joints).take(self.joints));
        let words = [Some(&self.session), self.target.as_ref()].into_iter().flatten();
        let words = words.filter_map(|labels| labels.of_row.get(row)).copied();
        let words = words.chain(self.observation(row).key()).map(|word| word as u64);
        let turned = self
            .orientations
            .iter()
            .filter_map(|column| column.get(row))
            .flat_map(|orientation| orientation.coords.iter());
        // Adding 0 turns −0 into 0.
        numbers
            .chain(turned)
            .chain(time)
            .chain(approach)
            .map(|number| (number + 0.0).to_bits())
            .chain(words)
            .collect()
    }
}

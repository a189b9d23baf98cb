//! Rows that say twice what one says.

use std::collections::HashMap;

use super::Measurements;
use crate::error::{Warning, WarningKind};

/// Copies that are named besides the first.
const NAMED: usize = 3;
/// Readings with digits this fine in units of σ hardly ever repeat to the last of them.
const FINE: f64 = 0.1;
/// The same where no σ is known \[m\].
const FINE_LENGTH: f64 = 1e-6;
/// Steps of the last digit that are looked for, from the coarsest on \[m\].
const STEPS: [f64; 8] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// A number within this part of a step of a whole number of them has no finer digits.
const WHOLE: f64 = 1e-3;

impl Measurements {
    /// A warning where rows are the same as earlier ones to the last digit: with measurements, a
    /// copy. `sigma` is the declared one of a coordinate \[m\]. Where digits are so much finer that
    /// chance hardly repeats all of a position, copies that differ in their times count too.
    pub fn repeated_rows(&self, sigma: Option<f64>) -> Option<Warning> {
        let fine = sigma.map_or(FINE_LENGTH, |sigma| FINE * sigma);
        let by_time = self.time_measured && self.step().is_some_and(|step| step > fine);
        let mut first_rows: HashMap<Vec<u64>, usize> = HashMap::with_capacity(self.len());
        let mut repeated = Vec::new();
        for row in 0..self.len() {
            // Numbers of one coordinate repeat by chance.
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
            .take(NAMED)
            .map(|&(row, _)| self.location(row).to_string())
            .collect();
        let kind = WarningKind::RowsRepeated {
            rows: repeated.len(),
            first: self.location(first).to_string(),
            others,
        };
        Some(Warning { location: self.location(row), kind })
    }

    /// The last digit of the measured positions \[m\]; `None` where there is none that all share.
    fn step(&self) -> Option<f64> {
        let numbers = || self.positions.iter().flatten();
        let is_whole = |step: f64| numbers().all(|x| (x / step - (x / step).round()).abs() < WHOLE);
        STEPS.into_iter().find(|step| is_whole(*step))
    }

    /// Everything that was measured in a row, its time where that counts; a time that was only
    /// counted is none.
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
            .flat_map(|all| all.iter().skip(row * self.joints).take(self.joints));
        let words = [Some(&self.session), self.target.as_ref()].into_iter().flatten();
        let words = words.filter_map(|labels| labels.of_row.get(row)).copied();
        let words = words.chain(self.observation(row).key()).map(|word| word as u64);
        let turned = self
            .orientations
            .iter()
            .filter_map(|all| all.get(row))
            .flat_map(|own| own.coords.iter());
        // Zero has no sign.
        numbers
            .chain(turned)
            .chain(time)
            .chain(approach)
            .map(|number| (number + 0.0).to_bits())
            .chain(words)
            .collect()
    }
}

//! Rows that say twice what one says.

use std::collections::HashMap;

use super::Measurements;
use crate::error::{Warning, WarningKind};

impl Measurements {
    /// A warning where rows are the same as earlier ones to the last digit: with measurements, a copy.
    pub fn repeated_rows(&self) -> Option<Warning> {
        let mut first_rows: HashMap<Vec<u64>, usize> = HashMap::with_capacity(self.len());
        let mut repeated = Vec::new();
        for row in 0..self.len() {
            let first = *first_rows.entry(self.bits(row)).or_insert(row);
            if first != row {
                repeated.push((row, first));
            }
        }
        let &(row, first) = repeated.first()?;
        let kind = WarningKind::RowsRepeated { rows: repeated.len(), first: self.location(first).to_string() };
        Some(Warning { location: self.location(row), kind })
    }

    /// Everything that was measured in a row; a time that was only counted is none.
    fn bits(&self, row: usize) -> Vec<u64> {
        let columns = [&self.sigma, &self.payload, &self.hoist, &self.temperature].into_iter().flatten();
        let numbers = self.configuration(row).iter().chain(self.positions.get(row).into_iter().flatten());
        let numbers = numbers.chain(columns.filter_map(|column| column.get(row)));
        let time = self.time.get(row).filter(|_| self.time_measured);
        let approach = self.approach.iter().flat_map(|all| all.iter().skip(row * self.joints).take(self.joints));
        let words = [Some(&self.session), self.target.as_ref()].into_iter().flatten();
        let words = words.filter_map(|labels| labels.of_row.get(row)).copied();
        let words = words.chain(self.observation(row).key()).map(|word| word as u64);
        let turned = self.orientations.iter().filter_map(|all| all.get(row)).flat_map(|own| own.coords.iter());
        // Zero has no sign.
        numbers.chain(turned).chain(time).chain(approach).map(|number| (number + 0.0).to_bits()).chain(words).collect()
    }
}

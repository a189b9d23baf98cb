//! Warning about rows that are probably copies of others.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::Measurements;
use crate::error::{Warning, WarningKind};
use crate::problem::Problem;

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
/// Minimum number of rows with fewer digits than their originals that are reported. Few of them
/// agree by chance.
const MIN_ROUNDED_COPIES: usize = 10;
/// Tolerance, as a fraction of a step, within which a number counts as a multiple of the step.
const MULTIPLE_TOLERANCE: f64 = 1e-3;

impl Measurements {
    /// Returns a warning if rows equal earlier ones to the last digit, which is improbable for
    /// measured rows.
    ///
    /// `sigma` is the declared standard deviation of a coordinate \[m\]. If the resolution is not
    /// much finer than σ, whole positions may repeat by chance. Rows then count as copies only if
    /// their times are equal, too.
    pub(super) fn repeated_rows(&self, sigma: Option<f64>) -> Option<Warning> {
        let by_time = self.time_measured && self.is_coarse(sigma);
        let mut first_rows: HashMap<Vec<u64>, usize> = HashMap::with_capacity(self.len());
        let mut repeated = Vec::new();
        for row in 0..self.len() {
            // Rows of other kinds have few coordinates, which may repeat by chance.
            let by_time = by_time || !self.observation(row).is_position();
            let first = *first_rows.entry(self.bits(row, by_time, true)).or_insert(row);
            if first != row {
                repeated.push((row, first));
            }
        }
        let &(row, first) = repeated.first()?;
        let kind = WarningKind::RowsRepeated {
            rows: repeated.len(),
            first: self.location(first).to_string(),
            others: self.named_copies(&repeated),
        };
        Some(Warning { location: self.location(row), kind })
    }

    /// Returns a warning if positions and configurations equal those of another session to the last
    /// digit.
    ///
    /// The resolution must be fine against `sigma`, the declared standard deviation of a coordinate
    /// \[m\], because coarse positions repeat by chance.
    pub(super) fn rows_of_another_session(&self, sigma: Option<f64>) -> Option<Warning> {
        if self.session.names.len() < 2 || self.is_coarse(sigma) {
            return None;
        }
        let session = |row: usize| self.session.of_row.get(row).copied();
        let mut first_rows: HashMap<Vec<u64>, usize> = HashMap::with_capacity(self.len());
        let mut repeated = Vec::new();
        for row in (0..self.len()).filter(|&row| self.observation(row).is_position()) {
            let first = *first_rows.entry(self.bits(row, false, false)).or_insert(row);
            if session(first) != session(row) {
                repeated.push((row, first));
            }
        }
        let &(row, first) = repeated.first()?;
        let name = |row| self.session.names.get(session(row)?).cloned();
        let kind = WarningKind::RowsOfAnotherSession {
            rows: repeated.len(),
            sessions: [name(row)?, name(first)?],
            first: self.location(first).to_string(),
            others: self.named_copies(&repeated),
        };
        Some(Warning { location: self.location(row), kind })
    }

    /// Returns a warning if rows equal others to the last digit of the coarser one: one measurement
    /// that was exported twice with different numbers of digits. `problem` declares the joints.
    pub(super) fn rounded_copies(&self, problem: &Problem) -> Option<Warning> {
        let groups = self.configurations(problem).0;
        let mut first_rows: HashMap<usize, usize> = HashMap::new();
        let mut pairs = Vec::new();
        for row in (0..self.len()).filter(|&row| self.observation(row).is_position()) {
            let first = *first_rows.entry(*groups.get(row)?).or_insert(row);
            if first != row {
                pairs.push((row, first, self.positions.get(row)?, self.positions.get(first)?));
            }
        }
        RESOLUTIONS.into_iter().find_map(|step| {
            let is_whole = |position: &Vector3<f64>| position.iter().all(|x| is_multiple(*x, step));
            // One of the two rows has the digits beyond the step, the other has not.
            let mixed: Vec<_> =
                pairs.iter().filter(|(.., a, b)| is_whole(a) != is_whole(b)).collect();
            let is_copy = mixed.iter().all(|(.., a, b)| (*a - *b).amax() < 0.5001 * step);
            let &&(row, first, ..) = mixed.first()?;
            let copies: Vec<(usize, usize)> =
                mixed.iter().map(|(row, first, ..)| (*row, *first)).collect();
            let kind = WarningKind::RowsRounded {
                rows: copies.len(),
                first: self.location(first).to_string(),
                step: format!("{}", (step * 1e9).round() / 1e6),
                others: self.named_copies(&copies),
            };
            (is_copy && mixed.len() >= MIN_ROUNDED_COPIES && 2 * mixed.len() > pairs.len())
                .then(|| Warning { location: self.location(row), kind })
        })
    }

    /// Returns the places of copies after the first one, for a message.
    fn named_copies(&self, copies: &[(usize, usize)]) -> Vec<String> {
        let others = copies.iter().skip(1).take(MAX_NAMED_COPIES);
        others.map(|&(row, _)| self.location(row).to_string()).collect()
    }

    /// Returns true if the readings have so few digits that positions repeat by chance. `sigma` is
    /// the declared standard deviation of a coordinate \[m\].
    pub(super) fn is_coarse(&self, sigma: Option<f64>) -> bool {
        let fine = sigma.map_or(FINE_RESOLUTION_WITHOUT_SIGMA, |sigma| FINE_RESOLUTION * sigma);
        self.step().is_some_and(|step| step > fine)
    }

    /// Returns the coarsest of [`RESOLUTIONS`] of which all measured coordinates are multiples
    /// \[m\]; `None` if there is none.
    fn step(&self) -> Option<f64> {
        let numbers = || self.positions.iter().flatten();
        let is_whole = |step: f64| numbers().all(|x| is_multiple(*x, step));
        RESOLUTIONS.into_iter().find(|step| is_whole(*step))
    }

    /// Returns the bit patterns of all numbers of a row, and the indices of its words, by which
    /// rows are compared. The time is included if it was measured and `by_time` is true, the
    /// session if `by_session` is.
    fn bits(&self, row: usize, by_time: bool, by_session: bool) -> Vec<u64> {
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
        let session = Some(&self.session).filter(|_| by_session);
        let words = [session, self.target.as_ref()].into_iter().flatten();
        let words = words.filter_map(|labels| labels.of_row.get(row)).copied();
        let words = words.chain(self.observation(row).sort_key()).map(|word| word as u64);
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

/// Returns true if a number is a multiple of a step.
fn is_multiple(x: f64, step: f64) -> bool {
    (x / step - (x / step).round()).abs() < MULTIPLE_TOLERANCE
}

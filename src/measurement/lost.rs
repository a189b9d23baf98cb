//! Detection of zeros that an instrument writes for a lost target.

use super::Measurements;
use crate::error::{InputError, TableErrorKind, Warning, WarningKind};

/// Largest fraction of rows at 0, 0, 0 that counts as lost targets. In a table with more of them,
/// the zeros may be placeholders of planned poses.
const MAX_LOST_FRACTION: f64 = 0.5;
/// Maximum number of rows at 0, 0, 0 that a message lists after the first.
const MAX_LISTED_ROWS: usize = 10;

impl Measurements {
    /// Returns a warning about the first row whose measured position is exactly 0, 0, 0. The
    /// message proposes to set the key `missing` to `write`.
    ///
    /// # Errors
    /// Returns an error if rows with different configurations measure this position, which does not
    /// happen by chance.
    pub(super) fn lost_targets(&self, write: &str) -> Result<Option<Warning>, InputError> {
        let is_lost = |row: &usize| {
            self.observation(*row).is_position()
                && self.positions.get(*row).is_some_and(|position| position.norm() == 0.0)
        };
        let lost: Vec<usize> = (0..self.len()).filter(is_lost).collect();
        let Some(&first) = lost.first() else { return Ok(None) };
        if !self.position_measured || lost.len() as f64 > MAX_LOST_FRACTION * self.len() as f64 {
            return Ok(None);
        }
        let (location, write) = (self.location(first), write.to_owned());
        let differs = |row: &&usize| self.configuration(**row) != self.configuration(first);
        if !lost.iter().any(|row| differs(&row)) {
            return Ok(Some(Warning { location, kind: WarningKind::PositionZero { write } }));
        }
        let others = lost.iter().skip(1).take(MAX_LISTED_ROWS);
        let others = others.map(|&row| self.location(row).to_string()).collect();
        Err(location.error(TableErrorKind::LostTargets { rows: lost.len(), others, write }))
    }
}

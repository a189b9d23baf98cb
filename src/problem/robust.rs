//! `[robust]`: how much a residual counts.

use super::section::Section;
use crate::error::{InputError, InputErrorKind};

/// `[robust]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robust {
    /// What residuals count.
    pub loss: RobustLoss,
    /// `threshold_sigma`: the length of a residual from which it counts less than its square \[σ\];
    /// `None`: the usual one.
    pub threshold: Option<f64>,
}

/// What the residual of a pose counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RobustLoss {
    /// Its square up to the threshold, its length beyond.
    Huber,
    /// Its length, rounded off below the threshold.
    L1,
}

/// The section, if it is there.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Option<Robust>, InputError> {
    let Some(mut section) = root.section("robust")? else { return Ok(None) };
    let words = ["huber", "l1"];
    let meanings = [RobustLoss::Huber, RobustLoss::L1];
    let Some(loss) = section.word("loss", &["huber", "l1"], &meanings)? else {
        return Err(
            section.missing("loss", words.map(|word| format!("loss = \"{word}\"")).join(" or "))
        );
    };
    let mut threshold = None;
    if let Some(item) = section.get("threshold_sigma") {
        let value = item.number()?;
        if value <= 0.0 {
            return Err(item.error(InputErrorKind::NotPositive { value }));
        }
        threshold = Some(value);
    }
    section.finish()?;
    Ok(Some(Robust { loss, threshold }))
}

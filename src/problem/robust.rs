//! Reader of `[robust]`: loss that limits the influence of large residuals.

use super::section::Section;
use crate::error::{InputError, InputErrorKind};

/// Section `[robust]`: robust loss of the residual of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robust {
    /// Loss function of a residual.
    pub loss: RobustLoss,
    /// Length of a residual above which the loss is no longer quadratic, `threshold_sigma` \[σ\];
    /// `None` for the default.
    pub threshold: Option<f64>,
}

/// Loss function of the residual of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RobustLoss {
    /// Quadratic up to the threshold, linear beyond.
    Huber,
    /// Linear, rounded off below the threshold.
    L1,
}

/// Reads the section; returns `None` if it is absent.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Option<Robust>, InputError> {
    if let Some(item) = root.peek("robust").filter(|item| item.any_text().is_ok()) {
        let word = item.any_text()?.to_lowercase();
        let loss = if ["huber", "l1"].contains(&word.as_str()) { word.as_str() } else { "huber" };
        let write = format!("the line [robust] and below it loss = \"{loss}\"");
        return Err(item.error(InputErrorKind::NotASection { write }));
    }
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

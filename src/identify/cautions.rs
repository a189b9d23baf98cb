//! What to ask about a fit that may be right all the same.

use std::fmt;

use super::Outlier;
use super::misread::Misreading;

/// The registered nominal arm misses the measurements by this part of their spread: a reason to ask.
const FAR_OFF: f64 = 0.1;
/// Rows that are named.
const NAMED: usize = 5;

/// A reason to look at the input again.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Caution {
    /// Held-out rows too far off to be noise.
    HeldOutOutliers {
        /// Which.
        rows: Vec<Outlier>,
        /// Of so many.
        of: usize,
    },
    /// Held-out rows that are identification rows again.
    HeldOutCopies {
        /// How many.
        copies: usize,
        /// Of so many.
        of: usize,
    },
    /// The nominal arm is far from the measurements, wherever its base stands.
    FarOff {
        /// Root mean squared error of the registered nominal arm \[m\].
        rms: f64,
        /// Root mean squared distance of the measured points from their centre \[m\].
        spread: f64,
        /// What would explain it, each by itself, the best first.
        misreadings: Vec<Misreading>,
    },
}

impl fmt::Display for Caution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HeldOutOutliers { rows, of } => {
                let row = |own: &Outlier| {
                    let millimetres = own.error.amax() * 1e3;
                    let size =
                        if millimetres < 1e9 { format!("{millimetres:.3}") } else { format!("{millimetres:.2e}") };
                    format!("{} (off by {size} mm along an axis)", own.location)
                };
                let named: Vec<String> = rows.iter().take(NAMED).map(row).collect();
                let more = rows.len().saturating_sub(NAMED);
                let more = if more > 0 { format!(", and {more} more") } else { String::new() };
                let (count, verb) = (rows.len(), if rows.len() == 1 { "is" } else { "are" });
                write!(f, "{count} of {of} held-out poses {verb} too far off to be noise: {}{more}", named.join(", "))
            }
            Self::HeldOutCopies { copies, of } => {
                write!(f, "{copies} of {of} held-out rows are identification rows again: they judge nothing")
            }
            Self::FarOff { rms, .. } if !rms.is_finite() => {
                f.write_str("the nominal arm misses the measurements by more than numbers hold; check their units")
            }
            Self::FarOff { rms, spread, misreadings } => {
                let (millimetres, part) = (rms * 1e3, 100.0 * rms / spread);
                write!(
                    f,
                    "the nominal arm misses the measurements by {millimetres:.1} mm, {part:.0} % of their spread, wherever its base \
                     stands; "
                )?;
                let words: Vec<String> = misreadings.iter().map(Misreading::to_string).collect();
                if words.is_empty() {
                    return f.write_str(
                        "check units, signs of joints, and whether the numbers are of this convention of frames",
                    );
                }
                write!(f, "this would explain it: {}", words.join(", or "))
            }
        }
    }
}

/// A nominal arm that is far off, and what would explain it.
pub(super) fn far_off(rms: f64, spread: f64, explain: impl FnOnce() -> Vec<Misreading>) -> Option<Caution> {
    (spread > 0.0 && rms > FAR_OFF * spread).then(|| Caution::FarOff { rms, spread, misreadings: explain() })
}

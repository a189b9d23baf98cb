//! What to ask about a fit that may be right all the same.

use std::fmt;

use crate::fit::Outlier;
use crate::fit::checks::kind::{Kind, measured, named, size};
use crate::fit::checks::misread::Misreading;

/// The registered nominal arm misses the measurements by this part of their spread: a reason to
/// ask.
const FAR_OFF: f64 = 0.1;
/// Contacts closer together than this part of the arm's size are in one place, and their spread is
/// what the arm misses it by.
const ONE_PLACE: f64 = 0.05;
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
        /// What the rows measure ([`Observation::kind`](crate::problem::Observation::kind)).
        kind: &'static str,
        /// Root mean squared error of the registered nominal arm \[m\]; of tilts \[rad\].
        rms: f64,
        /// Root mean squared distance of the measured points, or of the places where others than
        /// positions were measured, from their centre \[m\]; of tilts \[rad\].
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
                    let size = size(own.kind, own.error.amax(), 3);
                    let axis = if matches!(own.kind, "position" | "point") { " along an axis" } else { "" };
                    format!("{} (off by {size}{axis})", own.location)
                };
                let noun = if rows.iter().all(|own| own.kind == "position") { "poses" } else { "rows" };
                let named: Vec<String> = rows.iter().take(NAMED).map(row).collect();
                let more = rows.len().saturating_sub(NAMED);
                let more = if more > 0 { format!(", and {more} more") } else { String::new() };
                let (count, verb) = (rows.len(), if rows.len() == 1 { "is" } else { "are" });
                write!(f, "{count} of {of} held-out {noun} {verb} too far off to be noise: {}{more}", named.join(", "))
            }
            Self::HeldOutCopies { copies, of } => {
                write!(f, "{copies} of {of} held-out rows are identification rows again: they judge nothing")
            }
            Self::FarOff { rms, .. } if !rms.is_finite() => {
                f.write_str("the nominal arm misses the measurements by more than numbers hold; check their units")
            }
            Self::FarOff { kind, rms, spread, misreadings } => {
                let (what, by, part) = (measured(kind), size(kind, *rms, 1), 100.0 * rms / spread);
                let standing = if *kind == "position" { ", wherever its base stands" } else { "" };
                write!(f, "the nominal arm misses the {what} by {by}, {part:.0} % of their spread{standing}; ")?;
                let words: Vec<String> = misreadings.iter().map(Misreading::to_string).collect();
                if words.is_empty() && *kind != "position" {
                    return write!(f, "check units, signs of joints, and {}", named(kind));
                }
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

/// A nominal arm of some `size` \[m\] that is far off, and what would explain it.
pub(in crate::fit) fn far_off(
    Kind { observation, spread, .. }: &Kind,
    (rms, size): (f64, f64),
    explain: impl FnOnce() -> Vec<Misreading>,
) -> Option<Caution> {
    let measured = observation.is_position() || observation.is_angle();
    let least = if measured { 0.0 } else { ONE_PLACE * size };
    let (kind, spread) = (observation.kind(), *spread);
    (spread > least && rms > FAR_OFF * spread).then(|| Caution::FarOff {
        kind,
        rms,
        spread,
        misreadings: explain(),
    })
}

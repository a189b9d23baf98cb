//! Search for the scale of one coordinate of the positions against the two others.

use super::search::Trial;
use super::{Kind, Misreading};
use crate::fit::checks::row_kind::AXES;

/// Distances of the two trial ratios beside a ratio from it, relative to it: twice with the
/// registered nominal arm, then with full fits.
const STEPS: [(f64, bool); 3] = [(0.01, false), (0.002, false), (0.001, true)];
/// Smallest deviation of a ratio from 1, in millionths, that is a misreading. Scales of instruments
/// deviate by less.
const MIN_SCALE: u32 = 3000;
/// Largest step to the minimum of a parabola, as a multiple of the distance of its points.
const MAX_PARABOLA_STEP: f64 = 3.0;

impl Trial<'_> {
    /// Returns the misreading of the scale of one coordinate with the ratio at which the squared
    /// error is smallest: the minimum of the parabola through three ratios, several times. Other
    /// misreadings stay as they are.
    pub(super) fn with_best_ratio(&self, misreading: Misreading) -> Misreading {
        let Kind::AxisScale(axis, millionths) = misreading.kind else { return misreading };
        let mut ratio = f64::from(millionths);
        for (step, is_fitted) in STEPS {
            let square = |side: f64| {
                let scaled = Misreading::axis_scale(axis, ratio * (1.0 + side * step));
                let error = if is_fitted {
                    self.outcome(&scaled)?.rms
                } else {
                    self.registered_error(&scaled)?
                };
                Some(error.powi(2))
            };
            let (Some(below), Some(here), Some(above)) = (square(-1.0), square(0.0), square(1.0))
            else {
                return misreading;
            };
            let curvature = below - 2.0 * here + above;
            let side = (below - above) / (2.0 * curvature);
            if curvature > 0.0 {
                ratio *= 1.0 + side.clamp(-MAX_PARABOLA_STEP, MAX_PARABOLA_STEP) * step;
            }
        }
        Misreading::axis_scale(axis, ratio)
    }
}

impl Misreading {
    /// Returns true for a scale of one coordinate that an instrument may have.
    pub(super) fn is_minute(&self) -> bool {
        matches!(self.kind, Kind::AxisScale(_, of) if of.abs_diff(1_000_000) < MIN_SCALE)
    }

    /// Creates the misreading of the scale of a coordinate by the nearest ratio in millionths.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "near 1e6")]
    fn axis_scale(axis: usize, millionths: f64) -> Self {
        Self::of_axis_scale(axis, millionths.clamp(1.0, 1e9).round() as u32)
    }

    /// Creates the misreading of the scale of a coordinate by a ratio in millionths.
    pub(super) fn of_axis_scale(axis: usize, millionths: u32) -> Self {
        let name = AXES[axis];
        let ratio = f64::from(millionths) * 1e-6;
        let words =
            format!("{name} of the positions that is {ratio:.4} times as large as it should be");
        let factor = 1e6 / f64::from(millionths);
        Self::of_positions(words, move |position| position[axis] *= factor)
            .of_kind(Kind::AxisScale(axis, millionths))
            .in_group(format!("scale of {name}"))
    }
}

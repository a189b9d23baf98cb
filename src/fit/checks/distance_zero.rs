//! Check of the distances to one anchor for a constant error, as of a wire whose zero is wrong.

use serde_json::json;

use super::finding::{Finding, FindingCode};
use super::row_kind::format_error;
use crate::fit::{Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::problem::{Observation, Problem};

/// Smallest reduced χ² at which a constant error is tried.
const MIN_CHI2: f64 = 100.0;
/// Largest share of the reduced χ² that is left with a constant error.
const MAX_LEFT: f64 = 1e-3;
/// Maximum number of anchors, each of which is tried by itself.
const MAX_ANCHORS: usize = 8;
/// Steps of the constant in the fits on either side, one for each refinement \[m\].
const STEPS: [f64; 3] = [0.02, 2e-3, 2e-4];

/// Returns the finding that all distances to one anchor are wrong by one constant, which causes
/// nearly all of a misfit; `None` if they are not. `fit` repeats the fit with other data.
pub(in crate::fit) fn distance_zero(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    fit: impl Fn(&Dataset) -> Result<Identification, IdentifyError>,
) -> Option<Finding> {
    let before = found.reduced_chi2.filter(|chi2| *chi2 > MIN_CHI2)?;
    let rows = &data.measurements;
    if rows.leading().kind() != Observation::Distance(0).kind() {
        return None;
    }
    let is_used =
        |anchor: &usize| (0..rows.len()).any(|row| is_distance_to(rows.observation(row), *anchor));
    let anchors: Vec<usize> = (0..problem.fixtures.len()).filter(is_used).collect();
    let fitted = |anchor: usize, by: f64| {
        let mut data = data.clone();
        let observations = (0..rows.len()).map(|row| rows.observation(row));
        for (observation, measured) in observations.zip(&mut data.measurements.positions) {
            if is_distance_to(observation, anchor) {
                measured.x -= by;
            }
        }
        let fitted = fit(&data).ok()?;
        Some((fitted.reduced_chi2?, fitted))
    };
    let chi2 = |anchor: usize, by: f64| Some(fitted(anchor, by)?.0);
    // χ² is a parabola of the constant, as far as the model is linear.
    let lowest = |anchor: usize, (at, middle): (f64, f64), step: f64| {
        let (below, above) = (chi2(anchor, at - step)?, chi2(anchor, at + step)?);
        let curvature = below + above - 2.0 * middle;
        let by = 0.5 * step * (below - above) / curvature;
        let left = middle - 0.25 * (below - above) * by / step;
        (curvature > 0.0).then_some((at + by, left))
    };
    let first = |anchor: usize| Some((anchor, lowest(anchor, (0.0, before), STEPS[0])?));
    let tried = anchors.into_iter().take(MAX_ANCHORS).filter_map(first);
    let (anchor, (mut by, _)) = tried.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))?;
    for step in STEPS {
        by = lowest(anchor, (by, chi2(anchor, by)?), step)?.0;
    }
    let (after, fitted) = fitted(anchor, by)?;
    if after > MAX_LEFT * before {
        return None;
    }
    let kind = rows.leading().kind();
    let [left, declared] = [&fitted, found].map(|of| of.fitted.identification.rms.norm);
    let name = &problem.fixtures.get(anchor)?.name;
    let side = if by > 0.0 { "large" } else { "small" };
    let words = format!("distances to {name} that are {:.1} mm too {side}", by.abs() * 1e3);
    let text = format!(
        "the measurements fit if read in another way: with {words}, the rms error would be {} \
         instead of {}",
        format_error(kind, left, 3),
        format_error(kind, declared, 3)
    );
    let remedy = "correct the zero of this wire or bar, by which all its distances are wrong";
    let numbers = [json!([words]), declared.into(), left.into()];
    Some(Finding::new(FindingCode::Misread, numbers, text).with_remedy(remedy))
}

/// Returns true for a distance to the fixture with the index `anchor`.
fn is_distance_to(observation: Observation, anchor: usize) -> bool {
    matches!(observation, Observation::Distance(of) if of == anchor)
}

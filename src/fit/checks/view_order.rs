//! Check of the order in which a detector numbers the points of a marker.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use crate::measurement::Measurements;
use crate::model::Pose;
use crate::observation::Needs;
use crate::problem::{Observation, Problem};

/// Largest ratio of the rms error with reversed point numbers to that with the numbers of the
/// table, at which a view is reversed. A view in the right order has a ratio above 1.
const MAX_REVERSED_RATIO: f64 = 0.33;
/// Minimum number of points of a view or a marker whose order is judged.
const MIN_POINTS: usize = 4;
/// Largest deviation of a marker from point symmetry that is rounding, relative to the largest
/// distance of its points from its origin.
const MAX_ASYMMETRY: f64 = 1e-6;
/// Maximum number of views that the text of a finding lists.
const MAX_LISTED: usize = 5;

/// Groups rows that measure points of one marker in one image: equal camera, marker, session, time
/// and configuration. Each group holds indices into `rows`; rows of other kinds are left out.
pub(in crate::fit) fn views(measurements: &Measurements, rows: &[usize]) -> Vec<Vec<usize>> {
    let mut views: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (place, &row) in rows.iter().enumerate() {
        let observation = measurements.observation(row);
        if observation.description().needs != Needs::Carriers {
            continue;
        }
        let time = measurements.time_measured.then(|| measurements.time[row].to_bits());
        let configuration: Vec<u64> =
            measurements.configuration(row).iter().map(|q| q.to_bits()).collect();
        let session = measurements.session.of_row[row];
        let key = (observation.fixtures(), session, time, configuration);
        views.entry(key).or_default().push(place);
    }
    views.into_values().collect()
}

/// Checks that no view has the points of its marker in the reverse order.
///
/// A board looks the same after half a turn, so that a detector may begin at either end. Reversed
/// points of one view fit some pose of the marker as well as points in the right order, but not the
/// pose that the arm predicts.
pub(super) fn points_in_order(fit: &CheckedFit) -> Option<Finding> {
    let (fitting, problem) = (fit.fitting, fit.problem);
    let split = fitting.split;
    let rows: Vec<usize> = split.identification.iter().chain(&split.held_out).copied().collect();
    let poses = fitting.poses(&rows);
    let reversed: Vec<Pose> = poses
        .iter()
        .map(|pose| Pose { observation: reversed(problem, pose.observation), ..*pose })
        .collect();
    if poses.iter().zip(&reversed).all(|(pose, other)| pose.observation == other.observation) {
        return None;
    }
    let views = views(fitting.measurements, &rows);
    // Reversed views may spoil the fit. The views are therefore judged by the fitted or the
    // registered nominal arm, whichever has the smaller error.
    let errors = |poses: &[Pose], x| fitting.model.residuals(poses.to_vec(), x);
    let all_places: Vec<usize> = (0..rows.len()).collect();
    let arms = [fit.registered_x, &fit.end.x].map(|x| (errors(&poses, x), x));
    let [nominal, fitted] = arms;
    let is_fitted = mean_square(&fitted.0, &all_places) < mean_square(&nominal.0, &all_places);
    let (errors_here, x) = if is_fitted { fitted } else { nominal };
    let errors_reversed = errors(&reversed, x);
    let squares =
        |view: &[usize]| [&errors_here, &errors_reversed].map(|errors| mean_square(errors, view));
    let is_reversed = |view: &&Vec<usize>| {
        let [square, other] = squares(view);
        view.len() >= MIN_POINTS && other < MAX_REVERSED_RATIO.powi(2) * square
    };
    let found: Vec<&Vec<usize>> = views.iter().filter(is_reversed).collect();
    let places: Vec<usize> = found.iter().copied().flatten().copied().collect();
    let [before, after] = squares(&places).map(f64::sqrt);
    // If most views were reversed, the error would be of the arm or the marker.
    if found.is_empty() || 2 * found.len() > views.len() {
        return None;
    }
    let mut first: Vec<usize> =
        found.iter().filter_map(|view| view.iter().map(|&place| rows[place]).min()).collect();
    first.sort_unstable();
    let listed = first.iter().take(MAX_LISTED);
    let listed: Vec<String> =
        listed.map(|&row| fitting.measurements.location(row).to_string()).collect();
    let more = if first.len() > MAX_LISTED { ", …" } else { "" };
    let (views, begin) = match first.len() {
        1 => ("1 view numbers".to_owned(), "it begins"),
        count => (format!("{count} views number"), "they begin"),
    };
    let text = format!(
        "{views} the points of the marker from the other end: {begin} at {}{more}; with the \
         reverse order the error falls from {before:.1} to {after:.1} px",
        listed.join(", ")
    );
    let numbers = [json!(first.len()), json!(before), json!(after)];
    Some(Finding::new(FindingCode::ViewsReversed, numbers, text))
}

/// Returns the observation of the point that has the same number as the observed one if the marker
/// is numbered from the other end. Observations of markers without point symmetry, and of other
/// kinds, stay the same.
fn reversed(problem: &Problem, observation: Observation) -> Observation {
    let Observation::Pixel(camera, marker, point) = observation else { return observation };
    let points = problem.fixtures.get(marker as usize).map_or(&[][..], |marker| &marker.points);
    let last = points.len().saturating_sub(1);
    let sums = || points.iter().zip(points.iter().rev()).map(|(a, b)| a + b);
    let size = points.iter().map(Vector3::norm).fold(0.0, f64::max);
    let is_symmetric =
        sums().all(|sum| (sum - points[0] - points[last]).norm() <= MAX_ASYMMETRY * size);
    match u32::try_from(last).ok().and_then(|last| last.checked_sub(point)) {
        Some(other) if is_symmetric && points.len() >= MIN_POINTS => {
            Observation::Pixel(camera, marker, other)
        }
        _ => observation,
    }
}

/// Returns the mean squared length of the errors with the indices `places`; 0 if there are none.
fn mean_square(errors: &[Vector3<f64>], places: &[usize]) -> f64 {
    let sum: f64 = places.iter().map(|&place| errors[place].norm_squared()).sum();
    sum / places.len().max(1) as f64
}

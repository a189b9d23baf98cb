//! Finding that views of markers do not decide the poses of cameras and markers, with the reason:
//! how the camera moves against the marker.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use crate::model::Pose;
use crate::spatial::Frame;

/// Standard error of a pose from which on it is open \[m\] or \[rad\].
pub(in crate::fit) const MAX_POSE_ERROR: f64 = 0.1;
/// Largest rotation \[rad\] in which a camera counts as not turning about an axis.
const MAX_STILL_TURN: f64 = 0.035;
/// Largest distance \[m\] over which a camera that does not turn counts as standing still.
const MAX_STILL_SHIFT: f64 = 1e-3;
/// Largest angle \[rad\] between the camera's axis and the normal of a marker that is seen from the
/// front.
const MAX_FRONTAL_ANGLE: f64 = 0.17;

/// Returns the finding that the views leave open coordinates of poses of cameras and markers.
/// `poses` holds the indices of these among the unknowns. `names` are the unknowns and groups
/// involved; the flag is true if a focal length is among them. `None` if the fit knows the
/// coordinates from priors or other rows.
pub(super) fn undecided(
    fit: &CheckedFit,
    poses: &[usize],
    (names, has_focal): (&[String], bool),
) -> Option<Finding> {
    let open = open_coordinates(fit, poses);
    // Coordinates of markers alone have no effect on a row, such as the rotation of a single point.
    if !open.iter().any(|name| name.starts_with("camera[")) && !has_focal || open.is_empty() {
        return None;
    }
    let is_involved = |fixture: usize| {
        let Some(fixture) = fit.problem.fixtures.get(fixture) else { return false };
        let name = format!("{}[{}].", fixture.kind.word(), fixture.name);
        open.iter().any(|open| open.starts_with(&name))
    };
    let movement = movement(fit, is_involved)?;
    let front = movement.frontal.map(|angle| {
        format!(
            "see the marker from the front only (within {:.1}° of its normal)",
            angle.to_degrees()
        )
    });
    let (kind, why) = match movement.reason(["the camera", "the camera against the marker"]) {
        _ if has_focal && front.is_some() => ("frontal", String::new()),
        reason => reason,
    };
    let why: Vec<String> =
        [why].into_iter().filter(|why| !why.is_empty()).chain(front.clone()).collect();
    let mut groups: Vec<&str> =
        open.iter().filter_map(|name| name.rsplit_once('.')).map(|of| of.0).collect();
    groups.dedup();
    let (place, of) = (if groups.len() == 1 { "pose" } else { "poses" }, groups.join(" and "));
    let text = format!("the views leave the {place} of {of} open: they {}", why.join(" and "));
    let numbers =
        [json!(kind), json!(names), json!(open), movement.turn.into(), movement.across.into()];
    let finding = Finding::new(FindingCode::ViewsUndecided, numbers, text);
    Some(if has_focal {
        finding.with_remedy(
            "view the marker at an angle of 30° and more, hold fx and fy, or give them priors \
             (sigma_px)",
        )
    } else {
        finding
    })
}

/// Returns the finding that measured poses leave coordinates of tool and base open, which are the
/// unknowns with the indices `set_up`. `None` if the tool turns about several axes, if priors or the
/// rows give all of them, and without orientations.
pub(super) fn undecided_set_up(fit: &CheckedFit, set_up: &[usize]) -> Option<Finding> {
    let open = open_coordinates(fit, set_up);
    if !open.iter().any(|name| name.starts_with("tool")) {
        return None;
    }
    let rows: Vec<Pose> =
        fit.whole.poses.iter().filter(|pose| pose.orientation.is_some()).copied().collect();
    let frames = fit.model().frames(&rows, fit.end.x.as_slice());
    let mut movement = Movement::default();
    movement.widen(&frames.into_iter().flatten().collect::<Vec<_>>());
    let (kind, why) = movement.reason(["the tool", "the tool"]);
    if rows.is_empty() || kind == "other" {
        return None;
    }
    let text = format!("the measured poses leave {} open: they {why}", open.join(", "));
    let numbers = [json!(kind), json!(open), movement.turn.into(), movement.across.into()];
    Some(Finding::new(FindingCode::SetUpUndecided, numbers, text))
}

/// Returns the names of those of some unknowns that neither priors nor the rows determine.
fn open_coordinates<'f>(fit: &'f CheckedFit, unknowns: &[usize]) -> Vec<&'f str> {
    let parameters: Vec<_> = fit.whole.parameters().collect();
    let is_open = |k: &usize| {
        let is_informed = parameters[*k].sigma.is_some() || parameters[*k].is_bounded();
        // A comparison with NaN is false.
        let is_known = fit.statistics.determined[*k] && fit.statistics.errors[*k] <= MAX_POSE_ERROR;
        !is_informed && !is_known
    };
    unknowns.iter().filter(|k| is_open(k)).map(|&k| &*parameters[k].name).collect()
}

/// Movement of cameras against the markers that they see, over the views of some pairs.
#[derive(Debug, Clone, Copy, Default)]
struct Movement {
    /// Largest rotation from the first view of a pair \[rad\].
    turn: f64,
    /// Largest part of these rotations that is not about their main axis \[rad\].
    across: f64,
    /// Largest distance from the first view of a pair \[m\].
    shift: f64,
    /// Largest angle between the camera's axis and the normal of the flat marker, if all views are
    /// from the front \[rad\].
    frontal: Option<f64>,
}

impl Movement {
    /// Returns the kind of the movement that does not decide a pose, and says it of what moves: its
    /// name, and its name with what it moves against.
    fn reason(&self, [what, against]: [&str; 2]) -> (&'static str, String) {
        let Self { turn, across, shift, .. } = *self;
        let degrees = f64::to_degrees;
        match () {
            () if turn <= MAX_STILL_TURN && shift <= MAX_STILL_SHIFT => {
                ("still", format!("show no movement of {against}"))
            }
            () if turn <= MAX_STILL_TURN => (
                "translation",
                format!("only translate {what} (it turns by at most {:.1}°)", degrees(turn)),
            ),
            () if across <= MAX_STILL_TURN => (
                "one-axis",
                format!(
                    "turn {against} about one axis only (by up to {:.0}°, about others by at most \
                     {:.1}°)",
                    degrees(turn),
                    degrees(across)
                ),
            ),
            () => ("other", "are too few or too alike".to_owned()),
        }
    }

    /// Adds the movement between some frames.
    fn widen(&mut self, views: &[Frame<f64>]) {
        let Some(first) = views.first() else { return };
        let turned = |view: &Frame<f64>| {
            let change = first.inverse().compose(view);
            let axes = Matrix3::from_columns(&change.axes);
            (Rotation3::from_matrix_unchecked(axes).scaled_axis(), change.origin.norm())
        };
        let turned: Vec<(Vector3<f64>, f64)> = views.iter().map(turned).collect();
        let spread: Matrix3<f64> = turned.iter().map(|(turn, _)| turn * turn.transpose()).sum();
        let eigen = SymmetricEigen::new(spread);
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        for (turn, shift) in &turned {
            let across = (turn - axis * axis.dot(turn)).norm();
            self.turn = self.turn.max(turn.norm());
            self.across = self.across.max(across);
            self.shift = self.shift.max(*shift);
        }
    }
}

/// Returns the movement of the cameras and markers for whose index `is_involved` returns true;
/// `None` if no row shows one of the markers to one of the cameras.
fn movement(fit: &CheckedFit, is_involved: impl Fn(usize) -> bool) -> Option<Movement> {
    let (model, x) = (fit.model(), fit.end.x.as_slice());
    let of_pose = |pose: &Pose| match pose.observation.fixtures() {
        [Some(camera), Some(marker)] if is_involved(camera) || is_involved(marker) => {
            Some([camera, marker])
        }
        _ => None,
    };
    let rows: Vec<Pose> =
        fit.whole.poses.iter().filter(|pose| of_pose(pose).is_some()).copied().collect();
    let carriers = model.carrier_frames(&rows, x);
    let fixtures = model.fixtures(x);
    let pairs: BTreeSet<[usize; 2]> = rows.iter().filter_map(of_pose).collect();
    let mut movement = Movement::default();
    let mut angles = Vec::new();
    for pair in &pairs {
        let of_pair = rows.iter().zip(&carriers).filter(|(pose, _)| of_pose(pose) == Some(*pair));
        let relative = |of: [&Frame<f64>; 2]| of[1].inverse().compose(of[0]);
        let views: Vec<Frame<f64>> = of_pair
            .filter_map(|(_, frames)| {
                frames.as_ref().map(|[camera, marker]| relative([camera, marker]))
            })
            .collect();
        movement.widen(&views);
        let [camera, marker] = pair.map(|fixture| &fixtures[fixture]);
        let points = &fit.problem.fixtures[pair[1]].points;
        let normal = marker_normal(points).map(|normal| marker.frame().vector(&normal));
        let angle = |view: &Frame<f64>| {
            let looks = view.compose(&camera.frame()).axes[2];
            normal.map_or(f64::INFINITY, |normal| normal.dot(&looks).abs().min(1.0).acos())
        };
        angles.extend(views.iter().map(angle));
    }
    let widest = angles.into_iter().fold(0.0, f64::max);
    movement.frontal = (widest <= MAX_FRONTAL_ANGLE).then_some(widest);
    (!pairs.is_empty()).then_some(movement)
}

/// Returns the unit normal of the plane of a marker's points; `None` if they lie on a line or in no
/// plane.
fn marker_normal(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (first, rest) = points.split_first()?;
    let along = rest.iter().map(|point| point - first).find(|along| along.norm() > 0.0)?;
    let normals = rest.iter().map(|point| along.cross(&(point - first)));
    let normal = normals.max_by(|a, b| a.norm().total_cmp(&b.norm()))?.try_normalize(1e-12)?;
    let size = rest.iter().map(|point| (point - first).norm()).fold(0.0, f64::max);
    let is_flat = rest.iter().all(|point| normal.dot(&(point - first)).abs() < 1e-3 * size);
    is_flat.then_some(normal)
}

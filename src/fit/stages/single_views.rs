//! Views by themselves: do the points of each image fit the marker, wherever it is?
//!
//! The pose of the marker in the camera's frame is fitted to each view without the arm. Views that
//! fit no pose show a mistake in camera or marker, such as a grid that is declared along its other
//! side; views that do fit leave the joints and the poses of camera and marker.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3};

use super::marker_pose::marker_in_camera;
use crate::model::{Model, Pose};
use crate::observation::{FixtureValues, slopes_of_pixel};
use crate::problem::Observation;

/// Largest deviation of the distance between neighbouring points of a grid, relative to it.
const MAX_GRID_ERROR: f64 = 1e-6;
/// Minimum number of points of a view that is fitted by itself.
const MIN_POINTS: usize = 6;
/// Number of corners of a tag.
const CORNERS: usize = 4;
/// Maximum number of views that are fitted by themselves.
const MAX_VIEWS: usize = 40;
/// Smallest rms error of views by themselves \[px\] that shows a mistake in camera or marker:
/// lenses that are not calibrated leave a few pixels.
const MIN_MISS: f64 = 10.0;
/// Largest ratio of the rms error with points counted along the other side to that as declared, at
/// which they are counted so.
const MAX_OTHER_RATIO: f64 = 0.2;

/// Largest rms error of views by themselves \[px\] that counts as such; beyond it, and where the
/// points fit no pose, it is taken as this.
const MAX_MISS: f64 = 100.0;

/// Median rms errors of views by themselves \[px\].
#[derive(Debug, Clone, Copy)]
pub(super) struct SingleViews {
    /// Median rms reprojection error of the views with the points as the table numbers them \[px\].
    pub declared: f64,
    /// Error with the points numbered in the other way that fits best.
    pub other: f64,
    /// That other way.
    pub numbering: Numbering,
}

/// Way in which a detector may number the points of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbering {
    /// Point k of the table is point k of the marker.
    Declared,
    /// Points of a grid are counted along its other side.
    Transposed,
    /// Two of the four corners of a tag are exchanged; the other orders of a square are turns of it.
    Exchanged([usize; 2]),
}

impl Numbering {
    /// Ways other than the declared one.
    pub const OTHERS: [Self; 3] =
        [Self::Transposed, Self::Exchanged([2, 3]), Self::Exchanged([1, 2])];

    /// Returns the number of the marker's point that has the number `point` in the table; `None` if
    /// the marker cannot be numbered so.
    pub fn of(self, points: &[Vector3<f64>], point: usize) -> Option<usize> {
        match self {
            Self::Declared => Some(point),
            // The grid of a tag looks the same along its other side.
            Self::Transposed => transposed(points, point).filter(|_| points.len() != CORNERS),
            Self::Exchanged([a, b]) => (points.len() == CORNERS).then_some(match point {
                _ if point == a => b,
                _ if point == b => a,
                _ => point,
            }),
        }
    }
}

impl SingleViews {
    /// Fits the marker's pose to each view in `poses` at the full parameter vector `x`. `None`
    /// without a view of enough points.
    pub fn of(model: &Model, poses: &[Pose], x: &DVector<f64>) -> Option<Self> {
        let fixtures = model.fixtures(x.as_slice());
        let mut views: BTreeMap<_, Vec<&Pose>> = BTreeMap::new();
        for pose in poses {
            let [Some(camera), Some(marker)] = pose.observation.fixtures() else { continue };
            if matches!(pose.observation, Observation::Pixel(..)) {
                let bits: Vec<u64> = pose.setup.configuration.iter().map(|q| q.to_bits()).collect();
                views.entry((camera, marker, pose.base, bits)).or_default().push(pose);
            }
        }
        let views: Vec<((usize, usize), Vec<&Pose>)> = views
            .into_iter()
            .filter(|((_, marker, ..), view)| {
                let is_tag = model.marker_points(*marker).len() == CORNERS;
                view.len() >= if is_tag { CORNERS } else { MIN_POINTS }
            })
            .map(|((camera, marker, ..), view)| ((camera, marker), view))
            .collect();
        let step = views.len().div_ceil(MAX_VIEWS).max(1);
        let errors = |numbering: Numbering| {
            let error = |((camera, marker), view): &((usize, usize), Vec<&Pose>)| {
                let points = model.marker_points(*marker);
                let point = |pose: &&Pose| {
                    let number = numbering.of(points, pose.observation.point()?)?;
                    Some((*points.get(number)?, [pose.measured.x, pose.measured.y]))
                };
                let points: Option<Vec<_>> = view.iter().map(point).collect();
                points.map_or(f64::INFINITY, |points| view_error(&fixtures[*camera], &points))
            };
            median(views.iter().step_by(step).map(error).collect())
        };
        let declared = errors(Numbering::Declared)?;
        let others = Numbering::OTHERS.map(|numbering| (errors(numbering), numbering));
        let (other, numbering) = others
            .into_iter()
            .filter_map(|(error, numbering)| Some((error?, numbering)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Self { declared, other, numbering })
    }

    /// Returns the largest number of points of one camera and marker in one configuration among
    /// `poses`.
    pub fn most_points(poses: &[Pose]) -> usize {
        let mut counts: BTreeMap<_, usize> = BTreeMap::new();
        for pose in poses {
            let bits: Vec<u64> = pose.setup.configuration.iter().map(|q| q.to_bits()).collect();
            *counts.entry((pose.observation.fixtures(), pose.base, bits)).or_default() += 1;
        }
        counts.into_values().max().unwrap_or(0)
    }

    /// Returns true if the points of most views fit no pose of the marker.
    pub fn miss_the_marker(self) -> bool {
        self.declared > MIN_MISS
    }

    /// Returns true if the points of most views fit the marker once they are numbered in the other
    /// way.
    pub fn are_renumbered(self) -> bool {
        self.miss_the_marker() && self.other < MAX_OTHER_RATIO * self.declared.min(MAX_MISS)
    }
}

/// Returns the rms error of a view by itself \[px\]; infinite if its points fit no pose.
fn view_error(camera: &FixtureValues<f64>, points: &[(Vector3<f64>, [f64; 2])]) -> f64 {
    let Some(pose) = marker_in_camera(camera, points) else { return f64::INFINITY };
    let [_, _, _, _, _, _, fx, fy, ..] = camera.numbers;
    let square = |(place, pixel): &(Vector3<f64>, [f64; 2])| {
        let at = pose.rotation * place + pose.translation.vector;
        let [x, y] = slopes_of_pixel(camera, *pixel);
        (fx * (x - at.x / at.z)).powi(2) + (fy * (y - at.y / at.z)).powi(2)
    };
    (points.iter().map(square).sum::<f64>() / points.len().max(1) as f64).sqrt()
}

/// Returns the median; `None` of no numbers.
fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

/// Returns the number of the point that has the number `point` if a grid is counted along its other
/// side; `None` if the points form no grid that is numbered row by row.
///
/// With R rows of C points, point r C + c of the file has the number c R + r.
fn transposed(points: &[Vector3<f64>], point: usize) -> Option<usize> {
    let [rows, columns] = grid(points)?;
    Some(point % rows * columns + point / rows)
}

/// Returns the number of the point that has the number `point` if a grid is declared by its squares
/// and a detector counts the corners between them, one fewer in each row and column; `None` if the
/// points form no grid that is numbered row by row, or if it has no such corner.
pub(in crate::fit) fn between_squares(points: &[Vector3<f64>], point: usize) -> Option<usize> {
    let [rows, columns] = grid(points)?;
    let inner = columns.checked_sub(1).filter(|inner| *inner > 1)?;
    (point < inner * (rows - 1)).then_some(point / inner * columns + point % inner)
}

/// Returns the numbers of rows and columns of a grid that is numbered row by row; `None` for other
/// points.
fn grid(points: &[Vector3<f64>]) -> Option<[usize; 2]> {
    let step = points.get(1)? - points[0];
    let is_next =
        |pair: &&[Vector3<f64>]| (pair[1] - pair[0] - step).norm() <= MAX_GRID_ERROR * step.norm();
    let columns = 1 + points.windows(2).take_while(is_next).count();
    let rows = points.len() / columns;
    (rows > 1 && rows * columns == points.len()).then_some([rows, columns])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_between_squares_are_points_of_the_grid() {
        let points: Vec<Vector3<f64>> =
            (0..12).map(|k| Vector3::new(f64::from(k % 4), f64::from(k / 4), 0.0)).collect();
        let meant: Vec<Option<usize>> = (0..7).map(|k| between_squares(&points, k)).collect();
        let corners = [0, 1, 2, 4, 5, 6].map(Some);
        assert_eq!(meant, [&corners[..], &[None]].concat());
        assert_eq!(between_squares(&points[..5], 0), None);
    }
}

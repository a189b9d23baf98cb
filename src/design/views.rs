//! Configurations that cameras measure: the points of markers in view, and their sensitivity.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::Sensitivity;
use crate::measurement::Measurements;
use crate::model::{Model, Pose};
use crate::observation::{FixtureValues, Scene};
use crate::problem::{Fixture, Observation, Problem};
use crate::quantity::Unit;
use crate::spatial::Frame;

/// Smallest cosine of the angle between the line of sight and the normal of a flat marker at which
/// detectors find its points: 60°.
const MIN_COS_INCIDENCE: f64 = 0.5;
/// Largest ratio of the smallest to the largest spread of a marker's points at which the marker
/// counts as flat. The second largest spread must exceed this ratio.
const MAX_FLAT_RATIO: f64 = 0.05;
/// Maximum number of points of a view whose derivatives represent all its points in the search for
/// poses.
const SEARCH_POINTS: usize = 8;
/// Maximum number of points of a view whose derivatives represent all its points in forecasts.
const FORECAST_POINTS: usize = 60;
/// Number of rows to which the views of a configuration are compressed in the search. Six suffice
/// for a pose; six more are for a lens or a second view.
pub(super) const COMPRESSED_ROWS: usize = 12;
/// Deviations that make unknowns of different units comparable when views are compressed: of
/// lengths \[m\], angles \[rad\], pixels, and distortion coefficients.
const UNKNOWN_SCALES: [f64; 4] = [1e-3, 1e-3, 1.0, 1e-2];

/// Factors on the smallest and the largest measured distance between camera and marker that bound
/// the distances of planned views.
const DISTANCE_RANGE: [f64; 2] = [0.7, 1.5];

/// Condition on the views of a camera and a marker that detectors find.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ViewRule {
    /// Smallest number of points in view: that of the measured views, or else all points of the
    /// marker, because a detector of chessboards finds all corners or none.
    least_points: usize,
    /// Sign of the cosine between the line of sight and the marker's normal in the measured views;
    /// `None` if it is unknown or if the marker is not flat.
    side: Option<f64>,
    /// Smallest and largest distance between the camera and the middle of the marker \[m\].
    distances: [f64; 2],
}

/// Returns the condition on views of each pair, from the measured pixels among `poses`.
pub(super) fn rules(
    (problem, model): (&Problem, &Model),
    pairs: &[(usize, usize)],
    (poses, at): (&[Pose], &DVector<f64>),
) -> Vec<ViewRule> {
    let fixtures = model.fixtures(at.as_slice());
    let of_pair = |&(camera, marker): &(usize, usize)| {
        let points = &problem.fixtures[marker].points;
        let is_of_pair = |pose: &&Pose| match pose.observation {
            Observation::Pixel(of, seen, _) => (of as usize, seen as usize) == (camera, marker),
            _ => false,
        };
        let pixels: Vec<Pose> = poses.iter().filter(is_of_pair).copied().collect();
        // Rows of one view follow each other.
        let views: Vec<&[Pose]> = pixels
            .chunk_by(|a, b| a.setup.configuration == b.setup.configuration && a.base == b.base)
            .collect();
        let firsts: Vec<Pose> = views.iter().filter_map(|view| view.first().copied()).collect();
        let carriers = model.carrier_frames(&firsts, at.as_slice());
        let (middle, normal) = (middle(points), normal(points));
        let seen: Vec<(f64, Option<f64>)> = carriers
            .iter()
            .flatten()
            .map(|carriers| {
                let view = View {
                    lens: fixtures[camera],
                    marker: fixtures[marker],
                    carriers: *carriers,
                    normal,
                    image: [0.0, 0.0],
                };
                let sight = view.sight(middle);
                (sight.norm(), view.cos_incidence(&sight).map(f64::signum))
            })
            .collect();
        let far = |a: f64, b: &(f64, Option<f64>)| a.max(b.0);
        let near = |a: f64, b: &(f64, Option<f64>)| a.min(b.0);
        let fronts = seen.iter().filter_map(|(_, side)| *side).sum::<f64>();
        let range = [
            DISTANCE_RANGE[0] * seen.iter().fold(f64::INFINITY, near),
            DISTANCE_RANGE[1] * seen.iter().fold(0.0, far),
        ];
        ViewRule {
            least_points: views.iter().map(|view| view.len()).min().unwrap_or(points.len()).max(1),
            side: (fronts != 0.0).then(|| fronts.signum()),
            distances: if seen.is_empty() { [0.0, f64::INFINITY] } else { range },
        }
    };
    pairs.iter().map(of_pair).collect()
}

/// Returns the mean of points; zero for none.
fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

/// Returns the pairs of a camera and a marker on different carriers, as fixture indices. The list
/// is empty if σ of positions is declared or if rows of `table` state what they measure.
pub(super) fn pairs(problem: &Problem, table: &Measurements) -> Vec<(usize, usize)> {
    let are_plain = (0..table.len()).all(|row| table.observation(row).is_position());
    if problem.data.position_sigma.is_some() || !are_plain {
        return Vec::new();
    }
    let of = |word: &'static str| {
        let of_word = move |(_, fixture): &(usize, &Fixture)| fixture.kind.word() == word;
        problem.fixtures.iter().enumerate().filter(of_word)
    };
    let sees = |camera: &Fixture, marker: &Fixture| camera.carrier != marker.carrier;
    of("camera")
        .flat_map(|(camera, its)| {
            of("marker").filter_map(move |(marker, of)| sees(its, of).then_some((camera, marker)))
        })
        .collect()
}

/// Returns the points of markers in view in each of `poses` at the full parameter vector `at`, as
/// poses that measure pixels. Of each view at most `most` points are returned, whose σ is reduced
/// so that they inform as much as all points in view. Views that do not meet the rule of their pair
/// are left out; without `rules`, each point in view counts.
fn in_view<'a>(
    (problem, model): (&Problem, &Model),
    (pairs, rules): (&[(usize, usize)], Option<&[ViewRule]>),
    (poses, at): (&[Pose<'a>], &DVector<f64>),
    most: usize,
) -> Vec<Vec<Pose<'a>>> {
    let pixel = |&(camera, marker): &(usize, usize), point: usize| {
        let index = |index: usize| u32::try_from(index).unwrap_or(u32::MAX);
        Observation::Pixel(index(camera), index(marker), index(point))
    };
    let of_pair = |pose: &Pose<'a>, pair, point| Pose { observation: pixel(pair, point), ..*pose };
    let firsts: Vec<Pose> = poses
        .iter()
        .flat_map(|pose| pairs.iter().map(move |pair| of_pair(pose, pair, 0)))
        .collect();
    let carriers = model.carrier_frames(&firsts, at.as_slice());
    let fixtures = model.fixtures(at.as_slice());
    let normals: Vec<Option<Vector3<f64>>> =
        problem.fixtures.iter().map(|fixture| normal(&fixture.points)).collect();
    let of_pose = |(k, pose): (usize, &Pose<'a>)| {
        let mut seen = Vec::new();
        for (place, (pair, carriers)) in pairs.iter().zip(&carriers[k * pairs.len()..]).enumerate()
        {
            let (camera, marker) = (&problem.fixtures[pair.0], &problem.fixtures[pair.1]);
            let Some(carriers) = carriers else { continue };
            let view = View {
                lens: fixtures[pair.0],
                marker: fixtures[pair.1],
                carriers: *carriers,
                normal: normals[pair.1],
                image: camera.image.unwrap_or_else(|| {
                    let [_, _, _, _, _, _, _, _, cx, cy, ..] = fixtures[pair.0].numbers;
                    [2.0 * cx, 2.0 * cy]
                }),
            };
            let rule = rules.and_then(|rules| rules.get(place));
            if rule.is_some_and(|rule| !rule.admits(&view, &marker.points)) {
                continue;
            }
            let visible: Vec<usize> = (0..marker.points.len())
                .filter(|&point| view.shows(pixel(pair, point), marker.points[point]))
                .collect();
            if rule.is_some_and(|rule| visible.len() < rule.least_points) {
                continue;
            }
            let used = visible.len().min(most);
            let weight = (used as f64 / visible.len().max(1) as f64).sqrt();
            let sigma = camera.sigma.unwrap_or(1.0) * weight;
            seen.extend((0..used).map(|k| {
                let point = visible[(2 * k + 1) * visible.len() / (2 * used)];
                Pose { sigma, orientation: None, ..of_pair(pose, pair, point) }
            }));
        }
        seen
    };
    poses.iter().enumerate().map(of_pose).collect()
}

impl ViewRule {
    /// Returns true if the camera of a view is on the right side of a marker with these `points`,
    /// at a distance within those of the rule.
    fn admits(&self, view: &View, points: &[Vector3<f64>]) -> bool {
        let sight = view.sight(middle(points));
        let [near, far] = self.distances;
        let is_on_side = self
            .side
            .is_none_or(|side| view.cos_incidence(&sight).is_none_or(|cos| cos * side > 0.0));
        is_on_side && (near..=far).contains(&sight.norm())
    }
}

/// View of a marker by a camera.
struct View {
    lens: FixtureValues<f64>,
    marker: FixtureValues<f64>,
    /// Frames that camera and marker move with.
    carriers: [Frame<f64>; 2],
    /// Normal of a flat marker, marker frame; `None` for points in space.
    normal: Option<Vector3<f64>>,
    /// Width and height of the image \[px\].
    image: [f64; 2],
}

impl View {
    /// Returns true if a point (marker frame) is in front of the camera and in its image. The line
    /// of sight must also make at most 60° with the marker's normal.
    fn shows(&self, pixel: Observation, point: Vector3<f64>) -> bool {
        let Self { lens, marker, carriers, .. } = self;
        let fixtures = [*lens, *marker];
        let scene = Scene { fixtures, carriers: *carriers, point, ..Scene::default() };
        let seen = pixel.predict(&scene);
        let [width, height] = self.image;
        let is_in_image = (0.0..width).contains(&seen.x) && (0.0..height).contains(&seen.y);
        let cos = self.cos_incidence(&self.sight(point));
        is_in_image && cos.is_none_or(|cos| cos.abs() >= MIN_COS_INCIDENCE)
    }

    /// Returns the vector from the camera to a point (marker frame), measuring frame \[m\].
    fn sight(&self, point: Vector3<f64>) -> Vector3<f64> {
        let Self { lens, marker, carriers, .. } = self;
        let place = carriers[1].point(&marker.frame().point(&point));
        place - carriers[0].point(&lens.position())
    }

    /// Returns the cosine of the angle between a line of sight and the normal of a flat marker;
    /// `None` for points in space.
    fn cos_incidence(&self, sight: &Vector3<f64>) -> Option<f64> {
        let normal = self.marker.frame().vector(&self.normal?);
        Some(self.carriers[1].vector(&normal).dot(&sight.normalize()))
    }
}

/// Returns the unit normal of points in a plane; `None` for points on a line, and for points in
/// space.
fn normal(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let middle = middle(points);
    let spread: Matrix3<f64> =
        points.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let [first, second, third] = order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt());
    let is_flat = second > MAX_FLAT_RATIO * first && third < MAX_FLAT_RATIO * first;
    is_flat.then(|| eigen.eigenvectors.column(order[2]).into_owned())
}

/// Returns the indices of the poses in which a view of one of the `pairs` meets its rule.
pub(super) fn seen(
    of_site: (&Problem, &Model),
    (pairs, rules): (&[(usize, usize)], &[ViewRule]),
    (poses, at): (&[Pose], &DVector<f64>),
) -> Vec<usize> {
    let views = in_view(of_site, (pairs, Some(rules)), (poses, at), 1);
    (0..poses.len()).filter(|&pose| !views[pose].is_empty()).collect()
}

/// Returns the sensitivity of all points in view in some configurations, as rows of one table.
pub(super) fn all_points(
    (problem, model): (&Problem, &Model),
    pairs: &[(usize, usize)],
    (poses, at): (&[Pose], &DVector<f64>),
) -> Sensitivity {
    let seen = in_view((problem, model), (pairs, None), (poses, at), FORECAST_POINTS).concat();
    Sensitivity::of(model, &seen, at)
}

/// Returns the sensitivity of configurations, each compressed to the [`COMPRESSED_ROWS`] directions
/// that its views determine best; not finite for a configuration without a view that meets the
/// `rules`.
pub(super) fn compressed(
    (problem, model): (&Problem, &Model),
    (pairs, rules): (&[(usize, usize)], Option<&[ViewRule]>),
    (poses, at): (&[Pose], &DVector<f64>),
) -> Sensitivity {
    let n = model.parameters.len();
    let size = |unit: Unit| match unit {
        Unit::Length => UNKNOWN_SCALES[0],
        Unit::Angle => UNKNOWN_SCALES[1],
        Unit::Pixel => UNKNOWN_SCALES[2],
        _ => UNKNOWN_SCALES[3],
    };
    let sizes = DVector::from_iterator(n, model.parameters.iter().map(|p| size(p.unit())));
    let views = in_view((problem, model), (pairs, rules), (poses, at), SEARCH_POINTS);
    let sensitivity = Sensitivity::of(model, &views.concat(), at);
    let starts = views.iter().scan(0, |next, view| {
        let start = *next;
        *next += view.len();
        Some(start)
    });
    let starts: Vec<usize> = starts.collect();
    let columns: Vec<DMatrix<f64>> = views
        .par_iter()
        .zip(starts)
        .map(|(view, start)| {
            if view.is_empty() {
                return DMatrix::from_element(n, COMPRESSED_ROWS, f64::NAN);
            }
            // A pixel has two numbers; the third row of a pose is zero.
            let of_pose = sensitivity.coordinates;
            let rows: Vec<usize> = (start..start + view.len())
                .flat_map(|pose| [of_pose * pose, of_pose * pose + 1])
                .collect();
            let rows = sensitivity.rows.select_columns(&rows);
            let mut scaled = rows.clone();
            scaled.column_iter_mut().for_each(|mut column| column.component_mul_assign(&sizes));
            let eigen = scaled.tr_mul(&scaled).symmetric_eigen();
            let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
            order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
            let mut columns = DMatrix::zeros(n, COMPRESSED_ROWS);
            for (mut column, k) in columns.column_iter_mut().zip(order) {
                column.copy_from(&(&rows * eigen.eigenvectors.column(k)));
            }
            columns
        })
        .collect();
    let mut rows = DMatrix::zeros(n, COMPRESSED_ROWS * views.len());
    for (k, columns) in columns.iter().enumerate() {
        rows.columns_mut(COMPRESSED_ROWS * k, COMPRESSED_ROWS).copy_from(columns);
    }
    Sensitivity { rows, coordinates: COMPRESSED_ROWS }
}

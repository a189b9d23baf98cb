//! Misreadings of images.

use nalgebra::Vector3;

use super::candidates::MAX_OTHER_CARRIERS;
use super::{Misreading, counted};
use crate::fit::stages::single_views::{Numbering, between_squares};
use crate::measurement::Measurements;
use crate::observation::FixtureKind;
use crate::problem::fixture::carrier_word;
use crate::problem::{Fixture, Observation, Problem};

/// Returns true if the leading rows of the table are pixels.
pub(in crate::fit) fn is_of_views(table: &Measurements) -> bool {
    table.leading().kind() == Observation::Pixel(0, 0, 0).kind()
}

/// Returns the misreadings of images: exchanged or reversed axes, the numbering of the points,
/// images that are shifted against the configurations, and other carriers of cameras and markers.
pub(super) fn of_images(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let exchanged = Misreading::of_rows("columns u and v that are exchanged", |rows| {
        for_each_pixel(rows, |_, pixel| pixel.swap_rows(0, 1));
    });
    let heights: Vec<Option<f64>> =
        (0..problem.fixtures.len()).map(|camera| image_height(problem, camera)).collect();
    let from_bottom = "a column v that counts from the bottom of the image (write height − v)";
    let from_bottom = Misreading::of_rows(from_bottom, move |rows| {
        for_each_pixel(rows, |[camera, ..], pixel| {
            if let Some(height) = heights.get(*camera as usize).copied().flatten() {
                pixel.y = height - pixel.y;
            }
        });
    });
    let mut misreadings = vec![exchanged, from_bottom];
    let markers: Vec<Vec<Vector3<f64>>> =
        problem.fixtures.iter().map(|marker| marker.points.clone()).collect();
    for numbering in Numbering::OTHERS {
        if markers.iter().any(|points| numbering.of(points, 0).is_some()) {
            let words = match numbering {
                Numbering::Exchanged([a, b]) => format!(
                    "corners {a} and {b} of a tag that are exchanged (points_mm crosses it, detectors \
                     go round)"
                ),
                _ => "points of the marker that are numbered along the other side (its rows and \
                      columns exchanged)"
                    .to_owned(),
            };
            let of = renumbered(words, &markers, move |points, point| numbering.of(points, point));
            misreadings.push(of.in_group("numbering"));
        }
    }
    misreadings.extend([-1, 1].map(of_shifted_views));
    let is_first = |row| matches!(table.observation(row), Observation::Pixel(.., 0));
    if !(0..table.len()).any(is_first) {
        let words = "points of the marker that are numbered from 1 (point counts from 0)";
        misreadings.push(Misreading::of_rows(words, |rows| {
            for_each_pixel(rows, |[.., point], _| *point = point.saturating_sub(1));
        }));
    }
    let is_inner = |row: usize| {
        let Observation::Pixel(_, marker, point) = table.observation(row) else { return true };
        let marker = problem.fixtures.get(marker as usize);
        marker.is_some_and(|of| between_squares(&of.points, point as usize).is_some())
    };
    if (0..table.len()).all(is_inner) {
        let words = "points_mm that count the squares of the board (declare its inner corners)";
        misreadings.push(renumbered(words.to_owned(), &markers, between_squares));
    }
    misreadings.extend(of_mounts(problem));
    misreadings
}

/// Returns the misreadings of the frames that carry cameras and markers.
fn of_mounts(problem: &Problem) -> Vec<Misreading> {
    let of_kind = |wanted: FixtureKind| {
        let fixtures = problem.fixtures.iter().enumerate();
        fixtures.filter(move |(_, fixture)| fixture.kind == wanted)
    };
    let mut misreadings = Vec::new();
    for (index, fixture) in of_kind(FixtureKind::Camera).chain(of_kind(FixtureKind::Marker)) {
        let Some(carrier) = fixture.carrier.filter(|carrier| *carrier > 0) else { continue };
        let last = (carrier + MAX_OTHER_CARRIERS).min(problem.joints.len());
        let others = carrier.saturating_sub(MAX_OTHER_CARRIERS).max(1)..=last;
        misreadings.extend(others.filter(|frame| *frame != carrier).map(|frame| {
            let on = format!("on the frame of joint {frame}");
            let mounted = Fixture { carrier: Some(frame), ..fixture.clone() };
            let located =
                format!("\"{}\" {on} (on = \"{}\")", fixture.name, carrier_word(problem, &mounted));
            let mounted =
                Misreading::of_problem(format!("a camera or marker {on}"), move |problem| {
                    problem.fixtures.get_mut(index)?.carrier = Some(frame);
                    Some(())
                });
            mounted.located(Some(located))
        }));
    }
    for (index, camera) in of_kind(FixtureKind::Camera) {
        let markers = of_kind(FixtureKind::Marker);
        let others = markers.filter(|(_, marker)| marker.carrier != camera.carrier);
        misreadings.extend(others.map(|(with, marker)| {
            let words = "a camera and a marker with exchanged frames";
            let exchanged = Misreading::of_problem(words, move |problem| {
                let [first, second] =
                    [index, with].map(|index| problem.fixtures.get(index)?.carrier);
                problem.fixtures.get_mut(index)?.carrier = second;
                problem.fixtures.get_mut(with)?.carrier = first;
                Some(())
            });
            exchanged.located(Some(format!(
                "\"{}\" and \"{}\" with exchanged frames (on = …)",
                camera.name, marker.name
            )))
        }));
    }
    misreadings
}

/// Returns the misreading of the numbers of points, which `number` corrects for a marker of some
/// points; `None` stays.
fn renumbered(
    words: String,
    markers: &[Vec<Vector3<f64>>],
    number: impl Fn(&[Vector3<f64>], usize) -> Option<usize> + Send + Sync + 'static,
) -> Misreading {
    let markers = markers.to_vec();
    Misreading::of_rows(words, move |rows| {
        for_each_pixel(rows, |[_, marker, point], _| {
            let points = markers.get(*marker as usize);
            let other = points.and_then(|points| number(points, *point as usize));
            *point = other.and_then(|other| u32::try_from(other).ok()).unwrap_or(*point);
        });
    })
}

/// Calls `correct` with camera, marker and point of each row that measures a pixel, and the pixel.
fn for_each_pixel(rows: &mut Measurements, correct: impl Fn([&mut u32; 3], &mut Vector3<f64>)) {
    for (observation, pixel) in rows.observations.iter_mut().zip(&mut rows.positions) {
        if let Observation::Pixel(camera, marker, point) = observation {
            correct([camera, marker, point], pixel);
        }
    }
}

/// Index of the vertical image centre in the numbers of a camera.
const CENTRE_Y: usize = 9;

/// Returns the height of a camera's image \[px\]: the declared one, or twice the vertical centre.
/// `None` if neither is declared.
fn image_height(problem: &Problem, camera: usize) -> Option<f64> {
    let camera = problem.fixtures.get(camera)?;
    let centre = camera.known.get(CENTRE_Y).copied().flatten();
    camera.image.map(|[_, height]| height).or(centre.map(|centre| 2.0 * centre))
}

/// Returns the misreading that images belong to the configuration of the view that comes `by` views
/// earlier. A view is a run of rows with one configuration; at the ends of the table, a row keeps its
/// configuration.
fn of_shifted_views(by: i8) -> Misreading {
    let side = if by > 0 { "before" } else { "after" };
    let views = counted(by.unsigned_abs(), "view");
    let words = format!("images that belong to the configuration {views} {side}");
    let shifted = Misreading::of_order(words, move |table, chosen| {
        let mut rows = table.select(chosen);
        let starts: Vec<usize> = (0..table.len())
            .filter(|&row| row == 0 || table.configuration(row) != table.configuration(row - 1))
            .collect();
        let joints = rows.joints.max(1);
        for (q, &row) in rows.configurations.chunks_exact_mut(joints).zip(chosen) {
            let view = starts.partition_point(|&start| start <= row).saturating_sub(1);
            let source = view.checked_add_signed(-isize::from(by));
            if let Some(&source) = source.and_then(|view| starts.get(view)) {
                q.copy_from_slice(table.configuration(source));
            }
        }
        rows
    });
    shifted.in_group("shift of views")
}

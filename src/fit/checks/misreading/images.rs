//! Misreadings of images: their candidates, and tables as they should have been read.

use super::Misreading;
use super::candidates::MAX_OTHER_CARRIERS;
use crate::fit::stages::single_views::{Numbering, between_squares};
use crate::measurement::Measurements;
use crate::observation::FixtureKind;
use crate::problem::{Fixture, Observation, Problem};

/// Returns true if the leading rows of the table are pixels.
pub(in crate::fit) fn is_of_views(table: &Measurements) -> bool {
    table.leading().kind() == Observation::Pixel(0, 0, 0).kind()
}

/// Returns the misreadings of images: exchanged or reversed axes, the numbering of the points,
/// images that are shifted against the configurations, and other carriers of cameras and markers.
pub(super) fn of_images(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let is_first = |row| matches!(table.observation(row), Observation::Pixel(.., 0));
    let from_one = (!(0..table.len()).any(is_first)).then_some(Misreading::FromOne);
    let is_inner = |row: usize| {
        let Observation::Pixel(_, marker, point) = table.observation(row) else { return true };
        let marker = problem.fixtures.get(marker as usize);
        marker.is_some_and(|of| between_squares(&of.points, point as usize).is_some())
    };
    let squares = (0..table.len()).all(is_inner).then_some(Misreading::Squares);
    let from_one = from_one.into_iter().chain(squares);
    let shifts = [-1, 1].map(|by| Misreading::ShiftedViews { by });
    let axes = [Misreading::ExchangedAxes, Misreading::FromBottom];
    let markers = || problem.fixtures.iter().map(|marker| &marker.points[..]);
    let is_possible = |numbering: &Numbering| markers().any(|of| numbering.of(of, 0).is_some());
    let numberings = Numbering::OTHERS.into_iter().filter(is_possible).map(Misreading::Renumbered);
    let mut misreadings: Vec<Misreading> =
        axes.into_iter().chain(numberings).chain(shifts).chain(from_one).collect();
    let of_kind = |wanted: FixtureKind| {
        let fixtures = problem.fixtures.iter().enumerate();
        fixtures.filter(move |(_, fixture)| fixture.kind == wanted)
    };
    let mounted = of_kind(FixtureKind::Camera).chain(of_kind(FixtureKind::Marker));
    for (fixture, Fixture { carrier, .. }) in mounted {
        let Some(carrier) = carrier.filter(|carrier| *carrier > 0) else { continue };
        let last = (carrier + MAX_OTHER_CARRIERS).min(problem.joints.len());
        let others = carrier.saturating_sub(MAX_OTHER_CARRIERS).max(1)..=last;
        let others = others.filter(|frame| *frame != carrier);
        misreadings.extend(others.map(|frame| Misreading::Mounted { fixture, frame }));
    }
    for (fixture, camera) in of_kind(FixtureKind::Camera) {
        let markers = of_kind(FixtureKind::Marker);
        let others = markers.filter(|(_, marker)| marker.carrier != camera.carrier);
        misreadings.extend(others.map(|(with, _)| Misreading::ExchangedMounts { fixture, with }));
    }
    misreadings
}

impl Misreading {
    /// Corrects the pixels of images, or the numbers of their points, by the misreading.
    pub(super) fn undo_image(self, rows: &mut Measurements, problem: &Problem) {
        for (observation, pixel) in rows.observations.iter_mut().zip(&mut rows.positions) {
            let Observation::Pixel(camera, marker, point) = *observation else { continue };
            match self {
                Self::ExchangedAxes => pixel.swap_rows(0, 1),
                Self::FromOne => {
                    *observation = Observation::Pixel(camera, marker, point.saturating_sub(1));
                }
                Self::FromBottom => {
                    if let Some(height) = image_height(problem, camera as usize) {
                        pixel.y = height - pixel.y;
                    }
                }
                Self::Renumbered(_) | Self::Squares => {
                    let points = problem.fixtures.get(marker as usize).map(|of| &of.points[..]);
                    let other = points.and_then(|points| match self {
                        Self::Renumbered(numbering) => numbering.of(points, point as usize),
                        _ => between_squares(points, point as usize),
                    });
                    if let Some(other) = other.and_then(|other| u32::try_from(other).ok()) {
                        *observation = Observation::Pixel(camera, marker, other);
                    }
                }
                _ => {}
            }
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

/// Gives each of the `chosen` rows of `table` the configuration of the view that comes `by` views
/// earlier. A view is a run of rows with one configuration; at the ends of the table, a row keeps
/// its configuration.
pub(super) fn shift_views(
    rows: &mut Measurements,
    table: &Measurements,
    (chosen, by): (&[usize], i8),
) {
    let starts: Vec<usize> = (0..table.len())
        .filter(|&row| row == 0 || table.configuration(row) != table.configuration(row - 1))
        .collect();
    let joints = rows.joints.max(1);
    for (q, &row) in rows.configurations.chunks_exact_mut(joints).zip(chosen) {
        let view = starts.partition_point(|&start| start <= row).saturating_sub(1);
        let source = view.checked_add_signed(-isize::from(by)).and_then(|view| starts.get(view));
        if let Some(&source) = source {
            q.copy_from_slice(table.configuration(source));
        }
    }
}

/// Returns the name of a camera or marker.
pub(super) fn name_of_fixture(problem: &Problem, fixture: usize) -> String {
    problem.fixtures.get(fixture).map_or_else(String::new, |of| format!("\"{}\"", of.name))
}

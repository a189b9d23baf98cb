//! Search for misreadings of tables of images.
//!
//! Each view gives the pose of its marker in the camera's frame, and from these follow poses of
//! camera and marker on which most views agree. Misreadings are compared by the error that remains
//! then, so that hundreds are tried without a fit.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use nalgebra::DVector;

use super::Misreading;
use super::candidates::of_arm;
use super::explanation::Explanations;
use super::images::{is_of_views, of_images};
use super::reversed::several_reversed;
use super::search::{MAX_EXPLAINED_RATIO, Trial, explanations, near_misreadings};
use crate::error::{InputError, InputErrorKind};
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::nominal_error::MAX_NOMINAL_MISS;
use crate::fit::checks::row_kind::spread;
use crate::fit::checks::view_order::views;
use crate::fit::stages::fitting::Fitting;
use crate::fit::stages::stage::StageError;
use crate::numeric::{parallel, spaced};
use crate::problem::Problem;

/// Maximum number of views, evenly spaced, to which misreadings are applied.
const MAX_VIEWS: usize = 15;
/// Minimum number of points of such a view.
const MIN_POINTS: usize = 4;
/// Number of directions of the image of which the outermost points of a view are taken.
const DIRECTIONS: u8 = 8;
/// Maximum number of misreadings that are fitted in full.
const MAX_FITTED: usize = 4;
/// Number of steps of the trial of a fit that starts far from its images. Fits of images converge in
/// 5 to 15 steps from a nominal arm that is read as it was meant.
const TRIAL_STEPS: u64 = 30;
/// Largest ratio of the error after these steps to that before them, at which the fit goes on.
const MAX_GAINED_RATIO: f64 = 0.5;

impl CheckedFit<'_> {
    /// Returns the misreadings of table or problem that explain the misfit; the first call searches
    /// for them.
    pub fn explanations(&self) -> &Explanations {
        self.explanations.get_or_init(|| {
            let has_views = is_of_views(self.fitting.measurements);
            if has_views && !rows_of_views(self.fitting).is_empty() {
                explanations_of_views(self)
            } else {
                explanations(self)
            }
        })
    }
}

/// Returns the start of a fit of images: `begin`. If the nominal arm is far from most of them there,
/// a trial is made first; if it gains too little and stays far from the images, the fit starts where
/// it ends and is limited to one step, because more would not lead to them.
pub(in crate::fit) fn start_of_fit(
    fitting: &mut Fitting,
    begin: DVector<f64>,
) -> Result<DVector<f64>, StageError> {
    let (table, rows) = (fitting.measurements, fitting.leading_rows());
    if !is_of_views(table) {
        return Ok(begin);
    }
    let far =
        MAX_NOMINAL_MISS * spread(fitting.placement, &rows, |place| table.positions[rows[place]]);
    let before = fitting.typical_error(&begin);
    if before <= far {
        return Ok(begin);
    }
    let limit = fitting.max_steps;
    fitting.max_steps = Some(limit.map_or(TRIAL_STEPS, |limit| limit.min(TRIAL_STEPS)));
    let end = fitting.run(&begin)?;
    fitting.max_steps = limit;
    let after = fitting.typical_error(&end.x);
    if after > far.max(MAX_GAINED_RATIO * before) && !end.termination.converged() {
        fitting.max_steps = Some(limit.map_or(1, |limit| limit.min(1)));
        return Ok(end.x);
    }
    Ok(begin)
}

/// Adds the misreadings with which the images fit to an error about a point behind its camera;
/// returns any other error as it is.
pub(in crate::fit) fn with_readings(
    fitting: &Fitting,
    problem: &Problem,
    error: InputError,
) -> InputError {
    match *error.kind {
        InputErrorKind::PointBehindCamera { fits, miss, few, .. }
            if is_of_views(fitting.measurements) =>
        {
            let near = near_in_views(fitting, problem).near;
            let readings = near.iter().take(MAX_FITTED).map(|found| found.described(None));
            let readings = readings.collect();
            error.location.error(InputErrorKind::PointBehindCamera { fits, miss, few, readings })
        }
        kind => error.location.error(kind),
    }
}

/// Finds the misreadings that explain why a fit does not agree with its images.
fn explanations_of_views(fit: &CheckedFit) -> Explanations {
    let mut found = near_in_views(fit.fitting, fit.problem);
    let trial = Trial::of_rows(fit.fitting, fit.problem, rows_of_views(fit.fitting));
    found.as_read = trial.error_as_read(fit);
    let chosen = &found.near[..found.near.len().min(MAX_FITTED)];
    found.fitted = trial.explained(chosen, MAX_EXPLAINED_RATIO * found.as_read);
    found
}

/// Returns the misreadings with whose correction the nominal arm, with camera and marker where most
/// views have them, fits the images; none are found if it fits them as declared.
fn near_in_views(fitting: &Fitting, problem: &Problem) -> Explanations {
    let table = fitting.measurements;
    let rows = rows_of_views(fitting);
    let pixels = spread(fitting.placement, &rows, |place| table.positions[rows[place]]);
    let trial = Trial::of_rows(fitting, problem, rows);
    // The nominal arm with camera and marker located in closed form.
    let error = |misreading: &Misreading| {
        trial.with_corrected(misreading, false, |fitting, _| {
            Some(fitting.typical_error(&fitting.located()))
        })
    };
    let mut tested = of_arm(problem, table);
    tested.extend(several_reversed(&tested));
    tested.extend(of_images(problem, table));
    let errors = parallel::map_items(&tested, |of| Some((of.clone(), error(of)?)));
    let mut errors: Vec<(Misreading, f64)> = errors.into_iter().flatten().collect();
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let as_declared = error(&Misreading::none()).unwrap_or(f64::INFINITY);
    let near_error = errors.first().map_or(f64::NAN, |(_, error)| *error);
    if near_error.is_nan() || near_error > MAX_NOMINAL_MISS * pixels {
        return Explanations::default();
    }
    let mut near = near_misreadings(&errors, as_declared);
    // Joints whose sign has no effect on the images, as that of a joint that stands still, stay out.
    let count = |found: &Misreading| found.reversed_joints().count_ones();
    let smallest = near.iter().map(count).filter(|count| *count > 0).min();
    near.retain(|found| count(found) == 0 || Some(count(found)) == smallest);
    Explanations { near, near_error, ..Explanations::default() }
}

/// Returns identification rows of some views, evenly spaced: of each view the outermost points.
fn rows_of_views(fitting: &Fitting) -> Vec<usize> {
    let rows = &fitting.split.identification;
    let mut views = views(fitting.measurements, rows);
    views.retain(|view| view.len() >= MIN_POINTS);
    let outermost = |view: &Vec<usize>| -> Vec<usize> {
        let along = |direction: u8| {
            let (y, x) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
            let height = |place: &usize| {
                let pixel = &fitting.measurements.positions[rows[*place]];
                x * pixel.x + y * pixel.y
            };
            view.iter().copied().max_by(|a, b| height(a).total_cmp(&height(b)))
        };
        (0..DIRECTIONS).filter_map(along).collect()
    };
    let views = spaced(views, MAX_VIEWS);
    let places: BTreeSet<usize> = views.iter().flat_map(outermost).collect();
    places.into_iter().map(|place| rows[place]).collect()
}

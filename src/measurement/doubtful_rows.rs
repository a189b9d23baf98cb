//! Warnings about doubtful rows and words of a table: an instrument that held its last value or
//! lost its target, a pixel outside its image, intrinsics of another resolution, and session names
//! that are written in two ways.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Vector2, Vector3};

use super::Measurements;
use crate::error::{InputError, TableErrorKind, Warning, WarningKind};
use crate::problem::{FOCAL_X, Joint, JointKind, Observation, Problem};

/// Smallest ratio of the farthest pixel to twice the centre of the image, along both axes, at which
/// the intrinsics of a camera are those of another resolution. Centres of lenses are nearer to
/// those of images.
const MIN_PIXEL_REACH: f64 = 1.2;
/// Minimum number of rows of pixels from which normalised image coordinates are recognised.
const MIN_NORMALISED_ROWS: usize = 8;
/// Largest absolute normalised image coordinate of usual lenses.
const MAX_NORMALISED: f64 = 3.0;
/// Smallest focal length that is in pixels \[px\].
const MIN_PIXEL_FOCAL: f64 = 30.0;
/// Largest absolute coordinate of a pixel \[px\]; images are smaller by far, and a fit to one such
/// row takes long.
const MAX_PIXEL: f64 = 1e5;
/// Smallest distance of a position from the middle of the others, as a multiple of the length of
/// the arm, that no arm reaches. From one end of its workspace to the other it is twice the length.
const MIN_REACHES: f64 = 3.0;
/// Minimum number of rows for each one that is beyond reach; where more are, the table is misread.
const MIN_ROWS_TO_ONE_FAR: usize = 10;
/// Largest distance of a pixel beyond the centres of those at the edge of its image that is not
/// asked about \[px\]: half a pixel, and noise of corners at the edge.
const IMAGE_EDGE: f64 = 2.5;
/// Smallest difference between the commands of a joint that moves the target: 1° \[rad\], or 1 mm
/// \[m\].
const MIN_TURN: f64 = std::f64::consts::PI / 180.0;
const MIN_TRAVEL: f64 = 1e-3;
/// Smallest angle of a joint \[rad\], 20 turns, and smallest coordinate \[m\] that show lost
/// decimal points if all numbers are whole.
const MIN_LOST_ANGLE: f64 = 20.0 * std::f64::consts::TAU;
const MIN_LOST_PLACE: f64 = 100.0;
/// Largest deviation of a whole number from a whole one by conversion of its unit, relative to it.
const MAX_OFF_WHOLE: f64 = 1e-12;
/// Maximum number of rows that the warning names in addition to the first.
const MAX_NAMED_ROWS: usize = 3;

impl Measurements {
    /// Returns the warnings about rows that repeat others, and about the order of times.
    pub(crate) fn row_warnings(&self, problem: &Problem) -> Vec<Warning> {
        let sigma = problem.data.position_sigma;
        let repeated = self
            .repeated_rows(sigma)
            .or_else(|| self.rows_of_another_session(sigma))
            .or_else(|| self.rounded_copies(problem));
        let held = self.held_positions(problem);
        let outside = self.pixels_outside(problem).or_else(|| self.other_resolution(problem));
        let far = self.beyond_reach(problem);
        let doubts = repeated.into_iter().chain(held).chain(self.time_going_back());
        doubts.chain(outside).chain(far).collect()
    }

    /// Checks that the rows do not all show markers at rest in the images of cameras at rest.
    pub(super) fn require_moving_views(&self, problem: &Problem) -> Result<(), InputError> {
        let at_rest = |row: usize| {
            let Observation::Pixel(camera, marker, _) = self.observation(row) else { return None };
            let [camera, marker] = [camera, marker].map(|of| problem.fixtures.get(of as usize));
            let names = (camera?.name.clone(), marker?.name.clone());
            (camera?.carrier.is_none() && marker?.carrier.is_none()).then_some(names)
        };
        if !(0..self.len()).all(|row| at_rest(row).is_some()) {
            return Ok(());
        }
        match at_rest(0).filter(|_| !self.is_empty()) {
            Some((camera, marker)) => {
                Err(self.location(0).error(TableErrorKind::NothingMoves { camera, marker }))
            }
            None => Ok(()),
        }
    }

    /// Checks that the pixels of all cameras are places in an image, and those of a camera with a focal
    /// length in pixels no normalised image coordinates.
    pub(super) fn require_pixels(&self, problem: &Problem) -> Result<(), InputError> {
        let pixel = |row: usize| {
            let Observation::Pixel(camera, ..) = self.observation(row) else { return None };
            let focal =
                problem.fixtures.get(camera as usize)?.known.get(FOCAL_X).copied().flatten();
            Some((row, self.positions.get(row)?.xy(), focal.unwrap_or(0.0)))
        };
        let pixels: Vec<(usize, Vector2<f64>, f64)> = (0..self.len()).filter_map(pixel).collect();
        if let Some((row, at, _)) = pixels.iter().find(|(_, at, _)| at.amax() > MAX_PIXEL) {
            let (value, column) =
                if at.x.abs() > at.y.abs() { (at.x, "column u_px") } else { (at.y, "column v_px") };
            let value = format!("{value:.1}");
            let location = self.location(*row).with_key(column);
            return Err(location.error(TableErrorKind::NoPlaceInImage { value }));
        }
        let largest = pixels.iter().map(|(_, at, _)| at.amax()).fold(0.0, f64::max);
        let is_normalised = pixels.len() >= MIN_NORMALISED_ROWS
            && largest < MAX_NORMALISED
            && pixels.iter().any(|(_, at, _)| at.min() < 0.0)
            && pixels.iter().all(|(.., focal)| *focal > MIN_PIXEL_FOCAL);
        match pixels.first().filter(|_| is_normalised) {
            Some((row, ..)) => {
                let largest = format!("{largest:.2}");
                Err(self.location(*row).error(TableErrorKind::NormalisedPixels { largest }))
            }
            None => Ok(()),
        }
    }

    /// Checks that the numbers of joints and positions are not whole ones far beyond those of an
    /// arm, as in a table whose decimal points a spreadsheet took for separators of thousands.
    pub(super) fn require_decimals(&self, problem: &Problem) -> Result<(), InputError> {
        let turning = problem.joints.iter().filter(|joint| joint.takes_command());
        let turns: Vec<bool> = turning.map(Joint::takes_angle).collect();
        let angles = |row: usize| {
            let q = self.configuration(row).iter().zip(&turns);
            q.filter(|(_, turns)| **turns).map(|(q, _)| *q)
        };
        let is_position = |row: &usize| self.observation(*row) == Observation::Position;
        let rows = || (0..self.len()).filter(is_position);
        let numbers = rows().flat_map(angles);
        let places = rows().filter_map(|row| self.positions.get(row));
        let angle = numbers.clone().map(f64::abs).fold(0.0, f64::max);
        let distance = places.clone().map(Vector3::amax).fold(0.0, f64::max);
        if self.len() < MIN_NORMALISED_ROWS || angle < MIN_LOST_ANGLE || distance < MIN_LOST_PLACE {
            return Ok(());
        }
        let is_whole = |value: f64| (value - value.round()).abs() <= MAX_OFF_WHOLE * value.abs();
        let are_degrees = numbers.clone().all(|q| is_whole(q.to_degrees()));
        let are_radians = numbers.clone().all(is_whole);
        let unit = self.position_unit.unwrap_or(1e-3);
        let are_lengths = places.clone().all(|place| place.iter().all(|x| is_whole(x / unit)));
        if !are_lengths || !(are_degrees || are_radians) {
            return Ok(());
        }
        let kind = TableErrorKind::DecimalsLost {
            turns: format!("{:.0}", angle / std::f64::consts::TAU),
            metres: format!("{distance:.0}"),
        };
        Err(self.location(0).error(kind))
    }

    /// Returns a warning at the first of few positions that lie farther from the middle of the
    /// others of their session than the arm reaches, such as one whose decimal point was lost.
    fn beyond_reach(&self, problem: &Problem) -> Option<Warning> {
        let targets = problem.targets.iter().map(|target| target.at.norm());
        let target = targets.fold(problem.tool.target.norm(), f64::max);
        let reach = MIN_REACHES * (problem.length_of_links() + target);
        let is_position = |row: &usize| self.observation(*row) == Observation::default();
        let rows: Vec<usize> = (0..self.positions.len()).filter(is_position).collect();
        let session = |row: usize| self.session.of_row.get(row).copied().unwrap_or(0);
        let mut axes: BTreeMap<usize, [Vec<f64>; 3]> = BTreeMap::new();
        for (&row, position) in rows.iter().filter_map(|row| Some((row, self.positions.get(*row)?)))
        {
            let of_session = axes.entry(session(row)).or_default();
            for (axis, x) in of_session.iter_mut().zip(position) {
                axis.push(*x);
            }
        }
        let middle = |mut axis: Vec<f64>| {
            axis.sort_by(f64::total_cmp);
            axis.get(axis.len() / 2).copied().unwrap_or_default()
        };
        let middles: BTreeMap<usize, Vector3<f64>> = axes
            .into_iter()
            .map(|(session, axes)| (session, Vector3::from(axes.map(middle))))
            .collect();
        let off = |row: &usize| {
            let of_row = self.positions.get(*row).zip(middles.get(&session(*row)));
            of_row.map_or_else(Vector3::zeros, |(position, middle)| position - middle)
        };
        let far: Vec<usize> = rows.iter().copied().filter(|row| off(row).norm() > reach).collect();
        let &row = far.first().filter(|_| {
            reach.is_finite() && reach > 0.0 && MIN_ROWS_TO_ONE_FAR * far.len() <= rows.len()
        })?;
        let (axis, offset) = (off(&row).iamax(), off(&row).amax());
        let value = *self.positions.get(row)?.get(axis)?;
        let middle = value - off(&row).get(axis)?;
        let is_lost = |power: &i32| (value / 10_f64.powi(*power) - middle).abs() < reach / 2.0;
        let hint =
            if (1..=6).any(|power| is_lost(&power)) { ": is a decimal point lost?" } else { "" };
        let kind = WarningKind::BeyondReach {
            value: ((value * 1e6).round() / 1e3).to_string(),
            far: format!("{offset:.0}"),
            hint,
            rows: far.len(),
        };
        let column = ["column x_mm", "column y_mm", "column z_mm"].get(axis).copied()?;
        Some(Warning { location: self.location(row).with_key(column), kind })
    }

    /// Returns a warning at the first pixel that lies outside the declared size of its image.
    fn pixels_outside(&self, problem: &Problem) -> Option<Warning> {
        let outside = |row: usize| {
            let Observation::Pixel(camera, ..) = self.observation(row) else { return None };
            let camera = problem.fixtures.get(camera as usize)?;
            let (image, pixel) = (camera.image?, self.positions.get(row)?);
            let is_outside = |value: f64, size: f64| {
                value.is_finite() && !(-IMAGE_EDGE..=size - 1.0 + IMAGE_EDGE).contains(&value)
            };
            let [width, height] = image;
            let axes = [("column u_px", pixel.x, width), ("column v_px", pixel.y, height)];
            let (column, value, _) =
                axes.into_iter().find(|&(_, value, size)| is_outside(value, size))?;
            Some((row, column, value, camera))
        };
        let mut found = (0..self.len()).filter_map(outside);
        let (row, column, value, camera) = found.next()?;
        let fits_exchanged = |row: usize| {
            let Observation::Pixel(other, ..) = self.observation(row) else { return true };
            let is_other =
                problem.fixtures.get(other as usize).is_none_or(|of| of.name != camera.name);
            let [width, height] = camera.image.unwrap_or_default();
            let pixel = self.positions.get(row).copied().unwrap_or_default();
            is_other || (pixel.x <= height - 0.5 && pixel.y <= width - 0.5)
        };
        let kind = WarningKind::OutsideImage {
            is_exchanged: (0..self.len()).all(fits_exchanged),
            value: format!("{value:.1}"),
            camera: camera.name.clone(),
            image: camera.image?.map(|size| size.to_string()),
            rows: 1 + found.count(),
        };
        Some(Warning { location: self.location(row).with_key(column), kind })
    }

    /// Returns a warning about a camera without a declared size of its image, whose pixels reach
    /// far beyond twice its declared centre along both axes, as images of a higher resolution do.
    fn other_resolution(&self, problem: &Problem) -> Option<Warning> {
        let mut farthest = BTreeMap::new();
        let mut centred = BTreeSet::new();
        for row in 0..self.len() {
            let Observation::Pixel(camera, ..) = self.observation(row) else { continue };
            let pixel = self.positions.get(row)?;
            // Pixels with negative numbers do not count from a corner of the image.
            if pixel.x < 0.0 || pixel.y < 0.0 {
                centred.insert(camera);
            }
            let (reach, at): &mut ([f64; 2], usize) = farthest.entry(camera).or_default();
            let [x, y] = reach;
            if pixel.x > *x {
                *at = row;
            }
            (*x, *y) = (x.max(pixel.x), y.max(pixel.y));
        }
        farthest.retain(|camera, _| !centred.contains(camera));
        farthest.into_iter().find_map(|(camera, (reach, row))| {
            let fixture = problem.fixtures.get(camera as usize)?;
            let place = fixture.kind.fields().iter().position(|field| *field == "cx")?;
            let known = fixture.known.get(place..place + 2).filter(|_| fixture.image.is_none());
            let &[Some(cx), Some(cy)] = known? else { return None };
            let centre = [cx, cy];
            let is_beyond = |(centre, reach): (&f64, &f64)| {
                *centre > 0.0 && *reach > MIN_PIXEL_REACH * 2.0 * centre
            };
            let kind = WarningKind::OtherResolution {
                camera: fixture.name.clone(),
                pixel: reach.map(|value| format!("{value:.0}")),
                image: centre.map(|value| format!("{:.0}", 2.0 * value)),
            };
            centre
                .iter()
                .zip(&reach)
                .all(is_beyond)
                .then(|| Warning { location: self.location(row), kind })
        })
    }

    /// Returns a warning if rows measure exactly the position of the row above them, although the
    /// arm moved.
    ///
    /// The last moving joint does not count, because a target on its axis stays where it is. The
    /// digits must be fine against the declared σ.
    fn held_positions(&self, problem: &Problem) -> Option<Warning> {
        if !self.position_measured || self.is_coarse(problem.data.position_sigma) {
            return None;
        }
        let is_moving = |joint: &usize| {
            let declared = problem.joints.get(*joint);
            declared.is_some_and(Joint::takes_command)
        };
        let mut moving: Vec<usize> = (0..self.joints).filter(is_moving).collect();
        moving.pop();
        let moves = |row: usize, joint: usize| {
            let command = |row: usize| self.configuration(row).get(joint).copied().unwrap_or(0.0);
            let kind = problem.joints.get(joint).map(Joint::command_kind);
            let least = if kind == Some(JointKind::Prismatic) { MIN_TRAVEL } else { MIN_TURN };
            (command(row) - command(row - 1)).abs() > least
        };
        let word = |row: usize| {
            let target = self.target.as_ref().and_then(|target| target.of_row.get(row));
            (self.session.of_row.get(row), target, self.observation(row).sort_key())
        };
        let is_held = |row: &usize| {
            let (position, before) = (self.positions.get(*row), self.positions.get(row - 1));
            self.observation(*row).is_position()
                && position.is_some_and(|position| position.norm() > 0.0)
                && position == before
                && word(*row) == word(row - 1)
                && moving.iter().any(|&joint| moves(*row, joint))
        };
        let held: Vec<usize> = (1..self.len()).filter(is_held).collect();
        let &first = held.first()?;
        let others = held.iter().skip(1).take(MAX_NAMED_ROWS);
        let kind = WarningKind::PositionHeld {
            before: self.location(first - 1).to_string(),
            rows: held.len(),
            others: others.map(|&row| self.location(row).to_string()).collect(),
        };
        Some(Warning { location: self.location(first), kind })
    }

    /// Returns a warning if two sessions have the same name but for case, spaces and hyphens. It is
    /// located at the first row of the rarer one.
    pub(super) fn sessions_alike(&self) -> Option<Warning> {
        let names = &self.session.names;
        let plain = |name: &String| -> String {
            let letters = name.chars().filter(|letter| !letter.is_whitespace());
            letters.filter(|letter| !"-_".contains(*letter)).flat_map(char::to_lowercase).collect()
        };
        let count = |place: usize| self.session.of_row.iter().filter(|of| **of == place).count();
        let plains: Vec<String> = names.iter().map(plain).collect();
        let mut pairs = (0..names.len()).flat_map(|second| (0..second).map(move |k| (k, second)));
        let (first, second) = pairs.find(|&(first, second)| {
            plains.get(first) == plains.get(second)
                && plains.get(first).is_some_and(|plain| !plain.is_empty())
        })?;
        let (rare, usual) =
            if count(first) < count(second) { (first, second) } else { (second, first) };
        let row = self.session.of_row.iter().position(|of| *of == rare)?;
        let kind = WarningKind::SessionsAlike {
            name: names.get(rare)?.clone(),
            other: names.get(usual)?.clone(),
            rows: count(rare),
        };
        Some(Warning { location: self.location(row).with_key("session"), kind })
    }
}

/// Largest fraction of rows at 0, 0, 0 that counts as lost targets. In a table with more of them,
/// the zeros may be placeholders of planned poses.
const MAX_LOST_FRACTION: f64 = 0.5;
/// Maximum number of rows at 0, 0, 0 that a message lists after the first.
const MAX_LISTED_ROWS: usize = 10;

impl Measurements {
    /// Returns a warning about the first row whose measured position is exactly 0, 0, 0. The
    /// message proposes to set the key `missing` to `write`.
    ///
    /// # Errors
    /// Returns an error if rows with different configurations measure this position, which does not
    /// happen by chance.
    pub(super) fn lost_targets(&self, write: &str) -> Result<Option<Warning>, InputError> {
        let is_lost = |row: &usize| {
            self.observation(*row).is_position()
                && self.positions.get(*row).is_some_and(|position| position.norm() == 0.0)
        };
        let lost: Vec<usize> = (0..self.len()).filter(is_lost).collect();
        let Some(&first) = lost.first() else { return Ok(None) };
        if !self.position_measured || lost.len() as f64 > MAX_LOST_FRACTION * self.len() as f64 {
            return Ok(None);
        }
        let (location, write) = (self.location(first), write.to_owned());
        let differs = |row: &&usize| self.configuration(**row) != self.configuration(first);
        if !lost.iter().any(|row| differs(&row)) {
            return Ok(Some(Warning { location, kind: WarningKind::PositionZero { write } }));
        }
        let others = lost.iter().skip(1).take(MAX_LISTED_ROWS);
        let others = others.map(|&row| self.location(row).to_string()).collect();
        Err(location.error(TableErrorKind::LostTargets { rows: lost.len(), others, write }))
    }
}

//! Warnings about columns that are probably in another unit than their names say.

use std::f64::consts::TAU;

use super::Measurements;
use super::limits::Commands;
use crate::error::{Location, Warning, WarningKind};
use crate::problem::{Joint, Observation, Problem};
use crate::quantity::format::about_three_digits;

/// Range of room temperatures, 15 °C to 35 °C, in degrees Fahrenheit.
const ROOM_FAHRENHEIT: std::ops::RangeInclusive<f64> = 59.0..=95.0;
/// Highest declared reference temperature that is a room temperature \[°C\].
const MAX_ROOM_TEMPERATURE: f64 = 30.0;
/// Standard acceleration of gravity \[m/s²\].
const GRAVITY: f64 = 9.80665;
/// Largest relative difference between g times the median of the column `hoist_N` and the declared
/// hoist force, at which the column is probably in kilograms.
const MAX_HOIST_DIFFERENCE: f64 = 0.2;
/// Largest ratio of the median of a column to a declared number at which the two are near.
const MAX_NEAR_RATIO: f64 = 1.5;
/// Smallest ratio of the median of a column to its declared number at which the two are far apart.
const MIN_FAR_RATIO: f64 = 5.0;
/// Smallest distance of the reference temperature from all temperatures that is reported \[K\].
const MIN_FAR_REFERENCE: f64 = 40.0;
/// Step of round payloads \[kg\].
const ROUND_PAYLOAD: f64 = 0.5;
/// Largest relative deviation from a round payload.
const MAX_OFF_ROUND: f64 = 5e-4;
/// Smallest plausible distance to an anchor, as a fraction of the length of the arm's links, if no
/// other is longer.
const MIN_PLAUSIBLE_DISTANCE: f64 = 0.005;
/// Minimum number of rows of a table at which small ranges of the joints are suspect.
const MIN_ROWS: usize = 10;
/// Declared range of every revolute joint above which motions of a few degrees are suspect \[rad\].
const MIN_WIDE_RANGE: f64 = 1.0;

/// Largest plausible way of a joint that slides \[m\].
const MAX_SLIDE: f64 = 20.0;
/// Smallest plausible way of a joint that slides, as a fraction of its declared range.
const MIN_SHARE_OF_RANGE: f64 = 0.01;

/// Sizes of numbers that loggers write where a sensor gives no reading.
const PLACEHOLDERS: [f64; 13] = [
    99.0, 99.9, 99.99, 273.15, 999.0, 999.9, 999.99, 9999.0, 9999.9, 32_767.0, 32_768.0, 65_535.0,
    99_999.0,
];
/// Largest share of the rows that hold a placeholder.
const MAX_PLACEHOLDER_SHARE: f64 = 0.3;
/// Minimum number of rows beside those with a placeholder.
const MIN_OTHER_ROWS: usize = 4;
/// Smallest distance of a placeholder from all other numbers, as a multiple of their range: for one
/// of [`PLACEHOLDERS`], for a repeated 0, and for another repeated number.
const MIN_PLACEHOLDER_RANGES: [f64; 3] = [3.0, 2.0, 10.0];
/// Maximum number of rows with a placeholder that a warning names after the first.
const MAX_NAMED_ROWS: usize = 6;

impl Measurements {
    /// Returns a warning for each column of temperatures, payloads, hoist forces or covariates some
    /// of whose numbers are probably no readings, located at the first of them.
    pub(super) fn placeholders(&self, problem: &Problem) -> Vec<Warning> {
        let columns = [
            ("temperature_C", &self.temperature, true),
            ("payload_kg", &self.payload, false),
            ("hoist_N", &self.hoist, false),
        ];
        let columns = columns.into_iter().filter_map(|(name, values, may_repeat)| {
            Some((name.to_owned(), values.clone()?, may_repeat))
        });
        let declared = problem.data.covariates.iter().enumerate().map(|(place, covariate)| {
            let value = |row: usize| self.covariates_of(row).get(place).copied();
            let values = (0..self.len()).filter_map(value).collect();
            (covariate.name.clone(), values, true)
        });
        let warning = |(name, values, may_repeat): (String, Vec<f64>, bool)| {
            let (rows, [least, most]) = placeholder_rows(&values, may_repeat)?;
            let (&first, others) = rows.split_first()?;
            let value = *values.get(first)?;
            let others = others.iter().take(MAX_NAMED_ROWS);
            let kind = WarningKind::NoReading {
                value: format!("{value}"),
                rows: rows.len(),
                others: others.map(|&row| self.location(row).to_string()).collect(),
                range: [least, most].map(|limit| format!("{limit}")),
            };
            Some(self.warning(first, name, kind))
        };
        columns.chain(declared).filter_map(warning).collect()
    }

    /// Returns a warning, located at the lowest temperature, if all temperatures are room
    /// temperatures in degrees Fahrenheit, and the declared reference is a room temperature in °C.
    pub(super) fn fahrenheit(&self, problem: &Problem) -> Option<Warning> {
        let reference = problem.data.reference_temperature?;
        let temperatures = || self.temperature.iter().flatten().copied();
        let (row, least) = temperatures().enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let is_usual = temperatures().all(|value| ROOM_FAHRENHEIT.contains(&value));
        let kind = WarningKind::Fahrenheit { least: format!("{least}") };
        (is_usual && reference <= MAX_ROOM_TEMPERATURE)
            .then(|| self.warning(row, "temperature_C", kind))
    }

    /// Returns a warning, located at the first row, if the hoist forces are about the declared
    /// force in kilograms.
    pub(super) fn hoist_in_kilograms(&self, problem: &Problem) -> Option<Warning> {
        let hoists = problem.joints.iter().filter_map(|joint| joint.beam.as_ref()?.hoist.as_ref());
        let declared = hoists.map(|hoist| hoist.force).find(|force| *force > 0.0)?;
        let mut forces: Vec<f64> =
            self.hoist.iter().flatten().copied().filter(|force| *force > 0.0).collect();
        forces.sort_by(f64::total_cmp);
        let usual = *forces.get(forces.len() / 2)?;
        let ratio = usual * GRAVITY / declared;
        let kind = WarningKind::HoistInKilograms {
            usual: about_three_digits(usual),
            declared: format!("{declared}"),
        };
        ((ratio - 1.0).abs() < MAX_HOIST_DIFFERENCE).then(|| self.warning(0, "hoist_N", kind))
    }

    /// Returns a warning, located at the first row, if the numbers of one column of loads or
    /// temperatures are near what the problem declares for another one, whose numbers are not.
    pub(super) fn exchanged_loads(&self, problem: &Problem) -> Option<Warning> {
        let hoists = problem.joints.iter().filter_map(|joint| joint.beam.as_ref()?.hoist.as_ref());
        let force = hoists.map(|hoist| hoist.force).find(|force| *force != 0.0);
        let payload = Some(problem.tool.payload_mass).filter(|mass| *mass > 0.0);
        let columns = [("payload_kg", &self.payload, payload), ("hoist_N", &self.hoist, force)];
        let median = |values: &Option<Vec<f64>>| {
            let mut values = values.clone()?;
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let is_near = |value: f64, declared: f64| {
            let ratio = value / declared;
            (1.0 / MAX_NEAR_RATIO..=MAX_NEAR_RATIO).contains(&ratio)
        };
        let is_far = |value: f64, declared: f64| {
            !(1.0 / MIN_FAR_RATIO..=MIN_FAR_RATIO).contains(&(value / declared))
        };
        columns.iter().find_map(|(name, values, declared)| {
            let (usual, declared) = (median(values)?, (*declared)?);
            columns.iter().filter(|_| is_far(usual, declared)).find_map(|(other, values, of)| {
                let found = median(values)?;
                let is_other = other != name && is_near(found, declared);
                let fits = of.is_none_or(|of| !is_near(found, of));
                let kind = WarningKind::ColumnsExchanged {
                    name: (*name).to_owned(),
                    usual: about_three_digits(usual),
                    declared: about_three_digits(declared),
                    other: (*other).to_owned(),
                    here: about_three_digits(found),
                };
                (is_other && fits).then(|| self.warning(0, *name, kind))
            })
        })
    }

    /// Returns a warning, located at the first payload, if the payloads are round numbers of
    /// kilograms as weights in newtons, and not round in kilograms.
    pub(super) fn payload_in_newtons(&self) -> Option<Warning> {
        let payloads = self.payload.as_deref().unwrap_or_default();
        let is_round = |value: f64| {
            let steps = value / ROUND_PAYLOAD;
            (steps - steps.round()).abs() * ROUND_PAYLOAD < MAX_OFF_ROUND * value
        };
        let mut different: Vec<f64> = payloads.iter().copied().filter(|mass| *mass > 0.0).collect();
        different.sort_by(f64::total_cmp);
        different.dedup();
        let looks_like_weights = different
            .iter()
            .all(|&value| is_round(value / GRAVITY) && value >= GRAVITY && !is_round(value));
        let row = payloads.iter().position(|mass| *mass > 0.0)?;
        let newtons = *payloads.get(row)?;
        let kind = WarningKind::PayloadInNewtons {
            newtons: format!("{newtons}"),
            kilograms: format!("{:.1}", newtons / GRAVITY),
        };
        (different.len() > 1 && looks_like_weights).then(|| self.warning(row, "payload_kg", kind))
    }

    /// Returns a warning if the reference temperature is far beyond all temperatures, or if it lies
    /// outside them but would lie among them when converted from degrees Fahrenheit.
    pub(super) fn far_reference(&self, problem: &Problem) -> Option<Warning> {
        let reference = problem.data.reference_temperature?;
        let values = || self.temperature.iter().flatten().copied();
        let (least, most) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let distance = (least - reference).max(reference - most);
        let is_far = distance > MIN_FAR_REFERENCE.max(most - least) && distance.is_finite();
        // A room temperature in degrees Fahrenheit, among those of the table if in °C.
        let celsius = (reference - 32.0) / 1.8;
        let is_fahrenheit = distance > 0.0
            && ROOM_FAHRENHEIT.contains(&reference)
            && (least..=most).contains(&celsius);
        let kind = WarningKind::FarReference {
            celsius: is_fahrenheit.then(|| format!("{celsius:.1}")),
            distance: format!("{distance:.0}"),
            least: format!("{least}"),
            most: format!("{most}"),
        };
        let location = problem.data.location.clone().with_key("data.reference_temperature_C");
        (is_far || is_fahrenheit)
            .then_some(Warning { location: Location { excerpt: None, ..location }, kind })
    }

    /// Returns a warning, located at the first row, if all directions of approach are 0 or 1 and
    /// both occur.
    pub(super) fn approach_without_sign(&self) -> Option<Warning> {
        let directions = self.approach.as_deref().unwrap_or_default();
        let has =
            |value: f64| directions.iter().any(|direction| direction.total_cmp(&value).is_eq());
        let location = self.location(0).with_key("approach");
        let is_unsigned = self.len() >= MIN_ROWS && has(1.0) && has(0.0) && !has(-1.0);
        is_unsigned.then_some(Warning { location, kind: WarningKind::ApproachWithoutSign })
    }

    /// Returns a warning if the problem declares a σ of positions, no row measures one, and the rows
    /// have no σ of their own.
    pub(super) fn unused_sigma(&self, problem: &Problem) -> Option<Warning> {
        let data = &problem.data;
        let kinds = self.kinds();
        let leading = self.leading();
        let measures_positions = kinds.iter().any(|kind| kind.is_position());
        let is_unused = data.position_sigma.is_some()
            && !measures_positions
            && data.kind_sigmas.is_empty()
            && self.sigma.is_none()
            && leading.kind() != Observation::Pixel(0, 0, 0).kind();
        let location = Location { excerpt: None, ..data.position_sigma_location.clone() };
        let kind = WarningKind::SigmaUnused { write: format!("{}_sigma_mm", leading.kind()) };
        is_unused.then_some(Warning { location, kind })
    }

    /// Returns a warning, located at the longest distance to an anchor, if all are far shorter than
    /// the arm.
    pub(super) fn short_distances(&self, problem: &Problem) -> Option<Warning> {
        let rows = (0..self.len())
            .filter(|&row| matches!(self.observation(row), Observation::Distance(..)));
        let length = |row: usize| self.positions.get(row).map_or(0.0, |numbers| numbers.x);
        let longest = rows.max_by(|&a, &b| length(a).total_cmp(&length(b)))?;
        let links = problem.length_of_links();
        let kind = WarningKind::ShortDistances {
            longest: format!("{:.3}", length(longest) * 1e3),
            links: format!("{links:.3}"),
        };
        (length(longest) < MIN_PLAUSIBLE_DISTANCE * links)
            .then(|| self.warning(longest, "distance_mm", kind))
    }

    /// Returns a warning, located at the largest number, for each column of a joint that slides whose
    /// numbers are probably in the other unit of lengths: far more than an arm is long, or far less
    /// than the declared range.
    pub(super) fn slides(&self, problem: &Problem, columns: &[Commands]) -> Vec<Warning> {
        let warning = |column: &Commands| {
            let joint = problem.joints.get(column.joint).filter(|joint| !joint.takes_angle())?;
            let range = joint.limits.1 - joint.limits.0;
            let value = |row: usize| self.configuration(row).get(column.joint).map(|q| q.abs());
            let largest = |a: &usize, b: &usize| value(*a).partial_cmp(&value(*b));
            let rows = 0..self.len();
            let row = rows.max_by(|a, b| largest(a, b).unwrap_or(std::cmp::Ordering::Equal))?;
            let most = value(row).filter(|most| *most > 0.0)?;
            let (size, unit, suffix) = match column.unit() {
                "m" if range.is_infinite() && most > MAX_SLIDE => ("much", "millimetres", "_mm"),
                "mm" if range.is_finite()
                    && self.len() >= MIN_ROWS
                    && most < MIN_SHARE_OF_RANGE * range =>
                {
                    ("little", "metres", "_m")
                }
                _ => return None,
            };
            let value = format!("{} {}", column.shown(most), column.unit());
            let kind = WarningKind::SlideInOtherUnit { value, size, unit, suffix };
            Some(self.warning(row, format!("column {}", column.name), kind))
        };
        columns.iter().filter_map(warning).collect()
    }

    /// Returns a warning, located at the largest angle, if columns in degrees are probably in
    /// radians: all their numbers are within ±2π, although the joints have a larger range.
    pub(super) fn few_degrees(&self, problem: &Problem, columns: &[Commands]) -> Option<Warning> {
        let is_angle = |column: &&Commands| {
            column.unit() == "deg"
                && problem.joints.get(column.joint).is_some_and(Joint::takes_angle)
        };
        let is_wide = |column: &Commands| {
            let range = problem.joints.get(column.joint).map(|joint| joint.limits);
            range.is_none_or(|(min, max)| max - min > MIN_WIDE_RANGE)
        };
        let angles: Vec<&Commands> = columns.iter().filter(is_angle).collect();
        if self.len() < MIN_ROWS || angles.len() < 2 || !angles.iter().all(|angle| is_wide(angle)) {
            return None;
        }
        let value = |row: usize, joint: usize| {
            self.configuration(row).get(joint).copied().unwrap_or(0.0).abs().to_degrees()
        };
        let cells =
            (0..self.len()).flat_map(|row| angles.iter().map(move |angle| (row, angle.joint)));
        let (row, joint) = cells.max_by(|a, b| value(a.0, a.1).total_cmp(&value(b.0, b.1)))?;
        let widest = value(row, joint);
        let least = angles.iter().filter(|angle| {
            let mut rows = (0..self.len()).map(|row| value(row, angle.joint));
            rows.any(|value| value > 0.0)
        });
        let kind = WarningKind::FewDegrees { widest: format!("{widest:.1}") };
        (widest <= TAU && least.count() > 1)
            .then(|| self.warning(row, format!("joint {}", joint + 1), kind))
    }
}

/// Returns the rows whose number is probably a placeholder, and the range of all others; empty ranges
/// and usual numbers are none. With `may_repeat`, a far number that repeats exactly among numbers
/// that do not is one, too; without it, only one of [`PLACEHOLDERS`] is.
fn placeholder_rows(values: &[f64], may_repeat: bool) -> Option<(Vec<usize>, [f64; 2])> {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [least, most].into_iter().find_map(|value| {
        let is_value = |other: &f64| other.total_cmp(&value).is_eq();
        let rows: Vec<usize> =
            (0..values.len()).filter(|&row| values.get(row).is_some_and(is_value)).collect();
        let mut others: Vec<f64> =
            values.iter().copied().filter(|other| !is_value(other)).collect();
        let count = others.len();
        others.sort_by(f64::total_cmp);
        let (&low, &high) = (others.first()?, others.last()?);
        others.dedup();
        let is_known = PLACEHOLDERS.iter().any(|known| known.total_cmp(&value.abs()).is_eq());
        let repeats = may_repeat && rows.len() > 1 && 2 * others.len() > count;
        let [known, zero, other] = MIN_PLACEHOLDER_RANGES;
        let ranges = match value.abs().total_cmp(&0.0).is_eq() {
            _ if is_known => known,
            true => zero,
            false => other,
        };
        let distance = (low - value).max(value - high);
        let is_rare = count >= MIN_OTHER_ROWS
            && rows.len() as f64 <= MAX_PLACEHOLDER_SHARE * values.len() as f64;
        // Two values alone are a design, such as an arm with and without its payload.
        let is_far = high > low && distance > ranges * (high - low);
        (is_rare && is_far && (is_known || repeats)).then_some((rows, [low, high]))
    })
}

//! Warnings about implausible commands, conditions and repeated poses.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::Measurements;
use crate::error::{Warning, WarningKind};
use crate::problem::{Joint, Problem};
use crate::quantity::format::{decimals, number};

/// Largest excess over a joint limit that counts as rounding \[rad\] or \[m\].
const LIMIT_TOLERANCE: f64 = 1e-6;
/// Smallest ratio of a command in metres to the limit of its joint at which it is probably in
/// millimetres.
const MIN_MILLIMETRE_RATIO: f64 = 50.0;
/// Smallest ratio of a command in degrees to the limit of its joint at which it is probably a count
/// of an encoder.
const MIN_COUNTS_RATIO: f64 = 4.0;
/// Number of turns from zero above which a warning suggests that a column in radians is in degrees.
const MIN_SUSPICIOUS_TURNS: f64 = 2.0;
/// Highest plausible temperature [°C]. Above it, a warning suggests that the column is in kelvins;
/// even the temperature of a cold room exceeds it in kelvins.
const MAX_PLAUSIBLE_TEMPERATURE: f64 = 200.0;
/// Distance of a temperature from 20 °C \[K\] beyond which it is unusual for an arm.
const MAX_TEMPERATURE_DISTANCE: f64 = 120.0;
/// Trial steps of rounded positions \[m\], the largest first.
const POSITION_STEPS: [f64; 6] = [0.01, 0.005, 0.001, 5e-4, 2e-4, 1e-4];
/// Largest distance of a coordinate from a multiple of a step, relative to the step, at which it is
/// one.
const MAX_OFF_STEP: f64 = 1e-6;
/// Minimum number of rows from which a step of positions is determined.
const MIN_ROUNDED_ROWS: usize = 10;
/// Largest standard deviation of the error by rounding positions, in units of the declared σ, that
/// needs no warning.
const MAX_ROUNDING_SIGMAS: f64 = 2.0;
/// Largest plausible payload \[kg\]. The strongest industrial arms lift 2300 kg.
const MAX_PAYLOAD: f64 = 3000.0;
/// Largest plausible ratio of a payload to the declared mass of the arm. Arms lift at most about
/// their own mass.
const MAX_PAYLOAD_RATIO: f64 = 10.0;
/// Largest plausible distance between repeated measurements of one pose \[m\]. Repetition and
/// backlash move an arm by less.
const MAX_REPEAT_DISTANCE: f64 = 0.02;
/// Minimum number of rows in a table at which a separate session for each row is implausible.
const MIN_SESSION_ROWS: usize = 10;
/// Largest usual time between two rows \[s\]: some hours.
const MAX_USUAL_STEP: f64 = 2e4;
/// Smallest time of a date \[s\], counted from 1970: in 2001.
const MIN_DATE: f64 = 1e9;
/// Largest plausible time \[s\], counted from 1970. Later times are in the year 5138, whereas
/// milliseconds since 1970 exceed this limit from 1973 on.
const MAX_PLAUSIBLE_TIME: f64 = 1e11;

/// Column with the commands of a joint.
pub(super) struct Commands<'a> {
    /// Joint, counted from 0.
    pub joint: usize,
    /// Name of the column: `q2_deg`.
    pub name: &'a str,
    /// Conversion to the SI unit.
    pub to_si: fn(f64) -> f64,
}

impl Commands<'_> {
    /// Returns the unit in the column's name.
    pub(super) fn unit(&self) -> &str {
        self.name.rsplit_once('_').map_or("", |(_, unit)| unit)
    }

    /// Converts an SI value to the unit of the column, rounded to six decimals.
    pub(super) fn shown(&self, value: f64) -> f64 {
        (value / (self.to_si)(1.0) * 1e6).round() / 1e6
    }

    /// Returns the limits of the joint as they are written in a problem file, in the unit of the
    /// column.
    fn limits(&self, (min, max): (f64, f64)) -> String {
        let limit = |(key, limit): (&str, f64)| {
            limit.is_finite().then(|| format!("{key}_{} = {}", self.unit(), self.shown(limit)))
        };
        [("min", min), ("max", max)].into_iter().filter_map(limit).collect::<Vec<_>>().join(", ")
    }
}

impl Measurements {
    /// Returns a warning about a column in a row.
    pub(super) fn warning(&self, row: usize, key: impl Into<String>, kind: WarningKind) -> Warning {
        Warning { location: self.location(row).with_key(key), kind }
    }

    /// Returns a warning, located at the lowest temperature, if all temperatures are so high that
    /// they are probably in kelvins.
    pub(super) fn kelvins(&self) -> Option<Warning> {
        let (row, &least) = self
            .temperature
            .iter()
            .flatten()
            .enumerate()
            .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let location = self.location(row).with_key("temperature_C");
        (least > MAX_PLAUSIBLE_TEMPERATURE)
            .then(|| Warning { location, kind: WarningKind::Kelvins { least: format!("{least}") } })
    }

    /// Returns a warning, located at the temperature furthest from 20 °C, if that is unusual for an
    /// arm, although others are not.
    pub(super) fn unusual_temperature(&self) -> Option<Warning> {
        let distance = |value: f64| (value - 20.0).abs();
        let values = self.temperature.iter().flatten().enumerate();
        let (row, &value) = values.max_by(|a, b| distance(*a.1).total_cmp(&distance(*b.1)))?;
        let kind = WarningKind::UnusualTemperature { value: number(value, 1) };
        let is_unusual = distance(value) > MAX_TEMPERATURE_DISTANCE && self.kelvins().is_none();
        is_unusual.then(|| self.warning(row, "temperature_C", kind))
    }

    /// Returns a warning if all positions are multiples of a step whose rounding errs by much more
    /// than the declared σ.
    pub(super) fn rounded_positions(&self, problem: &Problem) -> Option<Warning> {
        let sigma = problem.data.position_sigma.filter(|_| self.sigma.is_none())?;
        let rows: Vec<usize> =
            (0..self.len()).filter(|&row| self.observation(row).is_position()).collect();
        let is_multiple = |value: f64| (value - value.round()).abs() < MAX_OFF_STEP;
        let is_step = |step: &f64| {
            let mut values = rows.iter().flat_map(|&row| self.positions[row].iter());
            values.all(|value| is_multiple(value / step))
        };
        let step = POSITION_STEPS.into_iter().find(is_step)?;
        // A rounded number errs by a uniform distribution of variance step²/12.
        let rounding = step / 12_f64.sqrt();
        let is_coarse = rows.len() >= MIN_ROUNDED_ROWS && rounding > MAX_ROUNDING_SIGMAS * sigma;
        let show = |length: f64| number(length * 1e3, decimals(length * 1e3, 4));
        let kind = WarningKind::PositionsRounded {
            step: show(step),
            rounding: show(rounding),
            sigma: show(sigma),
        };
        is_coarse.then(|| Warning { location: self.location(rows[0]), kind })
    }

    /// Returns true if the problem declares the place of a payload but no mass, and the table has no
    /// column of payloads.
    pub(crate) fn lacks_payload(&self, problem: &Problem) -> bool {
        self.payload.is_none()
            && problem.tool.payload_is_declared
            && problem.tool.payload_mass == 0.0
            && problem.is_elastic()
    }

    /// Returns a warning if the table [lacks payloads](Self::lacks_payload).
    pub(super) fn missing_payload(&self, problem: &Problem) -> Option<Warning> {
        let kind = WarningKind::NoPayloadColumn { mass: problem.tool.payload_mass.to_string() };
        self.lacks_payload(problem).then(|| self.warning(0, "payload_kg", kind))
    }

    /// Returns the largest payload of the rows \[kg\]: the one that `problem` declares without a column
    /// of payloads.
    pub(crate) fn largest_payload(&self, problem: &Problem) -> f64 {
        let of_rows = |values: &Vec<f64>| values.iter().copied().fold(0.0, f64::max);
        self.payload.as_ref().map_or(problem.tool.payload_mass, of_rows)
    }

    /// Returns a warning, located at the heaviest payload, if that is implausible for the arm.
    pub(super) fn heavy_payload(&self, problem: &Problem) -> Option<Warning> {
        let payloads = self.payload.iter().flatten().enumerate();
        let (row, &heaviest) = payloads.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let arm = problem.declared_mass();
        let is_heavy_for_arm = arm > 0.0 && heaviest > MAX_PAYLOAD_RATIO * arm;
        let kind = WarningKind::HeavyPayload {
            mass: heaviest.to_string(),
            arm: is_heavy_for_arm.then(|| format!("{arm:.1}")),
        };
        (is_heavy_for_arm || heaviest > MAX_PAYLOAD).then(|| self.warning(row, "payload_kg", kind))
    }

    /// Returns a warning for the first row that has the pose name, configuration, session, target
    /// and loads of an earlier row, but a position far from that row's position.
    pub(super) fn same_pose_elsewhere(&self) -> Option<Warning> {
        let name = |row: usize| match (&self.pose, &self.pose_names) {
            (Some(numbers), _) => numbers.get(row).map(|number| number.to_bits()),
            (None, Some(names)) => names.of_row.get(row).map(|name| *name as u64),
            (None, None) => None,
        };
        let mut first_rows: HashMap<_, usize> = HashMap::new();
        (0..self.len()).filter(|&row| self.observation(row).is_position()).find_map(|row| {
            let target = self.target.as_ref().map(|target| target.of_row[row]);
            let load = |values: &Option<Vec<f64>>| values.as_ref().map(|of| of[row].to_bits());
            let loads = (load(&self.payload), load(&self.hoist));
            let key = (name(row)?, self.session.of_row[row], target, loads);
            let first = *first_rows.entry(key).or_insert(row);
            let distance = (self.positions[row] - self.positions[first]).norm();
            let is_same = self.configuration(row) == self.configuration(first);
            let kind = WarningKind::SamePoseElsewhere {
                first: self.location(first).to_string(),
                distance: format!("{:.0}", distance * 1e3),
            };
            (is_same && distance > MAX_REPEAT_DISTANCE)
                .then(|| Warning { location: self.location(row), kind })
        })
    }

    /// Returns a warning, located at the first row, if there are several rows and each has a
    /// session of its own.
    pub(super) fn session_per_row(&self) -> Option<Warning> {
        let rows = self.len();
        let kind = WarningKind::SessionPerRow { rows };
        (rows >= MIN_SESSION_ROWS && self.session.names.len() == rows)
            .then(|| self.warning(0, "session", kind))
    }

    /// Returns a warning, located at the first row, if there are several rows and each has a target
    /// of its own.
    pub(super) fn target_per_row(&self) -> Option<Warning> {
        let rows = self.len();
        let is_each = self.target.as_ref().is_some_and(|target| target.names.len() == rows);
        (rows >= MIN_SESSION_ROWS && is_each)
            .then(|| self.warning(0, "target", WarningKind::TargetPerRow { rows }))
    }

    /// Returns a warning, located at the first row, if all times, or the usual times between rows,
    /// are so large that they are probably in milliseconds.
    pub(super) fn milliseconds(&self) -> Option<Warning> {
        let first = *self.time.first().filter(|_| self.time_measured)?;
        let is_late = self.time.iter().all(|time| *time > MAX_PLAUSIBLE_TIME);
        let kind = WarningKind::LooksLikeMilliseconds { value: format!("{first}") };
        if is_late {
            return Some(self.warning(0, "time", kind));
        }
        let pairs = self.time.iter().zip(self.time.iter().skip(1));
        let mut steps: Vec<f64> = pairs.map(|(one, other)| (other - one).abs()).collect();
        steps.sort_by(f64::total_cmp);
        let step = *steps.get(steps.len() / 2).filter(|step| **step > MAX_USUAL_STEP)?;
        // Dates are read as seconds, and are not mistaken for milliseconds.
        (first < MIN_DATE).then(|| {
            let kind = WarningKind::LongSteps { step: number(step, 0) };
            self.warning(0, "time", kind)
        })
    }

    /// Returns a warning, located at the largest angle, if a column in radians exceeds
    /// [`MIN_SUSPICIOUS_TURNS`] turns.
    pub(super) fn many_turns(&self, problem: &Problem, columns: &[Commands]) -> Option<Warning> {
        let is_angle = |column: &&Commands| {
            column.unit() == "rad"
                && problem.joints.get(column.joint).is_some_and(Joint::takes_angle)
        };
        let value =
            |row: usize, joint: usize| self.configuration(row).get(joint).copied().unwrap_or(0.0);
        let cells = columns
            .iter()
            .filter(is_angle)
            .flat_map(|column| (0..self.len()).map(move |row| (column, row)));
        let (column, row) = cells.max_by(|(a, i), (b, j)| {
            value(*i, a.joint).abs().total_cmp(&value(*j, b.joint).abs())
        })?;
        let turns = value(row, column.joint).abs() / TAU;
        let kind = WarningKind::ManyTurns {
            value: format!("{} = {}", column.name, column.shown(value(row, column.joint))),
            turns: format!("{turns:.0}"),
        };
        (turns > MIN_SUSPICIOUS_TURNS)
            .then(|| self.warning(row, format!("joint {}", column.joint + 1), kind))
    }

    /// Returns the indices of the joints whose coordinate is the same in all rows, which are at least
    /// two.
    #[doc(hidden)]
    pub fn still_joints(&self) -> Vec<usize> {
        let is_still = |joint: &usize| {
            let mut values = (0..self.len()).map(|row| self.configuration(row)[*joint]);
            let first = values.next();
            self.len() > 1 && values.all(|value| Some(value) == first)
        };
        (0..self.joints).filter(is_still).collect()
    }

    /// Returns a warning for each joint that is commanded beyond its declared range, located at the
    /// row with the largest excess.
    pub(super) fn beyond_limits(&self, problem: &Problem, columns: &[Commands]) -> Vec<Warning> {
        let warning = |column: &Commands| {
            let (min, max) = problem.joints.get(column.joint)?.limits;
            let value =
                |row: usize| self.configuration(row).get(column.joint).copied().unwrap_or(0.0);
            let beyond = |row: usize| (min - value(row)).max(value(row) - max);
            let rows: Vec<usize> =
                (0..self.len()).filter(|&row| beyond(row) > LIMIT_TOLERANCE).collect();
            // The iterator is reversed so that the first of equals wins.
            let worst = *rows.iter().rev().max_by(|&&a, &&b| beyond(a).total_cmp(&beyond(b)))?;
            let location = self.location(worst).with_key(format!("joint {}", column.joint + 1));
            let widest = min.abs().max(max.abs());
            let ratio = value(worst).abs() / widest;
            // Limits of a URDF in radians, written as degrees: as radians they hold all commands.
            let [lower, upper] = [min, max].map(f64::to_degrees);
            let are_radians = widest.to_degrees() <= TAU
                && (0..self.len()).all(|row| (lower..=upper).contains(&value(row)));
            let other_unit = match column.unit() {
                "m" if ratio > MIN_MILLIMETRE_RATIO => Some("millimetres"),
                "deg" if ratio > MIN_COUNTS_RATIO && !are_radians => Some("counts of an encoder"),
                _ => None,
            };
            let radians = || {
                format!(
                    "if the limits are in radians, write min_rad = {} and max_rad = {}",
                    column.shown(min),
                    column.shown(max)
                )
            };
            let kind = WarningKind::BeyondLimits {
                other_unit: other_unit
                    .map(|unit| format!("{ratio:.0} times the limit: are these {unit}?"))
                    .or_else(|| (column.unit() == "deg" && are_radians).then(radians)),
                rows: rows.len(),
                worst: format!("{} = {}", column.name, column.shown(value(worst))),
                limits: column.limits((min, max)),
            };
            Some(Warning { location, kind })
        };
        columns.iter().filter_map(warning).collect()
    }
}

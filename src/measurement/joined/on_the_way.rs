//! Poses of a joint table that no row measures, through which the arm came to the measured ones.

use std::ops::Range;

use super::super::columns::Columns;
use super::super::role::Role;
use super::super::table::Table;
use super::super::{Measurements, Stop};
use super::JoinedLog;
use crate::error::{Location, Warning, WarningKind};
use crate::problem::{JointKind, JointSource, Problem};

/// Smallest step \[rad\] of a rotating joint that counts as a motion; readings of an arm at rest
/// scatter by less.
const MIN_TURN: f64 = 3e-4;
/// The same for a prismatic joint \[m\].
const MIN_SLIDE: f64 = 5e-5;

/// Pose of a joint table.
struct Passed<'a> {
    /// Configuration, shape = (joints) \[rad\] or \[m\].
    configuration: &'a [f64],
    /// Time on the clock of the measurements \[s\]; NaN if it is unknown.
    time: f64,
    /// Rows that measure the pose, the earliest first; empty if none does.
    rows: Vec<usize>,
}

impl JoinedLog {
    /// Reads the configuration of each row of the joint table with `read`, behind the current row
    /// of a table of measured rows.
    pub fn read_configurations(&mut self, table: &mut Table, read: impl Fn(&Table) -> Vec<f64>) {
        for row in self.rows.iter_mut().filter(|row| row.configuration.is_empty()) {
            table.append_row(&row.source);
            row.configuration = read(table);
            table.detach_row();
        }
    }

    /// Keeps in mind that the current partner is that of the measured rows with these indices.
    pub fn state_measured(&mut self, rows: Range<usize>) {
        if let Some(partner) = self.partner {
            self.measured.entry(partner).or_default().extend(rows);
        }
    }

    /// Adds to the measured rows the poses by which the arm came to them; returns a warning if
    /// directions of approach are taken from these.
    pub fn add_stops(&self, rows: &mut Measurements, problem: &Problem) -> Option<Warning> {
        let is_timed = self.rule.times().is_some();
        let in_files: Vec<usize> = (0..self.rows.len()).collect();
        let order = if is_timed { &self.by_time } else { &in_files };
        let time = rows.time.clone();
        let pose = |&place: &usize| {
            let row = self.rows.get(place).filter(|row| !row.configuration.is_empty())?;
            let mut rows = self.measured.get(&place).cloned().unwrap_or_default();
            let time_of = |row: &usize| time.get(*row).copied().unwrap_or(f64::NAN);
            rows.sort_by(|a, b| time_of(a).total_cmp(&time_of(b)));
            let time = if is_timed { row.time } else { f64::NAN };
            Some(Passed { configuration: &row.configuration, time, rows })
        };
        let poses: Vec<Passed> = order.iter().filter_map(pose).collect();
        let measured = poses.iter().filter_map(|pose| pose.rows.first().copied());
        let is_measured_in_order = if rows.time_measured {
            measured.map(|row| time.get(row)).is_sorted()
        } else {
            measured.is_sorted()
        };
        // The order of a list of planned poses is not that of the motions.
        if !is_measured_in_order {
            return None;
        }
        let stops = rows.add_passed(poses.into_iter(), problem)?;
        let file = &self.rows.first()?.source.file;
        let kind = WarningKind::ApproachesTaken { stops };
        Some(Warning { location: Location::file(file), kind })
    }
}

impl Columns {
    /// Returns the configuration in the current row of a table; empty if a coordinate is missing.
    pub fn configuration(&self, table: &Table, problem: &Problem) -> Vec<f64> {
        let mut configuration = vec![0.0; problem.joints.len()];
        let is_reading = problem.data.joints == JointSource::Read;
        for column in self.read.iter().filter(|column| column.role.is_reading() == is_reading) {
            let (Role::Joint(joint) | Role::Reading(joint)) = column.role else { continue };
            let Ok(number) = table.number(column.place) else { return Vec::new() };
            if let Some(coordinate) = configuration.get_mut(joint) {
                *coordinate = (column.to_si)(number);
            }
        }
        configuration
    }
}

/// Last motion of a joint.
#[derive(Clone, Copy)]
struct Motion {
    /// Direction, −1 or +1; 0 before the first motion.
    direction: f64,
    /// Coordinate farthest in this direction \[rad\] or \[m\].
    extreme: f64,
    /// Place of the pose with this coordinate among those since the last measured one.
    place: Option<usize>,
}

/// Last motions of all joints; empty at the start of a session.
#[derive(Default)]
struct Motions(Vec<Motion>);

impl Motions {
    /// Moves to the next pose, the one at `place` since the last measured one, and calls `turn`
    /// with the place of each unmeasured pose at which a joint turned or began to move.
    fn advance(
        &mut self,
        configuration: &[f64],
        place: usize,
        (least, mut turn): (&[f64], impl FnMut(usize)),
    ) {
        let place = Some(place);
        if self.0.is_empty() {
            let at = |&extreme: &f64| Motion { direction: 0.0, extreme, place };
            self.0 = configuration.iter().map(at).collect();
        }
        for ((motion, &extreme), &least) in self.0.iter_mut().zip(configuration).zip(least) {
            let step = extreme - motion.extreme;
            if motion.direction * step > 0.0 {
                *motion = Motion { extreme, place, ..*motion };
            } else if step.abs() > least {
                motion.place.into_iter().for_each(&mut turn);
                *motion = Motion { direction: step.signum(), extreme, place };
            }
        }
    }
}

impl Measurements {
    /// Keeps beside the rows those unmeasured poses of a joint table, all in the order of their
    /// times, at which a joint turns, because between two of them friction and play follow the
    /// motion from one to the other. Unless columns state directions of approach, they are those of
    /// each joint's last motion if such a pose lies between two measured ones of a session. Returns
    /// how many do; `None` if directions are not taken from them.
    fn add_passed<'a>(
        &mut self,
        poses: impl Iterator<Item = Passed<'a>>,
        problem: &Problem,
    ) -> Option<usize> {
        let least: Vec<f64> = problem
            .joints
            .iter()
            .map(|joint| if joint.kind == JointKind::Prismatic { MIN_SLIDE } else { MIN_TURN })
            .collect();
        let mut sides = vec![0.0; self.configurations.len()];
        let (mut motions, mut between) = (Motions::default(), 0);
        let (mut passed, mut session) = (Vec::new(), None);
        for pose in poses {
            let Some(&before) = pose.rows.first() else {
                passed.push(pose);
                continue;
            };
            let of_row = self.session.of_row.get(before).copied();
            let is_first = session.replace(of_row) != Some(of_row);
            if is_first {
                motions = Motions::default();
            }
            let mut turns = vec![false; passed.len() + 1];
            for (place, pose) in passed.iter().chain([&pose]).enumerate() {
                let turn =
                    |place: usize| turns.iter_mut().skip(place).take(1).for_each(|is| *is = true);
                motions.advance(pose.configuration, place, (&least, turn));
            }
            for (pose, _) in passed.drain(..).zip(turns).filter(|(_, turns)| *turns) {
                between += usize::from(!is_first);
                let configuration = pose.configuration.to_vec();
                self.stops.push(Stop { before, time: pose.time, configuration });
            }
            motions.0.iter_mut().for_each(|motion| motion.place = None);
            let directions: Vec<f64> = motions.0.iter().map(|motion| motion.direction).collect();
            for row in pose.rows {
                let of_row = sides.iter_mut().skip(row * self.joints);
                of_row.zip(&directions).for_each(|(side, direction)| *side = *direction);
            }
        }
        self.stops.sort_by_key(|stop| stop.before);
        if between == 0 || self.approach.is_some() {
            return None;
        }
        self.approach = Some(sides);
        Some(between)
    }
}

//! Order in which the rows were measured within their sessions, and the past of each pose.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::OnceLock;

use super::Measurements;
use crate::error::{Warning, WarningKind};
use crate::problem::{Past, PoseTable};

/// Times by which the clock falls from a row to the next one behind midnight \[s\].
const MIDNIGHT_STEPS: std::ops::RangeInclusive<f64> = 79_200.0..=86_400.0;

/// Chronological order of a table's rows, computed at first use. A copy computes its order again,
/// because its rows may change.
#[derive(Debug, Default)]
pub struct RowOrder(OnceLock<Chronology>);

impl Clone for RowOrder {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for RowOrder {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Unmeasured pose of the joint table, by which the arm came to a measured one.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// First row that was measured afterwards.
    pub(super) before: usize,
    /// Time \[s\]; NaN if it is unknown.
    pub(super) time: f64,
    /// Configuration, shape = (joints) \[rad\] or \[m\].
    pub(super) configuration: Vec<f64>,
}

impl Stop {
    /// Returns the stop in a table that has `rows` further rows before.
    pub(super) fn moved_by(&self, rows: usize) -> Self {
        Self { before: self.before + rows, ..self.clone() }
    }
}

/// Chronological order of the rows: session by session, and by time within a session.
#[derive(Debug, Clone)]
struct Chronology {
    /// For each row, the position in the order of the first row or stop of its session, and of
    /// itself.
    places: Vec<(u32, u32)>,
    /// Columns in chronological order, with the stops between rows; `None` if the table already has
    /// that order and no stops.
    sorted: Option<Past>,
}

impl Chronology {
    fn new(table: &Measurements) -> Self {
        let session = |row: usize| table.session.of_row.get(row).copied().unwrap_or(0);
        let mut rows: Vec<usize> = (0..table.len()).collect();
        rows.sort_by(|&a, &b| {
            session(a).cmp(&session(b)).then(table.time[a].total_cmp(&table.time[b]))
        });
        let mut places = vec![(0, 0); rows.len()];
        let (mut begin, mut at) = (0, 0);
        let is_in_order = rows.is_sorted() && table.stops.is_empty();
        let mut past = Past::default();
        for (&row, &before) in rows.iter().zip(rows.first().into_iter().chain(&rows)) {
            let is_first = row == before || session(row) != session(before);
            if is_first {
                begin = at;
            }
            for stop in table.stops_of(row) {
                past.add_stop(stop, table, (row, (!is_first).then_some(before)));
                at += 1;
            }
            places[row] = (begin, at);
            if !is_in_order {
                past.add_row(table, row);
            }
            at += 1;
        }
        Self { places, sorted: (!is_in_order).then_some(past) }
    }
}

impl Past {
    /// Appends a row of a table.
    fn add_row(&mut self, table: &Measurements, row: usize) {
        let of_joints = row * table.joints..(row + 1) * table.joints;
        self.times.push(table.time[row]);
        self.temperatures.extend(table.temperature.as_ref().map(|column| column[row]));
        self.configurations.extend(&table.configurations[of_joints.clone()]);
        self.approaches.extend(table.approach.iter().flat_map(|all| &all[of_joints.clone()]));
    }

    /// Appends a stop between two rows of a table; the first is `None` at the start of a session.
    /// Its direction of approach is that of the step to it, and the temperature is linear in time.
    fn add_stop(
        &mut self,
        stop: &Stop,
        table: &Measurements,
        (row, before): (usize, Option<usize>),
    ) {
        let until = table.time[row];
        let since = before.map_or(f64::MIN, |before| table.time[before]);
        let last = self.times.last().copied().filter(|_| before.is_some());
        let time = stop.time.max(last.unwrap_or(since)).min(until);
        let time = if stop.time.is_nan() { until } else { time };
        self.times.push(time);
        self.configurations.extend(&stop.configuration);
        self.temperatures.extend(table.temperature.as_ref().map(|column| {
            let part = before.map_or(1.0, |_| (time - since) / (until - since));
            let first = column[before.unwrap_or(row)];
            if part.is_finite() { first + part * (column[row] - first) } else { column[row] }
        }));
        let sides = table.approach.iter().flat_map(|_| std::iter::repeat_n(0.0, table.joints));
        self.approaches.extend(sides);
    }
}

impl Measurements {
    /// Returns the median time between successive rows of different configurations, and the
    /// duration of the longest session \[s\]. Returns `None` if times were not measured or no
    /// configuration changes.
    pub(crate) fn clock(&self) -> Option<(f64, f64)> {
        let places = &self.chronology().places;
        let mut rows: Vec<usize> = (0..self.len()).collect();
        rows.sort_by_key(|&row| places[row]);
        let mut start = *rows.first()?;
        let (mut between, mut longest) = (Vec::new(), 0.0_f64);
        for (&row, &before) in rows.iter().zip(rows.iter().take(1).chain(&rows)) {
            let is_next = places[row].0 == places[before].0;
            if !is_next {
                start = row;
            }
            longest = longest.max(self.time[row] - self.time[start]);
            let step = self.time[row] - self.time[before];
            let moved = self.configuration(row) != self.configuration(before);
            between.extend((is_next && step > 0.0 && moved).then_some(step));
        }
        between.sort_by(f64::total_cmp);
        between
            .get(between.len() / 2)
            .filter(|_| self.time_measured)
            .map(|median| (*median, longest))
    }

    /// Returns a warning, located at the first such row, if a row is earlier than the one before it
    /// in the same file and session.
    pub(super) fn time_going_back(&self) -> Option<Warning> {
        if !self.time_measured {
            return None;
        }
        let file = |row: usize| self.origin.get(row).map(|origin| origin.0);
        let session = |row: usize| self.session.of_row.get(row);
        let mut last: HashMap<_, f64> = HashMap::new();
        let mut back: Vec<(usize, f64)> = Vec::new();
        for row in 0..self.len() {
            let before = last.insert((file(row), session(row)), self.time[row]);
            back.extend(
                before.map(|before| (row, before - self.time[row])).filter(|(_, by)| *by > 0.0),
            );
        }
        let &(row, by) = back.first()?;
        let kind = WarningKind::TimeGoesBack {
            rows: back.len(),
            back: format!("{by:.3}"),
            is_midnight: back.iter().all(|(_, by)| MIDNIGHT_STEPS.contains(by)),
        };
        Some(Warning { location: self.location(row), kind })
    }

    /// Returns a copy with the given rows, as [`select`](Self::select) does. The past of each row
    /// still consists of all rows of this table, until the copy is copied again.
    pub(crate) fn select_with_past(&self, rows: &[usize]) -> Self {
        let Chronology { places, sorted } = self.chronology();
        let columns = || self.columns().to_owned();
        let order = Chronology {
            places: rows.iter().map(|&row| places[row]).collect(),
            sorted: Some(sorted.clone().unwrap_or_else(columns)),
        };
        Self { order: RowOrder(OnceLock::from(order)), ..self.select(rows) }
    }

    /// Returns the rows with directions of approach, all unknown (0) if the table has none, for an
    /// arm whose fitted rows `had` them. Without the column the moment of the loads would decide on
    /// which side of its play a joint rests.
    pub(crate) fn with_sides(&self, had: bool) -> Cow<'_, Self> {
        if !had || self.approach.is_some() {
            return Cow::Borrowed(self);
        }
        let approach = Some(vec![0.0; self.configurations.len()]);
        // The past stays the same, because an unknown direction reads as none.
        Cow::Owned(Self { approach, order: RowOrder(self.order.0.clone()), ..self.clone() })
    }

    /// Returns the stops since the row that was measured before `row`.
    fn stops_of(&self, row: usize) -> &[Stop] {
        let first = self.stops.partition_point(|stop| stop.before < row);
        let next = self.stops.partition_point(|stop| stop.before <= row);
        &self.stops[first..next]
    }

    /// Returns the stops before each of some rows, for a table of these rows alone.
    pub(super) fn stops_before(&self, rows: &[usize]) -> Vec<Stop> {
        let moved = |(before, &row): (usize, &usize)| {
            self.stops_of(row).iter().map(move |stop| Stop { before, ..stop.clone() })
        };
        rows.iter().enumerate().flat_map(moved).collect()
    }

    /// Returns the columns on which the past of a pose depends, in the order of the rows.
    fn columns(&self) -> Past<&[f64]> {
        Past {
            times: &self.time,
            temperatures: self.temperature.as_deref().unwrap_or_default(),
            configurations: &self.configurations,
            approaches: self.approach.as_deref().unwrap_or_default(),
        }
    }

    /// Returns the chronological order, which is computed at the first call.
    fn chronology(&self) -> &Chronology {
        self.order.0.get_or_init(|| Chronology::new(self))
    }
}

impl PoseTable for Measurements {
    /// Returns the earlier rows of the session of a row, in chronological order.
    fn past(&self, row: usize) -> Past<&[f64]> {
        let Chronology { places, sorted } = self.chronology();
        let Some((begin, at)) = places.get(row).map(|&(begin, at)| (begin as usize, at as usize))
        else {
            return Past::default();
        };
        let n = self.joints;
        let columns = sorted.as_ref().map_or_else(|| self.columns(), Past::view);
        Past {
            times: columns.times.get(begin..at).unwrap_or_default(),
            // Without times the age of a temperature is unknown.
            temperatures: columns
                .temperatures
                .get(begin..at)
                .filter(|_| self.time_measured)
                .unwrap_or_default(),
            configurations: columns.configurations.get(begin * n..at * n).unwrap_or_default(),
            approaches: columns.approaches.get(begin * n..at * n).unwrap_or_default(),
        }
    }

    fn exposed(&self, row: usize, camera: usize) -> Option<(&[f64], f64)> {
        let velocities = self.velocities.as_deref()?;
        let of_row = velocities.get(row * self.joints..(row + 1) * self.joints)?;
        let is_of_camera = self.observation(row).fixtures()[0] == Some(camera);
        is_of_camera.then(|| (of_row, self.positions[row].y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Labels;
    use crate::problem::PoseView;

    #[test]
    fn past_is_chronological_within_a_session() {
        let table = Measurements {
            joints: 2,
            files: vec!["table.csv".into()],
            origin: (2..7).map(|line| (0, line)).collect(),
            positions: vec![nalgebra::Vector3::zeros(); 5],
            configurations: (0..10).map(f64::from).collect(),
            time: vec![5.0, 0.0, 3.0, 1.0, 4.0],
            time_measured: true,
            temperature: Some(vec![20.0, 21.0, 22.0, 23.0, 24.0]),
            session: ["a", "a", "b", "b", "a"].into_iter().collect::<Labels>(),
            ..Measurements::default()
        };
        assert_eq!(table.clock(), Some((2.0, 5.0)));
        // Row 1 is earlier than row 0 in session a, row 3 earlier than row 2 in session b.
        let warning = table.time_going_back().unwrap();
        let back = "5.000".to_owned();
        assert_eq!(warning.kind, WarningKind::TimeGoesBack { rows: 2, back, is_midnight: false });
        assert_eq!(warning.location.line, Some(3));
        let past = table.past(0);
        assert_eq!(
            (past.times, past.temperatures),
            ([0.0, 4.0].as_slice(), [21.0, 24.0].as_slice())
        );
        assert_eq!(
            (past.configurations, past.approaches),
            ([2.0, 3.0, 8.0, 9.0].as_slice(), [].as_slice())
        );
        assert_eq!(table.past(2).times, [1.0]);
        assert!(table.past(1).times.is_empty() && table.past(3).configurations.is_empty());
        // A selection has few rows, but each keeps its whole past if asked.
        let some = [2, 0];
        let [few, with_past] = [table.select(&some), table.select_with_past(&some)];
        assert!(few.past(0).times.is_empty() && with_past.len() == 2);
        assert_eq!([with_past.past(0), with_past.past(1)], [table.past(2), past]);
        let in_order = table.select(&[1, 4, 0, 3, 2]);
        assert_eq!(in_order.time_going_back(), None);
        assert_eq!(
            (in_order.past(2).times, in_order.past(4).temperatures),
            (past.times, [23.0].as_slice())
        );
        // An owned copy of a row's conditions keeps the same past.
        let setup = table.setup(0, &table.session_starts());
        assert_eq!((setup.past.read(), setup.past.place()), (past, Some(0)));
        assert_eq!(setup.to_owned().view().past.read(), past);
        let unknown = PoseView::from_configuration(setup.configuration).past;
        assert!(unknown.read().times.is_empty() && unknown.place().is_none());
    }
}

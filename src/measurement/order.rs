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

/// Chronological order of the rows: session by session, and by time within a session.
#[derive(Debug)]
struct Chronology {
    /// For each row, the position in the order of the first row of its session, and of itself.
    places: Vec<(u32, u32)>,
    /// Columns in chronological order; `None` if the table already has that order.
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
        let mut begin = 0_u32;
        for ((&row, &before), at) in rows.iter().zip(rows.first().into_iter().chain(&rows)).zip(0..)
        {
            if session(row) != session(before) {
                begin = at;
            }
            places[row] = (begin, at);
        }
        let n = table.joints;
        let sorted_column = |column: &[f64]| rows.iter().map(|&row| column[row]).collect();
        let sorted_joints = |column: &[f64]| {
            rows.iter().flat_map(|&row| &column[row * n..(row + 1) * n]).copied().collect()
        };
        let sorted = (!rows.is_sorted()).then(|| Past {
            times: sorted_column(&table.time),
            temperatures: table.temperature.as_deref().map(sorted_column).unwrap_or_default(),
            configurations: sorted_joints(&table.configurations),
            approaches: table.approach.as_deref().map(sorted_joints).unwrap_or_default(),
        });
        Self { places, sorted }
    }
}

impl Measurements {
    /// Returns the median time between successive rows of different configurations, and the
    /// duration of the longest session \[s\]. Returns `None` if times were not measured or no
    /// configuration changes.
    pub(crate) fn clock(&self) -> Option<(f64, f64)> {
        let chronology = self.chronology();
        let sorted = chronology.sorted.as_ref();
        let times = sorted.map_or(self.time.as_slice(), |sorted| &sorted.times);
        let configurations =
            sorted.map_or(self.configurations.as_slice(), |sorted| &sorted.configurations);
        let at_pose = |k: usize| configurations.get(k * self.joints..(k + 1) * self.joints);
        let (mut between, mut longest) = (Vec::new(), 0.0_f64);
        for &(begin, at) in &chronology.places {
            let (begin, at) = (begin as usize, at as usize);
            longest = longest.max(times[at] - times[begin]);
            let is_next = at > begin && times[at] > times[at - 1] && at_pose(at) != at_pose(at - 1);
            between.extend(is_next.then(|| times[at] - times[at - 1]));
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
        Cow::Owned(Self { approach: Some(vec![0.0; self.configurations.len()]), ..self.clone() })
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

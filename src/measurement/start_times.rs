//! Time of the first pose of each session, from which elapsed time is counted.

use std::collections::BTreeMap;

use super::Measurements;
use super::time::FIRST_DATE;

/// Time of the first pose of each session \[s\].
#[derive(Debug, Clone, PartialEq)]
pub struct StartTimes {
    /// Time of the first pose of all sessions \[s\].
    pub first: f64,
    /// Time of the first pose of each named session \[s\]; empty if no session has a name.
    pub sessions: BTreeMap<String, f64>,
}

impl StartTimes {
    /// Returns the time of the first pose of a session \[s\]; `None` for an unknown session. If no
    /// session has a name, all rows are one session.
    pub fn of_session(&self, name: &str) -> Option<f64> {
        if self.sessions.is_empty() { Some(self.first) } else { self.sessions.get(name).copied() }
    }

    /// Returns true if times are dates, not seconds since another start.
    pub(crate) fn are_dates(&self) -> bool {
        self.first >= FIRST_DATE
    }

    /// Returns the days from the first pose of these sessions to the first of `rows`; `None` unless
    /// both have dates.
    #[doc(hidden)]
    pub fn days_until(&self, rows: &Measurements) -> Option<f64> {
        let later = rows.start_times().first - self.first;
        (rows.has_dates() && self.are_dates()).then_some(later / 86_400.0)
    }
}

impl Measurements {
    /// Returns true if times were measured and are dates, not seconds since another start.
    #[doc(hidden)]
    pub fn has_dates(&self) -> bool {
        self.time_measured && self.time.iter().all(|&time| time >= FIRST_DATE)
    }

    /// Returns the time of the first pose of each session.
    pub(crate) fn start_times(&self) -> StartTimes {
        let starts = self.session_starts();
        let named = self.session.names.iter().cloned().zip(starts.iter().copied());
        StartTimes {
            first: starts.iter().copied().fold(f64::INFINITY, f64::min),
            sessions: named.filter(|(name, _)| !name.is_empty()).collect(),
        }
    }

    /// Returns the time of the first pose of each session in the order of their names \[s\].
    pub(crate) fn session_starts(&self) -> Vec<f64> {
        let mut starts = vec![f64::INFINITY; self.session.names.len()];
        for (&session, &time) in self.session.of_row.iter().zip(&self.time) {
            if let Some(start) = starts.get_mut(session) {
                *start = start.min(time);
            }
        }
        starts
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn time_counts_from_the_first_pose_of_each_session() {
        let table = Measurements {
            positions: vec![Vector3::zeros(); 4],
            time: vec![100.0, 160.0, 5000.0, 5030.0],
            session: ["A", "A", "B", "B"].into_iter().collect(),
            ..Measurements::default()
        };
        let starts = table.session_starts();
        let elapsed: Vec<f64> =
            (0..table.len()).map(|row| table.setup(row, &starts).elapsed).collect();
        assert_eq!(elapsed, [0.0, 60.0, 0.0, 30.0]);
        let starts = table.start_times();
        assert_eq!((starts.of_session("B"), starts.of_session("C")), (Some(5000.0), None));
        let unnamed = Measurements { session: ["", ""].into_iter().collect(), ..table };
        assert_eq!(unnamed.start_times().of_session("C"), Some(100.0));
    }
}

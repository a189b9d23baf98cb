//! Tables of measurements one after the other.

use super::Measurements;

impl Measurements {
    /// Returns these rows followed by those of a table with the same columns, sessions and targets.
    #[must_use]
    pub(crate) fn concatenate(&self, other: &Self) -> Self {
        fn both<T: Clone>([first, second]: [&Option<Vec<T>>; 2]) -> Option<Vec<T>> {
            Some([first.as_deref()?, second.as_deref()?].concat())
        }
        let mut joined = self.clone();
        joined.origin.extend(&other.origin);
        joined.configurations.extend(&other.configurations);
        joined.other_configurations =
            both([&self.other_configurations, &other.other_configurations]);
        if !self.observations.is_empty() || !other.observations.is_empty() {
            let each = |table: &Self| {
                (0..table.len()).map(|row| table.observation(row)).collect::<Vec<_>>()
            };
            joined.observations = [each(self), each(other)].concat();
        }
        joined.positions.extend(&other.positions);
        joined.orientations = both([&self.orientations, &other.orientations]);
        joined.sigma = both([&self.sigma, &other.sigma]);
        joined.payload = both([&self.payload, &other.payload]);
        joined.hoist = both([&self.hoist, &other.hoist]);
        joined.temperature = both([&self.temperature, &other.temperature]);
        joined.time.extend(&other.time);
        joined.approach = both([&self.approach, &other.approach]);
        joined.velocities = both([&self.velocities, &other.velocities]);
        joined.covariates.extend(&other.covariates);
        joined.pose = both([&self.pose, &other.pose]);
        joined.session.of_row.extend(&other.session.of_row);
        if let (Some(target), Some(other)) = (&mut joined.target, &other.target) {
            target.of_row.extend(&other.of_row);
        }
        if let (Some(marked), Some(other)) = (&mut joined.marked_held_out, &other.marked_held_out) {
            marked.extend(other);
        }
        joined.nests.extend(other.nests.iter().cloned());
        joined.stops.extend(other.stops.iter().map(|stop| stop.moved_by(self.len())));
        joined
    }
}

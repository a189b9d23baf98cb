//! Earlier poses of a session, on which effects with memory depend.

use std::fmt;

/// Poses of a session measured before a given one, in order; empty if there are none or they are
/// unknown.
///
/// V is a list with one number per pose, or one per pose and joint: `Vec<f64>` or `&[f64]`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Past<V = Vec<f64>> {
    /// Times, shape = (poses) \[s\], ascending.
    pub times: V,
    /// Temperatures, shape = (poses) [°C]; empty if unknown.
    pub temperatures: V,
    /// Configurations, shape = (poses, joints), row-major \[rad\] or \[m\].
    pub configurations: V,
    /// Directions of approach, shape = (poses, joints), −1, 0 or +1; empty if unknown.
    pub approaches: V,
}

impl Past<&[f64]> {
    /// Returns a copy that owns its numbers.
    pub(crate) fn to_owned(self) -> Past {
        Past {
            times: self.times.to_vec(),
            temperatures: self.temperatures.to_vec(),
            configurations: self.configurations.to_vec(),
            approaches: self.approaches.to_vec(),
        }
    }
}

impl Past {
    /// Returns a view that borrows the numbers.
    pub(crate) fn view(&self) -> Past<&[f64]> {
        Past {
            times: &self.times,
            temperatures: &self.temperatures,
            configurations: &self.configurations,
            approaches: &self.approaches,
        }
    }
}

/// Table of poses that provides the earlier poses of each row.
pub(crate) trait PoseTable: Sync {
    /// Returns the earlier poses of a row.
    fn past(&self, row: usize) -> Past<&[f64]>;

    /// Returns the velocities of the joints \[rad/s\] or \[m/s\] and the row of the image \[px\] if a
    /// row of the table measures a pixel of the camera with this index among the fixtures and
    /// velocities are recorded.
    fn exposed(&self, _row: usize, _camera: usize) -> Option<(&[f64], f64)> {
        None
    }
}

/// Provides itself as the past of a single pose.
impl PoseTable for Past {
    fn past(&self, _row: usize) -> Past<&[f64]> {
        self.view()
    }
}

/// Past of a pose that is looked up only when it is read, because few poses need it.
#[derive(Clone, Copy, Default)]
pub struct LazyPast<'a> {
    table: Option<&'a dyn PoseTable>,
    row: u32,
}

impl<'a> LazyPast<'a> {
    /// Returns the past of a row of a table.
    pub(crate) fn row(table: &'a dyn PoseTable, row: u32) -> Self {
        Self { table: Some(table), row }
    }

    /// Returns the velocities and the row of the image of [`PoseTable::exposed`].
    pub(crate) fn exposed(self, camera: usize) -> Option<(&'a [f64], f64)> {
        self.table?.exposed(self.row as usize, camera)
    }

    /// Returns the index of the pose's row in its table (0 for a single pose), or `None` without a
    /// table.
    pub(crate) fn place(self) -> Option<u32> {
        self.table.map(|_| self.row)
    }

    /// Returns the earlier poses.
    pub fn read(self) -> Past<&'a [f64]> {
        self.table.map(|table| table.past(self.row as usize)).unwrap_or_default()
    }
}

/// Borrows the earlier poses of a single pose, as row 0.
impl<'a> From<&'a Past> for LazyPast<'a> {
    fn from(past: &'a Past) -> Self {
        Self::row(past, 0)
    }
}

impl PartialEq for LazyPast<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.read() == other.read()
    }
}

impl fmt::Debug for LazyPast<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.read().fmt(f)
    }
}

/// Number of time constants or friction distances after which the past has no influence, because
/// exp(−36) is below double precision.
const MAX_DECAY_LENGTHS: f64 = 36.0;

impl Past<&[f64]> {
    /// Returns the temperature T̃ of a body that follows the measured temperature T with a time
    /// constant τ \[s\]: dT̃/dt = (T − T̃)/τ [°C].
    ///
    /// `now` is a time \[s\] with the temperature measured then [°C]. T is linear between readings,
    /// and T̃ starts at the first reading.
    pub fn lagged_temperature(&self, now: (f64, f64), time_constant: f64) -> f64 {
        let first = self
            .times
            .partition_point(|time| *time < now.0 - MAX_DECAY_LENGTHS * time_constant)
            .saturating_sub(1);
        ThermalLag { time_constant, progress: None }.advance_from(first, self, now)
    }

    /// Returns the friction state z ∈ [−1, 1] of a joint (counted from 0) after a Dahl model: over
    /// a travel Δq towards the side g = ±1, z = g + (z' − g) exp(−|Δq|/s). \[Dahl 1968\]
    ///
    /// `q` and `side` are coordinate and approach direction of the pose; `distance` is s \[rad\] or
    /// \[m\]. If the side is unknown (0), the sign of Δq replaces it. At the first pose of the
    /// session, z equals the side of approach.
    pub fn friction_state(&self, joint: usize, (q, side): (f64, f64), distance: f64) -> f64 {
        let joints = self.configurations.len().checked_div(self.times.len()).unwrap_or(0);
        let value_at =
            |column: &[f64], pose: usize| column.get(pose * joints + joint).copied().unwrap_or(0.0);
        let (mut q, mut side) = (q, side);
        let (mut travelled, mut state) = (0.0, 0.0);
        for pose in (0..self.times.len()).rev() {
            let before = value_at(self.configurations, pose);
            let travel = (q - before).abs() / distance;
            let towards = if side == 0.0 { (q - before).signum() } else { side };
            state += towards * f64::exp(-travelled) * -(-travel).exp_m1();
            travelled += travel;
            (q, side) = (before, value_at(self.approaches, pose));
            if travelled > MAX_DECAY_LENGTHS {
                return state;
            }
        }
        state + side * f64::exp(-travelled)
    }

    /// Returns the derivative of [`Past::friction_state`] with respect to q, ±(g − z)/s; 0 without
    /// an earlier pose.
    pub fn friction_state_slope(&self, joint: usize, (q, side): (f64, f64), distance: f64) -> f64 {
        let joints = self.configurations.len().checked_div(self.times.len()).unwrap_or(0);
        let last = self
            .times
            .len()
            .checked_sub(1)
            .and_then(|pose| self.configurations.get(pose * joints + joint));
        let travel = last.map_or(0.0, |before| q - before);
        if travel == 0.0 {
            return 0.0;
        }
        let towards = if side == 0.0 { travel.signum() } else { side };
        (towards - self.friction_state(joint, (q, side), distance)) * travel.signum() / distance
    }
}

/// Integrator of a lagged temperature over the poses of a session in order; each call continues
/// from the previous pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ThermalLag {
    time_constant: f64,
    /// Start of the session's data in memory, number of poses processed, and T̃ at the last of
    /// them.
    progress: Option<(usize, usize, f64)>,
}

impl ThermalLag {
    /// Returns a lag with the time constant \[s\].
    pub fn new(time_constant: f64) -> Self {
        Self { time_constant, progress: None }
    }

    /// Advances to `now`, a time \[s\] and the temperature then [°C], and returns the lagged
    /// temperature T̃ [°C] there. `past` holds the earlier poses of the session.
    pub fn advance(&mut self, past: &Past<&[f64]>, now: (f64, f64)) -> f64 {
        self.advance_from(0, past, now)
    }

    fn advance_from(&mut self, first: usize, past: &Past<&[f64]>, now: (f64, f64)) -> f64 {
        let reading = |k: usize| Some((*past.times.get(k)?, *past.temperatures.get(k)?));
        let session = past.times.as_ptr().addr();
        let continues = |(start, processed, _): &(usize, usize, f64)| {
            *start == session && *processed <= past.times.len()
        };
        let restart = || Some((session, first + 1, reading(first)?.1));
        let Some((_, mut processed, mut lagged)) = self.progress.filter(continues).or_else(restart)
        else {
            return now.1;
        };
        while let Some((before, next)) = reading(processed - 1).zip(reading(processed)) {
            lagged = self.advance_reading(lagged, before, next);
            processed += 1;
        }
        self.progress = Some((session, processed, lagged));
        reading(processed - 1).map_or(now.1, |before| self.advance_reading(lagged, before, now))
    }

    /// Returns T̃ at the reading `next` after a linear change of T from the reading `before`, each
    /// a time \[s\] and a temperature [°C]. There T̃' is `lagged`: T̃ = T − (1 − e) τ ΔT/Δt + (T̃'
    /// − T') e with e = exp(−Δt/τ).
    fn advance_reading(&self, lagged: f64, before: (f64, f64), next: (f64, f64)) -> f64 {
        let passed = (next.0 - before.0) / self.time_constant;
        let mean_delay = if passed > 0.0 { -(-passed).exp_m1() / passed } else { 1.0 };
        next.1 - mean_delay * (next.1 - before.1) + (lagged - before.1) * (-passed).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 4] = [0.0, 60.0, 200.0, 230.0];

    #[test]
    fn lagged_temperature_solves_its_differential_equation() {
        let temperatures = [20.0, 26.0, 21.0, 30.0];
        let past = Past { times: &TIMES[..3], temperatures: &temperatures[..3], ..Past::default() };
        let (steps, tau) = (200_000, 90.0);
        let mut lagged = 20.0;
        for step in 0..steps {
            let t = 230.0 * (f64::from(step) + 0.5) / f64::from(steps);
            let k = TIMES.iter().rposition(|time| *time <= t).unwrap();
            let part = (t - TIMES[k]) / (TIMES[k + 1] - TIMES[k]);
            let air = temperatures[k] + part * (temperatures[k + 1] - temperatures[k]);
            lagged += (air - lagged) / tau * 230.0 / f64::from(steps);
        }
        let found = past.lagged_temperature((230.0, 30.0), tau);
        assert!((found - lagged).abs() < 1e-4, "{found}, not {lagged}");
        assert!((past.lagged_temperature((230.0, 30.0), 1e-3) - 30.0).abs() < 1e-3);
        assert!((past.lagged_temperature((230.0, 30.0), 1e9) - 20.0).abs() < 1e-5);
        assert_eq!(
            Past::default().lagged_temperature((5.0, 17.0), 30.0).to_bits(),
            17_f64.to_bits()
        );
        let mut lag = ThermalLag::new(tau);
        for k in [0, 2, 3, 1] {
            let past =
                Past { times: &TIMES[..k], temperatures: &temperatures[..k], ..Past::default() };
            let (one_by_one, alone) = (
                lag.advance(&past, (TIMES[k], temperatures[k])),
                past.lagged_temperature((TIMES[k], temperatures[k]), tau),
            );
            assert!((one_by_one - alone).abs() < 1e-12, "{k}: {one_by_one}, not {alone}");
        }
    }

    #[test]
    fn friction_state_follows_the_travel_of_a_joint() {
        let commands = [0.1, 0.7, 0.5, 0.9];
        let mut z: f64 = -1.0;
        for k in 0..4 {
            if k > 0 {
                let travel: f64 = commands[k] - commands[k - 1];
                z = travel.signum() + (z - travel.signum()) * (-travel.abs() / 0.3).exp();
            }
            let configurations: Vec<f64> = commands[..k].iter().flat_map(|q| [9.0, *q]).collect();
            let approaches: Vec<f64> =
                [0.0, -1.0].into_iter().chain([0.0; 6]).take(2 * k).collect();
            let past = Past {
                times: &TIMES[..k],
                configurations: &configurations,
                approaches: &approaches,
                ..Past::default()
            };
            let found = past.friction_state(1, (commands[k], if k == 0 { -1.0 } else { 0.0 }), 0.3);
            assert!((found - z).abs() < 1e-12, "pose {k}: {found}, not {z}");
        }
    }
}

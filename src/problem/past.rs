//! What was before a pose: effects with a memory know it.

use std::fmt;

/// The poses of a session that were measured before one, from the first to the last; empty where
/// none were, or none are known.
///
/// V holds one number per pose, or one per pose and joint: a `Vec<f64>` or a `&[f64]`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Past<V = Vec<f64>> {
    /// Times, shape = (poses) \[s\], ascending.
    pub times: V,
    /// Temperatures, shape = (poses) [°C]; empty: not known.
    pub temperatures: V,
    /// Configurations, shape = (poses, joints), pose after pose \[rad\] or \[m\].
    pub configurations: V,
    /// Directions of approach, shape = (poses, joints), −1, 0 or +1; empty: not known.
    pub approaches: V,
}

impl Past<&[f64]> {
    /// The same with numbers of its own.
    pub(super) fn to_owned(self) -> Past {
        Past {
            times: self.times.to_vec(),
            temperatures: self.temperatures.to_vec(),
            configurations: self.configurations.to_vec(),
            approaches: self.approaches.to_vec(),
        }
    }
}

impl Past {
    /// The same for who only reads it.
    pub(crate) fn view(&self) -> Past<&[f64]> {
        Past {
            times: &self.times,
            temperatures: &self.temperatures,
            configurations: &self.configurations,
            approaches: &self.approaches,
        }
    }
}

/// A table of poses that knows what was before each of its rows.
pub(crate) trait PoseTable: Sync {
    /// The past of a row.
    fn past(&self, row: usize) -> Past<&[f64]>;
}

/// The past of one pose alone.
impl PoseTable for Past {
    fn past(&self, _row: usize) -> Past<&[f64]> {
        self.view()
    }
}

/// What was before a pose, looked up where it is needed: most poses are never asked.
#[derive(Clone, Copy, Default)]
pub struct PastOf<'a> {
    table: Option<&'a dyn PoseTable>,
    row: u32,
}

impl<'a> PastOf<'a> {
    /// What was before a row of a table.
    pub(crate) fn row(table: &'a dyn PoseTable, row: u32) -> Self {
        Self { table: Some(table), row }
    }

    /// Its row in its table, 0 where it is of one pose alone; `None`: there is none.
    pub(crate) fn place(self) -> Option<u32> {
        self.table.map(|_| self.row)
    }

    /// The poses before.
    pub fn read(self) -> Past<&'a [f64]> {
        self.table.map(|table| table.past(self.row as usize)).unwrap_or_default()
    }
}

/// The past of a pose that has one of its own.
impl<'a> From<&'a Past> for PastOf<'a> {
    fn from(past: &'a Past) -> Self {
        Self::row(past, 0)
    }
}

impl PartialEq for PastOf<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.read() == other.read()
    }
}

impl fmt::Debug for PastOf<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.read().fmt(f)
    }
}

/// Beyond this many time constants or distances nothing is left of what was before: exp(−36) is
/// below rounding.
const FORGOTTEN: f64 = 36.0;

impl Past<&[f64]> {
    /// Temperature of what follows the measured one with a time constant τ \[s\], dT̃/dt = (T −
    /// T̃)/τ, at a `time` \[s\] at which T is measured [°C].
    ///
    /// T goes evenly from each reading to the next, and T̃ begins at the first of them.
    pub fn lagging(&self, now: (f64, f64), time_constant: f64) -> f64 {
        let first = self
            .times
            .partition_point(|time| *time < now.0 - FORGOTTEN * time_constant)
            .saturating_sub(1);
        Lag { time_constant, known: None }.felt_from(first, self, now)
    }

    /// Which part of its friction pulls a joint, counted from 0, back the way on which it came, −1
    /// to 1: on a way Δq it follows the side g = ±1 from which the joint comes, z = g + (z' − g)
    /// exp(−|Δq|/s), with a distance s \[rad\] or \[m\]. \[Dahl 1968\]
    ///
    /// The side is that of the pose, or the sign of Δq where that is not known; z begins at the
    /// side of the first pose.
    pub fn dragged(&self, joint: usize, (q, side): (f64, f64), distance: f64) -> f64 {
        let joints = self.configurations.len().checked_div(self.times.len()).unwrap_or(0);
        let of =
            |column: &[f64], pose: usize| column.get(pose * joints + joint).copied().unwrap_or(0.0);
        let (mut q, mut side) = (q, side);
        let (mut gone, mut pulled) = (0.0, 0.0);
        for pose in (0..self.times.len()).rev() {
            let before = of(self.configurations, pose);
            let way = (q - before).abs() / distance;
            let towards = if side == 0.0 { (q - before).signum() } else { side };
            pulled += towards * f64::exp(-gone) * -(-way).exp_m1();
            gone += way;
            (q, side) = (before, of(self.approaches, pose));
            if gone > FORGOTTEN {
                return pulled;
            }
        }
        pulled + side * f64::exp(-gone)
    }

    /// Derivative of [`Past::dragged`] by q, (g − z)/s along the way: 0 where no pose was before.
    pub fn drag_slope(&self, joint: usize, (q, side): (f64, f64), distance: f64) -> f64 {
        let joints = self.configurations.len().checked_div(self.times.len()).unwrap_or(0);
        let last = self
            .times
            .len()
            .checked_sub(1)
            .and_then(|pose| self.configurations.get(pose * joints + joint));
        let way = last.map_or(0.0, |before| q - before);
        if way == 0.0 {
            return 0.0;
        }
        let towards = if side == 0.0 { way.signum() } else { side };
        (towards - self.dragged(joint, (q, side), distance)) * way.signum() / distance
    }
}

/// What follows the temperature, pose after pose of a session in order: each from the one before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lag {
    time_constant: f64,
    /// Where the poses of the session begin in memory, how many of them are behind, and T̃ at the
    /// last.
    known: Option<(usize, usize, f64)>,
}

impl Lag {
    /// With a time constant \[s\].
    pub fn new(time_constant: f64) -> Self {
        Self { time_constant, known: None }
    }

    /// T̃ [°C] at a time \[s\] at which T is measured [°C].
    pub fn felt(&mut self, past: &Past<&[f64]>, now: (f64, f64)) -> f64 {
        self.felt_from(0, past, now)
    }

    fn felt_from(&mut self, first: usize, past: &Past<&[f64]>, now: (f64, f64)) -> f64 {
        let reading = |k: usize| Some((*past.times.get(k)?, *past.temperatures.get(k)?));
        let session = past.times.as_ptr().addr();
        let ahead =
            |(own, behind, _): &(usize, usize, f64)| *own == session && *behind <= past.times.len();
        let begin = || Some((session, first + 1, reading(first)?.1));
        let Some((_, mut behind, mut felt)) = self.known.filter(ahead).or_else(begin) else {
            return now.1;
        };
        while let Some((before, next)) = reading(behind - 1).zip(reading(behind)) {
            felt = self.after(felt, before, next);
            behind += 1;
        }
        self.known = Some((session, behind, felt));
        reading(behind - 1).map_or(now.1, |before| self.after(felt, before, now))
    }

    /// T̃ after T went evenly from one reading to the next: by the rate times τ it stays behind in
    /// the end, T̃ = T − (1 − e) τ ΔT/Δt + (T̃' − T') e, e = exp(−Δt/τ).
    fn after(&self, felt: f64, before: (f64, f64), next: (f64, f64)) -> f64 {
        let passed = (next.0 - before.0) / self.time_constant;
        let behind = if passed > 0.0 { -(-passed).exp_m1() / passed } else { 1.0 };
        next.1 - behind * (next.1 - before.1) + (felt - before.1) * (-passed).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 4] = [0.0, 60.0, 200.0, 230.0];

    #[test]
    fn what_lags_follows_its_differential_equation() {
        let temperatures = [20.0, 26.0, 21.0, 30.0];
        let past = Past { times: &TIMES[..3], temperatures: &temperatures[..3], ..Past::default() };
        let (steps, tau) = (200_000, 90.0);
        let mut felt = 20.0;
        for step in 0..steps {
            let t = 230.0 * (f64::from(step) + 0.5) / f64::from(steps);
            let k = TIMES.iter().rposition(|time| *time <= t).unwrap();
            let part = (t - TIMES[k]) / (TIMES[k + 1] - TIMES[k]);
            let air = temperatures[k] + part * (temperatures[k + 1] - temperatures[k]);
            felt += (air - felt) / tau * 230.0 / f64::from(steps);
        }
        let found = past.lagging((230.0, 30.0), tau);
        assert!((found - felt).abs() < 1e-4, "{found}, not {felt}");
        assert!((past.lagging((230.0, 30.0), 1e-3) - 30.0).abs() < 1e-3);
        assert!((past.lagging((230.0, 30.0), 1e9) - 20.0).abs() < 1e-5);
        assert_eq!(Past::default().lagging((5.0, 17.0), 30.0).to_bits(), 17_f64.to_bits());
        let mut lag = Lag::new(tau);
        for k in [0, 2, 3, 1] {
            let past =
                Past { times: &TIMES[..k], temperatures: &temperatures[..k], ..Past::default() };
            let (one_by_one, alone) = (
                lag.felt(&past, (TIMES[k], temperatures[k])),
                past.lagging((TIMES[k], temperatures[k]), tau),
            );
            assert!((one_by_one - alone).abs() < 1e-12, "{k}: {one_by_one}, not {alone}");
        }
    }

    #[test]
    fn friction_follows_the_way_of_a_joint() {
        let commands = [0.1, 0.7, 0.5, 0.9];
        let mut z: f64 = -1.0;
        for k in 0..4 {
            if k > 0 {
                let way: f64 = commands[k] - commands[k - 1];
                z = way.signum() + (z - way.signum()) * (-way.abs() / 0.3).exp();
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
            let found = past.dragged(1, (commands[k], if k == 0 { -1.0 } else { 0.0 }), 0.3);
            assert!((found - z).abs() < 1e-12, "pose {k}: {found}, not {z}");
        }
    }
}

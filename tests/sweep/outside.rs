//! Effects outside the catalogue: a bump or a step of one joint coordinate.

use flexcal::fit::Options;
use flexcal::rig::Shape;
use flexcal::select::{ClosedLoop, Site, close};

use crate::bench::{NOISE, Size, lunar, measured, outside};
use crate::judged::{located, named, words};

/// Bump or step: joint, shape; height, centre and width in degrees.
pub type Outside = (usize, Shape, [f64; 3]);

/// Bumps and steps well within the range of each joint.
pub const KINDS: [Outside; 14] = [
    (1, Shape::Bump, [0.06, 10.0, 15.0]),
    (1, Shape::Bump, [0.03, -30.0, 25.0]),
    (1, Shape::Step, [0.03, 0.0, 10.0]),
    (2, Shape::Bump, [0.08, 25.0, 8.0]),
    (2, Shape::Bump, [0.05, 10.0, 12.0]),
    (2, Shape::Bump, [0.06, 40.0, 5.0]),
    (2, Shape::Step, [0.04, 30.0, 6.0]),
    (3, Shape::Bump, [0.08, -70.0, 10.0]),
    (3, Shape::Bump, [0.05, -50.0, 20.0]),
    (3, Shape::Step, [0.04, -80.0, 8.0]),
    (3, Shape::Step, [0.06, -60.0, 3.0]),
    (4, Shape::Bump, [0.3, 10.0, 15.0]),
    (4, Shape::Bump, [0.2, -20.0, 25.0]),
    (4, Shape::Step, [0.2, 20.0, 10.0]),
];

/// Data set with one of them, with the result of the loop.
pub struct Left {
    pub closure: ClosedLoop,
    /// True if it is located at the right joint, as a function of the right command.
    pub located: bool,
    /// Held-out rms error relative to that of the noise: before, and with the correction.
    pub before: f64,
    pub corrected: Option<f64>,
}

impl Left {
    pub fn of((joint, shape, values): Outside, size: Size, seed: u64) -> Self {
        let set = measured(&[outside(joint, shape, values)], size, seed);
        let closure = close(&lunar(), &set.data, &Options::default()).unwrap();
        let left = closure.unexplained.first();
        let located = left.is_some_and(|left| {
            left.site == Some(Site::Joint(joint - 1))
                && words(&left.depends_on) == format!("q{joint}")
        });
        let correction = left.and_then(|left| left.correction.as_ref());
        Self {
            located,
            before: closure.before.fit.fitted.held_out.rms.norm / NOISE,
            corrected: correction.map(|correction| correction.held_out.rms.norm / NOISE),
            closure,
        }
    }

    /// Returns the figures as one line.
    pub fn line(&self, (joint, shape, values): Outside, size: Size, seed: u64) -> String {
        let place = self.closure.unexplained.first().map_or_else(String::new, located);
        let effects: Vec<String> =
            self.closure.effects.iter().map(|found| named(&found.effect)).collect();
        format!(
            "outside {joint} {shape:?} {values:?};{};{seed};{:?};{};{place};{};{:.3};{:.3};{}",
            size.identification,
            self.closure.verdict,
            u8::from(self.located),
            effects.join(" + "),
            self.before,
            self.closure.after.fitted.held_out.rms.norm / NOISE,
            self.corrected.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}")),
        )
    }
}

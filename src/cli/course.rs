//! State of a running fit or loop in words, with an estimate of the remaining time.

use std::fmt;

use flexcal::fit::{COST_TOLERANCE, Progress};

/// Number of remaining solver steps from which no remaining time is stated.
const MAX_FORESEEN_STEPS: f64 = 200.0;

/// State of a running fit or loop; times are in seconds since its start.
#[derive(Debug, Default)]
pub struct Course {
    /// Current round of the loop; `None` before the first round and for a fit.
    round: Option<Round>,
    /// True if the loop adds no more effects and computes probabilities.
    finishing: bool,
    /// Last step of the current fit.
    step: Option<Step>,
    /// Time of the last report of progress.
    now: f64,
    /// Start time of the current fit of a round; `None` while candidates are evaluated.
    fit_begun: Option<f64>,
    /// Number of finished fits, including the one before the first round, and their total time
    /// \[s\].
    fits_done: (f64, f64),
}

/// State of the current round of a loop.
#[derive(Debug)]
struct Round {
    /// Number of the round, from 1.
    number: usize,
    /// Number of effects that earlier rounds added.
    effects: usize,
    /// Name of the effect that was added last.
    last: Option<String>,
    /// Number of the current fit of the round, from 1; 0 while candidates are evaluated.
    fit: usize,
    /// Number of fits of the round that are planned so far.
    fits: usize,
    /// Expected end time of the round \[s\]; `None` while candidates are evaluated.
    end: Option<f64>,
}

/// State of the current fit after its last step.
#[derive(Debug)]
struct Step {
    /// Number of steps tried in the fit.
    iteration: u64,
    unknowns: usize,
    poses: usize,
    /// Cost ½‖r‖² after the step.
    cost: f64,
    /// Decrease of the cost by the last step that decreased it; `None` before such a step.
    gain: Option<f64>,
    /// Number of the solver's first timed step, and its end time \[s\].
    begun: (u64, f64),
    /// Expected remaining time of the fit \[s\]; `None` while it cannot be foreseen.
    left: Option<f64>,
}

impl Course {
    /// Records progress at the time `now`, in seconds since the start.
    pub fn record(&mut self, progress: &Progress, now: f64) {
        self.now = now;
        match progress {
            &Progress::Step { iteration, unknowns, poses, cost } => {
                let same = |last: &Step| {
                    last.iteration < iteration && last.unknowns == unknowns && last.poses == poses
                };
                self.step = Some(match self.step.take().filter(same) {
                    Some(last) => last.after(iteration, cost, now),
                    None => Step {
                        iteration,
                        unknowns,
                        poses,
                        cost,
                        gain: None,
                        begun: (iteration, now),
                        left: None,
                    },
                });
            }
            Progress::Round { round, effects, fit, fits } => {
                let begun = self.fit_begun.take().or(self.round.is_none().then_some(0.0));
                if let Some(begun) = begun {
                    self.fits_done = (self.fits_done.0 + 1.0, self.fits_done.1 + now - begun);
                }
                self.step = None;
                self.fit_begun = (*fit > 0).then_some(now);
                let (done, time) = self.fits_done;
                let end =
                    (*fit > 0).then(|| now + (fits + 1).saturating_sub(*fit) as f64 * time / done);
                let last = effects.last().map(|effect| effect.name().to_owned());
                self.round = Some(Round {
                    number: *round,
                    effects: effects.len(),
                    last,
                    fit: *fit,
                    fits: *fits,
                    end,
                });
            }
            _ => (self.finishing, self.round, self.step) = (true, None, None),
        }
    }
}

impl Step {
    /// Returns the state after another step. The remaining time assumes that the gain of each step
    /// is a constant fraction of the gain before, until it is below the tolerance of the cost.
    fn after(self, iteration: u64, cost: f64, now: f64) -> Self {
        let gain = self.cost - cost;
        let each = (now - self.begun.1) / (iteration - self.begun.0) as f64;
        let steps =
            |before: f64| ((COST_TOLERANCE * cost / gain).ln() / (gain / before).ln()).max(0.0);
        let left = self.gain.filter(|before| gain > 0.0 && gain < *before).map(steps);
        let left = left.filter(|steps| *steps < MAX_FORESEEN_STEPS).map(|steps| steps * each);
        Self {
            iteration,
            cost,
            gain: if gain > 0.0 { Some(gain) } else { self.gain },
            left,
            ..self
        }
    }
}

impl fmt::Display for Course {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.finishing {
            f.write_str("computing the probabilities of the causes")?;
        }
        if let Some(round) = &self.round {
            let plural = if round.effects == 1 { "" } else { "s" };
            write!(f, "round {}, {} effect{plural}", round.number, round.effects)?;
            round.last.iter().try_for_each(|last| write!(f, " (last {last})"))?;
            match round.fit {
                0 => f.write_str(", weighing candidates")?,
                fit => write!(f, ", fit {fit} of {}", round.fits)?,
            }
            write_remaining(f, round.end.map(|end| end - self.now), "round")?;
        }
        let Some(step) = &self.step else { return Ok(()) };
        if self.finishing || self.round.is_some() {
            f.write_str("; ")?;
        }
        let Step { iteration, unknowns, poses, cost, left, .. } = step;
        write!(
            f,
            "{poses} poses, {unknowns} parameters: step {iteration}, half the sum of squares \
             {cost:.6e}"
        )?;
        write_remaining(f, left.filter(|_| self.round.is_none()), "fit")
    }
}

/// Writes the remaining time `left` \[s\] of the work `of`; nothing if it is unknown or below half
/// a second.
fn write_remaining(f: &mut fmt::Formatter<'_>, left: Option<f64>, of: &str) -> fmt::Result {
    match left {
        Some(left) if left >= 90.0 => write!(f, ", about {:.0} min left of the {of}", left / 60.0),
        Some(left) if left >= 0.5 => write!(f, ", about {left:.0} s left of the {of}"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(iteration: u64, cost: f64) -> Progress {
        Progress::Step { iteration, unknowns: 4, poses: 20, cost }
    }

    #[test]
    fn steps_that_gain_a_tenth_of_the_one_before_are_foreseen() {
        let mut course = Course::default();
        for (k, cost) in [2.11, 1.11, 1.01, 1.001].into_iter().enumerate() {
            course.record(&step(k as u64 + 1, cost), 2.0 * k as f64);
        }
        // The gain falls from 9e-3 to 1e-11. A step takes 2 s and gains 0.09 of what the step
        // before gained.
        assert!(
            course.to_string().ends_with(
                "step 4, half the sum of squares 1.001000e0, about 17 s left of the fit"
            ),
            "{course}"
        );
        course.record(&step(1, 5.0), 9.0);
        assert!(!course.to_string().contains("left"), "another fit: {course}");
        course.record(&step(2, 6.0), 10.0);
        course.record(&step(3, 6.0), 11.0);
        assert!(!course.to_string().contains("left"), "nothing gained: {course}");
    }

    #[test]
    fn a_round_takes_as_long_as_fits_took_before() {
        let mut course = Course::default();
        let round = |fit| Progress::Round { round: 2, effects: Vec::new(), fit, fits: 3 };
        course.record(&step(1, 1.0), 1.0);
        course.record(&round(0), 4.0);
        assert_eq!(course.to_string(), "round 2, 0 effects, weighing candidates");
        course.record(&round(1), 10.0);
        assert_eq!(
            course.to_string(),
            "round 2, 0 effects, fit 1 of 3, about 12 s left of the round"
        );
        course.record(&round(2), 12.0);
        assert_eq!(
            course.to_string(),
            "round 2, 0 effects, fit 2 of 3, about 6 s left of the round"
        );
        course.record(&step(1, 1.0), 13.0);
        assert!(
            course
                .to_string()
                .contains("about 5 s left of the round; 20 poses, 4 parameters: step 1"),
            "{course}"
        );
        course.record(&Progress::Finishing, 20.0);
        assert_eq!(course.to_string(), "computing the probabilities of the causes");
    }
}

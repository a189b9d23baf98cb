//! Recognition of targets of `compensate` that are given in another frame or unit than stated.

use clap::ValueEnum;
use flexcal::fit::Command;
use flexcal::measurement::Measurements;
use flexcal::remainder::TargetFrame;

/// Mean distance from the targets to the positions that their joint columns predict, above which
/// another frame or unit is tried \[m\]. Errors of arms are a few millimetres.
const MIN_MISS: f64 = 0.05;
/// Largest ratio of this distance in another frame or unit to the distance as given, at which the
/// other frame or unit is probably meant.
const MAX_MISS_RATIO: f64 = 0.1;

/// Frame in which the targets are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Frame {
    /// The measuring frame, as for measurements
    Measuring,
    /// The frame of the arm's base
    Base,
}

impl From<Frame> for TargetFrame {
    fn from(frame: Frame) -> Self {
        match frame {
            Frame::Measuring => Self::Measuring,
            Frame::Base => Self::Base,
        }
    }
}

/// Returns a warning that names the frame or unit in which the targets are much nearer to the
/// positions of their joint columns; `None` if there is no such frame or unit. `solve` finds the
/// commands for targets in a frame.
pub(super) fn warning(
    (targets, frame, commands): (&Measurements, Frame, &[Command]),
    solve: impl Fn(Measurements, Frame) -> Option<Vec<Command>>,
) -> Option<String> {
    let given = mean_miss(commands);
    if !targets.position_measured || given <= MIN_MISS {
        return None;
    }
    let (other, name) = match frame {
        Frame::Measuring => (Frame::Base, "base"),
        Frame::Base => (Frame::Measuring, "measuring"),
    };
    let scaled = |factor: f64| {
        let mut scaled = targets.clone();
        scaled.positions.iter_mut().for_each(|position| *position *= factor);
        scaled
    };
    let has_unit = |unit: f64| {
        targets.position_unit.is_some_and(|declared| (declared / unit - 1.0).abs() < 1e-9)
    };
    let mut trials = vec![(targets.clone(), other, format!("--frame {name}"))];
    if has_unit(1e-3) {
        trials.push((scaled(1e3), frame, "metres instead of the declared millimetres".to_owned()));
    } else if has_unit(1.0) {
        trials.push((scaled(1e-3), frame, "millimetres instead of the declared metres".to_owned()));
    }
    let misses = trials.into_iter().filter_map(|(targets, frame, words)| {
        let miss = mean_miss(&solve(targets, frame)?);
        (miss < MAX_MISS_RATIO * given).then_some((miss, words))
    });
    let (miss, words) = misses.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "the targets are {:.0} mm from where their joint columns lead, and with {words} {:.1} mm: \
         check frame and unit of the targets before the arm is moved",
        given * 1e3,
        miss * 1e3
    ))
}

/// Returns the mean distance from the targets to the positions that their joint columns predict
/// \[m\].
fn mean_miss(commands: &[Command]) -> f64 {
    commands.iter().map(|command| command.seed_miss).sum::<f64>() / commands.len().max(1) as f64
}

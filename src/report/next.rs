//! Text of the command `next`: the poses to measure next, or that there are enough.

use super::document::{Block, Table};
use super::render::text;
use crate::design::{NextOptions, NextPoses, Purpose, StopReason};
use crate::problem::Problem;
use crate::quantity::format::{counted, number, or_dash};

/// Formats a length in mm with three decimals.
fn mm(length: f64) -> String {
    number(length * 1e3, 3)
}

/// Returns the text of a choice of poses, ending in a line break.
pub fn next_text(problem: &Problem, options: &NextOptions, next: &NextPoses) -> String {
    let percent = number(options.level * 100.0, 1);
    let percent = percent.trim_end_matches(".0");
    let mut blocks = vec![Block::lines(format!(
        "{}\n{} measured; {}; predictions judged at {}",
        problem.title,
        counted(next.measured, "row"),
        counted(next.candidates, "candidate"),
        counted(next.workspace_poses, "pose"),
    ))];
    blocks.push(Block::Text(match next.error {
        Some(error) => format!(
            "In the workspace the identified arm errs by {} ± {} mm (expected rms, noise included), and by less than {} mm with a \
             probability of {percent} %.{} The choice allows for a misfit of the model of {} mm per axis besides {} mm of noise.",
            mm(error.expected),
            mm(error.expected_sigma),
            mm(error.bound),
            next.attainable
                .map(|least| format!(" Any number of further poses would bring the rms to {} mm.", mm(least)))
                .unwrap_or_default(),
            mm(next.misfit),
            mm(next.noise),
        ),
        None => format!(
            "The error in the workspace is told from ten measured configurations of positions on; until then a misfit of {} mm per axis \
             is assumed besides {} mm of noise.",
            mm(next.misfit),
            mm(next.noise),
        ),
    }));
    blocks.extend(verdict(options, next).map(Block::Text));
    if !next.effects.is_empty() {
        let effects = next.effects.iter().map(crate::problem::Effect::describe);
        blocks
            .push(Block::Lines("Effects that the poses tell apart:".to_owned(), effects.collect()));
    }
    if !next.steps.is_empty() {
        blocks.push(Block::Table(steps(options, next, percent)));
    }
    text(&blocks)
}

/// Returns the sentence that ends a series of measurements, or forecasts its end.
fn verdict(options: &NextOptions, next: &NextPoses) -> Option<String> {
    let tolerance = options.tolerance.map(mm);
    match (next.stop, tolerance, next.enough_after(options.tolerance)) {
        (Some(StopReason::Enough), Some(tolerance), _) => {
            Some(format!("Enough: the bound is below the tolerance of {tolerance} mm."))
        }
        (Some(StopReason::GainBelowNoise), Some(tolerance), _) => Some(format!(
            "Further poses gain less than the uncertainty of the error itself, and the bound is above the tolerance of {tolerance} mm: \
             a better model is needed, not more poses."
        )),
        (Some(StopReason::GainBelowNoise), None, _) => Some(
            "Enough: all that further poses can gain is less than the uncertainty of the error itself.".to_owned(),
        ),
        (Some(StopReason::NoCandidates), ..) => {
            Some("These are all poses of the pool that are not measured.".to_owned())
        }
        (_, Some(tolerance), Some(poses)) => Some(format!(
            "After {} the bound is expected to be below the tolerance of {tolerance} mm.",
            counted(poses, "more pose")
        )),
        (_, Some(tolerance), None) if !next.steps.is_empty() && next.error.is_some() => Some(format!(
            "After these poses the bound is still expected to be above the tolerance of {tolerance} mm."
        )),
        _ => None,
    }
}

/// Returns the table of the chosen poses.
fn steps(options: &NextOptions, next: &NextPoses, percent: &str) -> Table {
    let rows = next.steps.iter().enumerate().map(|(k, step)| {
        vec![
            (k + 1).to_string(),
            format!("{} %", number(step.travel * 100.0, 0)),
            format!("{} %", number(step.gain * 100.0, 2)),
            or_dash(step.error, |error| mm(error.expected)),
            or_dash(step.error, |error| mm(error.bound)),
        ]
    });
    let header = ["pose", "travel", "gain", "rms, mm", "bound, mm"];
    let goal = match options.purpose {
        Purpose::Accuracy => "mean variance of predictions",
        Purpose::Causes => "mean variance of the effects",
        Purpose::Both => "sum of the variances of predictions and effects",
    };
    let note = format!(
        "travel: largest move of a joint from the pose before, share of its range; gain: share of the present {goal}; rms, bound ({percent} %): \
         expected in the workspace after the pose"
    );
    Table::new(&header, rows.collect(), &[]).noted(&[&note])
}

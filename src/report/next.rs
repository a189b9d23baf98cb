//! Text and page of the command `next`: the poses to measure next, or that there are enough.

use super::candidates::{at_limits, candidates_drawn, few_in_view};
use super::document::{Block, Table, code, opening};
use super::figures::{ACCENT, Curve, Drawing, INK, Series};
use super::identify::page_warnings;
use super::render::Story;
use crate::design::{NextOptions, NextPoses, Purpose, StopReason, WorkspaceError};
use crate::fit::Noise;
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::quantity::format::{about_three_digits, counted, mm, number, or_dash};
use crate::results::{CommandedJoint, commanded_joints, pose_columns};

/// Largest ratio of the tolerance to the bound that it does not exceed, above which its unit is
/// doubted.
const MAX_USUAL_TOLERANCE_RATIO: f64 = 50.0;

/// Number of standard errors by which the attainable bound must exceed the tolerance to be called
/// out of reach.
const REACH_SIGMAS: f64 = 2.0;

/// Returns a choice of poses, with a figure of the error expected after each of them.
pub fn next(problem: &Problem, options: &NextOptions, next: &NextPoses) -> Story {
    let percent = number(options.level * 100.0, 1);
    let percent = percent.trim_end_matches(".0");
    let counts = format!(
        "{} {}; {}; predictions judged at {}",
        counted(next.measured, "row"),
        if options.update.is_some() { "added to the earlier estimate" } else { "fitted" },
        candidates_drawn(next.candidates, next.drawn, options.workspace.is_some()),
        counted(next.workspace_poses, "pose"),
    );
    let mut blocks = opening(&problem.title, counts).to_vec();
    blocks.push(Block::Text(verdict(options, next)));
    blocks.push(page_warnings(&next.found, None));
    blocks.extend(
        few_in_view(next.candidates, next.drawn, options.workspace.is_some()).map(Block::Text),
    );
    let is_trusted = next.found.is_trusted();
    blocks.extend(is_trusted.then(|| Block::Text(error_paragraph(next, percent))));
    if !next.effects.is_empty() {
        let effects = next.effects.iter().map(crate::problem::Effect::describe);
        let label = if next.stop == Some(StopReason::CausesAlike) {
            "Effects that stay open:"
        } else if next.effects.len() == 1 {
            "Effect that the poses test:"
        } else {
            "Effects that the poses distinguish:"
        };
        blocks.push(Block::Lines(label.to_owned(), effects.collect()));
    }
    let figure = if is_trusted { draw_errors(options, next, percent) } else { None };
    blocks.push(Block::figures([figure]));
    if !next.steps.is_empty() {
        blocks.push(Block::Table(step_table(options, next, percent)));
        blocks.extend(at_limits(problem, &next.poses, "choose").map(Block::Text));
        blocks.push(Block::Page(vec![
            Block::heading("The chosen poses, in the order of measurement"),
            Block::Table(command_table(problem, &next.poses)),
        ]));
    }
    Story::new(&problem.title, "next poses", blocks)
}

/// States the error in the workspace with its bound, which holds with a probability of `percent` %,
/// and the misfit that the choice assumes.
fn error_paragraph(next: &NextPoses, percent: &str) -> String {
    match next.error {
        Some(error) => format!(
            "In the workspace, measured errors are expected at {} ± {} mm (rms, noise included), and below {} mm with a \
             probability of {percent} %.{} {} a misfit of the model of {} mm per axis besides {} \
             mm of noise.",
            mm(error.expected, 3),
            mm(error.expected_sigma, 3),
            mm(error.bound, 3),
            next.attainable
                .map(|least| format!(
                    " As far as these rows tell, further poses alone bring the rms to about {} mm \
                     at best, and the bound to about {} mm.",
                    mm(least, 3),
                    mm(attainable_bound(&error), 3)
                ))
                .unwrap_or_default(),
            if next.found.noise == Noise::Declared && next.assumes_more_than_attainable() {
                "To be on the safe side, the choice allows for more:"
            } else if next.found.noise == Noise::Declared {
                "The choice allows for"
            } else {
                "No σ is declared, so the choice assumes"
            },
            mm(next.misfit, 3),
            mm(next.noise, 3),
        ),
        None if next.is_of_cameras => "Cameras measure: the choice lowers the mean variance of predicted pixels of the points in view, \
             over configurations of the workspace that show one. No error in mm is stated, and no misfit of the model is assumed."
            .to_owned(),
        None => format!(
            "The error in the workspace is stated once ten configurations are measured, and as many coordinates as parameters are \
             fitted; until then a misfit of {} mm per axis is assumed besides {} mm of noise.",
            mm(next.misfit, 3),
            mm(next.noise, 3),
        ),
    }
}

/// Draws the error in the workspace against the number of chosen poses; `None` if the error is
/// unknown.
fn draw_errors(options: &NextOptions, next: &NextPoses, percent: &str) -> Option<Drawing> {
    let after: Vec<_> =
        std::iter::once(next.error).chain(next.steps.iter().map(|step| step.error)).collect();
    let curve = |name, colour, of: fn(&WorkspaceError) -> f64| {
        let points = after.iter().enumerate();
        Curve::new(
            name,
            colour,
            points.filter_map(|(k, error)| Some((k as f64, of(error.as_ref()?) * 1e3))),
        )
    };
    let tolerance =
        options.tolerance.map(|most| (format!("tolerance {} mm", mm(most, 3)), most * 1e3));
    let least = next
        .attainable
        .map(|least| (format!("least rms that poses can reach {} mm", mm(least, 3)), least * 1e3));
    let caption = format!(
        "Error of predicted positions in the workspace, measurement noise included, now (0) and expected after each chosen pose: \
         the root mean square, and the bound that {percent} % of the errors do not exceed."
    );
    Series {
        names: ("next-errors", "Error in the workspace against the number of further poses"),
        caption,
        labels: ("further poses", "error [mm]"),
        curves: vec![
            curve("bound", ACCENT, |error| error.bound),
            curve("root mean square", INK, |error| error.expected),
        ],
        levels: tolerance.into_iter().chain(least).collect(),
        ..Series::default()
    }
    .drawing()
}

/// Returns the table of chosen poses: the joint commands, and all other columns of the CSV table
/// with their values, such as payload and hoist force.
pub(super) fn command_table(problem: &Problem, poses: &Measurements) -> Table {
    let joints = commanded_joints(problem);
    let is_listed =
        |name: &str| name != "pose" && joints.iter().all(|joint| joint.column() != name);
    let columns = pose_columns(problem, poses);
    let others: Vec<_> = columns.iter().filter(|(name, _)| is_listed(name)).collect();
    let rows = (0..poses.len()).map(|pose| {
        let q = poses.configuration(pose);
        let value = |joint: &CommandedJoint| {
            number(q.get(joint.joint).copied().unwrap_or(f64::NAN) * joint.factor(), 2)
        };
        let other = others.iter().map(|(_, cells)| cells[pose].clone());
        let commands = joints.iter().map(value);
        std::iter::once((pose + 1).to_string()).chain(commands).chain(other).collect()
    });
    let joint_names = joints.iter().map(|joint| format!("{}, {}", joint.name(), joint.symbol()));
    let names = others.iter().map(|(name, _)| name.clone());
    let header = std::iter::once("pose".to_owned()).chain(joint_names).chain(names);
    // Columns of words, such as the session.
    let is_words = |cells: &[String]| cells.iter().any(|cell| cell.parse::<f64>().is_err());
    let words = (0..others.len()).filter(|&k| is_words(&others[k].1));
    let left = words.map(|k| 1 + joints.len() + k).collect();
    Table { header: header.collect(), rows: rows.collect(), left, ..Table::default() }
}

/// States whether enough poses are measured, or after how many more there are expected to be
/// enough.
fn verdict(options: &NextOptions, next: &NextPoses) -> String {
    let tolerance = options.tolerance.map(|length| match mm(length, 3) {
        zero if zero == "0.000" => about_three_digits(length * 1e3),
        shown => shown,
    });
    if !next.found.is_trusted() {
        return "Not judged, because the fit to the measured poses is not to be trusted."
            .to_owned();
    }
    if next.stop == Some(StopReason::CausesAlike) {
        let effects = if next.effects.len() == 1 { "the effect" } else { "the effects" };
        return format!(
            "No pose within these ranges decides: the best {} lower the variance of {effects} listed \
             below by less than 1 %. Other ranges of the joints, another payload or another base may.",
            options.poses
        );
    }
    if options.purpose == Purpose::Causes {
        let gain: f64 = next.steps.iter().map(|step| step.gain).sum();
        let poses = counted(next.steps.len(), "pose");
        let variance = if next.effects.len() == 1 {
            "variance of the effect listed below falls"
        } else {
            "mean variance of the effects listed below falls"
        };
        return format!(
            "With these {poses} the {variance} by {} %. Run flexcal loop with them to see whether \
             they decide.",
            number(100.0 * gain, 0)
        );
    }
    match (next.stop, tolerance.as_ref(), next.enough_after(options.tolerance)) {
        (Some(StopReason::Enough), Some(tolerance), _) => {
            let incomplete = if next.has_large_misfit() {
                let ratio = number(next.misfit / next.noise, 1);
                format!(" A better model would lower the error further: the misfit is {ratio} × the noise.")
            } else {
                String::new()
            };
            let bound = next.error.map_or(f64::NAN, |error| error.bound);
            let ratio = options.tolerance.map_or(0.0, |length| length / bound);
            let odd = if ratio > MAX_USUAL_TOLERANCE_RATIO {
                format!(
                    " The tolerance is {} times that bound: check its unit, mm.",
                    number(ratio, 0)
                )
            } else {
                String::new()
            };
            format!("Enough: the bound is below the tolerance of {tolerance} mm.{odd}{incomplete}")
        }
        (Some(StopReason::GainBelowNoise), Some(tolerance), _) => format!(
            "Further poses gain less than the uncertainty of the error itself, and the bound is above the tolerance of {tolerance} mm: \
             a better {} is needed, not more poses.",
            lacking(next, options)
        ),
        (Some(StopReason::GainBelowNoise), None, _) => {
            "More poses would not help noticeably: all that they can gain is less than the uncertainty of the error itself.".to_owned()
        }
        (Some(StopReason::NoCandidates), ..) => {
            "These are all poses of the pool that are not measured.".to_owned()
        }
        (_, Some(tolerance), Some(poses)) => format!(
            "Not yet enough: after {} the bound is expected to be below the tolerance of \
             {tolerance} mm.",
            counted(poses, "more pose")
        ),
        (_, Some(tolerance), None) if next.is_out_of_reach(options.tolerance) => format!(
            "Out of reach: no number of further poses can be expected to bring the bound below \
             the tolerance of {tolerance} mm. A better {} is needed.",
            lacking(next, options)
        ),
        (_, Some(tolerance), None) if next.error.is_some_and(|error| is_beyond_poses(&error, options)) => format!(
            "Out of reach with more poses alone: they are expected to bring the bound no further than about {} mm, and the tolerance is \
             {tolerance} mm. A better {} is needed.",
            next.error.map_or_else(String::new, |error| mm(attainable_bound(&error), 3)),
            lacking(next, options)
        ),
        (_, Some(tolerance), None) if !next.steps.is_empty() && next.error.is_some() => format!(
            "Not yet enough: after these poses the bound is still expected to be above the \
             tolerance of {tolerance} mm."
        ),
        _ if next.is_of_cameras => "Further poses lower the variance of predictions as the table says; the error itself is not judged."
            .to_owned(),
        _ if next.error.is_none() => "Not yet enough: too few poses are measured to judge the error.".to_owned(),
        _ => match (next.error, next.steps.last().and_then(|step| step.error)) {
            (Some(now), Some(then)) if tolerance.is_none() => format!(
                "No tolerance is given: {} would lower the bound from {} mm to {} mm. {} says \
                 whether that is needed.",
                counted(next.steps.len(), "more pose"),
                mm(now.bound, 3),
                mm(then.bound, 3),
                code("--tolerance-mm")
            ),
            _ => "Not yet enough: further poses still lower the error.".to_owned(),
        },
    }
}

/// Returns the bound that arbitrarily many further poses are expected to reach \[m\].
fn attainable_bound(error: &WorkspaceError) -> f64 {
    error.bound * error.least / error.expected
}

/// Returns true if the bound that further poses are expected to reach is above the tolerance by more
/// than [`REACH_SIGMAS`] standard errors.
fn is_beyond_poses(error: &WorkspaceError, options: &NextOptions) -> bool {
    let least = 1.0 - REACH_SIGMAS * error.expected_sigma / error.expected;
    options.tolerance.is_some_and(|most| attainable_bound(error) * least > most)
}

/// Names what must be better for the error bound to fall below the tolerance.
fn lacking(next: &NextPoses, &NextOptions { tolerance, level, .. }: &NextOptions) -> &'static str {
    match (next.noise_exceeds(tolerance, level), next.has_large_misfit()) {
        (true, _) => "instrument",
        (false, true) => "model",
        (false, false) => "model or instrument",
    }
}

/// Returns the table of the chosen poses with the error expected after each. `percent` is the level
/// of the bound.
fn step_table(options: &NextOptions, next: &NextPoses, percent: &str) -> Table {
    // The error in mm is not judged where cameras measure, or if the fit is not trusted.
    let is_judged = !next.is_of_cameras && next.found.is_trusted();
    let columns = if is_judged { 5 } else { 3 };
    let rows = next.steps.iter().enumerate().map(|(k, step)| {
        let mut cells = vec![
            (k + 1).to_string(),
            format!("{} %", number(step.travel * 100.0, 0)),
            format!("{} %", number(step.gain * 100.0, 2)),
            or_dash(step.error, |error| mm(error.expected, 3)),
            or_dash(step.error, |error| mm(error.bound, 3)),
        ];
        cells.truncate(columns);
        cells
    });
    let header = &["pose", "travel", "gain", "rms, mm", "bound, mm"][..columns];
    let goal = match options.purpose {
        Purpose::Accuracy if next.is_of_cameras => {
            "mean variance of predictions that parameters cause"
        }
        Purpose::Accuracy => {
            "mean variance of predictions that parameters and assumed misfit cause"
        }
        Purpose::Causes => "mean variance of the effects",
        Purpose::Both => "sum of the variances of predictions and effects",
    };
    let note = format!(
        "travel: largest move of a joint from the pose before, share of its range; gain: by how \
         much the pose lowers the {goal}, in % of the present one"
    );
    let errors = format!(
        "; rms, bound ({percent} %): expected error in the workspace after the pose, with noise \
         and the misfit that no pose lowers"
    );
    let note = if is_judged { note + &errors } else { note };
    Table::new(header, rows.collect(), &[]).noted(&[&note])
}

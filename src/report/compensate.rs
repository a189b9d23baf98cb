//! Text of the command `compensate`.

use std::fmt::Write as _;

use super::document::Block;
use super::remainder::bound_sentence;
use super::render::text;
use crate::fit::Command;
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::quantity::format::{mm, number};
use crate::remainder::Bounds;
use crate::results::CompensationResult;

/// Returns the summary of the commands as text, with file and line of each target that cannot be
/// reached.
pub fn commands_text(
    problem: &Problem,
    targets: &Measurements,
    commands: &[Command],
    bounds: Option<&Bounds>,
) -> String {
    let result = CompensationResult::new(problem, commands);
    let mut words = format!(
        "{}\n{} of {} targets can be reached",
        problem.title, result.reached, result.targets
    );
    // The text states no distance between target and corrected command, which only the solver
    // leaves: the expected error of the real arm is larger.
    if let (Some(before), Some(_)) = (result.mean_miss_before_mm, result.mean_miss_mm) {
        let _ = write!(
            words,
            "; without correction the identified arm would miss them by {} mm on average",
            number(before, 4)
        );
    }
    if let (Some(before), Some(after)) = (result.mean_turn_before_deg, result.mean_turn_deg) {
        let _ = write!(
            words,
            "; its orientation errs by {}° on average with the corrected commands, by {}° without",
            number(after, 4),
            number(before, 4)
        );
    }
    if let Some(bounds) = bounds.filter(|_| result.reached > 0) {
        let _ = write!(words, ".\n{}", bound_sentence(bounds, None));
    } else if result.reached > 0 {
        words += ".\nThe expected error of the commands is not known, because the estimate states no uncertainty of positions.";
    }
    let point = |command: &Command| {
        let (place, miss) = (targets.location(command.row), command.miss.norm());
        if miss.is_finite() {
            format!("out of reach: {place}, nearest {} mm away", mm(miss, 2))
        } else {
            format!("out of reach: {place}, the identified arm does not come to rest there")
        }
    };
    let points = commands.iter().filter(|command| !command.is_reached()).map(point).collect();
    text(&[Block::Lines(words, points)])
}

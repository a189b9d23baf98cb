//! What `loop` prints.

use super::super::document::{Block, to_text};
use super::super::findings;
use super::parts;
use crate::diagnose::ClosedLoop;
use crate::problem::Problem;

/// What the loop came to as text, ending in a line break.
pub fn loop_text(problem: &Problem, closure: &ClosedLoop) -> String {
    let poses = &closure.before.fit.fitted;
    let (n, held_out) = (poses.identification.n, poses.held_out.n);
    let mut blocks = vec![
        Block::Text(format!("{}\n{n} poses to identify, {held_out} held out", problem.title)),
        Block::Text(parts::verdict(closure)),
    ];
    blocks.extend(parts::distrust(closure));
    blocks.extend([Block::Table(parts::errors(closure)), Block::Text(parts::gain(closure))]);
    let failed = findings::failed(&closure.before.findings);
    if !failed.is_empty() {
        blocks.push(Block::heading("What the declared problem leaves (checks that failed)"));
        blocks.push(Block::list(failed));
    }
    blocks.extend(parts::found(closure));
    let failed = findings::failed(&closure.findings);
    if closure.unexplained.is_some() || (!failed.is_empty() && !closure.effects.is_empty()) {
        blocks.push(Block::heading("What remains"));
        let unexplained = parts::unexplained(problem, closure).into_iter();
        // Without effects the checks are those above.
        let failed = failed.into_iter().filter(|_| !closure.effects.is_empty());
        blocks.push(Block::list(unexplained.chain(failed)));
    }
    to_text(&blocks)
}

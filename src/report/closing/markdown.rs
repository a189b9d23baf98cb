//! `report.md`.

use super::super::document::{Block, Table, to_markdown};
use super::super::parameters::parameter_blocks;
use super::super::quantity::number;
use super::super::{findings, trace};
use super::parts;
use crate::diagnose::{ClosedLoop, Round};
use crate::problem::Problem;

/// Candidates that a report shows.
const SHOWN: usize = 8;

/// The whole story of the loop as Markdown, ending in a line break.
pub fn loop_markdown(problem: &Problem, closure: &ClosedLoop) -> String {
    let fit = &closure.before.fit;
    let counts = format!(
        "{} parameters from {} poses; {} poses held out, which took no part in any choice.",
        fit.unknowns.len(),
        fit.fitted.identification.n,
        fit.fitted.held_out.n
    );
    let mut blocks = vec![Block::Text(parts::verdict(closure)), Block::Text(counts)];
    blocks.extend(parts::distrust(closure));
    blocks.extend([
        Block::Table(parts::errors(closure)),
        Block::Text(parts::gain(closure)),
        Block::heading("What the declared problem leaves"),
        Block::list(findings::all(&closure.before.findings)),
    ]);
    blocks.extend(trace::ranking(problem, &closure.before, SHOWN, "`flexcal trace` writes them all"));
    blocks.extend(rounds(closure));
    blocks.extend(parts::found(closure));
    blocks.push(Block::heading("What remains"));
    let unexplained = parts::unexplained(problem, closure).into_iter();
    blocks.push(Block::list(unexplained.chain(findings::all(&closure.findings))));
    blocks.push(Block::heading("Parameters of the final fit"));
    blocks.extend(parameter_blocks(&closure.after, parts::ALL));
    to_markdown(&problem.title, &blocks)
}

/// What each round of fit, trace and refit came to.
fn rounds(closure: &ClosedLoop) -> Vec<Block> {
    if closure.rounds.is_empty() {
        return Vec::new();
    }
    let mm = |value: f64| number(value * 1e3, 4);
    let row = |(k, step): (usize, &Round)| {
        let effects =
            match step.effects.iter().map(|effect| closure.before.describe(effect)).collect::<Vec<_>>().join("; ") {
                none if none.is_empty() => "none".to_owned(),
                effects => effects,
            };
        let errors = [step.identification.rms.norm, step.held_out.mean.norm, step.held_out.rms.norm].map(mm);
        [vec![(k + 1).to_string(), effects], errors.to_vec()].concat()
    };
    let header = vec!["round", "effects in the model", "identification rms, mm", "held out mean", "held out rms"];
    let rows = closure.rounds.iter().enumerate().map(row).collect();
    vec![Block::heading("Rounds"), Block::Table(Table { header, rows, left: vec![1] })]
}

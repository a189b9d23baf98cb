//! `report.md` of `identify` and `compare`.

use super::compare_text::{ROWS, TIME, ablation_rows, strategy_rows};
use super::document::{Block, Table, to_markdown};
use super::findings;
use super::parameters::{blind_text, correlation_text, parameter_blocks};
use super::quantity::number;
use super::text::{conditioning, no_errors, noise, outliers, why_not_trusted};
use crate::diagnose::Findings;
use crate::identify::{Comparison, ErrorSummary, Identification};
use crate::problem::Problem;

/// An identification as Markdown, ending in a line break.
pub fn identification_markdown(problem: &Problem, found: &Identification, findings: &Findings) -> String {
    let mut blocks = vec![Block::Text(counts(found)), Block::Table(errors(found))];
    blocks.extend(no_errors(found).map(Block::Text));
    blocks.extend(identified(problem, found, findings, "estimate.json"));
    to_markdown(&problem.title, &blocks)
}

/// A comparison as Markdown, ending in a line break.
pub fn comparison_markdown(problem: &Problem, comparison: &Comparison, findings: &Findings) -> String {
    let joint = &comparison.joint;
    // Without the time taken: the same input gives the same page.
    let side_by_side = |first: &'static str, mut rows: Vec<Vec<String>>| {
        let mut header: Vec<&str> = std::iter::once(first).chain(ROWS).collect();
        let time = header.iter().position(|name| *name == TIME);
        if let Some(time) = time {
            header.remove(time);
            for row in &mut rows {
                row.remove(time);
            }
        }
        Block::Table(Table { header, rows, left: vec![0, 1, 8] })
    };
    let mut blocks = vec![
        Block::Text(counts(joint)),
        Block::heading("Strategies and solvers side by side"),
        side_by_side("strategy", strategy_rows(comparison)),
        Block::heading("What each part of the elasticity is worth"),
        side_by_side("elasticity", ablation_rows(comparison)),
        Block::heading("Everything fitted at once"),
        Block::Table(errors(joint)),
    ];
    blocks.extend(no_errors(joint).map(Block::Text));
    blocks.extend(identified(problem, joint, findings, "the estimate.json of `flexcal identify`"));
    to_markdown(&problem.title, &blocks)
}

fn counts(found: &Identification) -> String {
    let (fitted, held_out) = (found.fitted.identification.n, found.fitted.held_out.n);
    let trusted = if found.is_trusted() { String::new() } else { format!(" Beware: {}.", why_not_trusted(found)) };
    format!(
        "{} parameters from {fitted} poses; {held_out} poses held out. Strategy {}, solver {}: {}.{trusted}",
        found.unknowns.len(),
        found.strategy.as_str(),
        found.solver.as_str(),
        found.termination,
    )
}

/// Before and after, on both kinds of poses.
fn errors(found: &Identification) -> Table {
    let row = |poses: &str, arm: &str, of: &ErrorSummary| {
        let mut row = vec![poses.to_owned(), arm.to_owned()];
        row.extend([of.mean.norm, of.rms.norm, of.max.norm].map(|value| number(value * 1e3, 4)));
        row
    };
    let (before, after) = (&found.registered, &found.fitted);
    let nominal = "nominal arm, base and tool fitted";
    let rows = vec![
        row("held out", nominal, &before.held_out),
        row("", "as identified", &after.held_out),
        row("identification", nominal, &before.identification),
        row("", "as identified", &after.identification),
    ];
    Table { header: vec!["error, mm", "", "mean", "rms", "max"], rows, left: vec![0, 1] }
}

/// The residual, the parameters, and what the poses can tell.
fn identified(problem: &Problem, found: &Identification, findings: &Findings, file: &str) -> Vec<Block> {
    let mut left = vec![noise(problem, found), outliers(problem, found)];
    left.retain(|text| !text.is_empty());
    let mut blocks = vec![Block::heading("What is left")];
    blocks.extend(left.iter().flat_map(|text| with_points(text)));
    blocks.push(Block::list(findings::all(findings)));
    blocks.extend(findings::another_size(findings, found.reduced_chi2).map(|words| Block::Text(words.to_owned())));
    blocks.push(Block::heading("Parameters"));
    blocks.extend(parameter_blocks(found, file));
    blocks.push(Block::heading("What the poses can tell"));
    blocks.push(paragraph(&conditioning(&found.identifiability, found.unknowns.len(), found.coordinates)));
    for text in [blind_text(&found.identifiability, &found.unknowns, file), correlation_text(found, file)] {
        blocks.extend(with_points(&text));
    }
    blocks
}

fn paragraph(text: &str) -> Block {
    Block::Text(text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Text whose indented lines are points.
fn with_points(text: &str) -> Vec<Block> {
    let (points, words): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with("  "));
    let mut blocks = vec![paragraph(&words.join(" "))];
    if !points.is_empty() {
        blocks.push(Block::list(points.iter().map(|point| point.trim().to_owned())));
    }
    blocks
}

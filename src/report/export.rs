//! Text of the command `export`: moved origins, errors, and the parts of the model that the file
//! cannot represent.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::render::text;
use crate::fit::rows_of_kind;
use crate::quantity::format::number;
use crate::results::{ExportResult, ExportedErrors, Origin, Summary};

/// Ratio of mean errors above which another geometry counts as better than the exported one.
const MIN_WORSE_RATIO: f64 = 1.1;

/// Option that exports the geometry nearest to the whole model.
const BEST_RIGID: &str = "--best-rigid";

/// Returns true if the geometry of `--best-rigid` was not exported, has the smallest error of all
/// geometries on held-out poses, and is clearly better than the exported one.
pub fn is_best_rigid_better(result: &ExportResult) -> bool {
    let mean = |summary: &Summary| summary.norms().0[0];
    result.held_out.as_ref().is_some_and(|errors| {
        let is_least = |best: f64| {
            errors.fitted_alone.as_ref().is_none_or(|alone| mean(alone) * MIN_WORSE_RATIO >= best)
        };
        errors
            .best_rigid
            .as_ref()
            .map(mean)
            .is_some_and(|best| is_least(best) && mean(&errors.rigid) > MIN_WORSE_RATIO * best)
    })
}

/// Returns the result as text: the verdict on the exported geometry first.
pub fn export_text(result: &ExportResult) -> String {
    let mut blocks = Vec::new();
    if let Some(errors) = &result.held_out {
        blocks.extend(compared(errors, is_best_rigid_better(result)));
    }
    if let Some(origins) = &result.origins {
        let row = |origin: &Origin| {
            vec![origin.joint.clone(), number(origin.moved_mm, 4), number(origin.turned_deg, 5)]
        };
        let header = ["origin of", "moved, mm", "turned, °"];
        blocks.push(Block::Table(Table::new(&header, origins.iter().map(row).collect(), &[0])));
    }
    if !result.not_held.is_empty() {
        let words = "Parts of the model that the file cannot hold".to_owned();
        blocks.push(Block::Lines(words, result.not_held.clone()));
    }
    blocks.extend(result.file.iter().map(|file| Block::lines(format!("Written to {file}"))));
    text(&blocks)
}

/// Compares the errors of the exported geometry with those of the whole model and of the geometries
/// that could be exported instead, the best first.
fn compared<'a>(errors: &ExportedErrors, best_rigid_is_better: bool) -> Vec<Block<'a>> {
    let ExportedErrors { whole, rigid, identified, best_rigid, fitted_alone } = errors;
    let mean = |summary: &Summary| summary.norms().0[0];
    let unit = rigid.norms().1;
    let size = |summary: &Summary| format!("{} {unit}", number(mean(summary), 4));
    let rows = rows_of_kind(whole.kind.unwrap_or("position"));
    let exported = if identified.is_some() {
        "geometry nearest to the whole model (--best-rigid), exported"
    } else {
        "identified geometry, exported"
    };
    let nearest = "geometry nearest to the whole model (--best-rigid)";
    let alone = "geometry fitted alone, without effects and elasticity";
    let mut geometries: Vec<(&str, &Summary)> = vec![(exported, rigid)];
    geometries.extend(identified.as_ref().map(|errors| ("identified geometry", errors)));
    geometries.extend(best_rigid.as_ref().map(|errors| (nearest, errors)));
    geometries.extend(fitted_alone.as_ref().map(|errors| (alone, errors)));
    geometries.sort_by(|(_, a), (_, b)| mean(a).total_cmp(&mean(b)));
    let least = geometries.first().map_or(0.0, |(_, summary)| mean(summary));
    let is_worse = mean(rigid) > MIN_WORSE_RATIO * least;
    let mut verdict = format!(
        "The exported geometry alone misses {} held-out {rows} by {} on average, the whole model by \
         {}.",
        whole.n,
        size(rigid),
        size(whole)
    );
    if best_rigid_is_better {
        let better = best_rigid.as_ref().map(size).unwrap_or_default();
        let _ = write!(
            verdict,
            " Not the best that a rigid controller can have: with {BEST_RIGID} it would be {better}."
        );
    } else if is_worse && let Some(alone) = fitted_alone.as_ref().filter(|of| mean(of) <= least) {
        let _ = write!(
            verdict,
            " A geometry fitted alone would have {}: identify the problem without its effects (and \
             with --strategy rigid if joints or links are compliant), and export that.",
            size(alone)
        );
    } else if is_worse && let Some((name, best)) = geometries.first() {
        let _ = write!(verdict, " The best of them, {name}, would have {}.", size(best));
    } else if geometries.len() > 1 {
        verdict += " No other geometry alone is clearly better.";
    }
    let row = |&(name, summary): &(&str, &Summary)| {
        let [mean, rms, max] = summary.norms().0.map(|value| number(value, 4));
        vec![name.to_owned(), mean, rms, max]
    };
    let listed = [("whole model", whole)].into_iter().chain(geometries);
    let heading = match unit {
        "mm" => "held-out error, mm",
        "°" => "held-out error, °",
        _ => "held-out error, px",
    };
    let rows = listed.map(|entry| row(&entry)).collect();
    vec![
        Block::Text(verdict),
        Block::Table(Table::new(&[heading, "mean", "rms", "max"], rows, &[0])),
    ]
}

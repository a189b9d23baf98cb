//! Text of the command `export`: moved origins, errors, and the parts of the model that the file
//! cannot represent.

use super::document::{Block, Table};
use super::render::text;
use crate::fit::rows_of_kind;
use crate::quantity::format::number;
use crate::results::{ExportResult, ExportedErrors, Origin, Summary};

/// Advice if the exported geometry alone has larger errors than the whole model.
const ADVICE: &str = "If the controller uses geometry alone, a geometry fitted alone may be better: identify the problem without its effects (and \
                     with --strategy rigid if joints or links are compliant), export it, and compare the errors.";

/// Ratio of the mean errors of geometry alone to the whole model, above which a geometry fitted
/// alone may be better.
const MIN_WORSE_RATIO: f64 = 1.1;

/// Returns the result as text.
pub fn export_text(result: &ExportResult) -> String {
    let mut blocks = Vec::new();
    if let Some(origins) = &result.origins {
        let row = |origin: &Origin| {
            vec![origin.joint.clone(), number(origin.moved_mm, 4), number(origin.turned_deg, 5)]
        };
        let header = ["origin of", "moved, mm", "turned, °"];
        blocks.push(Block::Table(Table::new(&header, origins.iter().map(row).collect(), &[0])));
    }
    if let Some(ExportedErrors { whole, rigid }) = &result.held_out {
        let words = |summary: &Summary| {
            let ([mean, rms, _], unit) = summary.norms();
            format!("mean {} {unit}, rms {} {unit}", number(mean, 4), number(rms, 4))
        };
        blocks.push(Block::lines(format!(
            "{} held-out {}: {} with the whole model, {} with the geometry that was exported",
            whole.n,
            rows_of_kind(whole.kind.unwrap_or("position")),
            words(whole),
            words(rigid)
        )));
        if rigid.norms().0[0] > MIN_WORSE_RATIO * whole.norms().0[0] {
            blocks.push(Block::Note(ADVICE.to_owned()));
        }
    }
    if !result.not_held.is_empty() {
        let words = "Parts of the model that the file cannot hold".to_owned();
        blocks.push(Block::Lines(words, result.not_held.clone()));
    }
    blocks.extend(result.file.iter().map(|file| Block::lines(format!("Written to {file}"))));
    text(&blocks)
}

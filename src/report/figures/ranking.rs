//! Figure of the ranking of candidate effects.

use super::super::errors::unit;
use super::prelude::*;
use crate::laws::ArgumentKind;
use crate::problem::Effect;
use crate::select::{Ranked, Trace};

/// Maximum number of candidates that the figure shows.
const MAX_CANDIDATES: usize = 12;
/// Space for the gaps before and after the number of a bar, and for numbers that are wider than
/// estimated, in displayed pixels.
const NUMBERS_MARGIN: f64 = 24.0;
/// Smallest p-value that is drawn at its value.
const MIN_DRAWN_P: f64 = 1e-300;

/// Returns the name of an effect with its place and its trial value, such as an order or a time.
fn label(effect: &Effect, trace: &Trace) -> String {
    let name = effect.name();
    match (effect.searched_value(), effect.joint()) {
        (Some((ArgumentKind::Time, time)), _) if trace.time_measured => {
            format!("{name} {time:.0} s")
        }
        (Some((ArgumentKind::Time, time)), _) => format!("{name} row {}", time.ceil()),
        (Some((ArgumentKind::Order, order)), Some(joint)) => format!("{name} {joint} ×{order}"),
        _ if effect.has_memory() => effect.name_and_place(),
        (Some((ArgumentKind::Duration, time_constant)), _) => format!("{name} {time_constant} s"),
        _ => {
            let orders = effect.harmonic_orders().map_or_else(String::new, |orders| {
                format!(" ×{}", orders.iter().map(u32::to_string).collect::<Vec<_>>().join(","))
            });
            format!("{name} {}{orders}", effect.place()).trim_end().to_owned()
        }
    }
}

/// Draws −log₁₀ p of the best candidates, with marks at those that are confounded with the first.
/// `None` without candidates.
pub fn ranking(trace: &Trace) -> Option<Drawing> {
    let shown: Vec<&Ranked> = trace.ranking.iter().take(MAX_CANDIDATES).collect();
    let first = shown.first()?;
    let level = -trace.level.log10();
    let evidence = |ranked: &Ranked| -ranked.p_value.max(MIN_DRAWN_P).log10();
    let highest = shown.iter().map(|ranked| evidence(ranked)).fold(1.0, f64::max).max(2.0 * level);
    let is_alike = |ranked: &Ranked| first.alike.iter().any(|(other, _)| *other == ranked.effect);
    let errors = &trace.fit.fitted.identification;
    let gain = |k: usize, ranked: &Ranked| {
        let mark = if k > 0 && is_alike(ranked) { "≈ first, " } else { "" };
        let (gain, symbol) = (errors.in_unit(ranked.gain.max(0.0)), unit(errors));
        format!("{mark}{} {symbol}", number(gain, 4))
    };
    let widths = shown.iter().enumerate().map(|(k, ranked)| text_width(&gain(k, ranked)));
    let numbers = NUMBERS_MARGIN + widths.fold(0.0, f64::max);
    let names = shown.iter().map(|ranked| {
        let colour = if ranked.p_value < trace.level { INK } else { MUTED };
        (label(&ranked.effect, trace), colour)
    });
    let shapes = shown.iter().enumerate().flat_map(|(k, ranked)| {
        let (row, end) = (k as f64, evidence(ranked).max(0.004 * highest));
        let is_alike = k > 0 && is_alike(ranked);
        let paint = match (k, is_alike, ranked.p_value < trace.level) {
            (0, _, true) => Paint::fill(ACCENT),
            (_, true, _) => Paint::fill(ACCENT).faded(0.4),
            _ => Paint::fill(FAINT),
        };
        // The text is to the right of the bar and of the line of significance.
        let text = Shape::text((end.max(level), row), 6.0, gain(k, ranked), MUTED);
        [Shape::area((0.0, row - 0.28), (end, row + 0.28), paint), text]
    });
    let x = Axis::linear((0.0, highest), "evidence, −log₁₀ p", 5);
    let panel =
        Panel::of_rows(22.0, (220.0, numbers), x, names).with(shapes).with_reference(level, INK);
    let caption = format!(
        "{} candidates were tested on the fit of the declared model; these are the best. A longer \
         bar is less likely to arise by chance; left of the vertical line (p = {}) a candidate is \
         not significant. Next to each bar: the expected decrease of the root mean square error. \
         Pale blue: hardly distinguishable from the first candidate with these poses.",
        trace.tried, trace.level
    );
    let rows = shown.iter().map(|ranked| {
        let name = label(&ranked.effect, trace);
        vec![name, format!("{:e}", ranked.p_value), fixed(errors.in_unit(ranked.gain), 6)]
    });
    let title = "Candidate effects by evidence";
    let gain = format!("expected_gain_{}", errors.unit().in_tables().suffix);
    let data = sheet(["effect", "p_value", gain.as_str()], rows);
    Some(Drawing::new(("ranking", title), caption, chart(title, &[], &[panel]), data))
}

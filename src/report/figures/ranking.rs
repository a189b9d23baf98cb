//! Ranking of candidate effects by their evidence.

use super::prelude::*;
use crate::laws::ArgumentKind;
use crate::problem::Effect;
use crate::select::{Ranked, Trace};

/// Maximum number of candidates in the figure.
const MAX_CANDIDATES: usize = 12;
/// Height of a row in pixels.
const ROW: i32 = 22;
/// Width for names in pixels.
const NAMES: i32 = 200;
/// Smallest p value that is distinguished from zero.
const MIN_P: f64 = 1e-300;

/// Returns the name of an effect with its site, as in a problem file.
fn named(effect: &Effect, trace: &Trace) -> String {
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

/// Draws −log₁₀ p of the best candidates; candidates confounded with the first are marked.
pub fn ranking(trace: &Trace) -> Option<Drawing> {
    let shown: Vec<&Ranked> = trace.ranking.iter().take(MAX_CANDIDATES).collect();
    let first = shown.first()?;
    let evidence = |ranked: &Ranked| -ranked.p_value.max(MIN_P).log10();
    let highest = shown
        .iter()
        .map(|ranked| evidence(ranked))
        .fold(1.0, f64::max)
        .max(-2.0 * trace.level.log10());
    let alike = |ranked: &Ranked| first.alike.iter().any(|(other, _)| *other == ranked.effect);
    let count = i32::try_from(shown.len()).unwrap_or_default();
    let (top, bottom) = (10, 10 + ROW * count);
    let position = |value: f64| px(NAMES) + pixels(value / highest * f64::from(WIDTH - NAMES - 96));
    let svg = figure((WIDTH, bottom + BELOW), "Candidate effects by evidence", |area| {
        for (value, number) in round_numbers((0.0, highest), 5) {
            let at = position(value);
            vertical_line(area, at, (top, bottom), GRID)?;
            write(area, &number, (at / px(1), bottom + 10), MUTED, HPos::Center)?;
        }
        for (k, ranked) in (0..).zip(&shown) {
            let y = top + ROW * k + ROW / 2;
            let is_significant = ranked.p_value < trace.level;
            let colour = if is_significant { INK } else { MUTED };
            write(area, &named(&ranked.effect, trace), (NAMES - 8, y), colour, HPos::Right)?;
            let end = position(evidence(ranked)).max(position(0.0) + px(1));
            let bar = [(position(0.0), px(y - 6)), (end, px(y + 6))];
            let style = match (k, alike(ranked), is_significant) {
                (0, _, true) => ACCENT.filled(),
                (_, true, _) => ACCENT.mix(0.4).filled(),
                _ => FAINT.filled(),
            };
            area.draw(&Rectangle::new(bar, style))?;
            let mark = if k > 0 && alike(ranked) { "≈ first, " } else { "" };
            let gain = format!("{mark}{} mm", mm(ranked.gain.max(0.0), 4));
            // The text is to the right of both bar and line.
            let beside = end.max(position(-trace.level.log10()));
            write(area, &gain, (beside / px(1) + 6, y), MUTED, HPos::Left)?;
        }
        let level = position(-trace.level.log10());
        vertical_line(area, level, (top - 4, bottom), INK)?;
        write(
            area,
            "evidence, −log₁₀ p",
            (NAMES + (WIDTH - NAMES - 96) / 2, bottom + 28),
            INK,
            HPos::Center,
        )
    });
    let caption = format!(
        "{} candidates were tested on the fit of the declared model; these are the best. A longer bar is less likely to \
             arise by chance; left of the vertical line (p = {}) a candidate is not significant. Next to each bar: the \
             expected decrease of the root mean square error. Pale blue: hardly distinguishable from the first candidate \
             with these poses.",
        trace.tried, trace.level
    );
    let row = |ranked: &&Ranked| {
        vec![
            named(&ranked.effect, trace),
            format!("{:e}", ranked.p_value),
            fixed(ranked.gain * 1e3, 6),
        ]
    };
    let sheet =
        Sheet::new(&["effect", "p_value", "expected_gain_mm"], shown.iter().map(row).collect());
    Some(Drawing::new("ranking", "Candidate effects by evidence", caption, svg).with(sheet))
}

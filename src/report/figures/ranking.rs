//! Candidates by what they explain.

use super::prelude::*;
use crate::problem::Effect;
use crate::select::{Ranked, Trace};

/// Candidates that are drawn.
const MOST: usize = 12;
const ROW: i32 = 22;
/// Room for names.
const NAMES: i32 = 200;
/// p below this cannot be told from zero.
const LEAST_P: f64 = 1e-300;

/// Name of an effect with its place, as in a problem file.
fn named(found: &Effect, trace: &Trace) -> String {
    let place = found.place();
    let orders = match found {
        Effect::JointHarmonic { orders, .. } => {
            format!(" ×{}", orders.iter().map(u32::to_string).collect::<Vec<_>>().join(","))
        }
        _ => String::new(),
    };
    let name = found.name();
    match found {
        Effect::StationShift { at_time } | Effect::StationMove { at_time }
            if trace.time_measured =>
        {
            format!("{name} {at_time:.0} s")
        }
        Effect::StationShift { at_time } | Effect::StationMove { at_time } => {
            format!("{name} row {}", at_time.ceil())
        }
        Effect::JointWave { joint, order } => format!("{name} {joint} ×{order}"),
        Effect::TrackerSettling { time_constant } => format!("{name} {time_constant} s"),
        own if own.has_memory() => own.name_and_place(),
        _ if place.is_empty() => name.to_owned(),
        _ => format!("{name} {place}{orders}"),
    }
}

/// −log₁₀ p of the best candidates; those alike to the first are marked.
pub fn ranking(trace: &Trace) -> Option<Drawing> {
    let shown: Vec<&Ranked> = trace.ranking.iter().take(MOST).collect();
    let first = shown.first()?;
    let evidence = |ranked: &Ranked| -ranked.p_value.max(LEAST_P).log10();
    let most = shown
        .iter()
        .map(|ranked| evidence(ranked))
        .fold(1.0, f64::max)
        .max(-2.0 * trace.level.log10());
    let alike = |ranked: &Ranked| first.alike.iter().any(|(other, _)| *other == ranked.effect);
    let count = i32::try_from(shown.len()).unwrap_or_default();
    let (top, bottom) = (10, 10 + ROW * count);
    let place = |value: f64| px(NAMES) + pixels(value / most * f64::from(WIDTH - NAMES - 96));
    let svg = figure((WIDTH, bottom + BELOW), "Candidate effects by evidence", |area| {
        for (value, number) in round_numbers((0.0, most), 5) {
            let at = place(value);
            upright(area, at, (top, bottom), GRID)?;
            write(area, &number, (at / px(1), bottom + 10), MUTED, HPos::Center)?;
        }
        for (k, ranked) in (0..).zip(&shown) {
            let y = top + ROW * k + ROW / 2;
            let stands_out = ranked.p_value < trace.level;
            let colour = if stands_out { INK } else { MUTED };
            write(area, &named(&ranked.effect, trace), (NAMES - 8, y), colour, HPos::Right)?;
            let end = place(evidence(ranked)).max(place(0.0) + px(1));
            let bar = [(place(0.0), px(y - 6)), (end, px(y + 6))];
            let style = match (k, alike(ranked), stands_out) {
                (0, _, true) => ACCENT.filled(),
                (_, true, _) => ACCENT.mix(0.4).filled(),
                _ => FAINT.filled(),
            };
            area.draw(&Rectangle::new(bar, style))?;
            let mark = if k > 0 && alike(ranked) { "≈ first, " } else { "" };
            let gain = format!("{mark}{} mm", mm(ranked.gain.max(0.0), 4));
            // Beside the bar, and clear of the line.
            let beside = end.max(place(-trace.level.log10()));
            write(area, &gain, (beside / px(1) + 6, y), MUTED, HPos::Left)?;
        }
        let level = place(-trace.level.log10());
        upright(area, level, (top - 4, bottom), INK)?;
        write(
            area,
            "evidence, −log₁₀ p",
            (NAMES + (WIDTH - NAMES - 96) / 2, bottom + 28),
            INK,
            HPos::Center,
        )
    });
    let caption = format!(
        "{} candidates were tried on the fit of the declared model; these are the best. The longer the bar, the less chance \
             could do as much; left of the upright line (p = {}) nothing stands out. Behind each bar: how much the effect would \
             take off the root mean square error. Pale blue: hard to tell from the first with these poses.",
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
    Some(Drawing::new("ranking", "Which effects the residual points to", caption, svg).with(sheet))
}

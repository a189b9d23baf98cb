//! Figure of an effect: partial residuals over the regressor, with the fitted law.

use super::prelude::*;
use crate::results::{Cause, Point};

/// Maximum number of poses that a figure shows.
const MAX_SHOWN_POSES: usize = 500;

/// Returns the ordinate of the fitted law at the abscissa `x`, by linear interpolation of its
/// curve; constant beyond its ends, 0 without a curve.
fn law_at(curve: &[(f64, f64)], x: f64) -> f64 {
    let next = curve.partition_point(|at| at.0 < x);
    match (next.checked_sub(1).and_then(|k| curve.get(k)), curve.get(next)) {
        (Some(a), Some(b)) if b.0 > a.0 => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(end), _) | (None, Some(end)) => end.1,
        (None, None) => 0.0,
    }
}

/// Draws the figure of the effect that the loop added as number `number` (from 1). `shown` are the
/// rows that figures may draw, ascending. `unknown` states what is not known if the effect only
/// represents structure of unknown law, and `doubt` how sure another effect is that was not found.
pub fn effect(
    cause: &Cause,
    number: usize,
    shown: &[usize],
    (unknown, doubt): (Option<&str>, Option<String>),
) -> Drawing {
    let name = format!("effect-{number}");
    let Some(unknown) = unknown else {
        let (law, lead) = match doubt {
            None => ("fitted law", "Found by the loop; the line is the fitted law.".to_owned()),
            Some(doubt) => ("fit", format!("{doubt}; the line is the fit of this law.")),
        };
        return draw(cause, shown, (&name, law, &lead));
    };
    let lead = format!(
        "{unknown}: the model represents the structure by this effect, and the line is its fit."
    );
    let title = format!("structure of unknown law, represented by: {}", cause.title);
    draw(&Cause { title, ..cause.clone() }, shown, (&name, "fit", &lead))
}

/// Draws the figure of structure that no effect explains. `shown` are the rows that figures may
/// draw, ascending.
pub fn unexplained(trend: &Cause, shown: &[usize]) -> Drawing {
    let lead = "No effect explains this; the line is the empirical correction. Its mean over this \
                range is subtracted from line and dots, since base and geometry absorb a constant.";
    draw(trend, shown, ("unexplained", "correction", lead))
}

/// Draws the partial residuals of the rows in `shown` as dots, and the law as a line. `name` is
/// that of the figure, `law` that of the line in the legend, and `lead` begins the caption.
fn draw(cause: &Cause, shown: &[usize], (name, law, lead): (&str, &str, &str)) -> Drawing {
    let is_finite = |point: &&Point| point.x.is_finite() && point.y.is_finite();
    let finite: Vec<&Point> = cause.points.iter().filter(is_finite).collect();
    let scaled = |x: f64, y: f64| (x * cause.across.factor, y * cause.up.factor);
    let is_shown = |k: &usize| finite[*k].row.is_none_or(|row| shown.binary_search(&row).is_ok());
    let candidates: Vec<usize> = (0..finite.len()).filter(is_shown).collect();
    let deviation = |k: usize| finite[k].y - law_at(&cause.curve, finite[k].x);
    let sampled = sample(&candidates, MAX_SHOWN_POSES, deviation);
    let points: Vec<((f64, f64), &Point)> =
        sampled.iter().map(|&k| (scaled(finite[k].x, finite[k].y), finite[k])).collect();
    let curve: Vec<(f64, f64)> = cause.curve.iter().map(|&(x, y)| scaled(x, y)).collect();
    let every_point = || points.iter().map(|(scaled, _)| *scaled).chain(curve.iter().copied());
    let x = with_margin(range(every_point().map(|at| at.0)), 0.04);
    let deviation = |&(x, y): &(f64, f64)| y - law_at(&curve, x);
    let limit = axis_limit(points.iter().map(|(at, _)| deviation(at)));
    let is_near = |at: &(f64, f64)| deviation(at).abs() <= limit;
    let near = points.iter().map(|(at, _)| *at).filter(is_near).chain(curve.iter().copied());
    let y = Axis::linear(with_margin(range(near.map(|at| at.1)), 0.06), &cause.up.label, 6);
    let (low, high) = y.range;
    let is_beyond = |at: &(f64, f64)| at.1 < low || at.1 > high;
    let outside = points.iter().filter(|(at, _)| is_beyond(at)).count();
    // Held-out poses are drawn over the fitted ones.
    let (held_out, fitted): (Vec<_>, Vec<_>) = points.iter().partition(|(_, point)| point.held_out);
    let dot = |(at, point): &((f64, f64), &Point)| {
        let colour = if point.held_out { INK } else { FAINT };
        let paint = if is_beyond(at) { Paint::line(WARM, 1.4) } else { Paint::fill(colour) };
        Shape::dot((at.0, at.1.clamp(low, high)), 2.2, paint, point.row)
    };
    let mut legend = poses_legend();
    legend.truncate(if held_out.is_empty() { 1 } else { 2 });
    legend.push((law, ACCENT, Mark::Line));
    let mut panel = Panel::new(232.0, Axis::linear(x, &cause.across.label, 6), y);
    if low < 0.0 && high > 0.0 {
        panel = panel.with_level(0.0);
    }
    let panel = panel
        .with(fitted.into_iter().chain(held_out).map(|point| dot(&point)))
        .with([Shape::line(curve.iter().copied(), Paint::line(ACCENT, 2.2))])
        .noting_beyond(outside, Anchor::End);
    let mut letters = cause.title.chars();
    let title: String =
        letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect();
    let caption = format!(
        "{lead} {}{}{}",
        cause.reading,
        beyond_note(outside),
        thinning_note(sampled.len(), finite.len())
    );
    let columns = ["held_out", cause.across.label.as_str(), cause.up.label.as_str()];
    let rows = points
        .iter()
        .map(|(at, point)| vec![point.held_out.to_string(), fixed(at.0, 6), fixed(at.1, 9)]);
    let svg = chart(&cause.title, &legend, &[panel]);
    Drawing::new((name, &title), caption, svg, sheet(columns, rows))
}

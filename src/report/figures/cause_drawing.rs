//! Figure of an effect: partial residuals over the regressor, with the fitted law.

use super::axis_limit::{axis_limit, beyond_note};
use super::cause::{Cause, Point};
use super::pose::{sample, thinning_note};
use super::prelude::*;

/// Maximum number of poses in a figure.
const MAX_POSES: usize = 500;
/// Height of the figure in pixels.
const HEIGHT: i32 = 300;

/// Returns the fitted law at a value, by linear interpolation of its curve; 0 without a curve.
fn law_at(curve: &[(f64, f64)], x: f64) -> f64 {
    let next = curve.partition_point(|at| at.0 < x);
    match (next.checked_sub(1).and_then(|k| curve.get(k)), curve.get(next)) {
        (Some(a), Some(b)) if b.0 > a.0 => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(end), _) | (None, Some(end)) => end.1,
        (None, None) => 0.0,
    }
}

impl Cause {
    /// Draws an effect that the loop found, with its number.
    pub fn draw_effect(&self, number: usize, shown: &[usize]) -> Drawing {
        self.draw(
            shown,
            &format!("effect-{number}"),
            "fitted law",
            "Found by the loop; the line is the fitted law.",
        )
    }

    /// Draws structure that no effect explains.
    pub fn draw_unexplained(&self, shown: &[usize]) -> Drawing {
        let lead = "No effect explains this; the line is the empirical correction. Its mean over this range is subtracted from \
                    line and dots, since base and geometry absorb a constant.";
        self.draw(shown, "unexplained", "correction", lead)
    }

    /// Draws the partial residuals of the rows in `shown` as dots, and the law as a line.
    fn draw(&self, shown: &[usize], name: &str, law: &str, lead: &str) -> Drawing {
        let is_finite = |point: &&Point| point.x.is_finite() && point.y.is_finite();
        let finite: Vec<&Point> = self.points.iter().filter(is_finite).collect();
        let scaled = |x: f64, y: f64| (x * self.across.factor, y * self.up.factor);
        let is_shown =
            |k: &usize| finite[*k].row.is_none_or(|row| shown.binary_search(&row).is_ok());
        let candidates: Vec<usize> = (0..finite.len()).filter(is_shown).collect();
        let deviation = |k: usize| finite[k].y - law_at(&self.curve, finite[k].x);
        let sampled = sample(&candidates, MAX_POSES, deviation);
        let points: Vec<((f64, f64), &Point)> =
            sampled.iter().map(|&k| (scaled(finite[k].x, finite[k].y), finite[k])).collect();
        let curve: Vec<(f64, f64)> = self.curve.iter().map(|&(x, y)| scaled(x, y)).collect();
        let every_point = || points.iter().map(|(scaled, _)| *scaled).chain(curve.iter().copied());
        let x = with_margin(range(every_point().map(|at| at.0)), 0.04);
        let deviation = |&(x, y): &(f64, f64)| y - law_at(&curve, x);
        let limit = axis_limit(points.iter().map(|(at, _)| deviation(at)));
        let is_near = |at: &(f64, f64)| deviation(at).abs() <= limit;
        let near = points.iter().map(|(at, _)| *at).filter(is_near).chain(curve.iter().copied());
        let y = with_margin(range(near.map(|at| at.1)), 0.06);
        let is_beyond = |at: &(f64, f64)| at.1 < y.0 || at.1 > y.1;
        let outside = points.iter().filter(|(at, _)| is_beyond(at)).count();
        let tags = Tags::of_dots();
        let svg = figure((WIDTH, HEIGHT), &self.title, |area| {
            let has_held_out = points.iter().any(|(_, point)| point.held_out);
            let dots = [("fitted pose", FAINT, Mark::Dot), ("held-out pose", INK, Mark::Dot)];
            let dots = dots.into_iter().take(if has_held_out { 2 } else { 1 });
            let entries: Vec<_> = dots.chain([(law, ACCENT, Mark::Line)]).collect();
            let body = legend(area, 20, &entries)?;
            let mut chart = chart(
                &body,
                &Axis::linear(x, &self.across.label),
                &Axis::linear(y, &self.up.label),
            )?;
            if y.0 < 0.0 && y.1 > 0.0 {
                chart.draw_series([PathElement::new(
                    vec![(x.0, 0.0), (x.1, 0.0)],
                    line(FAINT, 1.0),
                )])?;
            }
            for (held_out, colour) in [(false, FAINT), (true, INK)] {
                for (at, point) in points.iter().filter(|(_, point)| point.held_out == held_out) {
                    let style = if is_beyond(at) { line(WARM, 1.4) } else { colour.filled() };
                    tags.pose(point.row);
                    chart.draw_series([Circle::new(
                        (at.0, at.1.clamp(y.0, y.1)),
                        pixels(2.2),
                        style,
                    )])?;
                }
            }
            chart.draw_series(LineSeries::new(curve.iter().copied(), line(ACCENT, 2.2)))?;
            note_beyond(&body, outside)
        });
        let mut letters = self.title.chars();
        let title = letters
            .next()
            .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect());
        let caption = format!(
            "{lead} {}{}{}",
            self.reading,
            beyond_note(outside),
            thinning_note(sampled.len(), finite.len())
        );
        let columns = ["held_out", self.across.label.as_str(), self.up.label.as_str()];
        let row = |(at, point): &((f64, f64), &Point)| {
            vec![point.held_out.to_string(), fixed(at.0, 6), fixed(at.1, 9)]
        };
        let sheet = Sheet::new(&columns, points.iter().map(row).collect());
        Drawing::new(name, &title, caption, tags.insert_into(&svg)).with(sheet)
    }
}

//! Residual vectors over the workspace.

use super::data::PlotData;
use super::pose::{PoseError, left_out, thin, thinned};
use super::prelude::*;

/// Poses that are drawn at most.
const MOST: usize = 400;
/// Length of a long arrow as a part of the width.
const LONG: f64 = 0.09;
/// Heights of a view as shown.
const LEAST: f64 = 150.0;
const MAX_MAGNITUDE: f64 = 330.0;

/// Residuals from above and from the side, at their measured positions; none where no row measures
/// a position.
pub fn vectors(data: &PlotData) -> Option<Drawing> {
    if !data.has_positions() {
        return None;
    }
    let positions: Vec<usize> =
        (0..data.residuals.len()).filter(|&row| data.is_position(row)).collect();
    let is_finite = |row: &usize| data.is_position(*row) && data.size(*row).is_finite();
    let count = positions.iter().filter(|&row| is_finite(row)).count();
    let finite: Vec<usize> = data.shown.iter().copied().filter(is_finite).collect();
    let shown: Vec<(usize, &PoseError)> = thin(&finite, MOST, |row| data.size(row))
        .into_iter()
        .map(|row| (row, &data.residuals[row]))
        .collect();
    let tags = Tags::of_dots();
    let extent = |axis: usize| {
        with_margin(range(shown.iter().map(|(_, residual)| residual.position[axis])), 0.12)
    };
    let width = f64::from(WIDTH - LEFT - 12);
    let size = |(low, high): (f64, f64)| high - low;
    // One scale for all: strokes keep their directions.
    let per_pixel = (size(extent(0)) / width)
        .max(size(extent(1)) / MAX_MAGNITUDE)
        .max(size(extent(2)) / MAX_MAGNITUDE);
    let across = about(extent(0), width * per_pixel);
    let views = [1, 2].map(|axis| View::new(axis, extent(axis), per_pixel));
    let mut lengths: Vec<f64> = shown.iter().map(|(_, residual)| residual.error.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let long = lengths.get(lengths.len() * 9 / 10).copied().unwrap_or(1e-3).max(1e-9);
    // A scale of 1, 2 or 5 times a power of ten.
    let bar = rounded(long);
    let larger = LONG * (across.1 - across.0) / bar;
    let height = 24 + views.iter().map(|view| view.height + BELOW + 8).sum::<i32>();
    let svg = figure((WIDTH, height), "Residual vectors from above and from the side", |area| {
        let body = legend(
            area,
            22,
            &[("fitted pose", FAINT, Mark::Dot), ("held-out pose", INK, Mark::Dot)],
        )?;
        let length = pixels(LONG * width);
        let end = px(WIDTH - 12);
        area.draw(&PathElement::new(vec![(end - length, px(10)), (end, px(10))], line(INK, 1.6)))?;
        write(
            area,
            &format!("{} mm", short(bar * 1e3)),
            (WIDTH - 20 - length / 4, 10),
            INK,
            HPos::Right,
        )?;
        let panels = stacked(&body, &views.each_ref().map(|view| view.height + BELOW + 8));
        for (view, panel) in views.iter().zip(&panels) {
            view.draw(panel, across, (&shown, larger), &tags)?;
        }
        Ok(())
    });
    let caption = format!(
        "Each stroke starts at a measured position (dot) and shows the residual measured − predicted there, drawn {} times \
             too long: from above (x, y) and from the side (x, z) of the measuring frame. Neighbours that point alike are \
             structure; a tangle is noise.{}{}",
        short(larger),
        left_out(positions.len() - count),
        thinned(shown.len(), count)
    );
    let columns = ["x_mm", "y_mm", "z_mm", "residual_x_mm", "residual_y_mm", "residual_z_mm"];
    let row = |(_, own): (usize, &'_ PoseError)| {
        own.position.iter().chain(own.error.iter()).map(|x| x * 1e3).collect()
    };
    let sheet = Sheet::of_poses(&columns, shown.iter().map(|&own| (own.1, row(own))));
    Some(
        Drawing::new(
            "residual-vectors",
            "What is left, over the workspace",
            caption,
            tags.put(&svg),
        )
        .with(sheet),
    )
}

/// 1, 2 or 5 times the power of ten below.
fn rounded(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0]
        .map(|part| part * power)
        .into_iter()
        .find(|round| *round <= value * 1.001)
        .unwrap_or(power)
}

/// Two digits that count, without an exponent.
fn short(value: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "a power of ten")]
    let digits = 1 - value.abs().max(1e-12).log10().floor() as i32;
    if digits < 0 {
        let power = 10.0_f64.powi(-digits);
        return number((value / power).round() * power, 0);
    }
    let text = number(value, digits.unsigned_abs() as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A range of some width about the middle of another.
fn about((low, high): (f64, f64), width: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle - 0.5 * width, middle + 0.5 * width)
}

/// The part of the way from a value in a range to another that stays in it.
fn inside(from: f64, to: f64, (low, high): (f64, f64)) -> f64 {
    let edge = if to > high { high } else { low };
    if (low..=high).contains(&to) { 1.0 } else { ((edge - from) / (to - from)).clamp(0.0, 1.0) }
}

/// Positions projected on x and one other axis.
struct View {
    axis: usize,
    range: (f64, f64),
    /// Of the drawing between the axes, as shown.
    height: i32,
}

impl View {
    fn new(axis: usize, range: (f64, f64), per_pixel: f64) -> Self {
        let height = ((range.1 - range.0) / per_pixel).max(LEAST).round();
        #[expect(clippy::cast_possible_truncation, reason = "between the two heights")]
        let shown = height as i32;
        Self { axis, range: about(range, height * per_pixel), height: shown }
    }

    fn draw(
        &self,
        panel: &Area,
        across: (f64, f64),
        (shown, larger): (&[(usize, &PoseError)], f64),
        tags: &Tags,
    ) -> Result<(), Failure> {
        let label = if self.axis == 1 { "y [m]" } else { "z [m]" };
        let below =
            if self.axis == 1 { "x [m], seen from above" } else { "x [m], seen from the side" };
        let mut chart = chart(
            panel,
            &Axis::linear(across, below),
            &Axis::linear(self.range, label).numbers(5),
        )?;
        for (row, residual) in shown {
            let colour = if residual.held_out { INK } else { FAINT };
            let from = (residual.position.x, residual.position[self.axis]);
            let end =
                (from.0 + larger * residual.error.x, from.1 + larger * residual.error[self.axis]);
            // A stroke that would leave the view ends at its edge.
            let part = inside(from.0, end.0, across).min(inside(from.1, end.1, self.range));
            let to = (from.0 + part * (end.0 - from.0), from.1 + part * (end.1 - from.1));
            chart.draw_series([PathElement::new(vec![from, to], line(colour, 1.2))])?;
            tags.pose(Some(*row));
            chart.draw_series([Circle::new(from, pixels(1.5), colour.filled())])?;
        }
        Ok(())
    }
}

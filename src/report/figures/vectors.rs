//! Residual vectors over the workspace.

use super::data::PlotData;
use super::pose::{PoseError, omission_note, sample, thinning_note};
use super::prelude::*;

/// Maximum number of poses in the figure.
const MAX_POSES: usize = 400;
/// Length of a long residual vector as a fraction of the width.
const VECTOR_LENGTH: f64 = 0.09;
/// Minimum height of a view in displayed pixels.
const MIN_HEIGHT: f64 = 150.0;
/// Maximum height of a view in displayed pixels.
const MAX_HEIGHT: f64 = 330.0;

/// Draws the residuals from above and from the side at their measured positions; `None` if no row
/// measures a position.
pub fn vectors(data: &PlotData) -> Option<Drawing> {
    if !data.has_positions() {
        return None;
    }
    let positions: Vec<usize> =
        (0..data.residuals.len()).filter(|&row| data.is_position(row)).collect();
    let is_finite = |row: &usize| data.is_position(*row) && data.size(*row).is_finite();
    let count = positions.iter().filter(|&row| is_finite(row)).count();
    let finite: Vec<usize> = data.shown.iter().copied().filter(is_finite).collect();
    let shown: Vec<(usize, &PoseError)> = sample(&finite, MAX_POSES, |row| data.size(row))
        .into_iter()
        .map(|row| (row, &data.residuals[row]))
        .collect();
    let tags = Tags::of_dots();
    let extent = |axis: usize| {
        with_margin(range(shown.iter().map(|(_, residual)| residual.position[axis])), 0.12)
    };
    let width = f64::from(WIDTH - LEFT - 12);
    let size = |(low, high): (f64, f64)| high - low;
    // All views share one scale, so that vectors keep their directions.
    let per_pixel = (size(extent(0)) / width)
        .max(size(extent(1)) / MAX_HEIGHT)
        .max(size(extent(2)) / MAX_HEIGHT);
    let across = centred(extent(0), width * per_pixel);
    let views = [1, 2].map(|axis| View::new(axis, extent(axis), per_pixel));
    let mut lengths: Vec<f64> = shown.iter().map(|(_, residual)| residual.error.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let long = lengths.get(lengths.len() * 9 / 10).copied().unwrap_or(1e-3).max(1e-9);
    // The scale bar is 1, 2 or 5 times a power of ten.
    let bar = rounded(long);
    let magnification = VECTOR_LENGTH * (across.1 - across.0) / bar;
    let height = 24 + views.iter().map(|view| view.height + BELOW + 8).sum::<i32>();
    let svg = figure((WIDTH, height), "Residual vectors from above and from the side", |area| {
        let body = legend(
            area,
            22,
            &[("fitted pose", FAINT, Mark::Dot), ("held-out pose", INK, Mark::Dot)],
        )?;
        let length = pixels(VECTOR_LENGTH * width);
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
            view.draw(panel, across, (&shown, magnification), &tags)?;
        }
        Ok(())
    });
    let caption = format!(
        "Each line starts at a measured position (dot) and shows the residual measured − predicted there, magnified {} \
             times: from above (x, y) and from the side (x, z) of the measuring frame. Similar directions of neighbours are \
             structure; random directions are noise.{}{}",
        short(magnification),
        omission_note(positions.len() - count),
        thinning_note(shown.len(), count)
    );
    let columns = ["x_mm", "y_mm", "z_mm", "residual_x_mm", "residual_y_mm", "residual_z_mm"];
    let row = |residual: &PoseError| {
        residual.position.iter().chain(residual.error.iter()).map(|x| x * 1e3).collect()
    };
    let cells = shown.iter().map(|&(_, residual)| (residual, row(residual)));
    let sheet = Sheet::of_poses(&columns, cells);
    Some(
        Drawing::new(
            "residual-vectors",
            "Residuals over the workspace",
            caption,
            tags.insert_into(&svg),
        )
        .with(sheet),
    )
}

/// Returns the largest of 1, 2 or 5 times a power of ten that is not above the value.
fn rounded(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|round| *round <= value * 1.001)
        .unwrap_or(power)
}

/// Returns a number with two significant digits, without an exponent.
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

/// Returns a range of a given width about the centre of another.
fn centred((low, high): (f64, f64), width: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle - 0.5 * width, middle + 0.5 * width)
}

/// Returns the fraction of the way from a value within a range to another value that stays in the
/// range.
fn fraction_inside(from: f64, to: f64, (low, high): (f64, f64)) -> f64 {
    let edge = if to > high { high } else { low };
    if (low..=high).contains(&to) { 1.0 } else { ((edge - from) / (to - from)).clamp(0.0, 1.0) }
}

/// Projection of the positions on x and one other axis.
struct View {
    axis: usize,
    range: (f64, f64),
    /// Height between the axes in displayed pixels.
    height: i32,
}

impl View {
    fn new(axis: usize, range: (f64, f64), per_pixel: f64) -> Self {
        let height = ((range.1 - range.0) / per_pixel).max(MIN_HEIGHT).round();
        #[expect(clippy::cast_possible_truncation, reason = "between the two limits")]
        let shown = height as i32;
        Self { axis, range: centred(range, height * per_pixel), height: shown }
    }

    fn draw(
        &self,
        panel: &Area,
        across: (f64, f64),
        (shown, magnification): (&[(usize, &PoseError)], f64),
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
            let end = (
                from.0 + magnification * residual.error.x,
                from.1 + magnification * residual.error[self.axis],
            );
            // A line that would leave the view ends at its edge.
            let part = fraction_inside(from.0, end.0, across)
                .min(fraction_inside(from.1, end.1, self.range));
            let to = (from.0 + part * (end.0 - from.0), from.1 + part * (end.1 - from.1));
            chart.draw_series([PathElement::new(vec![from, to], line(colour, 1.2))])?;
            tags.pose(Some(*row));
            chart.draw_series([Circle::new(from, pixels(1.5), colour.filled())])?;
        }
        Ok(())
    }
}

//! Figure of the residual vectors over the workspace.

use std::collections::BTreeSet;

use super::chart::{LEFT_SPACE, RIGHT_SPACE};
use super::prelude::*;

/// Maximum number of poses that the figure shows.
const MAX_SHOWN_POSES: usize = 400;
/// Length of the scale bar, and so of a large residual vector, as a fraction of the drawing's
/// width.
const VECTOR_LENGTH: f64 = 0.09;
/// Minimum and maximum height of a view in displayed pixels.
const HEIGHT_RANGE: (f64, f64) = (150.0, 330.0);

/// Draws the residual vectors at the measured positions, from above and from the side; `None` if no
/// row measures a position.
pub fn vectors(data: &PlotData) -> Option<Drawing> {
    if !data.has_positions() {
        return None;
    }
    let positions = || (0..data.residuals.len()).filter(|&row| data.is_position(row));
    let is_finite = |row: &usize| data.is_position(*row) && data.residual_length(*row).is_finite();
    let count = positions().filter(is_finite).count();
    let finite: Vec<usize> = data.shown.iter().copied().filter(is_finite).collect();
    let rows = sample(&finite, MAX_SHOWN_POSES, |row| data.residual_length(row));
    let shown: Vec<&PoseError> = rows.iter().map(|&row| &data.residuals[row]).collect();
    let extent =
        |axis: usize| with_margin(range(shown.iter().map(|pose| pose.position[axis])), 0.12);
    let size = |axis: usize| {
        let (low, high) = extent(axis);
        high - low
    };
    // All views share one scale, so that vectors keep their directions.
    let width = FIGURE_WIDTH - LEFT_SPACE - RIGHT_SPACE;
    let per_pixel = (size(0) / width).max(size(1).max(size(2)) / HEIGHT_RANGE.1);
    let across = centred(extent(0), width * per_pixel);
    let mut lengths: Vec<f64> = shown.iter().map(|pose| pose.error.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let large = lengths.get(lengths.len() * 9 / 10).copied().unwrap_or(1e-3).max(1e-9);
    // The scale bar is 1, 2 or 5 times a power of ten.
    let bar = round_down(large);
    let magnification = VECTOR_LENGTH * (across.1 - across.0) / bar;
    let mut cut = BTreeSet::new();
    let view = |(axis, label, below): (usize, &str, &str)| {
        let height = (size(axis) / per_pixel).max(HEIGHT_RANGE.0).round();
        let up = centred(extent(axis), height * per_pixel);
        let vector = |(pose, &row): (&&PoseError, &usize)| {
            let colour = if pose.held_out { INK } else { FAINT };
            let from = (pose.position.x, pose.position[axis]);
            let shift = (magnification * pose.error.x, magnification * pose.error[axis]);
            // A line that would leave the view ends at its edge.
            let part = share_inside(from.0, shift.0, across).min(share_inside(from.1, shift.1, up));
            if part < 1.0 {
                cut.insert(row);
            }
            let to = (from.0 + part * shift.0, from.1 + part * shift.1);
            let line = Shape::line([from, to], Paint::line(colour, 1.2));
            [line, Shape::dot(from, 1.5, Paint::fill(colour), Some(row))]
        };
        Panel::new(height, Axis::linear(across, below, 6), Axis::linear(up, label, 5))
            .with(shown.iter().zip(&rows).flat_map(vector))
    };
    let views = [(1, "y [m]", "x [m], seen from above"), (2, "z [m]", "x [m], seen from the side")];
    let views = views.map(view);
    let cut = match cut.len() {
        0 => String::new(),
        1 => " 1 line is longer than shown: it ends at the frame.".to_owned(),
        count => format!(" {count} lines are longer than shown: they end at the frame."),
    };
    let scale = format!("{} mm", two_significant(bar * 1e3));
    let mut legend = poses_legend();
    legend.push((&scale, INK, Mark::Scale(VECTOR_LENGTH * width)));
    let caption = format!(
        "Each line starts at a measured position (dot) and shows the residual measured − \
         predicted there, magnified {} times: from above (x, y) and from the side (x, z) of the \
         measuring frame. Similar directions of neighbours are structure; random directions are \
         noise.{cut}{}{}",
        two_significant(magnification),
        omission_note(positions().count() - count),
        thinning_note(shown.len(), count)
    );
    let columns = ["x_mm", "y_mm", "z_mm", "residual_x_mm", "residual_y_mm", "residual_z_mm"];
    let cells = shown.iter().map(|&pose| {
        (pose, pose.position.iter().chain(pose.error.iter()).map(|x| x * 1e3).collect())
    });
    Some(Drawing::new(
        ("residual-vectors", "Residuals over the workspace"),
        caption,
        chart("Residual vectors from above and from the side", &legend, &views),
        pose_sheet(&columns, cells),
    ))
}

/// Returns the largest of 1, 2 or 5 times a power of ten that is not above the value.
fn round_down(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|factor| factor * power);
    steps.into_iter().find(|round| *round <= value * 1.001).unwrap_or(power)
}

/// Formats a number with two significant digits, without an exponent.
fn two_significant(value: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "a power of ten")]
    let digits = 1 - value.abs().max(1e-12).log10().floor() as i32;
    let power = 10.0_f64.powi(-digits);
    let text = number((value / power).round() * power, digits.max(0).unsigned_abs() as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Returns the range of a given width about the centre of another range.
fn centred((low, high): (f64, f64), width: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle - 0.5 * width, middle + 0.5 * width)
}

/// Returns the largest share, 0…1, of a shift that can be added to the value `from` without leaving
/// the range.
fn share_inside(from: f64, shift: f64, (low, high): (f64, f64)) -> f64 {
    let edge = if shift > 0.0 { high } else { low };
    let is_inside = (low..=high).contains(&(from + shift));
    if is_inside { 1.0 } else { ((edge - from) / shift).clamp(0.0, 1.0) }
}

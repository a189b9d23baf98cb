//! Figure of the residuals in the order of measurement.

use super::prelude::*;

/// Maximum number of poses that the figure shows.
const MAX_SHOWN_POSES: usize = 300;
/// Time span above which the axis is in hours \[s\].
const MIN_HOURS_SPAN: f64 = 7200.0;
/// Time span above which the axis is in minutes \[s\].
const MIN_MINUTES_SPAN: f64 = 180.0;

/// Draws the residual coordinates of fitted positions in order of time, with a band of ±2 σ of the
/// noise. `None` for less than two such rows.
pub fn order(data: &PlotData) -> Option<Drawing> {
    let is_fitted = |row: &usize| data.is_position(*row) && !data.residuals[*row].held_out;
    let is_finite = |row: &usize| data.residual_length(*row).is_finite();
    let fitted: Vec<usize> = (0..data.residuals.len()).filter(is_fitted).collect();
    let finite = fitted.iter().filter(|row| is_finite(row)).count();
    let candidates: Vec<usize> =
        data.shown.iter().copied().filter(|row| is_fitted(row) && is_finite(row)).collect();
    let rows = sample(&candidates, MAX_SHOWN_POSES, |row| data.residual_length(row));
    let shown: Vec<&PoseError> = rows.iter().map(|&row| &data.residuals[row]).collect();
    if shown.len() < 2 {
        return None;
    }
    let times = range(shown.iter().map(|residual| residual.time));
    let (factor, label) = match (data.time_measured, times.1 - times.0) {
        (false, _) => (1.0, "row"),
        (true, span) if span > MIN_HOURS_SPAN => (1.0 / 3600.0, "time from the first pose [h]"),
        (true, span) if span > MIN_MINUTES_SPAN => (1.0 / 60.0, "time from the first pose [min]"),
        (true, _) => (1.0, "time from the first pose [s]"),
    };
    let start = if data.time_measured { times.0 } else { 0.0 };
    let place = |residual: &PoseError| (residual.time - start) * factor;
    let across = with_margin(((times.0 - start) * factor, (times.1 - start) * factor), 0.02);
    let sigma = shown.iter().map(|residual| residual.sigma).sum::<f64>() / shown.len() as f64 * 1e3;
    let values = shown.iter().flat_map(|residual| residual.error.iter().map(|x| x * 1e3));
    let limit = axis_limit(values).max(2.2 * sigma) * 1.08;
    let is_beyond = |residual: &PoseError, axis: usize| (residual.error[axis] * 1e3).abs() > limit;
    let outside = |axis: usize| shown.iter().filter(|residual| is_beyond(residual, axis)).count();
    let panel = |(axis, name): (usize, &str)| {
        let bottom = if axis == 2 { Axis::linear(across, label, 7) } else { Axis::bare(across) };
        let dots = shown.iter().zip(&rows).map(|(residual, &row)| {
            let beyond = is_beyond(residual, axis);
            let paint = if beyond { Paint::line(WARM, 1.4) } else { Paint::fill(FAINT) };
            let value = (residual.error[axis] * 1e3).clamp(-limit, limit);
            Shape::dot((place(residual), value), 2.0, paint, Some(row))
        });
        let band = Shape::band((across.0, -2.0 * sigma), (across.1, 2.0 * sigma), ACCENT);
        Panel::new(80.0, bottom, Axis::linear((-limit, limit), name, 5))
            .with([band])
            .with_level(0.0)
            .with(dots)
            .noting_beyond(outside(axis), Anchor::End)
    };
    let panels: Vec<Panel> =
        ["x [mm]", "y [mm]", "z [mm]"].into_iter().enumerate().map(panel).collect();
    let legend = [
        ("fitted pose", FAINT, Mark::Dot),
        ("expected from noise: ±2 σ of the measurement", ACCENT, Mark::Band),
    ];
    let caption = format!(
        "Residuals measured − predicted of the fitted poses in the order of measurement; 95 % \
         should lie within the band. Runs of equal sign, drifts and steps are structure.{}{}{}",
        beyond_note((0..3).map(outside).sum()),
        omission_note(fitted.len() - finite),
        thinning_note(shown.len(), finite)
    );
    let cells = shown.iter().map(|&residual| {
        let errors = residual.error.iter().map(|x| x * 1e3);
        (residual, std::iter::once(place(residual)).chain(errors).collect())
    });
    let first = if label == "row" { "number" } else { label };
    let columns = [first, "residual_x_mm", "residual_y_mm", "residual_z_mm"];
    Some(Drawing::new(
        ("residual-order", "Residuals in the order of measurement"),
        caption,
        chart("Residuals in order", &legend, &panels),
        pose_sheet(&columns, cells),
    ))
}

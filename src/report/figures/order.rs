//! Residuals in the order of measurement.

use super::axis_limit::{axis_limit, beyond_note};
use super::data::PlotData;
use super::pose::{PoseError, omission_note, sample, thinning_note};
use super::prelude::*;

/// Maximum number of poses in the figure.
const MAX_POSES: usize = 300;
/// Height of a panel in pixels.
const PANEL: i32 = 92;

/// Draws the residual coordinates of positions in the order of time, with a band of ±2 σ.
pub fn order(data: &PlotData) -> Option<Drawing> {
    let fitted = data
        .residuals
        .iter()
        .filter(|residual| !residual.held_out && residual.observation.is_position());
    let (finite, lost): (Vec<&PoseError>, Vec<&PoseError>) =
        fitted.partition(|residual| residual.error.norm().is_finite());
    let is_fitted = |row: &usize| {
        data.is_position(*row) && !data.residuals[*row].held_out && data.size(*row).is_finite()
    };
    let candidates: Vec<usize> = data.shown.iter().copied().filter(is_fitted).collect();
    let shown: Vec<(usize, &PoseError)> = sample(&candidates, MAX_POSES, |row| data.size(row))
        .into_iter()
        .map(|row| (row, &data.residuals[row]))
        .collect();
    let first = range(shown.iter().map(|(_, residual)| residual.time));
    if shown.len() < 2 {
        return None;
    }
    let (factor, label) = match (data.time_measured, first.1 - first.0) {
        (false, _) => (1.0, "row"),
        (true, span) if span > 7200.0 => (1.0 / 3600.0, "time [h]"),
        (true, _) => (1.0, "time [s]"),
    };
    let across = with_margin((first.0 * factor, first.1 * factor), 0.02);
    let sigma =
        shown.iter().map(|(_, residual)| residual.sigma).sum::<f64>() / shown.len() as f64 * 1e3;
    let values = shown.iter().flat_map(|(_, residual)| residual.error.iter().map(|x| x * 1e3));
    let limit = axis_limit(values).max(2.2 * sigma) * 1.08;
    let is_beyond = |residual: &PoseError, axis: usize| (residual.error[axis] * 1e3).abs() > limit;
    let outside =
        |axis: usize| shown.iter().filter(|(_, residual)| is_beyond(residual, axis)).count();
    let tags = Tags::of_dots();
    let svg = figure((WIDTH, 22 + 3 * PANEL + 36), "Residuals in order", |area| {
        let entries = [
            ("fitted pose", FAINT, Mark::Dot),
            ("expected from noise: ±2 σ of the measurement", ACCENT, Mark::Band),
        ];
        let panels = stacked(&legend(area, 20, &entries)?, &[PANEL, PANEL, PANEL + 36]);
        for (axis, (name, panel)) in
            ["x [mm]", "y [mm]", "z [mm]"].into_iter().zip(&panels).enumerate()
        {
            let last = axis == 2;
            let bottom = Axis::linear(across, if last { label } else { "" }).numbers(if last {
                7
            } else {
                0
            });
            let mut chart = chart(panel, &bottom, &Axis::linear((-limit, limit), name).numbers(5))?;
            let noise =
                Rectangle::new([(across.0, -2.0 * sigma), (across.1, 2.0 * sigma)], band(ACCENT));
            chart.draw_series([noise])?;
            chart.draw_series([PathElement::new(
                vec![(across.0, 0.0), (across.1, 0.0)],
                line(FAINT, 1.0),
            )])?;
            for (row, residual) in &shown {
                let value = (residual.error[axis] * 1e3).clamp(-limit, limit);
                let at = (residual.time * factor, value);
                let is_beyond = is_beyond(residual, axis);
                let style = if is_beyond { line(WARM, 1.4) } else { FAINT.filled() };
                tags.pose(Some(*row));
                chart.draw_series([Circle::new(at, pixels(2.0), style)])?;
            }
            note_beyond(panel, outside(axis))?;
        }
        Ok(())
    });
    let caption = format!(
        "Residuals measured − predicted of the fitted poses in the order of measurement; 95 % should lie within the band. \
             Runs of equal sign, drifts and steps are structure.{}{}{}",
        beyond_note((0..3).map(outside).sum()),
        omission_note(lost.len()),
        thinning_note(shown.len(), finite.len())
    );
    let row = |residual: &PoseError| {
        let errors = residual.error.iter().map(|x| x * 1e3);
        std::iter::once(residual.time * factor).chain(errors).collect()
    };
    let columns = [
        if label == "row" { "number" } else { label },
        "residual_x_mm",
        "residual_y_mm",
        "residual_z_mm",
    ];
    let cells = shown.iter().map(|&(_, residual)| (residual, row(residual)));
    let sheet = Sheet::of_poses(&columns, cells);
    Some(
        Drawing::new(
            "residual-order",
            "Residuals in the order of measurement",
            caption,
            tags.insert_into(&svg),
        )
        .with(sheet),
    )
}

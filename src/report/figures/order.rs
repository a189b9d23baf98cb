//! Residuals one after another.

use plotters::prelude::*;

use super::data::{PlotData, PoseError};
use super::frame::{
    ACCENT, Axis, Drawing, FAINT, Mark, WIDTH, band, chart, every, figure, left_out, legend, line, radius, range,
    stacked, thinned, with_margin,
};

/// Poses that are drawn at most.
const MOST: usize = 300;
const PANEL: i32 = 92;

/// Residual coordinates in the order of time, with the band of ±2 σ.
pub fn order(data: &PlotData) -> Option<Drawing> {
    let mut fitted: Vec<&PoseError> = data.residuals.iter().filter(|residual| !residual.held_out).collect();
    let all = fitted.len();
    fitted.retain(|residual| residual.error.norm().is_finite());
    let without = all - fitted.len();
    let step = every(fitted.len(), MOST);
    let shown: Vec<&PoseError> = fitted.into_iter().step_by(step).collect();
    let first = range(shown.iter().map(|residual| residual.time));
    if shown.len() < 2 {
        return None;
    }
    let (factor, label) = match (data.time_measured, first.1 - first.0) {
        (false, _) => (1.0, "row [1]"),
        (true, span) if span > 7200.0 => (1.0 / 3600.0, "time [h]"),
        (true, _) => (1.0, "time [s]"),
    };
    let across = with_margin((first.0 * factor, first.1 * factor), 0.02);
    let sigma = shown.iter().map(|residual| residual.sigma).sum::<f64>() / shown.len() as f64 * 1e3;
    let most = shown.iter().map(|residual| residual.error.amax() * 1e3).fold(2.2 * sigma, f64::max) * 1.08;
    let svg = figure((WIDTH, 22 + 3 * PANEL + 36), "Residuals in order", |area| {
        let entries = [("fitted pose", FAINT, Mark::Dot), ("noise alone: ±2 σ of the measurement", ACCENT, Mark::Band)];
        let panels = stacked(&legend(area, 20, &entries)?, &[PANEL, PANEL, PANEL + 36]);
        for (axis, (name, panel)) in ["x [mm]", "y [mm]", "z [mm]"].into_iter().zip(&panels).enumerate() {
            let last = axis == 2;
            let bottom = Axis::linear(across, if last { label } else { "" }).numbers(if last { 7 } else { 0 });
            let mut chart = chart(panel, &bottom, &Axis::linear((-most, most), name).numbers(5))?;
            let noise = Rectangle::new([(across.0, -2.0 * sigma), (across.1, 2.0 * sigma)], band(ACCENT));
            chart.draw_series([noise])?;
            chart.draw_series([PathElement::new(vec![(across.0, 0.0), (across.1, 0.0)], line(FAINT, 1.0))])?;
            let at = |residual: &&PoseError| (residual.time * factor, residual.error[axis] * 1e3);
            chart.draw_series(shown.iter().map(|residual| Circle::new(at(residual), radius(2.0), FAINT.filled())))?;
        }
        Ok(())
    });
    let caption = format!(
        "Residuals measured − predicted of the fitted poses, in the order in which they were measured; nineteen of twenty \
             should lie within the band. Runs of equal sign, drifts and steps are structure.{}{}",
        left_out(without),
        thinned(step)
    );
    Some(Drawing::new("residual-order", "The residuals one after another", caption, svg))
}

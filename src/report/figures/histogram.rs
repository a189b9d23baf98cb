//! Histogram of the residuals.

use super::data::PlotData;
use super::pose::PoseError;
use super::prelude::*;
use crate::numeric::median;

/// Height of the figure in pixels.
const HEIGHT: i32 = 280;
/// Smallest half-width of the axis \[σ\]. The axis spans four times the scatter of most residuals
/// if that is more; values beyond it are counted in the outermost bars.
const MIN_HALF_WIDTH: f64 = 5.0;

/// Returns the residual coordinates of a row in units of σ.
fn coordinates(residual: &PoseError) -> impl Iterator<Item = f64> + use<> {
    let whitened = residual.error / residual.sigma;
    whitened.data.0[0].into_iter().take(residual.observation.coordinates())
}

/// Draws the residual coordinates of the fitted poses in units of σ, with the normal distribution.
pub fn histogram(data: &PlotData) -> Option<Drawing> {
    let fitted = data.residuals.iter().filter(|residual| !residual.held_out);
    let values: Vec<f64> = fitted.flat_map(coordinates).filter(|v| v.is_finite()).collect();
    if values.len() < 3 {
        return None;
    }
    // The median absolute value is robust against a few large residuals.
    let scatter = 1.4826 * median(values.iter().map(|value| value.abs()))?;
    let reach = (4.0 * scatter).ceil().max(MIN_HALF_WIDTH);
    let half: usize = if values.len() < 150 { 10 } else { 20 };
    let width = reach / half as f64;
    let mut counts = vec![0_usize; 2 * half];
    for value in &values {
        let shifted = ((value + reach) / width).floor().clamp(0.0, (2 * half - 1) as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to the bars"
        )]
        let bar = shifted as usize;
        counts[bar] += 1;
    }
    let scale = values.len() as f64 * width;
    let normal = |u: f64| scale * (-0.5 * u * u).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let tallest = counts.iter().map(|count| *count as f64).fold(normal(0.0), f64::max) * 1.08;
    let beyond = [
        values.iter().filter(|value| **value < -reach).count(),
        values.iter().filter(|value| **value > reach).count(),
    ];
    let svg = figure((WIDTH, HEIGHT), "Histogram of the residuals", |area| {
        let body = legend(
            area,
            20,
            &[("fitted poses", FAINT, Mark::Bar), ("expected from noise", ACCENT, Mark::Line)],
        )?;
        let x = Axis::linear((-reach, reach), "residual coordinate [σ]").numbers(10);
        let mut chart = chart(&body, &x, &Axis::linear((0.0, tallest), "number of coordinates"))?;
        let bars = counts.iter().enumerate().filter(|(_, count)| **count > 0).map(|(k, count)| {
            let left = k as f64 * width - reach;
            let outermost = (k == 0 && beyond[0] > 0) || (k + 1 == 2 * half && beyond[1] > 0);
            let colour = if outermost { WARM } else { FAINT };
            Rectangle::new(
                [(left + 0.04 * width, 0.0), (left + 0.96 * width, *count as f64)],
                colour.filled(),
            )
        });
        chart.draw_series(bars)?;
        let curve = (-60..=60).map(|k| reach * f64::from(k) / 60.0).map(|u| (u, normal(u)));
        chart.draw_series(LineSeries::new(curve, line(ACCENT, 2.0)))?;
        for (count, at, side) in
            [(beyond[0], LEFT + 6, HPos::Left), (beyond[1], WIDTH - 16, HPos::Right)]
        {
            if count > 0 {
                write(&body, &format!("{count} beyond"), (at, 18), WARM, side)?;
            }
        }
        Ok(())
    });
    let outside = if beyond[0] + beyond[1] > 0 {
        let total = beyond[0] + beyond[1];
        format!(" {total} lie beyond ±{reach} σ and are counted in the outermost bars.")
    } else {
        String::new()
    };
    let caption = format!(
        "Residual coordinates of the fitted poses in units of the σ of the measurement. If only noise is left, they follow \
             the line; a fit reduces them slightly, the more the more parameters it has.{outside}"
    );
    let rows = counts.iter().enumerate().map(|(k, count)| {
        let left = k as f64 * width - reach;
        vec![fixed(left, 4), fixed(left + width, 4), count.to_string()]
    });
    let sheet = Sheet::new(&["from_sigma", "to_sigma", "coordinates"], rows.collect());
    Some(
        Drawing::new("residual-histogram", "Distribution of the residuals", caption, svg)
            .with(sheet),
    )
}

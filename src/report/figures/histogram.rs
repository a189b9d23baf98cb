//! Figure of the distribution of the residuals.

use super::prelude::*;
use crate::numeric::{median, whole};

/// Smallest half-width of the axis \[σ\]. The half-width is four times the scatter of the residuals
/// if that is more. Values outside the axis are counted in the outermost bars.
const MIN_HALF_WIDTH: f64 = 5.0;
/// Number of values from which bars are half as wide.
const MIN_NARROW_BAR_VALUES: usize = 150;

/// Returns the residual coordinates of a row in units of σ.
fn coordinates(residual: &PoseError) -> impl Iterator<Item = f64> + use<> {
    let whitened = residual.error / residual.sigma;
    whitened.data.0[0].into_iter().take(residual.observation.coordinates())
}

/// Draws the histogram of the residual coordinates of the fitted poses in units of σ, with the
/// normal distribution. `None` for less than three coordinates.
pub fn histogram(data: &PlotData) -> Option<Drawing> {
    let fitted = data.residuals.iter().filter(|residual| !residual.held_out);
    let values: Vec<f64> = fitted.flat_map(coordinates).filter(|v| v.is_finite()).collect();
    if values.len() < 3 {
        return None;
    }
    // The median absolute value is robust against a few large residuals.
    let scatter = 1.4826 * median(values.iter().map(|value| value.abs()))?;
    let reach = (4.0 * scatter).ceil().max(MIN_HALF_WIDTH);
    let bars: usize = if values.len() < MIN_NARROW_BAR_VALUES { 20 } else { 40 };
    let width = 2.0 * reach / bars as f64;
    let mut counts = vec![0_usize; bars];
    for value in &values {
        counts[whole((value + reach) / width).min(bars - 1)] += 1;
    }
    let scale = values.len() as f64 * width;
    let normal = |u: f64| scale * (-0.5 * u * u).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let tallest = counts.iter().map(|count| *count as f64).fold(normal(0.0), f64::max) * 1.08;
    let beyond = |side: f64| values.iter().filter(|value| side * **value > reach).count();
    let (below, above) = (beyond(-1.0), beyond(1.0));
    let left = |k: usize| k as f64 * width - reach;
    let bar = |(k, count): (usize, &usize)| {
        let is_outermost = (k == 0 && below > 0) || (k + 1 == bars && above > 0);
        let paint = Paint::fill(if is_outermost { WARM } else { FAINT });
        let (from, to) = (left(k) + 0.04 * width, left(k) + 0.96 * width);
        (*count > 0).then(|| Shape::area((from, 0.0), (to, *count as f64), paint))
    };
    let curve = (-60..=60).map(|k| reach * f64::from(k) / 60.0).map(|u| (u, normal(u)));
    let x = Axis::linear((-reach, reach), "residual coordinate [σ]", 10);
    let panel = Panel::new(212.0, x, Axis::linear((0.0, tallest), "number of coordinates", 6))
        .with(counts.iter().enumerate().filter_map(bar))
        .with([Shape::line(curve, Paint::line(ACCENT, 2.0))])
        .noting_beyond(below, Anchor::Start)
        .noting_beyond(above, Anchor::End);
    let legend = [("fitted poses", FAINT, Mark::Bar), ("expected from noise", ACCENT, Mark::Line)];
    let outside = match below + above {
        0 => String::new(),
        1 => format!(" 1 lies beyond ±{reach} σ and is counted in the outermost bar."),
        n => format!(" {n} lie beyond ±{reach} σ and are counted in the outermost bars."),
    };
    let caption = format!(
        "Residual coordinates of the fitted poses in units of the σ of the measurement. If only \
         noise is left, they follow the line; a fit with many parameters for few coordinates makes \
         them narrower than the line.{outside}"
    );
    let rows = counts
        .iter()
        .enumerate()
        .map(|(k, count)| vec![fixed(left(k), 4), fixed(left(k + 1), 4), count.to_string()]);
    Some(Drawing::new(
        ("residual-histogram", "Distribution of the residuals"),
        caption,
        chart("Histogram of the residuals", &legend, &[panel]),
        sheet(["from_sigma", "to_sigma", "coordinates"], rows),
    ))
}

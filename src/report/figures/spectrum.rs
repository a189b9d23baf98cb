//! Figure of the singular values of the scaled Jacobian.

use super::prelude::*;
use crate::least_squares::Identifiability;

/// Smallest ratio to the largest singular value that is drawn at its value; smaller ones are drawn
/// at this ratio.
const MIN_DRAWN_RATIO: f64 = 1e-17;

/// Draws the singular values of the scaled Jacobian, relative to the largest, in descending order.
/// `None` if there is no positive one.
pub fn spectrum(found: &Identifiability) -> Option<Drawing> {
    let values = &found.singular_values;
    let largest = values.first().copied().filter(|value| *value > 0.0)?;
    let relative = |value: &f64| (value / largest).max(MIN_DRAWN_RATIO).log10();
    let lowest = values.iter().map(relative).fold(0.0, f64::min).floor().min(-2.0);
    let shapes = values.iter().enumerate().flat_map(|(k, value)| {
        let at = (k as f64 + 1.0, relative(value));
        let paint = Paint::fill(if k < found.rank { ACCENT } else { WARM });
        let stem = Shape::line([(at.0, lowest), at], Paint::line(FAINT, 1.0));
        [stem, Shape::dot(at, 2.6, paint, None)]
    });
    let label = "combination of parameters, best identified first";
    let x = Axis::linear((0.0, values.len() as f64 + 1.0), label, 6);
    let y = Axis::logarithmic((lowest, 0.3), "singular value / largest", 6);
    let panel = Panel::new(212.0, x, y).with(shapes);
    let unidentifiable = found.unidentifiable.len();
    let legend = [("identifiable", ACCENT, Mark::Dot), ("not identifiable", WARM, Mark::Dot)];
    let legend = if unidentifiable > 0 { &legend } else { &legend[..1] };
    let statement = match unidentifiable {
        0 => "every combination is identifiable".to_owned(),
        1 => "one combination is not identifiable: changing it moves no predicted position"
            .to_owned(),
        n => format!(
            "{n} combinations are not identifiable: changing them moves no predicted position"
        ),
    };
    let caption = format!(
        "Singular values of the Jacobian with columns of unit length, at the nominal arm; \
         {statement}. Rank {} of {}, condition number {:.0}.",
        found.rank,
        values.len(),
        found.condition_number()
    );
    let rows = values.iter().enumerate().map(|(k, value)| {
        vec![(k + 1).to_string(), format!("{value:e}"), (k < found.rank).to_string()]
    });
    Some(Drawing::new(
        ("singular-values", "Identifiable combinations of parameters"),
        caption,
        chart("Singular values", legend, &[panel]),
        sheet(["number", "singular_value", "identifiable"], rows),
    ))
}

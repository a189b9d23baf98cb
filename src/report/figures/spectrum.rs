//! Singular values of the scaled Jacobian.

use super::prelude::*;
use crate::least_squares::Identifiability;

/// Height of the figure in pixels.
const HEIGHT: i32 = 280;
/// Relative singular value below which points are drawn at the lower edge.
const MIN_VALUE: f64 = 1e-17;

/// Draws the singular values of the scaled Jacobian in descending order.
pub fn spectrum(identifiability: &Identifiability) -> Option<Drawing> {
    let largest = identifiability.singular_values.first().copied().filter(|value| *value > 0.0)?;
    let relative = |value: f64| (value / largest).max(MIN_VALUE).log10();
    let values: Vec<(f64, f64)> = identifiability
        .singular_values
        .iter()
        .enumerate()
        .map(|(k, value)| (k as f64 + 1.0, relative(*value)))
        .collect();
    let lowest = values.iter().map(|at| at.1).fold(0.0, f64::min).floor().min(-2.0);
    let unidentifiable = identifiability.unidentifiable.len();
    let svg = figure((WIDTH, HEIGHT), "Singular values", |area| {
        let entries = [("identifiable", ACCENT, Mark::Dot), ("not identifiable", WARM, Mark::Dot)];
        let body = legend(area, 20, if unidentifiable > 0 { &entries } else { &entries[..1] })?;
        let x = Axis::linear(
            (0.0, values.len() as f64 + 1.0),
            "combination of parameters, best identified first",
        );
        let y = Axis::logarithmic((lowest, 0.3), "singular value / largest");
        let mut chart = chart(&body, &x, &y)?;
        for (k, at) in values.iter().enumerate() {
            let colour = if k < identifiability.rank { ACCENT } else { WARM };
            chart.draw_series([PathElement::new(vec![(at.0, lowest), *at], line(FAINT, 1.0))])?;
            chart.draw_series([Circle::new(*at, pixels(2.6), colour.filled())])?;
        }
        Ok(())
    });
    let statement = match unidentifiable {
        0 => "every combination is identifiable".to_owned(),
        1 => "one combination is not identifiable: changing it moves no predicted position"
            .to_owned(),
        n => format!(
            "{n} combinations are not identifiable: changing them moves no predicted position"
        ),
    };
    let caption = format!(
        "Singular values of the Jacobian with columns of unit length, at the nominal arm; {statement}. Rank {} of {}, condition \
             number {:.0}.",
        identifiability.rank,
        identifiability.singular_values.len(),
        identifiability.condition_number()
    );
    let values = identifiability.singular_values.iter().enumerate();
    let rows = values.map(|(k, value)| {
        vec![(k + 1).to_string(), format!("{value:e}"), (k < identifiability.rank).to_string()]
    });
    let sheet = Sheet::new(&["number", "singular_value", "identifiable"], rows.collect());
    let title = "Identifiable combinations of parameters";
    Some(Drawing::new("singular-values", title, caption, svg).with(sheet))
}

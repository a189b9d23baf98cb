//! What the poses can tell: singular values.

use super::prelude::*;
use crate::least_squares::Identifiability;

const HEIGHT: i32 = 280;
/// Singular values below this part of the largest are drawn there.
const LEAST: f64 = 1e-17;

/// Singular values of the scaled Jacobian, largest first.
pub fn spectrum(found: &Identifiability) -> Option<Drawing> {
    let largest = found.singular_values.first().copied().filter(|value| *value > 0.0)?;
    let relative = |value: f64| (value / largest).max(LEAST).log10();
    let values: Vec<(f64, f64)> = found
        .singular_values
        .iter()
        .enumerate()
        .map(|(k, value)| (k as f64 + 1.0, relative(*value)))
        .collect();
    let lowest = values.iter().map(|at| at.1).fold(0.0, f64::min).floor().min(-2.0);
    let unidentifiable = found.unidentifiable.len();
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
            let colour = if k < found.rank { ACCENT } else { WARM };
            chart.draw_series([PathElement::new(vec![(at.0, lowest), *at], line(FAINT, 1.0))])?;
            chart.draw_series([Circle::new(*at, pixels(2.6), colour.filled())])?;
        }
        Ok(())
    });
    let tells = match unidentifiable {
        0 => "every combination is identifiable".to_owned(),
        1 => "one combination is not identifiable: it can change and no predicted position moves"
            .to_owned(),
        n => format!(
            "{n} combinations are not identifiable: they can change and no predicted position moves"
        ),
    };
    let caption = format!(
        "Singular values of the Jacobian with columns of unit length, at the nominal arm; {tells}. Rank {} of {}, condition \
             number {:.0}.",
        found.rank,
        found.singular_values.len(),
        found.condition_number()
    );
    let values = found.singular_values.iter().enumerate();
    let rows = values.map(|(k, value)| {
        vec![(k + 1).to_string(), format!("{value:e}"), (k < found.rank).to_string()]
    });
    let sheet = Sheet::new(&["number", "singular_value", "identifiable"], rows.collect());
    Some(Drawing::new("singular-values", "What the poses can tell", caption, svg).with(sheet))
}

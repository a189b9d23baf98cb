//! Figure of the contribution of each parameter and effect to the predicted positions.

use super::prelude::*;
use crate::results::Contribution;

/// Maximum number of contributions that the figure shows.
const MAX_SHOWN: usize = 20;
/// Maximum number of decades of the logarithmic scale.
const MAX_DECADES: f64 = 4.0;

/// Draws the largest contributions as dots on a logarithmic scale. At most half of the dots are
/// those of effects. `None` if all contributions are 0.
pub fn contributions(contributions: &[Contribution]) -> Option<Drawing> {
    let (mut effects, parameters): (Vec<&Contribution>, Vec<&Contribution>) = contributions
        .iter()
        .filter(|contribution| contribution.moved > 0.0)
        .partition(|contribution| contribution.is_effect);
    effects.truncate(MAX_SHOWN / 2);
    let room = MAX_SHOWN - effects.len();
    let has_effects = !effects.is_empty();
    let mut shown: Vec<&Contribution> =
        effects.into_iter().chain(parameters.into_iter().take(room)).collect();
    shown.sort_by(|a, b| b.moved.total_cmp(&a.moved));
    let log_mm = |contribution: &Contribution| (contribution.moved * 1e3).log10();
    let most = log_mm(shown.first()?);
    let least = shown.last().map_or(most, |last| log_mm(last)).max(most - MAX_DECADES) - 0.25;
    let shapes = shown.iter().enumerate().flat_map(|(k, contribution)| {
        let (row, value) = (k as f64, log_mm(contribution));
        let colour = if contribution.is_effect { ACCENT } else { FAINT };
        // Smaller contributions are rings at the left edge.
        let is_beyond = value < least;
        let paint = if is_beyond { Paint::line(WARM, 1.4) } else { Paint::fill(colour) };
        let at = (value.max(least), row);
        let words = format!("{} mm", two_digits(contribution.moved * 1e3, 4));
        [Shape::dot(at, 3.4, paint, None), Shape::text(at, 8.0, words, MUTED)]
    });
    let names = shown.iter().map(|contribution| {
        (contribution.name.clone(), if contribution.is_effect { INK } else { MUTED })
    });
    let label = "displacement, rms [mm], logarithmic scale";
    let x = Axis { label: label.to_owned(), ..Axis::bare((least, most)) };
    let panel = Panel::of_rows(19.0, (220.0, 74.0), x, names).with(shapes);
    let legend = [("parameter", FAINT, Mark::Dot), ("effect", ACCENT, Mark::Dot)];
    let note = if contributions.len() > shown.len() {
        format!(" The largest {} of {} are drawn.", shown.len(), contributions.len())
    } else {
        String::new()
    };
    let caption = format!(
        "Root mean square displacement of the predicted positions of the measured poses if one \
         parameter returns to its nominal value (base and tool: to their values for the nominal \
         arm), or one effect is removed, and everything else stays unchanged. Two parameters \
         that compensate each other both show large displacements.{note}"
    );
    let rows = contributions.iter().map(|contribution| {
        let moved = fixed(contribution.moved * 1e3, 6);
        vec![contribution.name.clone(), contribution.is_effect.to_string(), moved]
    });
    let title = "What each parameter and effect contributes";
    let legend = if has_effects { &legend } else { &legend[..1] };
    let data = sheet(["name", "is_effect", "rms_move_mm"], rows);
    Some(Drawing::new(("contributions", title), caption, chart(title, legend, &[panel]), data))
}

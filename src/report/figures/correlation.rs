//! Figures of the correlations of the estimates, and of the singular values of the scaled Jacobian.

use nalgebra::DMatrix;

use super::prelude::*;
use crate::fit::Correlations;
use crate::least_squares::Identifiability;

/// Maximum number of parameters that the matrix shows.
const MAX_PARAMETERS: usize = 20;
/// Minimum and maximum width of the column of names in displayed pixels.
const NAME_WIDTH: (f64, f64) = (118.0, 230.0);
/// Ratio of the mean width of a letter to the text size, by which the width of names is estimated.
const LETTER_WIDTH: f64 = 0.62;
/// Smallest absolute correlation that is coloured.
const MIN_CORRELATION: f64 = 0.05;

/// Returns the colour of a correlation; `None` for a small or undefined one, whose cell stays
/// blank.
fn shade(value: f64) -> Option<Paint> {
    let colour = if value < 0.0 { WARM } else { ACCENT };
    // Few distinct colours keep the file small.
    let depth = (value.abs() * 10.0).ceil() / 10.0;
    (value.abs() >= MIN_CORRELATION).then(|| Paint::fill(colour).faded(depth))
}

/// Draws the correlation matrix in colours; of many parameters only the most correlated ones.
/// `None` for less than two parameters.
pub fn correlation(correlations: &Correlations) -> Option<Drawing> {
    let (matrix, total) = (&correlations.matrix, correlations.names.len());
    if total < 2 {
        return None;
    }
    let shown = clustered_order(matrix);
    let count = shown.len() as f64;
    let names: Vec<&str> = shown.iter().map(|&i| correlations.names[i].as_str()).collect();
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or_default() as f64;
    let cell_beside = |names: f64| ((FIGURE_WIDTH - names - 4.0) / count).clamp(8.0, 26.0).floor();
    let text_of = |cell: f64| (0.85 * cell).min(TEXT_SIZE);
    let wanted = LETTER_WIDTH * text_of(cell_beside(NAME_WIDTH.0)) * longest + 12.0;
    let left = wanted.clamp(NAME_WIDTH.0, NAME_WIDTH.1);
    let cell = cell_beside(left);
    let (shown_rows, x) = (&shown, Axis::bare((-0.5, count - 0.5)));
    let boxes = shown.iter().enumerate().flat_map(|(row, &i)| {
        shown_rows.iter().enumerate().filter_map(move |(column, &j)| {
            let paint = if i == j { Some(Paint::fill(GRID)) } else { shade(matrix[(i, j)]) };
            let (x, y) = (column as f64, row as f64);
            Some(Shape::area((x - 0.48, y - 0.48), (x + 0.48, y + 0.48), paint?))
        })
    });
    let sides = (left, FIGURE_WIDTH - left - cell * count);
    let rows = names.iter().map(|name| ((*name).to_owned(), MUTED));
    let matrix_panel =
        Panel { text: text_of(cell), sides, ..Panel::of_rows(cell, sides, x, rows) }.with(boxes);
    let steps = (0..=10).filter_map(|k| {
        let paint = shade(f64::from(k) / 5.0 - 1.0)?;
        Some(Shape::area((f64::from(k) - 0.5, -0.5), (f64::from(k) + 0.5, 0.5), paint))
    });
    let (low, high) = (("−1".to_owned(), MUTED), "+1   correlation");
    let x = Axis::bare((-0.5, 10.5));
    let sides = (left, FIGURE_WIDTH - left - 14.0 * 11.0);
    let scale = Panel { sides, ..Panel::of_rows(12.0, sides, x, [low]) }
        .with(steps)
        .with([Shape::text((10.5, 0.0), 6.0, high, MUTED)]);
    let note = if total > shown.len() {
        format!(" Shown are the {MAX_PARAMETERS} most correlated of {total} parameters.")
    } else {
        String::new()
    };
    let caption = format!(
        "Correlation of every pair of estimates, columns in the order of the rows, correlated \
         parameters side by side. Deep colours off the diagonal: only the sum (orange) or the \
         difference (blue) of two parameters is well determined, so neither value is reliable \
         alone.{note}"
    );
    let header = std::iter::once("parameter").chain(names.iter().copied());
    let rows = names.iter().zip(&shown).map(|(name, &i)| {
        let values = shown.iter().map(|&j| fixed(matrix[(i, j)], 4));
        std::iter::once((*name).to_owned()).chain(values).collect()
    });
    let svg = chart("Correlations of the parameters", &[], &[matrix_panel, scale]);
    let titles = ("correlations", "Correlations of the estimates");
    Some(Drawing::new(titles, caption, svg, sheet(header, rows)))
}

/// Returns the indices of the most correlated parameters, at most [`MAX_PARAMETERS`], with
/// correlated ones side by side.
///
/// Groups of parameters are joined end to end in descending order of the absolute correlation
/// (single linkage).
fn clustered_order(matrix: &DMatrix<f64>) -> Vec<usize> {
    let count = matrix.ncols();
    let size = |&(i, j): &(usize, usize)| {
        Some(matrix[(i, j)].abs()).filter(|size| size.is_finite()).unwrap_or(0.0)
    };
    let mut pairs: Vec<(usize, usize)> =
        (0..count).flat_map(|j| (0..j).map(move |i| (i, j))).collect();
    pairs.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
    let mut strongest: Vec<usize> = Vec::new();
    for i in pairs.iter().flat_map(|&(i, j)| [i, j]) {
        if strongest.len() < MAX_PARAMETERS && !strongest.contains(&i) {
            strongest.push(i);
        }
    }
    let mut groups: Vec<Vec<usize>> = strongest.iter().map(|&i| vec![i]).collect();
    for (i, j) in pairs {
        let group_of = |k: usize| groups.iter().position(|group| group.contains(&k));
        let (Some(of_i), Some(of_j)) = (group_of(i), group_of(j)) else { continue };
        if of_i != of_j {
            let (first, last) = (of_i.min(of_j), of_i.max(of_j));
            let mut joined = groups.remove(last);
            // The correlated ends of both groups meet in the middle.
            let position =
                |group: &[usize], k: usize| group.iter().position(|&i| i == k).unwrap_or(0);
            let (a, b) = if groups[first].contains(&i) { (i, j) } else { (j, i) };
            if 2 * position(&groups[first], a) + 1 < groups[first].len() {
                groups[first].reverse();
            }
            if 2 * position(&joined, b) + 1 > joined.len() {
                joined.reverse();
            }
            groups[first].append(&mut joined);
        }
    }
    groups.concat()
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlated_parameters_are_side_by_side() {
        let mut matrix = DMatrix::identity(5, 5);
        for (i, j, value) in [(0, 3, -0.99), (1, 4, 0.95), (4, 2, 0.5)] {
            matrix[(i, j)] = value;
            matrix[(j, i)] = value;
        }
        let order = clustered_order(&matrix);
        let position = |k: usize| order.iter().position(|&i| i == k).unwrap_or(9);
        assert_eq!(order.len(), 5);
        for (i, j) in [(0, 3), (1, 4), (2, 4)] {
            assert_eq!(position(i).abs_diff(position(j)), 1, "{order:?}");
        }
    }
}

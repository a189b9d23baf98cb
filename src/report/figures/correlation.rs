//! Correlations of the estimates.

use nalgebra::DMatrix;

use super::prelude::*;
use crate::fit::Correlations;

/// Maximum number of parameters in the matrix.
const MAX_PARAMETERS: usize = 20;
/// Minimum and maximum width for names in pixels.
const NAME_WIDTH: (i32, i32) = (118, 230);
/// Ratio of the width of a letter to its height.
const LETTER_WIDTH: f64 = 0.62;
/// Smallest absolute correlation that is coloured.
const MIN_CORRELATION: f64 = 0.05;

/// Draws the correlation matrix in colours; with many parameters only the most correlated ones.
pub fn correlation(correlations: &Correlations) -> Option<Drawing> {
    let matrix = &correlations.matrix;
    let total = correlations.names.len();
    if total < 2 {
        return None;
    }
    let shown = clustered_order(matrix);
    let count = i32::try_from(shown.len()).unwrap_or(1);
    let longest =
        shown.iter().map(|&i| correlations.names[i].chars().count()).max().unwrap_or_default();
    let letters_of = |cell: i32| (0.85 * f64::from(cell)).min(TEXT);
    let cell_of = |names: i32| ((WIDTH - names - 4) / count).clamp(8, 26);
    #[expect(clippy::cast_possible_truncation, reason = "a position on the drawing")]
    let width = |cell: i32| (LETTER_WIDTH * letters_of(cell) * longest as f64).ceil() as i32 + 12;
    let names = width(cell_of(NAME_WIDTH.0)).clamp(NAME_WIDTH.0, NAME_WIDTH.1);
    let cell = cell_of(names);
    let height = 8 + cell * count + 40;
    let letters = letters_of(cell);
    let svg = figure((WIDTH, height), "Correlations of the parameters", |area| {
        for (row, &i) in (0..).zip(&shown) {
            let top = 8 + cell * row;
            let position = (names - 6, top + cell / 2);
            write_sized(area, &correlations.names[i], position, (MUTED, letters), HPos::Right)?;
            for (column, &j) in (0..).zip(&shown) {
                let left = names + cell * column;
                let value = matrix[(i, j)];
                let corners = [(px(left), px(top)), (px(left + cell) - 3, px(top + cell) - 3)];
                let style = match value {
                    _ if i == j => GRID.filled(),
                    // Small or undefined correlations stay blank.
                    v if v.abs() < MIN_CORRELATION || v.is_nan() => continue,
                    // Few distinct colours keep the file small.
                    v if v < 0.0 => WARM.mix((-v * 10.0).ceil() / 10.0).filled(),
                    v => ACCENT.mix((v * 10.0).ceil() / 10.0).filled(),
                };
                area.draw(&Rectangle::new(corners, style))?;
            }
        }
        let y = 8 + cell * count + 20;
        for k in 0..=10 {
            let value = f64::from(k) / 5.0 - 1.0;
            let colour = if value < 0.0 { WARM.mix(-value) } else { ACCENT.mix(value) };
            let left = names + 14 * k;
            area.draw(&Rectangle::new(
                [(px(left), px(y - 6)), (px(left + 14), px(y + 6))],
                colour.filled(),
            ))?;
        }
        write(area, "−1", (names - 6, y), MUTED, HPos::Right)?;
        write(area, "+1   correlation", (names + 14 * 11 + 6, y), MUTED, HPos::Left)
    });
    let omitted = total - shown.len();
    let note = if omitted > 0 {
        format!(" Shown are the {MAX_PARAMETERS} most correlated of {total} parameters.")
    } else {
        String::new()
    };
    let caption = format!(
        "Correlation of every pair of estimates, columns in the order of the rows, correlated parameters side \
             by side. Deep colours off the diagonal: only the \
             sum (orange) or the difference (blue) of two parameters is well determined, so neither value is reliable alone.{note}"
    );
    let names = || shown.iter().map(|&i| correlations.names[i].as_str());
    let header: Vec<&str> = std::iter::once("parameter").chain(names()).collect();
    let row = |(name, &i): (&str, &usize)| {
        let values = shown.iter().map(|&j| fixed(matrix[(i, j)], 4));
        std::iter::once(name.to_owned()).chain(values).collect()
    };
    let sheet = Sheet::new(&header, names().zip(&shown).map(row).collect());
    Some(Drawing::new("correlations", "Correlations of the estimates", caption, svg).with(sheet))
}

/// Returns the most correlated parameters, at most [`MAX_PARAMETERS`], with correlated ones side by
/// side.
///
/// Groups are joined end to end in descending order of the correlations (single linkage).
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

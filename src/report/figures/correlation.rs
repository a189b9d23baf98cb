//! Which estimates go together.

use nalgebra::DMatrix;

use super::prelude::*;
use crate::fit::Correlations;

/// Parameters that are drawn at most.
const MOST: usize = 20;
/// Room for names, at least and at most.
const NAMES: (i32, i32) = (118, 230);
/// Width of a letter as a part of its height.
const LETTER: f64 = 0.62;
/// Correlations below this are left white.
const LEAST: f64 = 0.05;

/// The matrix of correlations as colours; with many parameters, of those that go together most.
pub fn correlation(correlations: &Correlations) -> Option<Drawing> {
    let matrix = &correlations.matrix;
    let all = correlations.names.len();
    if all < 2 {
        return None;
    }
    let shown = partners(matrix);
    let count = i32::try_from(shown.len()).unwrap_or(1);
    let longest =
        shown.iter().map(|&i| correlations.names[i].chars().count()).max().unwrap_or_default();
    let letters_of = |cell: i32| (0.85 * f64::from(cell)).min(TEXT);
    let cell_of = |names: i32| ((WIDTH - names - 4) / count).clamp(8, 26);
    #[expect(clippy::cast_possible_truncation, reason = "a place on the paper")]
    let room = |cell: i32| (LETTER * letters_of(cell) * longest as f64).ceil() as i32 + 12;
    let names = room(cell_of(NAMES.0)).clamp(NAMES.0, NAMES.1);
    let cell = cell_of(names);
    let height = 8 + cell * count + 40;
    let letters = letters_of(cell);
    let svg = figure((WIDTH, height), "Correlations of the parameters", |area| {
        for (row, &i) in (0..).zip(&shown) {
            let top = 8 + cell * row;
            let place = (names - 6, top + cell / 2);
            write_sized(area, &correlations.names[i], place, (MUTED, letters), HPos::Right)?;
            for (column, &j) in (0..).zip(&shown) {
                let left = names + cell * column;
                let value = matrix[(i, j)];
                let corners = [(px(left), px(top)), (px(left + cell) - 3, px(top + cell) - 3)];
                let style = match value {
                    _ if i == j => GRID.filled(),
                    // Below that, or none at all.
                    v if v.abs() < LEAST || v.is_nan() => continue,
                    // Steps of a tenth keep the file small.
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
    let left_out = all - shown.len();
    let part = if left_out > 0 {
        format!(" Of {all} parameters the {MOST} that go together most.")
    } else {
        String::new()
    };
    let caption = format!(
        "Correlation of every pair of estimates, columns in the order of the rows, those that go together side \
             by side. Deep colours off the diagonal: only the \
             sum (orange) or the difference (blue) of two parameters is well known, so do not read much into either alone.{part}"
    );
    let names = || shown.iter().map(|&i| correlations.names[i].as_str());
    let header: Vec<&str> = std::iter::once("parameter").chain(names()).collect();
    let row = |(name, &i): (&str, &usize)| {
        let values = shown.iter().map(|&j| fixed(matrix[(i, j)], 4));
        std::iter::once(name.to_owned()).chain(values).collect()
    };
    let sheet = Sheet::new(&header, names().zip(&shown).map(row).collect());
    Some(Drawing::new("correlations", "Which estimates go together", caption, svg).with(sheet))
}

/// The parameters of the largest correlations, at most so many, ordered so that partners stand side
/// by side: groups are joined from the largest correlation down, end to end (single linkage).
fn partners(matrix: &DMatrix<f64>) -> Vec<usize> {
    let all = matrix.ncols();
    let size = |&(i, j): &(usize, usize)| {
        Some(matrix[(i, j)].abs()).filter(|size| size.is_finite()).unwrap_or(0.0)
    };
    let mut pairs: Vec<(usize, usize)> =
        (0..all).flat_map(|j| (0..j).map(move |i| (i, j))).collect();
    pairs.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
    let mut strongest: Vec<usize> = Vec::new();
    for i in pairs.iter().flat_map(|&(i, j)| [i, j]) {
        if strongest.len() < MOST && !strongest.contains(&i) {
            strongest.push(i);
        }
    }
    let mut groups: Vec<Vec<usize>> = strongest.iter().map(|&i| vec![i]).collect();
    for (i, j) in pairs {
        let place = |k: usize| groups.iter().position(|group| group.contains(&k));
        let (Some(one), Some(other)) = (place(i), place(j)) else { continue };
        if one != other {
            let (first, last) = (one.min(other), one.max(other));
            let mut joined = groups.remove(last);
            // The partner's end of each group comes to the middle.
            let near =
                |group: &[usize], k: usize| group.iter().position(|&own| own == k).unwrap_or(0);
            let (a, b) = if groups[first].contains(&i) { (i, j) } else { (j, i) };
            if 2 * near(&groups[first], a) + 1 < groups[first].len() {
                groups[first].reverse();
            }
            if 2 * near(&joined, b) + 1 > joined.len() {
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
    fn partners_stand_side_by_side() {
        let mut matrix = DMatrix::identity(5, 5);
        for (i, j, value) in [(0, 3, -0.99), (1, 4, 0.95), (4, 2, 0.5)] {
            matrix[(i, j)] = value;
            matrix[(j, i)] = value;
        }
        let order = partners(&matrix);
        let place = |k: usize| order.iter().position(|&own| own == k).unwrap_or(9);
        assert_eq!(
            (order.len(), place(0).abs_diff(place(3)), place(1).abs_diff(place(4))),
            (5, 1, 1)
        );
        assert_eq!(place(2).abs_diff(place(4)), 1, "{order:?}");
    }
}

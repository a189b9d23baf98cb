//! Which estimates go together.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::frame::{ACCENT, Drawing, GRID, MUTED, TEXT, WARM, WIDTH, figure, px, write, write_sized};
use crate::identify::Correlations;

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
    let strongest = |i: usize| (0..all).filter(|&j| j != i).map(|j| matrix[(i, j)].abs()).fold(0.0, f64::max);
    let mut shown: Vec<usize> = (0..all).collect();
    shown.sort_by(|&i, &j| strongest(j).total_cmp(&strongest(i)).then(i.cmp(&j)));
    shown.truncate(MOST);
    shown.sort_unstable();
    let count = i32::try_from(shown.len()).unwrap_or(1);
    let longest = shown.iter().map(|&i| correlations.names[i].chars().count()).max().unwrap_or_default();
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
            area.draw(&Rectangle::new([(px(left), px(y - 6)), (px(left + 14), px(y + 6))], colour.filled()))?;
        }
        write(area, "−1", (names - 6, y), MUTED, HPos::Right)?;
        write(area, "+1   correlation [1]", (names + 14 * 11 + 6, y), MUTED, HPos::Left)
    });
    let left_out = all - shown.len();
    let part =
        if left_out > 0 { format!(" Of {all} parameters the {MOST} that go together most.") } else { String::new() };
    let caption = format!(
        "Correlation of every pair of estimates, columns in the order of the rows. Deep colours off the diagonal: only the \
             sum (orange) or the difference (blue) of two parameters is well known, so do not read much into either alone.{part}"
    );
    Some(Drawing::new("correlations", "Which estimates go together", caption, svg))
}

//! How programs write tables: delimiters, decimal signs, names, comments, and rows without a
//! measurement.

use std::fmt::Write as _;

use super::draw::Draw;
use super::row::Row;
use super::table::Column;

/// How cells and lines are written.
pub struct Dialect {
    delimiter: &'static str,
    pub comma: bool,
    is_mapped: bool,
}

/// Returns true for the columns of a position.
pub fn is_position(name: &str) -> bool {
    ["x_m", "y_m", "z_m", "x_mm", "y_mm", "z_mm"].contains(&name)
}

/// Draws a dialect; adds what has to be declared of it to `[data.format]`.
pub fn dialect(draw: &mut Draw, format: &mut String, has_empty_cells: bool) -> Dialect {
    let (delimiter, word) = draw.pick(&[
        (",", ","),
        (",", ","),
        (",", ","),
        (";", ";"),
        ("\t", "tab"),
        ("|", "|"),
        if has_empty_cells { (";", ";") } else { ("  ", "spaces") },
    ]);
    let comma = delimiter != "," && draw.chance(0.4);
    if comma {
        *format += "decimal = \",\"\n";
    }
    if word == "|" || draw.chance(0.3) {
        let _ = writeln!(format, "delimiter = \"{word}\"");
    }
    Dialect { delimiter, comma, is_mapped: draw.chance(0.25) }
}

/// Returns the names of the columns in the table.
pub fn mapped(
    draw: &mut Draw,
    dialect: &Dialect,
    columns: &[Column],
    split: Option<&str>,
) -> Vec<String> {
    let gap = if dialect.delimiter == "  " { "_" } else { " " };
    columns
        .iter()
        .enumerate()
        .map(|(k, (ours, _))| {
            let is_named = dialect.is_mapped && split != Some(ours.as_str()) && draw.chance(0.5);
            if is_named { format!("Col{gap}{k}") } else { ours.clone() }
        })
        .collect()
}

/// Writes header and rows, and records the lines of these.
pub fn lines(
    draw: &mut Draw,
    rows: &mut [Row],
    (names, columns): (&[String], &[Column]),
    dialect: &Dialect,
    (leaves_out, has_comments): (bool, bool),
) -> String {
    let mut lines = Vec::new();
    if has_comments {
        lines.push("// measured in the hall".to_owned());
    }
    lines.push(names.join(dialect.delimiter));
    let is_word = |name: &str| ["session", "target", "anchor", "surface", "frame"].contains(&name);
    for (k, row) in rows.iter_mut().enumerate() {
        let cells = |is_left_out: bool| {
            let cell = |(name, cells): &Column| {
                let cell = if is_left_out && is_position(name) { "0" } else { &cells[k] };
                if dialect.comma && !is_word(name) {
                    cell.replace('.', ",")
                } else {
                    cell.to_owned()
                }
            };
            columns.iter().map(cell).collect::<Vec<_>>().join(dialect.delimiter)
        };
        if leaves_out && k > 0 && draw.chance(0.1) {
            lines.push(cells(true));
        }
        if has_comments && draw.chance(0.05) {
            lines.push("// a pause".to_owned());
        }
        lines.push(cells(false));
        row.line = lines.len();
    }
    lines.join("\n") + "\n"
}

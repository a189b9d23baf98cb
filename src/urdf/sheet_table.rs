//! Table of Denavit-Hartenberg parameters in CSV, with its units in the header, as a problem.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::{InputError, Location, UrdfErrorKind};
use crate::problem::item::Document;
use crate::problem::quoted;

/// Key with other names and its units.
type Key = (&'static str, &'static [&'static str], Option<[&'static str; 2]>);
/// Units of angles and of lengths in the header.
const ANGLES: [&str; 2] = ["deg", "rad"];
const LENGTHS: [&str; 2] = ["mm", "m"];
/// Keys of a joint that a table may have, with their other names and their units; those of limits
/// depend on the joint.
const KEYS: [Key; 6] = [
    ("theta", &["θ", "offset"], Some(ANGLES)),
    ("alpha", &["α", "twist"], Some(ANGLES)),
    ("d", &["s"], Some(LENGTHS)),
    ("a", &["r"], Some(LENGTHS)),
    ("min", &["lower"], None),
    ("max", &["upper"], None),
];

/// Marks of a header whose α and a belong to the row before, as in the modified form.
const OF_THE_ROW_BEFORE: [&str; 4] = ["i-1", "(i-1)", "{i-1}", "i−1"];
/// Names of a joint coordinate in a cell, without its number.
const COORDINATES: [&str; 6] = ["q", "θ", "theta", "t", "d", "s"];

/// Column of a table that is read.
struct Column {
    place: usize,
    key: &'static str,
    unit: &'static str,
}

/// Returns the text of a problem with the joints of a table, whose rows are taken for standard
/// Denavit-Hartenberg parameters. A cell such as `q2 - 90` or `θ2` states the constant part of the
/// coordinate that the joint moves; if that is d, the joint is prismatic.
///
/// # Errors
/// Returns an error if the file cannot be read, a column has no unit, or a cell is not a number.
pub(crate) fn text_of_table(file: &Path) -> Result<String, InputError> {
    let document = Document::read(file, UrdfErrorKind::Missing.into())?;
    let text = document.text.trim_start_matches('\u{feff}');
    let is_header = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let first = text.lines().find(is_header).unwrap_or_default();
    let delimiter = [b';', b'\t', b','].into_iter().find(|&byte| first.as_bytes().contains(&byte));
    let delimiter = delimiter.unwrap_or(b',');
    let mut reader = ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .trim(Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let place = |line: usize, key: Option<&str>| {
        let location = Location::file(file).at_line(line);
        match key {
            Some(key) => location.with_key(format!("column {key}")),
            None => location,
        }
    };
    let line = |position: Option<&csv::Position>| {
        position.map_or(1, |position| usize::try_from(position.line()).unwrap_or(usize::MAX))
    };
    let bad = |error: &csv::Error| {
        place(line(error.position()), None)
            .error(UrdfErrorKind::SheetCell { cell: error.to_string() })
    };
    let header = reader.headers().map_err(|error| bad(&error))?.clone();
    let columns = columns(&header, |column| place(1, Some(column)))?;
    let name = file.file_stem().map_or("arm".into(), |stem| stem.to_string_lossy());
    let form = if is_modified(&header) {
        "# Modified form: Rx(α) Tx(a) Rz(θ+q) Tz(d)"
    } else {
        "dh = \"standard\"          # Rz(θ+q) Tz(d) Tx(a) Rx(α); the header alpha_i-1, a_i-1 takes the other form"
    };
    let mut out = format!("name = {}\n{form}\njoint = [\n", quoted(&name));
    for record in reader.records() {
        let record = record.map_err(|error| bad(&error))?;
        let line = line(record.position());
        if record.iter().all(str::is_empty) {
            continue;
        }
        let is_end =
            |cell: &&str| ["base", "tool", "tcp", "flange"].contains(&&*cell.to_lowercase());
        if let Some(name) = record.get(0).filter(is_end) {
            return Err(place(line, None).error(UrdfErrorKind::SheetEnd { name: name.to_owned() }));
        }
        let (mut entries, mut variable) = (Vec::new(), None);
        for column in &columns {
            let cell = record.get(column.place).unwrap_or_default();
            let unreadable = || {
                let key = header.get(column.place);
                place(line, key).error(UrdfErrorKind::SheetCell { cell: cell.to_owned() })
            };
            let comma = if delimiter == b',' { ',' } else { '.' };
            let cell = cell.replace(',', &comma.to_string());
            let (value, is_variable) = number(&cell, column.unit).ok_or_else(unreadable)?;
            if is_variable {
                let is_one = variable.replace(column.key).is_none();
                if !is_one || !["theta", "d"].contains(&column.key) {
                    return Err(unreadable());
                }
            }
            let is_limit = ["min", "max"].contains(&column.key);
            if !cell.is_empty() && (value != 0.0 || is_limit) {
                entries.push(format!("{}_{} = {value}", column.key, column.unit));
            }
        }
        if variable == Some("d") {
            entries.push("kind = \"prismatic\"".to_owned());
        }
        let _ = writeln!(out, "  {{ {} }},", entries.join(", "));
    }
    Ok(out + "]\n")
}

/// Returns true if the header says that α and a belong to the row before.
fn is_modified(header: &StringRecord) -> bool {
    header.iter().any(|name| OF_THE_ROW_BEFORE.iter().any(|mark| name.contains(mark)))
}

/// Returns the columns that hold parameters of joints. `at` is the place of a column in messages.
fn columns(
    header: &StringRecord,
    at: impl Fn(&str) -> Location,
) -> Result<Vec<Column>, InputError> {
    let mut columns: Vec<Column> = Vec::new();
    for (place, name) in header.iter().enumerate() {
        let lower = name.to_lowercase();
        let end = lower.find(|c: char| !c.is_alphabetic()).unwrap_or(lower.len());
        let (word, rest) = lower.split_at(end);
        let mut keys = KEYS.iter();
        let is_meant = |(key, others, _): &&Key| *key == word || others.contains(&word);
        let Some(&(key, _, units)) = keys.find(is_meant) else { continue };
        let rest = OF_THE_ROW_BEFORE.iter().fold(rest.to_owned(), |rest, of| rest.replace(of, ""));
        let rest = rest.trim_start_matches('_');
        let of_row = rest.strip_prefix('i').filter(|after| !after.starts_with(char::is_alphabetic));
        let rest = of_row.unwrap_or(rest);
        let unit = match rest.trim_matches(|c: char| !c.is_alphanumeric() && c != '°') {
            "deg" | "degree" | "degrees" | "°" => Some("deg"),
            "rad" => Some("rad"),
            "mm" => Some("mm"),
            "m" => Some("m"),
            _ => None,
        };
        let is_right = |unit: &&str| units.is_none_or(|units| units.contains(unit));
        if units.is_none() && unit.is_none() {
            continue;
        }
        let unit = unit.filter(is_right).ok_or_else(|| {
            let write = units.unwrap_or(ANGLES).map(|unit| format!("{key}_{unit}")).join(" or ");
            at(name).error(UrdfErrorKind::SheetUnit { write })
        })?;
        columns.push(Column { place, key, unit });
    }
    let has = |key: &str| columns.iter().any(|column| column.key == key);
    if !(has("alpha") && (has("a") || has("d"))) {
        return Err(at("alpha").error(UrdfErrorKind::SheetWithoutParameters));
    }
    columns.sort_by_key(|column| KEYS.iter().position(|(key, ..)| *key == column.key));
    Ok(columns)
}

/// Parses a cell such as `-90`, `90°`, `π/2`, `q2 - 90` or empty for 0, in the unit of its column,
/// and tells whether it names the coordinate of the joint; `None` for other texts.
fn number(cell: &str, unit: &str) -> Option<(f64, bool)> {
    let text: String = cell.replace('−', "-").replace("pi", "π").to_lowercase();
    if unit == "rad" && text.contains('°') {
        return None;
    }
    let text: String = text.chars().filter(|c| !" °*".contains(*c)).collect();
    let is_name = |c: char| c.is_alphabetic() && c != 'π';
    let Some(start) = text.find(is_name) else { return Some((constant(&text, unit)?, false)) };
    if let Ok(number) = text.parse::<f64>() {
        return number.is_finite().then_some((number, false));
    }
    let (before, name) = text.split_at(start);
    let word: String = name.chars().take_while(|&c| is_name(c)).collect();
    if !COORDINATES.contains(&&*word) {
        return None;
    }
    let end = name.find(['+', '-']).unwrap_or(name.len());
    let before = if before.is_empty() { before } else { before.strip_suffix('+')? };
    Some((constant(before, unit)? + constant(name.get(end..)?, unit)?, true))
}

/// Parses a number or a multiple of π \[rad\] in the `unit` of a column; 0 for an empty text.
fn constant(text: &str, unit: &str) -> Option<f64> {
    let Some((factor, divisor)) = text.split_once('π') else {
        let number = if text.is_empty() { Some(0.0) } else { text.parse().ok() };
        return number.filter(|number: &f64| number.is_finite());
    };
    let factor = match factor {
        "" | "+" => 1.0,
        "-" => -1.0,
        factor => factor.parse().ok()?,
    };
    let divisor = divisor.strip_prefix('/').map_or(Some(1.0), |divisor| divisor.parse().ok());
    let radians: f64 =
        factor * PI / divisor.filter(|_| text.ends_with(['π']) || text.contains('/'))?;
    Some(if unit == "deg" { radians.to_degrees() } else { radians })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_data_sheets_are_read() {
        for (cell, value) in [
            ("-90", (-90.0, false)),
            ("90°", (90.0, false)),
            ("−π/2", (-90.0, false)),
            ("2pi/3", (120.0, false)),
            ("", (0.0, false)),
            ("q2", (0.0, true)),
            ("θ2 - 90", (-90.0, true)),
            ("90 + q_2", (90.0, true)),
            ("1e2", (100.0, false)),
        ] {
            let (read, is_variable) = number(cell, "deg").unwrap();
            assert!((read - value.0).abs() < 1e-12 && is_variable == value.1, "{cell}: {read}");
        }
        for cell in ["1.2.3", "--3", "π2", "q2*3 + x", "x2", "2*q2", "nan"] {
            assert_eq!(number(cell, "deg"), None, "{cell}");
        }
    }
}

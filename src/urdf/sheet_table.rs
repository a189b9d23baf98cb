//! Table of Denavit-Hartenberg parameters in CSV, with its units in the header, as a problem.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use super::sheet::left_out;
use crate::error::{InputError, Location, UrdfErrorKind, Warning, WarningKind};
use crate::problem::item::Document;
use crate::problem::quoted;
use crate::quantity::Unit;

/// Words of one meaning; the first is that of keys.
type Names = &'static [&'static str];
/// Key with other names and the units of its columns.
type Key = (&'static str, Names, [Names; 2]);
/// Units of angles and of lengths, with their other names in headers.
const ANGLES: [Names; 2] = [&["deg", "degree", "degrees"], &["rad", "radian", "radians"]];
const LENGTHS: [Names; 2] = [&["mm"], &["m"]];
/// Keys of a joint that a table may have, with their other names and their units. "offset" is one
/// of d where it is a length.
const KEYS: [Key; 5] = [
    ("theta", &["θ", "offset"], ANGLES),
    ("alpha", &["α", "twist"], ANGLES),
    ("d", &["s", "offset"], LENGTHS),
    ("a", &["r"], LENGTHS),
    ("theta", &["angle", "angulo", "winkel", "drehwinkel"], ANGLES),
];
/// Keys of limits, whose units depend on the joint.
const LIMITS: [(&str, Names); 2] = [
    ("min", &["min", "lower", "minimum", "minimo", "최소", "最小"]),
    ("max", &["max", "upper", "maximum", "maximo", "최대", "最大"]),
];
/// Largest length of a sheet that is asked about as one in metres, if no other is longer \[mm\].
const MAX_ASKED_MM: f64 = 5.0;
/// Words of a header that say nothing of its key.
const FILLERS: [&str; 5] = ["i", "joint", "link", "limit", "limits"];
/// Letters with accents, and those without in their place.
const ACCENTS: [&str; 2] = ["áàâãäéèêëíìîïóòôõöúùûüçñ", "aaaaaeeeeiiiiooooouuuucn"];

/// Marks of a header whose α and a belong to the row before, as in the modified form.
const OF_THE_ROW_BEFORE: [&str; 4] = ["i-1", "(i-1)", "{i-1}", "i−1"];
/// Names of a joint coordinate in a cell, without its number.
const COORDINATES: [&str; 6] = ["q", "θ", "theta", "t", "d", "s"];
/// Line of the text of a problem at which the rows of its joints begin.
const FIRST_LINE_OF_ROWS: usize = 4;

/// Column of a table that is read.
struct Column {
    place: usize,
    key: &'static str,
    unit: &'static str,
}

/// Text of a problem with the joints of a table.
pub(crate) struct SheetTable {
    pub text: String,
    pub warnings: Vec<Warning>,
    /// Lines of the rows in the table, shape = (joints).
    lines: Vec<usize>,
}

impl SheetTable {
    /// Returns the place in the table of a place in the text.
    pub fn place(&self, location: Location) -> Location {
        let row = location.line.and_then(|line| line.checked_sub(FIRST_LINE_OF_ROWS));
        let line = row.and_then(|row| self.lines.get(row)).copied();
        Location { line, excerpt: None, ..location }
    }
}

/// Returns a problem with the joints of a table, whose rows are taken for standard
/// Denavit-Hartenberg parameters. A cell such as `q2 - 90` or `θ2` states the constant part of the
/// coordinate that the joint moves; if that is d, the joint is prismatic.
///
/// # Errors
/// Returns an error if the file cannot be read, a column has no unit, or a cell is not a number.
pub(crate) fn text_of_table(file: &Path) -> Result<SheetTable, InputError> {
    let (document, latin_line) = Document::read_table(file, UrdfErrorKind::Missing.into())?;
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
    let header_line = line(header.position());
    let columns = columns(&header, |column| place(header_line, Some(column)))?;
    let at = |line, kind| Warning { location: place(line, None), kind };
    let mut warnings: Vec<Warning> =
        latin_line.map(|line| at(line, WarningKind::ReadAsWindows1252)).into_iter().collect();
    warnings.extend(not_taken(&header, &columns).map(|kind| at(header_line, kind)));
    let name = file.file_stem().map_or("arm".into(), |stem| stem.to_string_lossy());
    let form = if is_modified(&header) {
        "# Modified form: Rx(α) Tx(a) Rz(θ+q) Tz(d)"
    } else {
        "dh = \"standard\"          # Rz(θ+q) Tz(d) Tx(a) Rx(α); the header alpha_i-1, a_i-1 takes the other form"
    };
    let mut out = format!("name = {}\n{form}\njoint = [\n", quoted(&name));
    let (mut lines, mut rows, mut longest) = (Vec::new(), Vec::new(), 0.0_f64);
    let (mut names, has_names) = (Vec::new(), columns.iter().all(|column| column.place > 0));
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
        let (mut entries, mut variable, mut row) = (Vec::new(), None, [0.0; 3]);
        for &Column { place: index, key, unit } in &columns {
            let cell = record.get(index).unwrap_or_default();
            let column = || place(line, header.get(index));
            let unreadable = || column().error(UrdfErrorKind::SheetCell { cell: cell.to_owned() });
            let comma = if delimiter == b',' { ',' } else { '.' };
            let cell = cell.replace(',', &comma.to_string());
            let (value, is_variable) = number(&cell, unit).ok_or_else(unreadable)?;
            if is_variable {
                let is_one = variable.replace(key).is_none();
                if !is_one || !["theta", "d"].contains(&key) {
                    return Err(unreadable());
                }
            }
            if ["a", "d"].contains(&key) {
                longest = longest.max(value.abs() * if unit == "mm" { 1.0 } else { 1e3 });
            }
            let place = ["a", "d", "alpha"].iter().position(|of| *of == key);
            if let Some(number) = place.and_then(|place| row.get_mut(place)) {
                *number = match unit {
                    "deg" => value.to_radians(),
                    "mm" => value * 1e-3,
                    _ => value,
                };
            }
            let is_limit = LIMITS.iter().any(|(limit, _)| *limit == key);
            if !cell.is_empty() && (value != 0.0 || is_limit) {
                if entries.iter().any(|(other, _)| *other == key) {
                    return Err(column().error(UrdfErrorKind::SheetTwice { key }));
                }
                entries.push((key, format!("{key}_{unit} = {value}")));
            }
        }
        let entries = entries.into_iter().map(|(_, entry)| entry);
        let slides = (variable == Some("d")).then(|| "kind = \"prismatic\"".to_owned());
        let entries: Vec<String> = entries.chain(slides).collect();
        let _ = writeln!(out, "  {{ {} }},", entries.join(", "));
        lines.push(line);
        names.extend(record.get(0).filter(|_| has_names).map(str::to_owned));
        rows.push(row);
    }
    if let Some((row, kind)) = left_out(&names.iter().map(String::as_str).collect::<Vec<_>>()) {
        warnings.push(at(lines.get(row).copied().unwrap_or(header_line), kind));
    }
    if longest > 0.0 && longest < MAX_ASKED_MM {
        let kind = WarningKind::SheetInMetres { longest: longest.to_string() };
        warnings.push(at(header_line, kind));
    }
    out.push_str("]\n");
    out.push_str(&masses(&rows, is_modified(&header)));
    Ok(SheetTable { text: out, warnings, lines })
}

/// Returns comments with a body for each link, of the rows a \[m\], d \[m\], α \[rad\], whose
/// centre of mass lies in the middle of the link: between the frame of its row and the one before,
/// or in the modified form the one behind.
fn masses(rows: &[[f64; 3]], is_modified: bool) -> String {
    let mut out = "# Masses, to look for what gives way under loads: put them into the rows, with \
         true com_m.\n# The middle of each link, in metres in the frame behind the whole row, is \
         about\n"
        .to_owned();
    let links = rows.get(usize::from(is_modified)..).unwrap_or_default();
    for (number, [a, d, alpha]) in (1..).zip(links) {
        let (sin, cos) = alpha.sin_cos();
        let middle = if is_modified {
            [a / 2.0, -d * sin / 2.0, d * cos / 2.0]
        } else {
            [-a / 2.0, -d * sin / 2.0, -d * cos / 2.0]
        };
        if middle.iter().any(|value| value.abs() > 1e-6) {
            let [x, y, z] = middle.map(|value| (value * 1e4).round() / 1e4 + 0.0);
            let _ = writeln!(
                out,
                "#   row {number}: body = [{{ mass_kg = ?, com_m = [{x}, {y}, {z}] }}]"
            );
        }
    }
    out
}

/// Returns true if the header says that α and a belong to the row before.
fn is_modified(header: &StringRecord) -> bool {
    header.iter().any(|name| OF_THE_ROW_BEFORE.iter().any(|mark| name.contains(mark)))
}

/// Returns the warning that names the columns that are not read. The first one is not named,
/// because it numbers the joints or states their names.
fn not_taken(header: &StringRecord, columns: &[Column]) -> Option<WarningKind> {
    let is_taken = |place: usize| columns.iter().any(|column| column.place == place);
    let named = header.iter().enumerate().skip(1);
    let named = named.filter(|(place, name)| !is_taken(*place) && !name.is_empty());
    let names: Vec<&str> = named.map(|(_, name)| name).collect();
    let taken = columns.iter().map(|column| format!("{}_{}", column.key, column.unit));
    let (names, taken) = (names.join(", "), taken.collect::<Vec<_>>().join(", "));
    (!names.is_empty()).then_some(WarningKind::SheetColumns { names, taken })
}

/// Splits the name of a column into words in lower case, without accents and marks.
fn words(name: &str) -> Vec<String> {
    let lower = name.to_lowercase().replace('°', " deg ");
    let lower = OF_THE_ROW_BEFORE.iter().fold(lower, |name, mark| name.replace(mark, " "));
    let plain = |c: char| {
        let [accents, letters] = ACCENTS;
        let place = accents.chars().position(|accent| accent == c);
        place.and_then(|place| letters.chars().nth(place)).unwrap_or(c)
    };
    let lower: String = lower.chars().map(plain).collect();
    // A unit such as deg/s stays one word.
    let words = lower.split(|c: char| !(c.is_alphanumeric() || c == '/'));
    let words = words.filter(|word| !word.is_empty() && !FILLERS.contains(word));
    words.map(str::to_owned).collect()
}

/// Returns the columns that hold parameters of joints. `at` is the place of a column in messages.
fn columns(
    header: &StringRecord,
    at: impl Fn(&str) -> Location,
) -> Result<Vec<Column>, InputError> {
    let mut columns: Vec<Column> = Vec::new();
    for (place, name) in header.iter().enumerate() {
        let words = words(name);
        let Some((last, before)) = words.split_last() else { continue };
        let all_units = || ANGLES.into_iter().chain(LENGTHS);
        let unit = all_units().find(|names| names.contains(&last.as_str()));
        let foreign = Unit::Angle.foreign_suffixes().chain(Unit::Length.foreign_suffixes());
        let is_foreign = foreign.into_iter().any(|foreign| foreign == last);
        let names = if unit.is_some() || is_foreign { before } else { &words };
        let is_of = |word: &String, key: &Key| key.0 == word || key.1.contains(&word.as_str());
        let bounds =
            |word: &String| LIMITS.iter().find(|(_, names)| names.contains(&word.as_str()));
        let is_known =
            |word: &String| bounds(word).is_some() || KEYS.iter().any(|key| is_of(word, key));
        if !names.iter().all(is_known) {
            continue;
        }
        if let Some((key, _)) = names.iter().find_map(bounds) {
            columns.extend(unit.map(|unit| Column { place, key, unit: suffix(unit) }));
            continue;
        }
        let mut keys = KEYS.iter().filter(|key| names.iter().any(|word| is_of(word, key)));
        let Some(first) = keys.clone().next() else { continue };
        let (key, unit) = keys
            .find_map(|key| Some((key.0, suffix(unit.filter(|unit| key.2.contains(unit))?))))
            .ok_or_else(|| {
                let write =
                    first.2.map(|unit| format!("{}_{}", first.0, suffix(unit))).join(" or ");
                at(name).error(if unit.is_some() || is_foreign {
                    let quantity = if first.2 == ANGLES { Unit::Angle } else { Unit::Length };
                    let factor = quantity.convert_foreign(last, 1.0);
                    let symbol = quantity.in_tables().suffix;
                    let factor = factor.map(|factor| format!(": 1 {last} is {factor} {symbol}"));
                    let (found, factor) = (last.clone(), factor.unwrap_or_default());
                    UrdfErrorKind::SheetOtherUnit { found, write, factor }
                } else {
                    UrdfErrorKind::SheetUnit { write }
                })
            })?;
        columns.push(Column { place, key, unit });
    }
    let has = |key: &str| columns.iter().any(|column| column.key == key);
    let lengths = ["a", "d"].into_iter().filter(|key| has(key)).count();
    match (has("alpha"), lengths) {
        (true, 1..) => {}
        (false, 1..) if has("theta") || lengths == 2 => {
            return Err(at("alpha").error(UrdfErrorKind::SheetWithoutAlpha));
        }
        _ => return Err(at("alpha").error(UrdfErrorKind::SheetWithoutParameters)),
    }
    let order = ["theta", "alpha", "d", "a", "min", "max"];
    columns.sort_by_key(|column| order.iter().position(|key| *key == column.key));
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

/// Returns the first of the names of a unit, by which keys end.
fn suffix(names: Names) -> &'static str {
    names.first().copied().unwrap_or_default()
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

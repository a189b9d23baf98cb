//! The table of a case, in one of the dialects that people use.

use std::fmt::Write as _;

use nalgebra::{Rotation3, UnitQuaternion};

use super::arm::Kind;
use super::dialect::{dialect, is_position, lines, mapped};
use super::draw::Draw;
use super::geometry::DrawnArm;
use super::row::Row;
use super::sight::Sight;

/// Columns that a table has besides joints and positions.
#[derive(Debug, Clone, Copy, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each column is there or not")]
pub struct Columns {
    pub session: bool,
    pub target: bool,
    pub payload: bool,
    pub temperature: bool,
    pub time: bool,
    pub approach: bool,
    pub covariate: bool,
    pub pose: bool,
    pub sigma: Option<f64>,
    /// True if some rows measure something else than positions.
    pub sights: bool,
    /// Name of the column that marks held-out rows.
    pub split: Option<&'static str>,
}

/// Table as written, with what `[data.columns]` and `[data.format]` have to say of it.
pub struct Table {
    pub text: String,
    pub sections: String,
}

/// Column: our name, and a cell for each row.
pub type Column = (String, Vec<String>);

fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Adds a column of numbers in one of two units.
fn add(
    columns: &mut Vec<Column>,
    draw: &mut Draw,
    base: &str,
    units: [(&str, f64); 2],
    values: impl Iterator<Item = f64>,
) {
    let (unit, factor) = if draw.chance(0.75) { units[0] } else { units[1] };
    let cell = |value: f64| number(value * factor);
    columns.push((format!("{base}_{unit}"), values.map(cell).collect()));
}

const ANGLE: [(&str, f64); 2] = [("deg", 180.0 / std::f64::consts::PI), ("rad", 1.0)];
const LENGTH: [(&str, f64); 2] = [("mm", 1e3), ("m", 1.0)];

/// Returns commands and measurements; the number of a joint counts all or those that move.
fn joints(draw: &mut Draw, arm: &DrawnArm, rows: &[Row], has_approach: bool) -> Vec<Column> {
    let mut columns = Vec::new();
    let counts_moving = draw.chance(0.5);
    let mut moving = 0;
    for k in 0..arm.written {
        let joint = &arm.arm.joints[k];
        if joint.kind == Kind::Fixed {
            continue;
        }
        moving += 1;
        let n = if counts_moving { moving } else { k + 1 };
        if joint.mimic.is_some() {
            // Numbers of moving joints leave those out that follow another.
            moving -= 1;
            continue;
        }
        let units = if joint.kind == Kind::Revolute { ANGLE } else { LENGTH };
        let base = match &arm.names[k] {
            // Numbers count moving joints only where every one of them has its number.
            Some(name) if !counts_moving && draw.chance(0.5) => name.clone(),
            _ => format!("q{n}"),
        };
        add(&mut columns, draw, &base, units, rows.iter().map(|row| row.q[k]));
        if has_approach {
            columns.push((
                format!("approach{n}"),
                rows.iter().map(|row| number(row.approach[k])).collect(),
            ));
        }
    }
    columns
}

fn orientations(draw: &mut Draw, rows: &[Row], format: &mut String) -> Vec<Column> {
    let turns: Vec<Rotation3<f64>> = rows.iter().filter_map(|row| row.orientation).collect();
    let mut columns = Vec::new();
    if turns.len() < rows.len() {
        return columns;
    }
    let choice = draw.whole(0, 3);
    if choice == 0 {
        let turns: Vec<UnitQuaternion<f64>> =
            turns.iter().map(UnitQuaternion::from_rotation_matrix).collect();
        for (k, name) in ["qx", "qy", "qz", "qw"].into_iter().enumerate() {
            columns
                .push((name.to_owned(), turns.iter().map(|turn| number(turn.coords[k])).collect()));
        }
        return columns;
    }
    let angles = |turn: &Rotation3<f64>| match choice {
        1 => {
            let (roll, pitch, yaw) = turn.euler_angles();
            [roll, pitch, yaw]
        }
        // R = Rx Ry Rz is the inverse of Rz(−z) Ry(−y) Rx(−x).
        2 => {
            let (x, y, z) = turn.inverse().euler_angles();
            [-x, -y, -z]
        }
        // The rotation vector of a matrix is lost at half a turn, that of a quaternion is not.
        _ => UnitQuaternion::from_rotation_matrix(turn).scaled_axis().into(),
    };
    *format += ["", "rotation = \"rpy\"\n", "rotation = \"euler-xyz\"\n", ""][choice];
    for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate() {
        add(&mut columns, draw, axis, ANGLE, turns.iter().map(|turn| angles(turn)[k]));
    }
    columns
}

/// Writes the rows in a random dialect and records their lines.
pub fn written(draw: &mut Draw, arm: &DrawnArm, rows: &mut [Row], has: &Columns) -> Table {
    let mut format = String::new();
    let mut columns = joints(draw, arm, rows, has.approach);
    let unit = draw.pick(&[[LENGTH[0]; 2], [LENGTH[1]; 2]]);
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        add(&mut columns, draw, axis, unit, rows.iter().map(|row| row.position[k]));
    }
    columns.extend(orientations(draw, rows, &mut format));
    if has.sights {
        other_sights(&mut columns, draw, rows);
    }
    let mut words = |name: &str, exists: bool, cell: &dyn Fn(&Row) -> String| {
        if exists {
            columns.push((name.to_owned(), rows.iter().map(cell).collect()));
        }
    };
    words("session", has.session, &|row| row.session.clone());
    words("target", has.target, &|row| row.target.clone().unwrap_or_default());
    words("payload_kg", has.payload, &|row| number(row.payload.unwrap_or_default()));
    words("temperature_C", has.temperature, &|row| number(row.temperature));
    words("time_s", has.time, &|row| number(row.time));
    words("oil_bar", has.covariate, &|row| number(row.covariate));
    words("sigma_mm", has.sigma.is_some(), &|_| number(has.sigma.unwrap_or_default() * 1e3));
    words(has.split.unwrap_or_default(), has.split.is_some(), &|row| {
        if row.marked { "validation" } else { "identification" }.to_owned()
    });
    if has.pose {
        columns.push(("pose".to_owned(), (1..=rows.len()).map(|k| k.to_string()).collect()));
    }
    draw.shuffle(&mut columns);
    let dialect = dialect(draw, &mut format, has.sights);
    let theirs = mapped(draw, &dialect, &columns, has.split);
    let map: Vec<String> = theirs
        .iter()
        .zip(&columns)
        .filter(|(theirs, (ours, _))| *theirs != ours)
        .map(|(theirs, (ours, _))| format!("\"{theirs}\" = \"{ours}\"\n"))
        .collect();
    let mut sections = String::new();
    if !map.is_empty() {
        let _ = write!(sections, "[data.columns]\n{}", map.concat());
    }
    let leaves_out = !has.sights && draw.chance(0.12);
    if leaves_out {
        format += if dialect.comma { "missing = \"0;0;0\"\n" } else { "missing = \"0,0,0\"\n" };
    }
    if draw.chance(0.12) {
        format += "comment = \"//\"\n";
    }
    let has_comments = format.contains("comment");
    if !format.is_empty() {
        let _ = write!(sections, "[data.format]\n{format}");
    }
    let text = lines(draw, rows, (&theirs, &columns), &dialect, (leaves_out, has_comments));
    Table { text, sections }
}

/// Returns the word of a sight if it is of the kind.
type Word = fn(&Sight) -> Option<&String>;

/// Column of words, columns of quantities, the word of a row, and the units.
type OtherColumns = (&'static str, &'static [&'static str], Word, [(&'static str, f64); 2]);

/// Empties the positions of rows that measure something else, and adds the columns of these.
fn other_sights(columns: &mut Vec<Column>, draw: &mut Draw, rows: &[Row]) {
    for (_, cells) in columns.iter_mut().filter(|(name, _)| is_position(name)) {
        for (cell, _) in cells.iter_mut().zip(rows).filter(|(_, row)| row.sight != Sight::Position)
        {
            cell.clear();
        }
    }
    let kinds: [OtherColumns; 3] = [
        (
            "anchor",
            &["distance"],
            |sight| if let Sight::Distance(word) = sight { Some(word) } else { None },
            LENGTH,
        ),
        (
            "surface",
            &["offset"],
            |sight| if let Sight::Offset(word) = sight { Some(word) } else { None },
            LENGTH,
        ),
        (
            "frame",
            &["tilt_x", "tilt_y"],
            |sight| if let Sight::Tilt(word) = sight { Some(word) } else { None },
            ANGLE,
        ),
    ];
    for (name, quantities, word, units) in kinds {
        if !rows.iter().any(|row| word(&row.sight).is_some()) {
            continue;
        }
        let words = rows.iter().map(|row| word(&row.sight).cloned().unwrap_or_default());
        columns.push((name.to_owned(), words.collect()));
        for (k, quantity) in quantities.iter().enumerate() {
            let value = |row: &Row| word(&row.sight).map_or(f64::NAN, |_| row.position[k]);
            add(columns, draw, quantity, units, rows.iter().map(value));
        }
    }
    for (_, cells) in columns.iter_mut() {
        cells.iter_mut().filter(|cell| *cell == "NaN").for_each(String::clear);
    }
}

//! Parts of error messages.

use std::path::Path;

use super::file_format::{JSON, RICH_TEXT, ZIP};
use super::near::file_like;
use super::shortened;

/// Returns the plural ending `s` unless `count` is 1.
pub(super) fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// Returns ` and n more` for the number of names that a list leaves out; empty for none.
pub(super) fn and_more(left: usize) -> String {
    if left > 0 { format!(" and {left} more") } else { String::new() }
}

/// Returns `, near` and a quotation of the text near an error; empty for an empty text.
pub(super) fn near_quote(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(", near `{text}`") }
}

/// Returns `; ` and a remedy, or an empty text.
pub(super) fn with_remedy(remedy: Option<&str>) -> String {
    remedy.map_or_else(String::new, |remedy| format!("; {remedy}"))
}

/// Returns the hint that a path is a pattern, an address, or an absolute one of Windows; otherwise,
/// unless a file has a similar name, that poses can be planned.
pub(super) fn path_hint(path: &Path) -> &'static str {
    let text = path.to_string_lossy();
    if text.contains(['*', '?']) {
        return "; a name is no pattern, so list each file by its name";
    }
    if text.split('/').any(|part| part == "~") {
        return "; ~ stands for no folder in a file, so write the whole path";
    }
    if text.contains("file:/") || text.contains("http:/") || text.contains("https:/") {
        return "; an address names no file, so write a path without it";
    }
    let has_drive = text.split('/').any(|part| {
        let drive = part.strip_suffix(':').unwrap_or_default();
        drive.len() == 1 && drive.starts_with(|letter: char| letter.is_ascii_alphabetic())
    });
    if has_drive && cfg!(not(windows)) {
        "; an absolute path of Windows names no file on this system"
    } else if file_like(path).is_none() {
        "; before anything is measured, flexcal plan chooses poses"
    } else {
        ""
    }
}

/// Angle by which no soft joint turns, so that its stiffness is rather a compliance \[rad\].
const MIN_ANGLE_OF_COMPLIANCE: f64 = 1e3;

/// Returns the units that may have been meant by a stiffness, with which a joint would turn by
/// `angle` \[rad\].
pub(super) fn stiffness_units(angle: &str) -> &'static str {
    if angle.parse::<f64>().is_ok_and(|angle| angle > MIN_ANGLE_OF_COMPLIANCE) {
        "if the number is a compliance in rad/(N·m), its reciprocal is the stiffness"
    } else {
        "a stiffness in kN·m/rad times 1000, in N·m/arcmin times 3438, or in N·m/° times 57.3, is one \
         in N·m/rad"
    }
}

/// Returns the remedy for a list with too many numbers; empty unless some of them follow a comma
/// without a space.
pub(super) fn decimal_comma_hint(has_close_commas: bool) -> &'static str {
    if has_close_commas {
        "; if a comma is a decimal one, write a point: 0.18 for 0,18"
    } else {
        ""
    }
}

/// Returns a clause that says which of two files has a column: the present one if `has`, else
/// `other`.
pub(super) fn column_difference(other: &Path, has: bool) -> String {
    let says = if has { "has this column, this file does not" } else { "does not have it" };
    format!("{} {says}", other.display())
}

/// Returns the remedy for a time of the day without its date, such as `09:12:06.7`; further forms
/// of times that are read for other words.
pub(super) fn missing_date_hint(value: &str) -> String {
    let mut parts = value.split([':', '.', ',']);
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let is_clock = value.contains(':') && parts.all(is_number);
    if is_clock {
        format!(
            "; its date is missing: write 2024-05-31T{value}, or, if another column holds the dates, \
             \"…\" = \"date\" in [data.columns]"
        )
    } else {
        ", 31.05.2024 14:03:20, 05/31/2024 2:03:20 PM, 31-May-2024 14:03:20 or 20240531 140320"
            .to_owned()
    }
}

/// Returns the column names of a header in quotes, as in `there are "a", "b"`, or a clause that
/// there are no others.
pub(super) fn in_quotes(names: &[String]) -> String {
    let names: Vec<String> =
        names.iter().map(|name| format!("\"{}\"", shortened(name, 40))).collect();
    joined_list("there are", &names, "its other columns have names of flexcal")
}

/// Returns `verb` followed by the names, or the text `none` if there are no names.
pub(super) fn joined_list(verb: &str, names: &[String], none: &str) -> String {
    if names.is_empty() { none.to_owned() } else { format!("{verb} {}", names.join(", ")) }
}

/// Maximum number of unknown columns that an error lists.
const MAX_LISTED_COLUMNS: usize = 12;

/// Returns the remedy of a missing column: the similar column `near`, or else the `unknown` columns,
/// and the section that maps such names.
pub(super) fn missing_column_remedy(write: &str, near: Option<&str>, unknown: &[String]) -> String {
    let is_usual = |name: &&str| name.ends_with("_deg") || name.ends_with("_mm");
    let mut names = write.split(" or ");
    let ours = names.clone().find(is_usual).or(names.next()).unwrap_or_default();
    let map = |theirs: &str| format!("[data.columns] maps it, as in \"{theirs}\" = \"{ours}\"");
    match (near, unknown.first()) {
        (Some(near), _) if near.contains(' ') => format!(" (is it column {near}? {})", map(near)),
        (Some(near), _) => format!(" (is it column {near}?)"),
        (None, Some(first)) if !ours.contains(' ') => {
            let listed: Vec<String> =
                unknown.iter().take(MAX_LISTED_COLUMNS).map(|name| shortened(name, 40)).collect();
            let more = if unknown.len() > MAX_LISTED_COLUMNS { ", …" } else { "" };
            format!(
                " (columns that flexcal does not know: {}{more}; if it is one of them, {})",
                listed.join(", "),
                map(first)
            )
        }
        _ => String::new(),
    }
}

/// Returns the remedy for a row with more fields than the header; empty if it has fewer.
pub(super) fn decimal_comma_remedy(found: usize, expected: usize) -> &'static str {
    if found > expected {
        "; if its numbers have a decimal comma, separate the columns by ; or tab"
    } else {
        ""
    }
}

/// States by how much the points of images miss the nearest pose of a marker \[px\]; infinity if they
/// fit none.
pub(super) fn missed(miss: f64) -> String {
    if miss.is_finite() {
        format!("they miss the nearest one by {miss:.1} px")
    } else {
        "they miss it far".to_owned()
    }
}

/// Returns the other numbering of a marker's points with its remedy: two corners of a tag are
/// exchanged, or else the grid is counted along its other side.
pub(super) fn renumbered(crossed: Option<[usize; 2]>) -> String {
    match crossed {
        Some([a, b]) => format!(
            "corners {a} and {b} exchanged: points_mm goes round the tag in another order than the \
             detector; exchange {a} and {b} in points_mm, or in the column point"
        ),
        None => {
            "corners along and across exchanged; declare points_mm as the detector counts them, \
                 columns and rows exchanged"
                .to_owned()
        }
    }
}

/// Returns the remedy for a point behind the camera. `fits` is true if the points of the images fit
/// the marker by themselves, which they miss by `miss` \[px\]. `few` is the largest number of points
/// in an image if that is too small for a pose, otherwise 0.
pub(super) fn behind_camera_remedy(
    (fits, few): (Option<bool>, usize),
    miss: Option<f64>,
    readings: &[String],
) -> String {
    if !readings.is_empty() {
        let named = readings.join(", or ");
        return format!("the images fit if the table is read in another way: with {named}");
    }
    if few > 0 {
        return format!(
            "no image shows more than {few} point{} of this marker, and it takes four to tell where \
             it is: detect more points, or declare at_m and rotation_deg of camera and marker well",
            plural(few)
        );
    }
    let miss = miss.filter(|miss| miss.is_finite());
    let miss = miss.map_or_else(|| "far".to_owned(), |miss| format!("by {miss:.1} px"));
    match fits {
        Some(true) => {
            "each image by itself fits the marker, so that the points are right; check units \
             (radians under _deg?), signs and order of the joint columns, whether joints and \
             images belong together, whether focal_px and centre_px are of the resolution of the \
             images, and at_m and rotation_deg of camera and marker"
                .to_owned()
        }
        Some(false) => format!(
            "the points of the images fit no pose of the marker, which they miss {miss} without \
             the arm; check focal_px and centre_px (in pixels, not in millimetres), points_mm, \
             and the numbers in the column point"
        ),
        None => {
            "check the names and numbers of the row, whether points_mm counts the corners as the \
             detector does (10 × 7 or 7 × 10), and the poses of camera and marker (at_m and \
             rotation_deg), which views of one direction do not determine"
                .to_owned()
        }
    }
}

/// Returns one key of each table, in parentheses, if no row shares a key: of the measurements, and
/// of the joint table. Returns an empty text for `None`.
pub(super) fn compared_keys(keys: Option<&[String; 2]>) -> String {
    keys.map_or_else(String::new, |[measured, joints]| {
        format!(" (the measurements have {measured}, the joint table {joints})")
    })
}

/// Returns a clause that names the further rows that repeat others.
pub(super) fn repeated_rows(rows: usize, named: &[String]) -> String {
    let (further, left) = (rows.saturating_sub(1), rows.saturating_sub(1 + named.len()));
    let left = and_more(left);
    let named = named.join(", ");
    match further {
        0 => String::new(),
        1 => format!(", and 1 further row repeats another ({named})"),
        _ => format!(", and {further} further rows repeat others ({named}{left})"),
    }
}

/// Returns a clause that names the further rows of which a warning is true.
pub(super) fn further_rows(rows: usize, named: &[String]) -> String {
    let (further, left) = (rows.saturating_sub(1), rows.saturating_sub(1 + named.len()));
    let left = and_more(left);
    match further {
        0 => String::new(),
        1 => format!(", as does {}", named.join(", ")),
        _ => format!(", as do {further} further rows ({}{left})", named.join(", ")),
    }
}

/// Returns a clause that counts the further rows of which a warning is true.
pub(super) fn additional_rows(rows: usize) -> String {
    if rows > 1 {
        format!(", and in {} further row{}", rows - 1, plural(rows - 1))
    } else {
        String::new()
    }
}

/// Returns the hint for a column that does not resemble a known one.
pub(super) fn covariate_hint(meant: Option<&str>, is_angle: bool) -> &'static str {
    match (meant, is_angle) {
        (Some(_), _) => "",
        (None, true) => {
            " (if it is a joint of the arm, its [[joint]] is missing: from a URDF, flexcal init \
             with another --tip adds it; if the arm may only depend on it, name it in \
             [data.covariates])"
        }
        (None, false) => " (name it in [data.covariates] if the arm may depend on it)",
    }
}

/// Returns the remedy for a file of the format `found` where a file of another one is `expected`.
pub(super) fn format_remedy(found: &str, expected: &str) -> &'static str {
    match found {
        RICH_TEXT => "; save the file as plain text in UTF-8",
        JSON if expected.starts_with("a table") => "; an estimate.json follows --estimate",
        ZIP if expected.contains("problem.toml") => "; unpack an archive and give its folder",
        _ => "",
    }
}

/// Returns the value of `held_out` for its text `word`, which may be the name of a column or of a
/// session.
pub(super) fn held_out_example(word: Option<&str>) -> String {
    word.map_or_else(
        || "{ fraction = 0.3, seed = 1 }".to_owned(),
        |word| {
            format!(
                "{{ column = \"{word}\" }} if a column of this name marks the rows, {{ session = \
                 \"{word}\" }} if a session is called so, or {{ fraction = 0.3, seed = 1 }}"
            )
        },
    )
}

/// States which fixtures of a kind there are, and how another one is declared.
pub(super) fn fixtures_of(what: &str, known: &[String]) -> String {
    if known.is_empty() {
        return format!("none is declared by a section [[{what}]]");
    }
    format!("there are {}; a section [[{what}]] declares another one", known.join(", "))
}

/// Returns what to do with the declared size of images that has its numbers exchanged, or is wrong.
pub(super) fn image_remedy(image: &[String; 2], is_exchanged: bool) -> String {
    if is_exchanged {
        format!("the pixels fit image_px = [{}, {}]: write that", image[1], image[0])
    } else {
        "correct image_px".to_owned()
    }
}

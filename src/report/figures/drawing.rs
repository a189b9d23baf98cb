//! Figure with its title, caption and CSV data, and the sentences that captions share.

use crate::files::csv;
use crate::quantity::format::{fixed, two_digits};
use crate::results::PoseError;

/// Figure of a report: title, caption, drawing and plotted data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    /// File name without extension.
    pub name: String,
    /// Title of the figure.
    pub title: String,
    /// Caption that explains the figure.
    pub caption: String,
    /// Drawing as SVG text.
    pub svg: String,
    /// Data that are drawn, as CSV text.
    pub data: String,
}

impl Drawing {
    pub fn new(
        (name, title): (&str, &str),
        caption: impl Into<String>,
        svg: String,
        data: String,
    ) -> Self {
        Self { name: name.to_owned(), title: title.to_owned(), caption: caption.into(), svg, data }
    }
}

/// Formats the plotted data of a figure as CSV text.
pub fn sheet<'a>(
    header: impl IntoIterator<Item = &'a str>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    csv(header.into_iter().map(str::to_owned).collect(), rows)
}

/// Formats the plotted data of some poses as CSV text: file and line, whether the pose is held out,
/// and the values of `columns`.
pub fn pose_sheet<'a>(
    columns: &[&str],
    rows: impl IntoIterator<Item = (&'a PoseError, Vec<f64>)>,
) -> String {
    let cells = |(pose, values): (&PoseError, Vec<f64>)| {
        let pose = [pose.place.clone(), pose.held_out.to_string()];
        pose.into_iter().chain(values.into_iter().map(|value| fixed(value, 6))).collect()
    };
    sheet([&["row", "held_out"], columns].concat(), rows.into_iter().map(cells))
}

/// Returns the sentence of a caption on poses that are not drawn, such as " 300 of 6487 rows are
/// drawn, including those with the largest residuals." Returns an empty text if all are drawn.
pub fn thinning_note(drawn: usize, total: usize) -> String {
    if drawn < total {
        format!(" {drawn} of {total} rows are drawn, including those with the largest residuals.")
    } else {
        String::new()
    }
}

/// Returns the sentence of a caption on poses without equilibrium, for example " 3 poses without an
/// equilibrium are omitted."; empty for none.
pub fn omission_note(poses: usize) -> String {
    match poses {
        0 => String::new(),
        1 => " One pose without an equilibrium is omitted.".to_owned(),
        n => format!(" {n} poses without an equilibrium are omitted."),
    }
}

/// Returns the sentence of a caption on values beyond the axes, for example " 3 values lie beyond
/// the axes: rings at the rim."; empty for none.
pub fn beyond_note(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => " One value lies beyond the axes: a ring at the rim.".to_owned(),
        n => format!(" {n} values lie beyond the axes: rings at the rim."),
    }
}

/// Returns the opacity of each length on a colour scale from `least` to `most` \[m\], and the words
/// of a caption on the scale; `beyond` follows its upper end. If both ends are the same in two
/// digits, all lengths have one opacity.
pub fn shades((least, most): (f64, f64), beyond: &str) -> (impl Fn(f64) -> f64 + Copy, String) {
    let [pale, deep] = [least, most].map(|length| two_digits(length * 1e3, 4));
    let is_even = pale == deep;
    let words = if is_even {
        format!("about {pale} mm{beyond} throughout")
    } else {
        format!("pale {pale} mm, deep {deep} mm{beyond}")
    };
    let share = move |length: f64| ((length - least) / (most - least)).min(1.0);
    (move |length| if is_even { 0.5 } else { 0.08 + 0.92 * share(length) }, words)
}

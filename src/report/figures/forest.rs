//! Forest plot: values with their intervals, one row for each name.

use super::prelude::*;

/// Maximum number of rows that a figure shows.
const MAX_ROWS: usize = 24;
/// Largest space for the names of the rows in displayed pixels.
const MAX_NAME_SPACE: f64 = 270.0;
/// Distance between the marks of one row, as a share of the height of the row.
const MARK_SPACING: f64 = 0.22;

/// Row of a forest plot: its name, and values with the half-widths of their intervals, in the order
/// of the legend. A missing value is `None`.
pub type Row = (String, Vec<Option<(f64, f64)>>);

/// Forest plot: one row of values with intervals for each name.
#[derive(Debug, Clone, Default)]
pub struct Forest<'a> {
    /// File name and title.
    pub names: (&'a str, &'a str),
    pub caption: String,
    /// Label of the horizontal axis, with the unit.
    pub label: &'a str,
    /// Names and colours of the values of a row.
    pub legend: Vec<(&'a str, Colour)>,
    /// Values at which vertical lines are drawn; the first one is the reference of all rows.
    pub references: Vec<f64>,
    pub rows: Vec<Row>,
    /// True for a logarithmic axis; all values are then positive.
    pub is_logarithmic: bool,
}

impl Forest<'_> {
    /// Draws the rows; `None` if there are none. Of too many rows, draws those with values farthest
    /// from the first of the references (0 without references).
    pub fn drawing(&self) -> Option<Drawing> {
        let centre = self.references.first().copied().unwrap_or_default();
        let size = |row: &Row| {
            row.1.iter().flatten().map(|value| (value.0 - centre).abs()).fold(0.0, f64::max)
        };
        let every: Vec<usize> = (0..self.rows.len()).collect();
        let mut kept = every.clone();
        kept.sort_by(|&a, &b| size(&self.rows[b]).total_cmp(&size(&self.rows[a])));
        kept.truncate(MAX_ROWS);
        kept.sort_unstable();
        let shown: Vec<&Row> = kept.iter().map(|&k| &self.rows[k]).collect();
        let values = || shown.iter().flat_map(|row| row.1.iter().flatten());
        let smallest = values().map(|value| value.0).filter(|value| *value > 0.0);
        let smallest = smallest.fold(f64::INFINITY, f64::min);
        let ends = || values().flat_map(|(value, error)| [value - error, value + error]);
        // A logarithmic axis begins at the lowest end of an interval, at most a decade below the
        // smallest value; intervals that reach 0 end there.
        let shown_ends = ends().filter(|end| *end >= 0.1 * smallest);
        let least = shown_ends.fold(smallest, f64::min);
        let along = |value: f64| if self.is_logarithmic { value.max(least).log10() } else { value };
        let (low, high) = range(ends().chain(self.references.iter().copied()).map(along));
        if shown.is_empty() || !(low.is_finite() && high.is_finite()) {
            return None;
        }
        let count = self.legend.len() as f64;
        let marks = shown.iter().enumerate().flat_map(|(k, (_, values))| {
            let marks = values.iter().zip(&self.legend).enumerate();
            marks.flat_map(move |(of, (value, &(_, colour)))| {
                let row = k as f64 + MARK_SPACING * (of as f64 - 0.5 * (count - 1.0));
                let drawn = value.iter().filter(|(value, error)| (value + error).is_finite());
                drawn.flat_map(move |&(value, error)| {
                    let interval = [value - error, value + error].map(|end| (along(end), row));
                    let dot = Shape::dot((along(value), row), 3.2, Paint::fill(colour), None);
                    [Shape::line(interval, Paint::line(colour, 1.6)), dot]
                })
            })
        });
        let axis = if self.is_logarithmic { Axis::logarithmic } else { Axis::linear };
        let x = axis(with_margin((low, high), 0.04), self.label, 5);
        let names = shown.iter().map(|row| (row.0.clone(), INK));
        let panel = Panel::of_rows(22.0, (MAX_NAME_SPACE, 20.0), x, names);
        let panel =
            self.references.iter().fold(panel, |panel, at| panel.with_reference(along(*at), FAINT));
        let legend: Vec<_> =
            self.legend.iter().map(|&(name, colour)| (name, colour, Mark::Dot)).collect();
        let legend = if legend.len() > 1 { legend.as_slice() } else { &[] };
        let svg = chart(self.names.1, legend, &[panel.with(marks)]);
        let note = if shown.len() < self.rows.len() {
            format!(
                " Drawn are the {} of {} rows whose values are farthest from {centre}.",
                shown.len(),
                self.rows.len()
            )
        } else {
            String::new()
        };
        let cells = self.rows.iter().flat_map(|(name, values)| {
            values.iter().zip(&self.legend).filter_map(move |(value, (of, _))| {
                let (value, error) = (*value)?;
                // A value without an interval is drawn with one of no width.
                let error = if error > 0.0 { fixed(error, 6) } else { String::new() };
                Some(vec![name.clone(), (*of).to_owned(), fixed(value, 6), error])
            })
        });
        let data = sheet(["name", "of", self.label, "half width of the interval"], cells);
        Some(Drawing::new(self.names, format!("{}{note}", self.caption), svg, data))
    }
}

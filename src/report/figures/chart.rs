//! Charts: panels with axes, the shapes in them, and a legend. One renderer draws every figure.

use super::axis::Axis;
use super::svg::{
    Anchor, Colour, FAINT, GRID, INK, MUTED, Paint, Svg, TEXT_SIZE, WARM, text_width,
};

/// Width of every figure in displayed pixels, without its left margin.
pub const FIGURE_WIDTH: f64 = 480.0;
/// Default space left of a panel's plot area in displayed pixels.
pub const LEFT_SPACE: f64 = 62.0;
/// Default space right of a panel's plot area in displayed pixels.
pub const RIGHT_SPACE: f64 = 12.0;
/// Space above a panel's plot area in displayed pixels.
const SPACE_ABOVE: f64 = 8.0;
/// Height of a line of the legend in displayed pixels.
const LEGEND_HEIGHT: f64 = 20.0;
/// Space between the names of rows and the plot area, and around the names, in displayed pixels.
const NAME_GAP: f64 = 10.0;
/// Smallest space between the labels of two ticks in displayed pixels; closer labels are left out.
const TICK_GAP: f64 = 6.0;
/// Opacity of a band behind the data, 0 to 1.
const BAND_OPACITY: f64 = 0.16;

/// Position (x, y) in the units of a panel's axes.
pub type At = (f64, f64);

/// Shape in the units of a panel's axes.
#[derive(Debug, Clone)]
pub enum Shape {
    /// Circle with a radius in displayed pixels; `row` is the row of the measurements (from 0) that
    /// it shows.
    Dot { at: At, radius: f64, paint: Paint, row: Option<usize> },
    /// Polyline through points.
    Line { points: Vec<At>, paint: Paint },
    /// Rectangle between two corners, with attributes for the script of the page.
    Box { corners: [At; 2], paint: Paint, tag: String },
    /// Text at a position, shifted by displayed pixels to the right and downwards.
    Text { at: At, shift: (f64, f64), text: String, colour: Colour, anchor: Anchor },
}

impl Shape {
    /// Creates a dot. If it shows a `row` of the measurements, the page's script can select that
    /// row.
    pub fn dot(at: At, radius: f64, paint: Paint, row: Option<usize>) -> Self {
        Self::Dot { at, radius, paint, row }
    }

    pub fn line(points: impl IntoIterator<Item = At>, paint: Paint) -> Self {
        Self::Line { points: points.into_iter().collect(), paint }
    }

    pub fn area(from: At, to: At, paint: Paint) -> Self {
        Self::Box { corners: [from, to], paint, tag: String::new() }
    }

    /// Creates a translucent band behind the data.
    pub fn band(from: At, to: At, colour: Colour) -> Self {
        Self::area(from, to, Paint::fill(colour).faded(BAND_OPACITY))
    }

    /// Creates text that starts `right` pixels right of a position; if `right` is negative, it ends
    /// that far left of it.
    pub fn text(at: At, right: f64, text: impl Into<String>, colour: Colour) -> Self {
        let anchor = if right < 0.0 { Anchor::End } else { Anchor::Start };
        Self::Text { at, shift: (right, 0.0), text: text.into(), colour, anchor }
    }
}

/// Plot area with its axes and the shapes in it.
#[derive(Debug, Clone)]
pub struct Panel {
    pub x: Axis,
    pub y: Axis,
    /// Height of the plot area in displayed pixels.
    pub height: f64,
    /// Space left and right of the plot area in displayed pixels.
    pub sides: (f64, f64),
    /// Size of the tick labels of the vertical axis in displayed pixels.
    pub text: f64,
    pub shapes: Vec<Shape>,
}

impl Panel {
    pub fn new(height: f64, x: Axis, y: Axis) -> Self {
        Self { x, y, height, sides: (LEFT_SPACE, RIGHT_SPACE), text: TEXT_SIZE, shapes: Vec::new() }
    }

    /// Creates a panel of rows with names. `row` is the height of a row, `max_names` is the largest
    /// space left of the plot area, and `numbers` is that right of it, all in displayed pixels.
    /// Names that need more space are written smaller.
    pub fn of_rows(
        row: f64,
        (max_names, numbers): (f64, f64),
        x: Axis,
        rows: impl IntoIterator<Item = (String, Colour)>,
    ) -> Self {
        let y = Axis::names(rows);
        let height = row * y.ticks.len() as f64;
        let widths = y.ticks.iter().map(|tick| text_width(&tick.text));
        let longest = widths.fold(1.0, f64::max);
        let names = (longest.max(LEFT_SPACE) + NAME_GAP).min(max_names);
        let text = TEXT_SIZE * ((names - NAME_GAP) / longest).min(1.0);
        Self { sides: (names, numbers), text, ..Self::new(height, x, y) }
    }

    pub fn with(mut self, shapes: impl IntoIterator<Item = Shape>) -> Self {
        self.shapes.extend(shapes);
        self
    }

    /// Adds a horizontal line across the panel at the ordinate `y`.
    pub fn with_level(self, y: f64) -> Self {
        let (left, right) = self.x.range;
        self.with([Shape::line([(left, y), (right, y)], Paint::line(FAINT, 1.0))])
    }

    /// Adds a vertical line across the panel at the abscissa `x`.
    pub fn with_reference(self, x: f64, colour: Colour) -> Self {
        let (bottom, top) = self.y.range;
        self.with([Shape::line([(x, bottom), (x, top)], Paint::line(colour, 1.0))])
    }

    /// Writes the number of values outside the axes (`count`) at the top, unless it is 0; at the
    /// left for `Anchor::Start`, else at the right.
    pub fn noting_beyond(self, count: usize, anchor: Anchor) -> Self {
        let (x, shift) = match anchor {
            Anchor::Start => (self.x.range.0, 6.0),
            _ => (self.x.range.1, -4.0),
        };
        let (at, text) = ((x, self.y.range.1), format!("{count} beyond"));
        let note = Shape::Text { at, shift: (shift, 8.0), text, colour: WARM, anchor };
        self.with((count > 0).then_some(note))
    }

    /// Returns the space below the plot area in displayed pixels, for tick labels and axis label.
    fn below(&self) -> f64 {
        match (self.x.label.is_empty(), self.x.ticks.is_empty()) {
            (true, true) => 6.0,
            (true, false) | (false, true) => 20.0,
            (false, false) => 38.0,
        }
    }

    /// Draws the panel at the distance `top` \[displayed pixels\] from the top of the figure.
    fn draw(&self, svg: &mut Svg, top: f64) {
        let (left, right) = (self.sides.0, FIGURE_WIDTH - self.sides.1);
        let (top, bottom) = (top + SPACE_ABOVE, top + SPACE_ABOVE + self.height);
        let share = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        let x = |value: f64| left + (right - left) * share(value, self.x.range);
        let y = |value: f64| bottom - (bottom - top) * share(value, self.y.range);
        let place = |at: At| (x(at.0), y(at.1));
        let grid = Paint::line(GRID, 1.0);
        let mut end_of_labels = f64::NEG_INFINITY;
        for tick in &self.x.ticks {
            svg.line([(x(tick.at), top), (x(tick.at), bottom)], grid);
            let half_width = 0.5 * text_width(&tick.text);
            if x(tick.at) - half_width < end_of_labels + TICK_GAP {
                continue;
            }
            end_of_labels = x(tick.at) + half_width;
            svg.text(
                &tick.text,
                (x(tick.at), bottom + 11.0),
                (tick.colour, TEXT_SIZE),
                Anchor::Middle,
            );
        }
        for tick in &self.y.ticks {
            if self.y.is_numeric {
                svg.line([(left, y(tick.at)), (right, y(tick.at))], grid);
            }
            svg.text(&tick.text, (left - 7.0, y(tick.at)), (tick.colour, self.text), Anchor::End);
        }
        if self.y.is_numeric && !self.y.ticks.is_empty() {
            svg.line([(left, top), (left, bottom), (right, bottom)], Paint::line(FAINT, 1.0));
        }
        if !self.x.label.is_empty() {
            // A label that is wider than the plot area stays within the figure.
            let half_width = 0.5 * text_width(&self.x.label);
            let middle = (0.5 * (left + right)).min(FIGURE_WIDTH - half_width).max(half_width);
            let at = (middle, bottom + self.below() - 10.0);
            svg.text(&self.x.label, at, (INK, TEXT_SIZE), Anchor::Middle);
        }
        if !self.y.label.is_empty() {
            svg.text_upwards(&self.y.label, (6.0, 0.5 * (top + bottom)), INK);
        }
        for shape in &self.shapes {
            match shape {
                Shape::Dot { at, radius, paint, row } => {
                    let tag = row.map_or_else(String::new, |row| format!(" data-p=\"{row}\""));
                    svg.circle(place(*at), *radius, *paint, &tag);
                }
                Shape::Line { points, paint } => {
                    svg.line(points.iter().copied().map(place), *paint);
                }
                Shape::Box { corners, paint, tag } => {
                    svg.rectangle(corners.map(place), *paint, tag);
                }
                Shape::Text { at, shift, text, colour, anchor } => {
                    let (x, y) = place(*at);
                    svg.text(text, (x + shift.0, y + shift.1), (*colour, TEXT_SIZE), *anchor);
                }
            }
        }
    }
}

/// Symbol of an entry of a legend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    Dot,
    Ring,
    Line,
    Bar,
    Band,
    /// Line of the given length in displayed pixels, as a scale.
    Scale(f64),
}

/// Entry of a legend: name, colour and symbol.
pub type Entry<'a> = (&'a str, Colour, Mark);

/// Returns the legend of fitted and held-out poses.
pub fn poses_legend() -> Vec<Entry<'static>> {
    vec![("fitted pose", FAINT, Mark::Dot), ("held-out pose", INK, Mark::Dot)]
}

/// Draws a legend, and below it the panels one below the other. Returns SVG text; `label` describes
/// the figure for screen readers.
pub fn chart(label: &str, legend: &[Entry], panels: &[Panel]) -> String {
    let mut svg = Svg::default();
    let mut top = if legend.is_empty() { 0.0 } else { LEGEND_HEIGHT };
    let mut at = LEFT_SPACE;
    for &(name, colour, mark) in legend {
        let width = if let Mark::Scale(length) = mark { length } else { 8.0 };
        // An entry that does not fit begins another line.
        if at > LEFT_SPACE && at + width + 5.0 + text_width(name) > FIGURE_WIDTH {
            (at, top) = (LEFT_SPACE, top + LEGEND_HEIGHT);
        }
        let y = top - 0.5 * LEGEND_HEIGHT;
        let square = [(at, y - 4.0), (at + 8.0, y + 4.0)];
        match mark {
            Mark::Dot => svg.circle((at + 4.0, y), 3.2, Paint::fill(colour), ""),
            Mark::Ring => svg.circle((at + 4.0, y), 3.2, Paint::line(colour, 1.2), ""),
            Mark::Line => svg.line([(at - 2.0, y), (at + 9.0, y)], Paint::line(colour, 2.2)),
            Mark::Scale(_) => svg.line([(at, y), (at + width, y)], Paint::line(colour, 1.6)),
            Mark::Bar => svg.rectangle(square, Paint::fill(colour), ""),
            Mark::Band => svg.rectangle(square, Paint::fill(colour).faded(BAND_OPACITY), ""),
        }
        svg.text(name, (at + width + 5.0, y), (MUTED, TEXT_SIZE), Anchor::Start);
        at += width + 19.0 + 6.0 * name.chars().count() as f64;
    }
    for panel in panels {
        panel.draw(&mut svg, top);
        top += SPACE_ABOVE + panel.height + panel.below();
    }
    svg.finish((FIGURE_WIDTH, top), label)
}

//! Canvas and axes of the figures: sizes in displayed pixels, round tick values, and colours that a
//! page may replace.

use std::io;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::sheet::Sheet;

/// Ratio of drawn to displayed size; the backend rounds to whole drawn pixels.
pub const SCALE: i32 = 4;
/// Width of a figure in displayed pixels.
pub const WIDTH: i32 = 480;
/// Text size in displayed pixels.
pub const TEXT: f64 = 11.5;
/// Margin on the left for text that the backend places too far out, in displayed pixels.
const MARGIN: i32 = 6;
/// Space left of an axis in displayed pixels.
pub const LEFT: i32 = 62;
/// Space below an axis in displayed pixels.
pub const BELOW: i32 = 40;
/// Ratio by which the backend writes text smaller than requested.
const POINTS: f64 = 1.24;

/// Colour of important lines and text, and of held-out poses.
pub const INK: RGBColor = RGBColor(0x1F, 0x23, 0x28);
/// Colour of axes and their numbers.
pub const MUTED: RGBColor = RGBColor(0x59, 0x63, 0x6E);
/// Colour of references, and of fitted poses.
pub const FAINT: RGBColor = RGBColor(0xA3, 0xAD, 0xB8);
/// Colour of the grid.
pub const GRID: RGBColor = RGBColor(0xE4, 0xE8, 0xEC);
/// Accent colour: the best result, a law, or pure noise.
pub const ACCENT: RGBColor = RGBColor(0x0B, 0x6B, 0xCB);
/// Opposite of the accent: negative values and failures.
pub const WARM: RGBColor = RGBColor(0xC2, 0x52, 0x1B);

/// Figure with its title, caption and data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    /// File name without extension.
    pub name: String,
    /// Title of the figure.
    pub title: String,
    /// Explanation of the figure.
    pub caption: String,
    /// Drawing as SVG text.
    pub svg: String,
    /// Data that are drawn.
    pub data: Sheet,
}

impl Drawing {
    /// Creates a figure without data.
    pub fn new(name: &str, title: &str, caption: impl Into<String>, svg: String) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            caption: caption.into(),
            svg,
            data: Sheet::default(),
        }
    }

    /// Adds the data that are drawn.
    pub fn with(self, data: Sheet) -> Self {
        Self { data, ..self }
    }
}

/// Rectangular part of a figure.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Error of the backend; writing to memory never fails.
pub type Failure = DrawingAreaErrorKind<io::Error>;
/// Axes with the area between them.
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;

/// Coordinate of an axis with chosen tick values.
pub struct Coordinate {
    inner: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ranged for Coordinate {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.inner.map(value, limit)
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.inner.range()
    }
}

impl ValueFormatter<f64> for Coordinate {
    fn format(value: &f64) -> String {
        value.to_string()
    }
}

/// Axis of a chart.
#[derive(Debug, Clone)]
pub struct Axis<'a> {
    /// Ends of the axis; logarithms to base 10 for a logarithmic axis.
    pub range: (f64, f64),
    /// Label with the unit.
    pub label: &'a str,
    /// True if values are given as logarithms to base 10.
    pub logarithmic: bool,
    /// Approximate number of tick values; 0 for none.
    pub numbers: usize,
}

impl<'a> Axis<'a> {
    pub fn linear(range: (f64, f64), label: &'a str) -> Self {
        Self { range: widened(range), label, logarithmic: false, numbers: 6 }
    }

    /// Creates a logarithmic axis; `range` is in decades.
    pub fn logarithmic(range: (f64, f64), label: &'a str) -> Self {
        Self { range: widened(range), label, logarithmic: true, numbers: 6 }
    }

    pub fn numbers(self, numbers: usize) -> Self {
        Self { numbers, ..self }
    }

    fn coordinate(&self) -> Coordinate {
        Coordinate { inner: (self.range.0..self.range.1).into(), ticks: self.ticks() }
    }

    fn ticks(&self) -> Vec<f64> {
        let (low, high) = self.range;
        if self.numbers == 0 {
            return Vec::new();
        }
        if self.logarithmic && high - low >= 1.0 {
            let steps: &[f64] = if high - low > 2.0 { &[1.0] } else { &[1.0, 3.0] };
            let every = ((high - low) / self.numbers as f64).floor().max(1.0);
            let decades = (0..=64).map(|k| (low / every).floor() * every + f64::from(k) * every);
            let ticks =
                decades.flat_map(|decade| steps.iter().map(move |step| decade + step.log10()));
            return ticks.filter(|tick| (low - 1e-9..=high + 1e-9).contains(tick)).collect();
        }
        let step = step(high - low, self.numbers);
        let first = (low / step - 1e-9).ceil();
        let ticks = (0..=64).map(|k| (first + f64::from(k)) * step);
        ticks.filter(|tick| *tick <= high + 1e-9 * (high - low)).collect()
    }

    fn number(&self, value: f64) -> String {
        if self.logarithmic {
            let plain = 10.0_f64.powf(value);
            let exponent = value.floor();
            if !(-4.0..5.0).contains(&exponent) {
                return power_of_ten(value.round());
            }
            let decimals = if exponent < 0.0 { -exponent } else { 0.0 };
            return crate::report::quantity::number(plain, whole(decimals));
        }
        let step = step(self.range.1 - self.range.0, self.numbers.max(1));
        crate::report::quantity::number(value, whole((-step.log10()).ceil().max(0.0)))
            .replace('-', "−")
    }
}

/// Returns a power of ten as text, for example 10⁻⁶ for −6.
fn power_of_ten(exponent: f64) -> String {
    let superscript = |digit: char| match digit {
        '-' => Some('⁻'),
        digit => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize),
    };
    format!("10{}", format!("{exponent:.0}").chars().filter_map(superscript).collect::<String>())
}

/// Returns the integer part of a small number.
fn whole(value: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=12"
    )]
    let whole = value.clamp(0.0, 12.0) as usize;
    whole
}

/// Returns about `count` round values in a range, each with its text.
pub fn round_numbers(range: (f64, f64), count: usize) -> Vec<(f64, String)> {
    let axis = Axis::linear(range, "").numbers(count);
    axis.ticks().into_iter().map(|tick| (tick, axis.number(tick))).collect()
}

/// Returns a tick step of 1, 2 or 5 times a power of ten that gives about `count` ticks.
fn step(range: f64, count: usize) -> f64 {
    let raw = range / count as f64;
    let power = 10.0_f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= raw)
        .unwrap_or(10.0 * power)
}

/// Returns a range of positive width, also for a single value or none.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    match (low.is_finite() && high.is_finite(), high - low) {
        (false, _) => (0.0, 1.0),
        (true, width) if width > 0.0 => (low, high),
        (true, _) => (low - 0.5 * low.abs().max(1e-9), low + 0.5 * low.abs().max(1e-9)),
    }
}

/// Returns the smallest and the largest of some values.
pub fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

/// Adds a margin to both ends of a range, as a fraction of its width.
pub fn with_margin((low, high): (f64, f64), fraction: f64) -> (f64, f64) {
    let margin = fraction * (high - low);
    (low - margin, high + margin)
}

/// Converts displayed to drawn pixels.
pub fn px(shown: i32) -> i32 {
    shown * SCALE
}

/// Returns a line style; the width is in displayed pixels.
pub fn line(colour: RGBColor, width: f64) -> ShapeStyle {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
    let width = (width * f64::from(SCALE)).round() as u32;
    colour.stroke_width(width)
}

/// Converts a displayed length to drawn pixels, rounded.
pub fn pixels(shown: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "no longer than the canvas")]
    let drawn = (shown * f64::from(SCALE)).round() as i32;
    drawn
}

fn font(colour: RGBColor, size: f64) -> TextStyle<'static> {
    ("sans-serif", size * f64::from(SCALE) * POINTS).into_font().color(&colour)
}

/// Removes control characters, which SVG does not allow.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// Writes text at a position in displayed pixels.
pub fn write(
    area: &Area,
    text: &str,
    at: (i32, i32),
    colour: RGBColor,
    side: HPos,
) -> Result<(), Failure> {
    write_sized(area, text, at, (colour, TEXT), side)
}

/// Writes text of a given size in displayed pixels.
pub fn write_sized(
    area: &Area,
    text: &str,
    at: (i32, i32),
    (colour, size): (RGBColor, f64),
    side: HPos,
) -> Result<(), Failure> {
    let style = font(colour, size).pos(Pos::new(side, VPos::Center));
    area.draw_text(&printable(text), &style, (px(at.0), px(at.1)))
}

/// Draws a vertical line at a drawn position, between two displayed heights.
pub fn vertical_line(
    area: &Area,
    at: i32,
    (from, to): (i32, i32),
    colour: RGBColor,
) -> Result<(), Failure> {
    area.draw(&PathElement::new(vec![(at, px(from)), (at, px(to))], line(colour, 1.0)))
}

/// Draws a figure of a displayed size; `label` describes it for screen readers.
pub fn figure(
    size: (i32, i32),
    label: &str,
    paint: impl FnOnce(&Area) -> Result<(), Failure>,
) -> String {
    let drawn = (px(size.0).unsigned_abs(), px(size.1).unsigned_abs());
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, drawn).into_drawing_area();
        if paint(&area).and_then(|()| area.present()).is_err() {
            return String::new();
        }
    }
    let body = text.split_once('>').map_or("", |(_, body)| body);
    // Attributes that every element repeats although they are the default.
    let body = [
        " opacity=\"1\"",
        " stroke=\"none\"",
        " stroke-width=\"1\"",
        " font-family=\"sans-serif\"",
    ]
    .into_iter()
    .fold(body.to_owned(), |body, default| body.replace(default, ""));
    let label = printable(label).replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;");
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"{label}\" font-family=\"system-ui, sans-serif\">{body}",
        -px(MARGIN),
        px(size.0 + MARGIN),
        drawn.1,
        size.0 + MARGIN,
        size.1
    )
}

/// Creates axes in an area with space for numbers and labels; an axis without a label takes none
/// below.
pub fn chart<'a, 'b>(area: &'a Area<'b>, x: &Axis, y: &Axis) -> Result<Chart<'a, 'b>, Failure> {
    let below = match (x.label.is_empty(), x.numbers) {
        (true, 0) => 6,
        (true, _) => BELOW / 2,
        (false, _) => BELOW,
    };
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(8))
        .margin_right(px(12))
        .x_label_area_size(px(below))
        .y_label_area_size(px(LEFT))
        .build_cartesian_2d(x.coordinate(), y.coordinate())?;
    let (x_number, y_number) = (|v: &f64| x.number(*v), |v: &f64| y.number(*v));
    chart
        .configure_mesh()
        .x_label_formatter(&x_number)
        .y_label_formatter(&y_number)
        .x_desc(x.label)
        .y_desc(y.label)
        .label_style(font(MUTED, TEXT))
        .axis_desc_style(font(INK, TEXT))
        .axis_style(line(FAINT, 1.0))
        .bold_line_style(line(GRID, 1.0))
        .light_line_style(TRANSPARENT)
        .set_all_tick_mark_size(px(3))
        .draw()?;
    Ok(chart)
}

/// Mark of a legend entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    Dot,
    Ring,
    Line,
    Bar,
    /// Translucent band behind the data.
    Band,
}

/// Opacity of a band.
const BAND_OPACITY: f64 = 0.16;

/// Returns the fill style of a band.
pub fn band(colour: RGBColor) -> ShapeStyle {
    colour.mix(BAND_OPACITY).filled()
}

/// Draws legend entries from left to right along the top of an area, and returns the area below
/// `height`.
pub fn legend<'a>(
    area: &Area<'a>,
    height: i32,
    entries: &[(&str, RGBColor, Mark)],
) -> Result<Area<'a>, Failure> {
    let mut at = LEFT;
    for &(name, colour, mark) in entries {
        let middle = (px(at + 4), px(10));
        let corners = |half: i32| [(px(at), px(10 - half)), (px(at + 8), px(10 + half))];
        match mark {
            Mark::Dot => area.draw(&Circle::new(middle, pixels(3.2), colour.filled())),
            Mark::Ring => area.draw(&Circle::new(middle, pixels(3.2), line(colour, 1.2))),
            Mark::Line => area.draw(&PathElement::new(
                vec![(px(at - 2), px(10)), (px(at + 9), px(10))],
                line(colour, 2.2),
            )),
            Mark::Bar => area.draw(&Rectangle::new(corners(4), colour.filled())),
            Mark::Band => area.draw(&Rectangle::new(corners(4), band(colour))),
        }?;
        write(area, name, (at + 13, 10), MUTED, HPos::Left)?;
        at += 27 + i32::try_from(name.chars().count()).unwrap_or_default() * 6;
    }
    Ok(area.split_vertically(px(height)).1)
}

/// Divides an area into parts one below the other, with heights in displayed pixels.
pub fn stacked<'a>(area: &Area<'a>, heights: &[i32]) -> Vec<Area<'a>> {
    let mut remaining = area.clone();
    let part = |height: &i32| {
        let (part, below) = remaining.split_vertically(px(*height));
        remaining = below;
        part
    };
    heights.iter().map(part).collect()
}

/// Writes the number of values beyond the axes at the top right of a panel.
pub fn note_beyond(panel: &Area, count: usize) -> Result<(), Failure> {
    if count == 0 {
        return Ok(());
    }
    write(panel, &format!("{count} beyond"), (WIDTH - 16, 15), WARM, HPos::Right)
}

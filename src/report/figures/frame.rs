//! Paper and axes of every figure: sizes in pixels as shown, ticks at round numbers, colours that a
//! page may exchange.

use std::io;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::sheet::Sheet;

/// Figures are drawn this much larger than they are shown: the backend keeps to whole pixels.
pub const SCALE: i32 = 4;
/// Width of a figure as shown.
pub const WIDTH: i32 = 480;
/// Text as shown.
pub const TEXT: f64 = 11.5;
/// Room on the left for what the backend sets too far out.
const MARGIN: i32 = 6;
/// Room for what stands left of an axis and below it.
pub const LEFT: i32 = 62;
pub const BELOW: i32 = 40;
/// The backend writes text smaller than asked by this.
const POINTS: f64 = 1.24;

/// Lines and text that matter; held-out poses.
pub const INK: RGBColor = RGBColor(0x1F, 0x23, 0x28);
/// Axes and their numbers.
pub const MUTED: RGBColor = RGBColor(0x59, 0x63, 0x6E);
/// What is there to compare with; fitted poses.
pub const FAINT: RGBColor = RGBColor(0xA3, 0xAD, 0xB8);
/// Grid.
pub const GRID: RGBColor = RGBColor(0xE4, 0xE8, 0xEC);
/// What to look at: the best, a law, what noise alone does.
pub const ACCENT: RGBColor = RGBColor(0x0B, 0x6B, 0xCB);
/// Its opposite: negative, failed.
pub const WARM: RGBColor = RGBColor(0xC2, 0x52, 0x1B);

/// A figure as it is drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    /// Name of its file, without the ending.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// What to see in it.
    pub caption: String,
    /// The drawing.
    pub svg: String,
    /// Its numbers, as drawn.
    pub data: Sheet,
}

impl Drawing {
    pub fn new(name: &str, title: &str, caption: impl Into<String>, svg: String) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            caption: caption.into(),
            svg,
            data: Sheet::default(),
        }
    }

    /// With its numbers.
    pub fn with(self, data: Sheet) -> Self {
        Self { data, ..self }
    }
}

/// A part of a figure.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Why drawing failed; writing to memory never does.
pub type Failure = DrawingAreaErrorKind<io::Error>;
/// Axes with what is drawn between them.
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;

/// A coordinate with numbers at chosen places.
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

/// An axis.
#[derive(Debug, Clone)]
pub struct Axis<'a> {
    /// Ends; of a logarithmic axis the logarithms to base 10.
    pub range: (f64, f64),
    /// What it shows, with its unit.
    pub label: &'a str,
    /// Whether values are given as logarithms to base 10.
    pub logarithmic: bool,
    /// About how many numbers it has; none without numbers.
    pub numbers: usize,
}

impl<'a> Axis<'a> {
    pub fn linear(range: (f64, f64), label: &'a str) -> Self {
        Self { range: widened(range), label, logarithmic: false, numbers: 6 }
    }

    /// The range in decades.
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
            let parts: &[f64] = if high - low > 2.0 { &[1.0] } else { &[1.0, 3.0] };
            let every = ((high - low) / self.numbers as f64).floor().max(1.0);
            let decades = (0..=64).map(|k| (low / every).floor() * every + f64::from(k) * every);
            let all =
                decades.flat_map(|decade| parts.iter().map(move |part| decade + part.log10()));
            return all.filter(|tick| (low - 1e-9..=high + 1e-9).contains(tick)).collect();
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

/// 10⁻⁶ for −6.
fn power_of_ten(exponent: f64) -> String {
    let raised = |digit: char| match digit {
        '-' => Some('⁻'),
        digit => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize),
    };
    format!("10{}", format!("{exponent:.0}").chars().filter_map(raised).collect::<String>())
}

/// A small number without its fraction.
fn whole(value: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=12"
    )]
    let whole = value.clamp(0.0, 12.0) as usize;
    whole
}

/// Numbers at round places of a range, about `count`, each in words.
pub fn round_numbers(range: (f64, f64), count: usize) -> Vec<(f64, String)> {
    let axis = Axis::linear(range, "").numbers(count);
    axis.ticks().into_iter().map(|tick| (tick, axis.number(tick))).collect()
}

/// 1, 2 or 5 times a power of ten, about `count` to a range.
fn step(range: f64, count: usize) -> f64 {
    let raw = range / count as f64;
    let power = 10.0_f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|part| part * power)
        .into_iter()
        .find(|step| *step >= raw)
        .unwrap_or(10.0 * power)
}

/// A range that is one, even of a single value or none.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    match (low.is_finite() && high.is_finite(), high - low) {
        (false, _) => (0.0, 1.0),
        (true, width) if width > 0.0 => (low, high),
        (true, _) => (low - 0.5 * low.abs().max(1e-9), low + 0.5 * low.abs().max(1e-9)),
    }
}

/// Smallest and largest of some values.
pub fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

/// A range with a margin of this part on both sides.
pub fn with_margin((low, high): (f64, f64), part: f64) -> (f64, f64) {
    let margin = part * (high - low);
    (low - margin, high + margin)
}

/// Pixels as drawn.
pub fn px(shown: i32) -> i32 {
    shown * SCALE
}

/// A style of lines, width as shown.
pub fn line(colour: RGBColor, width: f64) -> ShapeStyle {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
    let width = (width * f64::from(SCALE)).round() as u32;
    colour.stroke_width(width)
}

/// A length as drawn, to the nearest pixel.
pub fn pixels(shown: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "no longer than the paper")]
    let drawn = (shown * f64::from(SCALE)).round() as i32;
    drawn
}

fn font(colour: RGBColor, size: f64) -> TextStyle<'static> {
    ("sans-serif", size * f64::from(SCALE) * POINTS).into_font().color(&colour)
}

/// Without control characters, which no SVG may have.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// Writes text at a place in pixels as shown.
pub fn write(
    area: &Area,
    text: &str,
    at: (i32, i32),
    colour: RGBColor,
    side: HPos,
) -> Result<(), Failure> {
    write_sized(area, text, at, (colour, TEXT), side)
}

/// The same in letters of some size as shown.
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

/// Draws an upright line at a place as drawn, between two heights as shown.
pub fn upright(
    area: &Area,
    at: i32,
    (from, to): (i32, i32),
    colour: RGBColor,
) -> Result<(), Failure> {
    area.draw(&PathElement::new(vec![(at, px(from)), (at, px(to))], line(colour, 1.0)))
}

/// Draws a figure of some size as shown; `label` says what it is to who cannot see it.
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
    // What every element says of itself and is so anyway.
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

/// Axes in an area, with room for their numbers and labels; an axis without a label takes none
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

/// How something is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    Dot,
    Ring,
    Line,
    Bar,
    /// Pale, behind what is drawn on it.
    Band,
}

/// Opacity of a band.
const PALE: f64 = 0.16;

/// The colour of a band.
pub fn band(colour: RGBColor) -> ShapeStyle {
    colour.mix(PALE).filled()
}

/// Entries of a legend, from left to right along the top of an area, each with the mark that it
/// stands for, and the area from `height` on.
pub fn legend<'a>(
    area: &Area<'a>,
    height: i32,
    entries: &[(&str, RGBColor, Mark)],
) -> Result<Area<'a>, Failure> {
    let mut at = LEFT;
    for &(name, colour, mark) in entries {
        let middle = (px(at + 4), px(10));
        let corners = |reach: i32| [(px(at), px(10 - reach)), (px(at + 8), px(10 + reach))];
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

/// Parts of an area below each other, of these heights as shown.
pub fn stacked<'a>(area: &Area<'a>, heights: &[i32]) -> Vec<Area<'a>> {
    let mut rest = area.clone();
    let part = |height: &i32| {
        let (part, below) = rest.split_vertically(px(*height));
        rest = below;
        part
    };
    heights.iter().map(part).collect()
}

/// Writes at the top right of a panel how many values lie beyond it.
pub fn note_beyond(panel: &Area, count: usize) -> Result<(), Failure> {
    if count == 0 {
        return Ok(());
    }
    write(panel, &format!("{count} beyond"), (WIDTH - 16, 15), WARM, HPos::Right)
}

//! Shapes of SVG drawings; coordinates in displayed pixels, y downwards.

use std::fmt::Write as _;

use maud::html;

use crate::error::is_hidden;

/// Colour in hexadecimal notation. Style sheets find colours by this text and replace them in dark
/// themes.
pub type Colour = &'static str;

/// Colour of emphasised lines and text, and of held-out poses.
pub const INK: Colour = "#1F2328";
/// Colour of axes and their numbers.
pub const MUTED: Colour = "#59636E";
/// Colour of reference lines, and of fitted poses.
pub const FAINT: Colour = "#A3ADB8";
/// Colour of the grid.
pub const GRID: Colour = "#E4E8EC";
/// Accent colour, for the best result, a fitted law, or what noise alone leads to expect.
pub const ACCENT: Colour = "#0B6BCB";
/// Colour opposite to the accent, for negative values, limits and failures.
pub const WARM: Colour = "#C2521B";

/// Default text size in displayed pixels.
pub const TEXT_SIZE: f64 = 11.5;
/// Width of a character at the default text size in displayed pixels, rounded up from the mean of
/// common sans-serif fonts.
const CHARACTER_WIDTH: f64 = 6.3;
/// Margin on the left of a drawing in displayed pixels.
const LEFT_MARGIN: f64 = 6.0;

/// Fill or outline of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    colour: Colour,
    opacity: f64,
    /// Width of the outline; `None` for a filled shape.
    width: Option<f64>,
}

impl Paint {
    pub fn fill(colour: Colour) -> Self {
        Self { colour, opacity: 1.0, width: None }
    }

    pub fn line(colour: Colour, width: f64) -> Self {
        Self { width: Some(width), ..Self::fill(colour) }
    }

    /// Returns the paint with an opacity from 0 to 1, rounded to 0.02, because few distinct values
    /// keep files small.
    pub fn faded(self, opacity: f64) -> Self {
        Self { opacity: (opacity * 50.0).round() / 50.0, ..self }
    }

    /// Returns the SVG attributes of the paint, with a space before each.
    fn attributes(self) -> String {
        let paint = match self.width {
            None => format!(" fill=\"{}\"", self.colour),
            Some(width) => {
                format!(" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"", self.colour)
            }
        };
        if self.opacity < 1.0 { format!("{paint} opacity=\"{}\"", self.opacity) } else { paint }
    }
}

/// Horizontal alignment of text at a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text starts at the position.
    Start,
    /// The middle of the text is at the position.
    Middle,
    /// The text ends at the position.
    End,
}

/// SVG elements of a drawing under construction.
#[derive(Debug, Default)]
pub struct Svg(String);

impl Svg {
    pub fn circle(&mut self, (x, y): (f64, f64), radius: f64, paint: Paint, tag: &str) {
        let (x, y, paint) = (rounded(x), rounded(y), paint.attributes());
        // Writing to a String cannot fail.
        let _ = write!(self.0, "<circle{tag} cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"{paint}/>");
    }

    pub fn rectangle(&mut self, [a, b]: [(f64, f64); 2], paint: Paint, tag: &str) {
        let (x, y) = (rounded(a.0.min(b.0)), rounded(a.1.min(b.1)));
        let (width, height) = (rounded((a.0 - b.0).abs()), rounded((a.1 - b.1).abs()));
        let paint = paint.attributes();
        let _ = write!(
            self.0,
            "<rect{tag} x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"{paint}/>"
        );
    }

    pub fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>, paint: Paint) {
        let points = points.into_iter().map(|(x, y)| format!("{},{}", rounded(x), rounded(y)));
        let points = points.collect::<Vec<_>>().join(" ");
        let _ = write!(self.0, "<polyline points=\"{points}\"{}/>", paint.attributes());
    }

    /// Writes text with a colour and a size at a position, vertically centred there.
    pub fn text(
        &mut self,
        text: &str,
        (x, y): (f64, f64),
        (colour, size): (Colour, f64),
        anchor: Anchor,
    ) {
        let size = if (size - TEXT_SIZE).abs() < 1e-9 {
            String::new()
        } else {
            format!(" font-size=\"{}\"", rounded(size))
        };
        self.write(
            text,
            &format!("x=\"{}\" y=\"{}\"{size}", rounded(x), rounded(y)),
            colour,
            anchor,
        );
    }

    /// Writes text that runs upwards, centred at a position.
    pub fn text_upwards(&mut self, text: &str, (x, y): (f64, f64), colour: Colour) {
        let place = format!("transform=\"translate({},{}) rotate(-90)\"", rounded(x), rounded(y));
        self.write(text, &place, colour, Anchor::Middle);
    }

    /// Writes a text element; `place` are the attributes that position it.
    fn write(&mut self, text: &str, place: &str, colour: Colour, anchor: Anchor) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let text = escaped(text);
        let _ =
            write!(self.0, "<text {place} dy=\"0.35em\"{anchor} fill=\"{colour}\">{text}</text>");
    }

    /// Returns the drawing as SVG text with a width (without the left margin) and a height; `label`
    /// describes it for screen readers.
    pub fn finish(self, (width, height): (f64, f64), label: &str) -> String {
        let (width, label) = (width + LEFT_MARGIN, escaped(label));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-{LEFT_MARGIN} 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{label}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"{TEXT_SIZE}\">{}</svg>",
            self.0
        )
    }
}

/// Estimates the width of a text at the default size in displayed pixels.
pub fn text_width(text: &str) -> f64 {
    CHARACTER_WIDTH * text.chars().count() as f64
}

/// Rounds a coordinate to a tenth of a pixel.
fn rounded(value: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (value * 10.0).round() / 10.0 + 0.0
}

/// Escapes text for SVG, and removes control characters and other invisible characters.
fn escaped(text: &str) -> String {
    let printable: String = text.chars().filter(|&c| !is_hidden(c)).collect();
    html! { (printable) }.into_string()
}

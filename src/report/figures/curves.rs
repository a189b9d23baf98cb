//! Line charts, for example of errors against the number of poses or of evidence after each row.

use super::chart::At;
use super::prelude::*;

/// Number of points of a joined curve up to which they are also drawn as dots.
const MAX_DOTS: usize = 60;
/// Maximum number of dots that are drawn of a curve without a line.
const MAX_SCATTERED_DOTS: usize = 600;
/// Smallest value that a logarithmic axis shows; smaller values are drawn there.
const MIN_LOGARITHMIC_VALUE: f64 = 1e-12;
/// Height above the lower edge of the panel from which on the name of a level may stand below its
/// line, in displayed pixels.
const MIN_NAME_HEIGHT: f64 = 18.0;
/// Height of the panel in displayed pixels.
const PANEL_HEIGHT: f64 = 210.0;

/// Named points of a figure, joined by a line or scattered.
#[derive(Debug, Clone)]
pub struct Curve<'a> {
    pub name: &'a str,
    pub colour: Colour,
    pub points: Vec<At>,
    /// True if a line joins the points.
    pub is_joined: bool,
}

impl<'a> Curve<'a> {
    pub fn new(name: &'a str, colour: Colour, points: impl IntoIterator<Item = At>) -> Self {
        let is_finite = |at: &At| at.0.is_finite() && at.1.is_finite();
        let points = points.into_iter().filter(is_finite).collect();
        Self { name, colour, points, is_joined: true }
    }

    /// Returns the curve as dots without a line between them.
    pub fn scattered(self) -> Self {
        Self { is_joined: false, ..self }
    }
}

/// Figure of curves in one panel.
#[derive(Debug, Clone, Default)]
pub struct Series<'a> {
    /// File name and title.
    pub names: (&'a str, &'a str),
    pub caption: String,
    /// Labels of the horizontal and the vertical axis, with units.
    pub labels: (&'a str, &'a str),
    /// True if both axes are logarithmic.
    pub is_logarithmic: bool,
    pub curves: Vec<Curve<'a>>,
    /// Names and ordinates of horizontal lines, such as a tolerance.
    pub levels: Vec<(String, f64)>,
    /// True if the legend names the horizontal lines; otherwise their names are at the lines.
    pub are_levels_in_legend: bool,
    /// Names and abscissas of vertical lines, for example the first row of each file.
    pub starts: Vec<(String, f64)>,
}

impl Series<'_> {
    /// Draws the curves; `None` if no curve has two points.
    pub fn drawing(&self) -> Option<Drawing> {
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        if self.curves.iter().all(|curve| curve.points.len() < 2) {
            return None;
        }
        let up =
            |y: f64| if self.is_logarithmic { y.max(MIN_LOGARITHMIC_VALUE).log10() } else { y };
        let levels = self.levels.iter().map(|level| level.1);
        let (low, high) = range(points().map(|at| at.1).chain(levels).map(up));
        let from_zero = !self.is_logarithmic && low >= 0.0;
        let (below, above) = with_margin((low, high), 0.08);
        let ends = (if from_zero { 0.0 } else { below }, above);
        let y = if self.is_logarithmic {
            Axis::logarithmic(ends, self.labels.1, 6)
        } else {
            Axis::linear(ends, self.labels.1, 5)
        };
        let across = with_margin(range(points().map(|at| up(at.0))), 0.03);
        let x = if self.is_logarithmic {
            Axis::logarithmic(across, self.labels.0, 8)
        } else {
            // An axis of counts has no ticks between whole numbers.
            let is_count = points().all(|at| at.0.fract() == 0.0);
            let fits = |labels: &usize| !is_count || *labels as f64 <= across.1 - across.0;
            Axis::linear(across, self.labels.0, (1..=7).rev().find(fits).unwrap_or(1))
        };
        let named = |text: &String, at: At, shift: (f64, f64), anchor: Anchor| Shape::Text {
            at,
            shift,
            text: text.clone(),
            colour: MUTED,
            anchor,
        };
        // The name of a level is on the side away from the ends of the curves, and not on the
        // numbers below the panel.
        let is_below = |level: f64| {
            let last_points = self.curves.iter().filter(|curve| curve.is_joined);
            let mut last_points = last_points.filter_map(|curve| curve.points.last());
            let above_edge = PANEL_HEIGHT * (level - ends.0) / (ends.1 - ends.0);
            above_edge > MIN_NAME_HEIGHT && last_points.any(|at| up(at.1) > level)
        };
        let levels = self.levels.iter().flat_map(|(text, level)| {
            let level = up(*level);
            let shift = if is_below(level) { 9.0 } else { -8.0 };
            let line = Shape::line([(across.0, level), (across.1, level)], Paint::line(WARM, 1.2));
            let name = named(text, (across.1, level), (-4.0, shift), Anchor::End);
            [Some(line), (!self.are_levels_in_legend).then_some(name)].into_iter().flatten()
        });
        let starts = self.starts.iter().flat_map(|(text, start)| {
            let line = Shape::line([(*start, ends.0), (*start, ends.1)], Paint::line(FAINT, 1.0));
            [line, named(text, (*start, ends.1), (4.0, 8.0), Anchor::Start)]
        });
        let shapes = self.curves.iter().flat_map(|curve| {
            let at = move |at: &At| if self.is_logarithmic { (up(at.0), up(at.1)) } else { *at };
            let is_dotted = !curve.is_joined || curve.points.len() <= MAX_DOTS;
            let line = curve
                .is_joined
                .then(|| Shape::line(curve.points.iter().map(at), Paint::line(curve.colour, 1.8)));
            let dots = curve
                .drawn_points()
                .into_iter()
                .filter(move |_| is_dotted)
                .map(move |point| Shape::dot(at(point), 2.4, Paint::fill(curve.colour), None));
            line.into_iter().chain(dots)
        });
        let panel = Panel::new(PANEL_HEIGHT, x, y).with(starts).with(levels).with(shapes);
        let mark = |curve: &Curve| if curve.is_joined { Mark::Line } else { Mark::Dot };
        let curves = self.curves.iter().map(|curve| (curve.name, curve.colour, mark(curve)));
        let levels = self.levels.iter().filter(|_| self.are_levels_in_legend);
        let levels = levels.map(|(name, _)| (name.as_str(), WARM, Mark::Line));
        let legend: Vec<_> = curves.chain(levels).collect();
        let rows = self.curves.iter().flat_map(|curve| {
            let row = |at: &At| vec![curve.name.to_owned(), fixed(at.0, 6), fixed(at.1, 6)];
            curve.points.iter().map(row)
        });
        let data = sheet(["curve", self.labels.0, self.labels.1], rows);
        let drawn = self.curves.iter().map(|curve| curve.drawn_points().len()).sum();
        let caption = format!("{}{}", self.caption, thinning_note(drawn, points().count()));
        let svg = chart(self.names.1, &legend, &[panel]);
        Some(Drawing::new(self.names, caption, svg, data))
    }
}

impl Curve<'_> {
    /// Returns the points that are drawn: all points of a line, a sample of many scattered ones.
    fn drawn_points(&self) -> Vec<&At> {
        let every: Vec<usize> = (0..self.points.len()).collect();
        let kept = if self.is_joined {
            every
        } else {
            sample(&every, MAX_SCATTERED_DOTS, |k| self.points[k].1)
        };
        kept.into_iter().map(|k| &self.points[k]).collect()
    }
}

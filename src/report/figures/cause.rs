//! The residual against what drives it, with the law that was fitted.

use plotters::prelude::*;

use super::frame::{
    ACCENT, Axis, Drawing, FAINT, INK, WIDTH, chart, every, figure, legend, line, px, radius, range, thinned,
    with_margin,
};
use crate::quantity::Unit;
use crate::report::plot_data::{Abscissa, Cause, Ordinate, Point};

/// Poses that are drawn at most.
const MOST: usize = 500;
const HEIGHT: i32 = 300;

/// Of an effect that was found, with its number.
pub fn effect(own: &Cause, number: usize) -> Drawing {
    cause(own, format!("effect-{number}"), "Found by the loop; the line is the fitted law.")
}

/// Of structure that no effect explains.
pub fn trend(own: &Cause) -> Drawing {
    let lead = "No effect explains this; the line is the empirical correction. Its mean over this range is taken off line and \
                dots: a constant is what base and geometry take up.";
    cause(own, "unexplained".to_owned(), lead)
}

/// Each pose's own measurement of it, and the fitted law as a line.
fn cause(cause: &Cause, name: String, lead: &str) -> Drawing {
    let finite = |point: &&Point| point.x.is_finite() && point.y.is_finite();
    let all: Vec<&Point> = cause.points.iter().filter(finite).collect();
    let step = every(all.len(), MOST);
    let shown: Vec<&Point> = all.into_iter().step_by(step).collect();
    let across = Shown::abscissa(cause.abscissa, range(cause.curve.iter().map(|at| at.0)));
    let heights = range(shown.iter().map(|point| point.y).chain(cause.curve.iter().map(|at| at.1)));
    let up = Shown::ordinate(&cause.ordinate, heights);
    let at = |x: f64, y: f64| (x * across.factor, y * up.factor);
    let points: Vec<((f64, f64), bool)> = shown.iter().map(|point| (at(point.x, point.y), point.held_out)).collect();
    let curve: Vec<(f64, f64)> = cause.curve.iter().map(|&(x, y)| at(x, y)).collect();
    let x = with_margin(range(points.iter().map(|(at, _)| at.0).chain(curve.iter().map(|at| at.0))), 0.04);
    let y = with_margin((heights.0 * up.factor, heights.1 * up.factor), 0.06);
    let svg = figure((WIDTH, HEIGHT), &cause.title, |area| {
        let held_out = points.iter().any(|(_, held_out)| *held_out);
        let law = if matches!(cause.ordinate, Ordinate::Place { .. }) { "correction" } else { "fitted law" };
        let entries = [("fitted pose", FAINT, true), ("held-out pose", INK, true), (law, ACCENT, true)];
        let kept: Vec<_> = entries.into_iter().filter(|(name, ..)| held_out || *name != "held-out pose").collect();
        legend(area, &kept)?;
        let (_, body) = area.split_vertically(px(20));
        let mut chart = chart(&body, &Axis::linear(x, &across.label), &Axis::linear(y, &up.label))?;
        if y.0 < 0.0 && y.1 > 0.0 {
            chart.draw_series([PathElement::new(vec![(x.0, 0.0), (x.1, 0.0)], line(FAINT, 1.0))])?;
        }
        for (only, colour) in [(false, FAINT), (true, INK)] {
            let dots = points.iter().filter(|(_, held_out)| *held_out == only);
            chart.draw_series(dots.map(|(at, _)| Circle::new(*at, radius(2.2), colour.filled())))?;
        }
        chart.draw_series(LineSeries::new(curve.iter().copied(), line(ACCENT, 2.2)))?;
        Ok(())
    });
    Drawing { name, title: capital(&cause.title), caption: format!("{lead} {}{}", reading(cause), thinned(step)), svg }
}

/// With a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// What a point is.
fn reading(cause: &Cause) -> &'static str {
    match cause.ordinate {
        Ordinate::Joint { .. } | Ordinate::Place { .. } => {
            "Each dot is the error of this coordinate as one pose alone measures it, all other parameters as fitted. Poses that hardly feel the coordinate are left out."
        }
        Ordinate::Displacement => {
            "Each dot is the residual of one pose along the direction in which the effect moves it, all other parameters as \
             fitted."
        }
        Ordinate::Curvature(_) | Ordinate::Strain(_) | Ordinate::Mass => {
            "Each dot is the effect's size as one pose alone measures it, all other parameters as fitted. \
             Poses that hardly feel it are left out."
        }
    }
}

/// A quantity as an axis shows it.
struct Shown {
    factor: f64,
    label: String,
}

impl Shown {
    fn abscissa(abscissa: Abscissa, range: (f64, f64)) -> Self {
        let of = |factor: f64, label: String| Self { factor, label };
        match abscissa {
            Abscissa::Command { joint, slides: false } => {
                of(180.0 / std::f64::consts::PI, format!("command of joint {joint}, q{joint} [°]"))
            }
            Abscissa::Command { joint, slides: true } => of(1e3, format!("command of joint {joint}, q{joint} [mm]")),
            Abscissa::Approach(joint) => of(1.0, format!("side from which joint {joint} came [−1 … +1]")),
            Abscissa::Moment(joint) => of(1.0, format!("moment about joint {joint} [N·m]")),
            Abscissa::Temperature => of(1.0, "temperature [°C]".to_owned()),
            Abscissa::Elapsed if range.1 > 7200.0 => of(1.0 / 3600.0, "time since the first pose [h]".to_owned()),
            Abscissa::Elapsed => of(1.0, "time since the first pose [s]".to_owned()),
            Abscissa::Payload => of(1.0, "payload [kg]".to_owned()),
            Abscissa::Hoist => of(1.0, "hoist force [N]".to_owned()),
            Abscissa::Displacement => of(1e3, "displacement by the law [mm]".to_owned()),
        }
    }

    fn ordinate(ordinate: &Ordinate, (low, high): (f64, f64)) -> Self {
        let small = |what: &str, unit: &str| {
            if low.abs().max(high.abs()) < 1e-3 {
                Self { factor: 1e6, label: format!("{what} [µ{unit}]") }
            } else {
                Self { factor: 1e3, label: format!("{what} [m{unit}]") }
            }
        };
        match ordinate {
            Ordinate::Joint { joint, unit: Unit::Length } => {
                Self { factor: 1e3, label: format!("error of joint {joint} [mm]") }
            }
            Ordinate::Joint { joint, .. } => small(&format!("error of joint {joint}"), "rad"),
            Ordinate::Place { place, unit: Unit::Length } => {
                Self { factor: 1e3, label: format!("error of {place} [mm]") }
            }
            Ordinate::Place { place, .. } => small(&format!("error of {place}"), "rad"),
            Ordinate::Curvature(link) => small(&format!("curvature of link {link}"), "rad/m"),
            Ordinate::Strain(link) => Self { factor: 1e6, label: format!("strain of link {link} [10⁻⁶]") },
            Ordinate::Mass => Self { factor: 1.0, label: "missing mass [kg]".to_owned() },
            Ordinate::Displacement => Self { factor: 1e3, label: "displacement, measured [mm]".to_owned() },
        }
    }
}

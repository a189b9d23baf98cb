//! Figure data of structure without a known cause.

use super::figure::{Cause, Point, Quantity};
use super::view::COORDINATE_CAPTION;
use crate::measurement::Split;
use crate::numeric::range;
use crate::problem::Problem;
use crate::residual_tests::Covariate;
use crate::results::plots::arm::MIN_LEVER;
use crate::select::{PartialResidual, Unexplained};

/// Returns the figure data of the empirical correction of unexplained structure, whose mean over
/// the drawn range is subtracted. `None` unless the correction is a function of one covariate at
/// one coordinate.
pub fn unexplained(structure: &Unexplained, problem: &Problem, split: &Split) -> Option<Cause> {
    let correction = structure.correction.as_ref()?.curve.as_ref()?;
    let mut curve: Vec<(f64, f64)> =
        correction.points.iter().map(|point| (point.covariate, point.correction)).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let trapezoid = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) * 0.5 * (pair[0].1 + pair[1].1);
    let width = curve.last()?.0 - curve.first()?.0;
    let area: f64 = curve.windows(2).map(trapezoid).sum();
    let mean = if width > 0.0 { area / width } else { 0.0 };
    for (_, y) in &mut curve {
        *y -= mean;
    }
    let across = match correction.covariate {
        Covariate::Temperature => Quantity::temperature(),
        Covariate::Time => Quantity::elapsed(range(curve.iter().map(|at| at.0)).1),
        Covariate::Row => Quantity::new("row", 1.0),
        Covariate::Payload => Quantity::new("payload [kg]", 1.0),
        Covariate::Hoist => Quantity::new("hoist force [N]", 1.0),
        Covariate::Command(joint) => Quantity::command(problem, joint + 1),
        Covariate::Declared(ref name) => Quantity::new(&**name, 1.0),
        _ => return None,
    };
    let longest = correction.points.iter().map(|point| point.lever).fold(0.0, f64::max);
    let informative =
        correction.points.iter().enumerate().filter(|(_, point)| point.lever > MIN_LEVER * longest);
    let point = |(k, point): (usize, &PartialResidual)| Point {
        x: point.covariate,
        y: point.value - mean,
        held_out: false,
        row: split.identification.get(k).copied(),
    };
    let points: Vec<Point> = informative.map(point).collect();
    let site = structure.site?;
    let up = Quantity::error(&site.to_string(), correction.unit);
    let title = format!("{site}: structure without a known cause");
    Some(Cause { title, found: None, across, up, points, curve, reading: COORDINATE_CAPTION })
}

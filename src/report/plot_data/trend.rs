//! Structure without a cause: the partial residuals at its place against what it depends on, and its correction.

use super::cause::{Abscissa, Cause, Ordinate, Point};
use super::joint::LEAST_LEVER;
use crate::diagnose::{Covariate, Unexplained};
use crate::problem::{JointKind, Problem};

/// The figure of a correction, less its mean; none where the correction is one of the order of the rows.
pub(super) fn of(left: &Unexplained, problem: &Problem) -> Option<Cause> {
    let correction = left.correction.as_ref()?;
    let abscissa = abscissa(correction.covariate, problem)?;
    let mean = mean(&correction.curve);
    let most = correction.points.iter().map(|point| point.lever).fold(0.0, f64::max);
    let telling = correction.points.iter().filter(|point| point.lever > LEAST_LEVER * most);
    let points = telling.map(|point| Point { x: point.covariate, y: point.value - mean, held_out: false }).collect();
    Some(Cause {
        title: format!("{}: structure without a known cause", left.place),
        abscissa,
        ordinate: Ordinate::Place { place: left.place.to_string(), unit: correction.unit },
        points,
        curve: correction.curve.iter().map(|&(x, y)| (x, y - mean)).collect(),
    })
}

fn abscissa(covariate: Covariate, problem: &Problem) -> Option<Abscissa> {
    match covariate {
        Covariate::Temperature => Some(Abscissa::Temperature),
        Covariate::Time => Some(Abscissa::Elapsed),
        Covariate::Payload => Some(Abscissa::Payload),
        Covariate::Hoist => Some(Abscissa::Hoist),
        Covariate::Command(joint) => {
            let slides = problem.joints.get(joint)?.kind == JointKind::Prismatic;
            Some(Abscissa::Command { joint: joint + 1, slides })
        }
        _ => None,
    }
}

/// Mean height of a curve over its range.
fn mean(curve: &[(f64, f64)]) -> f64 {
    let trapezoids: f64 = curve.windows(2).map(|pair| (pair[1].0 - pair[0].0) * 0.5 * (pair[0].1 + pair[1].1)).sum();
    let width = curve.last().zip(curve.first()).map_or(0.0, |(last, first)| last.0 - first.0);
    if width > 0.0 { trapezoids / width } else { 0.0 }
}

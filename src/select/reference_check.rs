//! Check of an effect of the instrument against readings of fixed points, which were not fitted.
//!
//! If an instrument moves by d f(t) and rotates by ω f(t), a fixed point near p is read at z = p +
//! (d + ω × p) f(t) + noise of σ. The true position of the point is unknown. With θ = (d, ω), or d
//! alone, and B = [1 −p×], the readings of a point relative to their mean contain
//!
//! v = Bᵀ Σ (f − f̄)(z − z̄)/σ²,   M = BᵀB Σ (f − f̄)²/σ²,
//!
//! summed over the points: ln p(readings | θ) = θᵀv − θᵀMθ/2, up to a constant. The estimate θ̂ of
//! the loop with its covariance C = L Lᵀ is compared with no motion. With g = Lᵀ(v − M θ̂) and K =
//! 1 + LᵀM L, twice the logarithm of the ratio of both marginal likelihoods is
//!
//! 2 θ̂ᵀv − θ̂ᵀM θ̂ + gᵀK⁻¹g − ln det K.
//!
//! The readings decide if the odds are 100 to 1 either way.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Vector3};

use super::data::Data;
use super::fitted::Fitted;
use crate::laws::Quantity;
use crate::measurement::NestReading;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, PoseView, Problem};

/// Twice ln of the odds of 100 to 1, at which readings confirm or contradict an effect.
const MIN_TWICE_LN_ODDS: f64 = 9.21;

/// Outcome of a reference check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceVerdict {
    /// The readings are at least 100 times as probable with the motion that the effect describes as
    /// without it.
    Corroborated,
    /// The readings are at least 100 times as probable without that motion as with it.
    Contradicted,
}

/// Check of an effect against data that were not fitted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReferenceCheck {
    /// Description of the data that were not fitted and judge the effect, such as the reference
    /// readings.
    pub data: String,
    /// Outcome of the check.
    pub verdict: ReferenceVerdict,
}

/// Reading of a fixed point.
struct Reading {
    /// Measured position z of the point, measuring frame \[m\].
    seen: Vector3<f64>,
    /// Value f(t) of the motion's time function at the reading; the motion is (d, ω) f(t).
    moved: f64,
    /// Weight 1/σ² of a measured coordinate [1/m²].
    weight: f64,
}

/// Returns v and M of one point for 3 parameters (d) or 6 (d and ω); see the module's equations.
fn point_information(readings: &[Reading], parameters: usize) -> (DVector<f64>, DMatrix<f64>) {
    let total_weight: f64 = readings.iter().map(|reading| reading.weight).sum();
    let place = readings.iter().map(|reading| reading.seen * reading.weight).sum::<Vector3<f64>>()
        / total_weight;
    let moved =
        readings.iter().map(|reading| reading.moved * reading.weight).sum::<f64>() / total_weight;
    let vector_and_information = |reading: &Reading| {
        let f = reading.moved - moved;
        ((reading.seen - place) * (reading.weight * f), reading.weight * f * f)
    };
    let (sum, information) = readings
        .iter()
        .map(vector_and_information)
        .fold((Vector3::zeros(), 0.0), |a: (Vector3<f64>, f64), b| (a.0 + b.0, a.1 + b.1));
    let turned = -place.cross_matrix();
    let moves =
        DMatrix::from_fn(
            3,
            parameters,
            |i, j| if j < 3 { f64::from(i == j) } else { turned[(i, j - 3)] },
        );
    (moves.tr_mul(&sum), moves.tr_mul(&moves) * information)
}

/// Returns twice the log odds of θ ∼ N(θ̂, C) against θ = 0, with θ̂ = `found`, C = `spread` and
/// the v and M of all points. `None` if no point was read at different f.
fn twice_ln_odds(
    found: &DVector<f64>,
    spread: &DMatrix<f64>,
    (vector, information): (&DVector<f64>, &DMatrix<f64>),
) -> Option<f64> {
    if information.trace() <= 0.0 {
        return None;
    }
    // If some parameters are almost certain, C may be singular to rounding.
    let eigen = spread.clone().symmetric_eigen();
    let mut root = eigen.eigenvectors;
    root.column_iter_mut()
        .zip(&eigen.eigenvalues)
        .for_each(|(mut column, value)| column *= value.max(0.0).sqrt());
    let predicted_vector = information * found;
    let whitened_difference = root.tr_mul(&(vector - &predicted_vector));
    let inner = (root.tr_mul(&(information * &root))
        + DMatrix::identity(root.ncols(), root.ncols()))
    .cholesky()?;
    let ln_determinant =
        2.0 * inner.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>();
    Some(
        2.0 * found.dot(vector) - found.dot(&predicted_vector)
            + whitened_difference.dot(&inner.solve(&whitened_difference))
            - ln_determinant,
    )
}

/// Returns the function of time f(t) by which an effect moves the instrument; `None` for other
/// effects.
fn time_function(effect: &Effect, problem: &Problem) -> Option<Regressor> {
    let mut terms = effect.terms(problem).into_iter();
    let first = terms.next()?;
    let is_of_instrument = |site: ParameterSite| {
        matches!(site, ParameterSite::Shift { .. } | ParameterSite::Turn { .. })
    };
    let quantities = first.regressor.quantities();
    let follows_time =
        quantities.iter().all(|quantity| matches!(quantity, Quantity::Elapsed | Quantity::Time));
    let is_one = is_of_instrument(first.site)
        && terms.all(|term| is_of_instrument(term.site) && term.regressor == first.regressor);
    (is_one && follows_time && !quantities.is_empty()).then_some(first.regressor)
}

/// Checks an effect of the instrument against readings of fixed points. Returns `None` for other
/// effects, without the times needed, and if the odds are below 100 to 1 either way.
pub(super) fn reference_check(
    fitted: &Fitted,
    data: &Data,
    effect: &Effect,
) -> Option<ReferenceCheck> {
    let measurements = data.measurements;
    let course = time_function(effect, &fitted.problem)?;
    let starts = measurements.start_times();
    let moves = |reading: &NestReading| -> Option<f64> {
        // If row numbers replace times, the reading is half way between the rows before and after
        // it.
        let time = if measurements.time_measured {
            reading.time?
        } else {
            measurements.time.first()? + reading.after as f64 - 0.5
        };
        let pose = PoseView::from_configuration(&[]);
        let start = starts.of_session(&reading.session).unwrap_or(starts.first);
        Some(course.value(&PoseView { time, elapsed: time - start, ..pose }))
    };
    let places = fitted.parameters_of(effect);
    let count = places.len();
    if !matches!(count, 3 | 6) {
        return None;
    }
    let found = DVector::from_fn(count, |i, _| fitted.found.x[places[i]]);
    let spread = DMatrix::from_fn(count, count, |i, j| {
        fitted.found.covariance.entry(places[i], places[j]).unwrap_or(0.0)
    });
    // The instrument is set up anew in each session, so a point has another position there.
    let mut points: BTreeMap<(&str, &str), Vec<Reading>> = BTreeMap::new();
    for reading in &measurements.nests {
        let weight = reading.sigma.unwrap_or(fitted.sigma).powi(-2);
        let reading_of_point = Reading { seen: reading.position, moved: moves(reading)?, weight };
        points.entry((&reading.session, &reading.name)).or_default().push(reading_of_point);
    }
    let nothing = (DVector::zeros(count), DMatrix::zeros(count, count));
    let (vector, information) = points
        .values()
        .map(|readings| point_information(readings, count))
        .fold(nothing, |a, b| (a.0 + b.0, a.1 + b.1));
    let gain = twice_ln_odds(&found, &spread, (&vector, &information))?;
    let verdict = if gain > MIN_TWICE_LN_ODDS {
        ReferenceVerdict::Corroborated
    } else if gain < -MIN_TWICE_LN_ODDS {
        ReferenceVerdict::Contradicted
    } else {
        return None;
    };
    let names: BTreeSet<&str> = points.keys().map(|(_, name)| *name).collect();
    let names: Vec<&str> = names.into_iter().collect();
    Some(ReferenceCheck {
        data: format!("{} readings of {}", measurements.nests.len(), names.join(", ")),
        verdict,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_weighed_with_what_was_found_and_its_error() {
        let found = DVector::from_column_slice(&[1.0, 0.0, 0.0]);
        let identity = DMatrix::<f64>::identity(3, 3);
        let (sure, unsure) = (&identity * 1e-8, &identity * 0.09);
        let odds = |spread: &DMatrix<f64>, part: f64| {
            let information = &identity * 1e4;
            super::twice_ln_odds(&found, spread, (&(&found * part * 1e4), &information)).unwrap()
        };
        // The readings show less than half of an estimate that has a standard error of 0.3. They
        // still corroborate the motion, because they are precise.
        assert!(odds(&unsure, 0.45) > 100.0);
        assert!(odds(&sure, 0.45) < -100.0);
        assert!((odds(&sure, 1.0) - 1e4).abs() < 1.0);
        // The expected value is twice ln of N(0; 1, 0.09 + 1e-4) over N(0; 0, 1e-4), for each
        // coordinate.
        let expected = -1.0 / 0.0901 - 3.0 * (901.0_f64).ln();
        assert!((odds(&unsure, 0.0) - expected).abs() < 1e-6);
        assert_eq!(
            super::twice_ln_odds(&found, &unsure, (&DVector::zeros(3), &DMatrix::zeros(3, 3))),
            None
        );
    }

    #[test]
    fn points_that_turn_about_the_origin_tell_a_turn_from_a_shift() {
        let places = [
            Vector3::new(2.0, 0.5, -1.0),
            Vector3::new(-1.0, 3.0, 0.2),
            Vector3::new(0.5, -2.0, 1.5),
        ];
        let (moved, turned) = (Vector3::new(1e-3, -2e-3, 5e-4), Vector3::new(4e-4, 1e-4, -3e-4));
        let readings_of = |turn: f64| {
            let of = |place: &Vector3<f64>| {
                let at = |f: f64| {
                    let seen = place + (moved + turned.cross(place) * turn) * f;
                    Reading { seen, moved: f, weight: 1e12 }
                };
                point_information(&[at(0.0), at(1.0), at(1.0)], 6)
            };
            let sum = |a: (DVector<f64>, DMatrix<f64>), b: (DVector<f64>, DMatrix<f64>)| {
                (a.0 + b.0, a.1 + b.1)
            };
            places.iter().map(of).reduce(sum).unwrap()
        };
        let found = DVector::from_iterator(6, moved.iter().chain(&turned).copied());
        let spread = DMatrix::identity(6, 6) * 1e-12;
        let odds = |turn: f64| {
            let (vector, information) = readings_of(turn);
            super::twice_ln_odds(&found, &spread, (&vector, &information)).unwrap()
        };
        // The measured places are off by the motion itself, which hardly changes the estimate.
        let (vector, information) = readings_of(1.0);
        let read = information.cholesky().unwrap().solve(&vector);
        assert!((read - &found).norm() < 1e-3 * found.norm());
        assert!(odds(1.0) > 1e5 && odds(-2.0) < odds(1.0) - 1e4, "{} {}", odds(1.0), odds(-2.0));
    }
}

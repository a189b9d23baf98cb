//! What data that took no part in the fit say of an effect: fixed points that were measured again.
//!
//! An instrument that moved by d f(t) moves a fixed point with it: z = p + d f(t) + noise of σ, its true place p unknown. All readings
//! together say d = r ± 1/√b of each coordinate, with r = a/b, a = Σ (f − f̄)(z − z̄)/σ² and b = Σ (f − f̄)²/σ². What the loop found, d̂ with its
//! covariance C, is held against no motion by twice the logarithm of the ratio of both marginal likelihoods,
//!
//! b |r|² − (r − d̂)ᵀ (C + 1/b)⁻¹ (r − d̂) − ln det(1 + b C),
//!
//! which decides where the odds are 100 to 1 either way.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector3};

use super::data::Data;
use super::fitted::Fitted;
use crate::measurement::NestReading;
use crate::problem::Effect;

/// Twice the logarithm of the odds at which readings decide: 100 to 1.
const DECIDED: f64 = 9.21;

/// What it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WitnessVerdict {
    /// It moved as the effect has it.
    Corroborated,
    /// It did not.
    Contradicted,
}

/// A witness of an effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Witness {
    /// Which data.
    pub data: String,
    /// What they say.
    pub says: WitnessVerdict,
}

/// A reading of a fixed point.
struct Reading {
    /// z \[m\].
    seen: Vector3<f64>,
    /// f.
    moved: f64,
    /// 1/σ² of a coordinate [1/m²].
    weight: f64,
}

/// Σ w (f − f̄)(z − z̄) and b = Σ w (f − f̄)² of one point, its own place taken out.
fn told(readings: &[Reading]) -> (Vector3<f64>, f64) {
    let all: f64 = readings.iter().map(|own| own.weight).sum();
    let place = readings.iter().map(|own| own.seen * own.weight).sum::<Vector3<f64>>() / all;
    let moved = readings.iter().map(|own| own.moved * own.weight).sum::<f64>() / all;
    let one = |own: &Reading| {
        let f = own.moved - moved;
        ((own.seen - place) * (own.weight * f), own.weight * f * f)
    };
    readings.iter().map(one).fold((Vector3::zeros(), 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// Twice the logarithm of the odds of d ∼ N(d̂, C) against d = 0; `None` where no point was read at different f.
fn odds(found: &Vector3<f64>, spread: &Matrix3<f64>, told: &Vector3<f64>, certainty: f64) -> Option<f64> {
    if certainty <= 0.0 {
        return None;
    }
    let read = told / certainty;
    let expected = (spread * certainty + Matrix3::identity()).cholesky()?;
    let off = read - found;
    Some(certainty * (read.norm_squared() - off.dot(&expected.solve(&off))) - expected.determinant().ln())
}

/// What readings of fixed points say of an effect of the instrument; `None` for other effects, and where they do not decide.
pub(super) fn witness(fitted: &Fitted, data: &Data, effect: &Effect) -> Option<Witness> {
    let measurements = data.measurements;
    let first = measurements.time.iter().copied().fold(f64::INFINITY, f64::min);
    let moves = |reading: &NestReading| -> Option<f64> {
        // Where rows are the time, a reading lies between those before and behind it.
        let time = if measurements.time_measured {
            reading.time?
        } else {
            measurements.time.first()? + reading.after as f64 - 0.5
        };
        match effect {
            Effect::StationShift { at_time } => Some(f64::from(time >= *at_time)),
            Effect::TrackerDrift => Some(time - first),
            Effect::TrackerSettling { time_constant } => Some(1.0 - ((first - time) / time_constant).exp()),
            _ => None,
        }
    };
    let parameters = fitted.parameters_of(effect);
    let [x, y, z] = parameters.as_slice() else { return None };
    let strength = Vector3::new(fitted.found.x[*x], fitted.found.x[*y], fitted.found.x[*z]);
    let places = [*x, *y, *z];
    let spread = Matrix3::from_fn(|i, j| fitted.found.covariance.of(places[i], places[j]).unwrap_or(0.0));
    // A session has a place of its own for the instrument.
    let mut points: BTreeMap<(&str, &str), Vec<Reading>> = BTreeMap::new();
    for reading in &measurements.nests {
        let weight = reading.sigma.unwrap_or(fitted.sigma).powi(-2);
        let own = Reading { seen: reading.position, moved: moves(reading)?, weight };
        points.entry((&reading.session, &reading.name)).or_default().push(own);
    }
    let (told, certainty) =
        points.values().map(|all| told(all)).fold((Vector3::zeros(), 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    let gain = odds(&strength, &spread, &told, certainty)?;
    let says = if gain > DECIDED {
        WitnessVerdict::Corroborated
    } else if gain < -DECIDED {
        WitnessVerdict::Contradicted
    } else {
        return None;
    };
    let names: BTreeSet<&str> = points.keys().map(|(_, name)| *name).collect();
    let names: Vec<&str> = names.into_iter().collect();
    Some(Witness { data: format!("{} readings of {}", measurements.nests.len(), names.join(", ")), says })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_weighed_with_what_was_found_and_its_error() {
        let found = Vector3::new(1.0, 0.0, 0.0);
        let (sure, unsure) = (Matrix3::identity() * 1e-8, Matrix3::identity() * 0.09);
        // Sharp readings of less than half of what was found with an error of 0.3: a motion all the same.
        let read = |part: f64| found * part * 1e4;
        assert!(odds(&found, &unsure, &read(0.45), 1e4).is_some_and(|odds| odds > 100.0));
        assert!(odds(&found, &sure, &read(0.45), 1e4).is_some_and(|odds| odds < -100.0));
        assert!(odds(&found, &sure, &read(1.0), 1e4).is_some_and(|odds| (odds - 1e4).abs() < 1.0));
        // Twice ln of N(0; 1, 0.09 + 1e-4) of each coordinate over that of N(0; 0, 1e-4), by hand.
        let expected = -1.0 / 0.0901 - 3.0 * (901.0_f64).ln();
        assert!(odds(&found, &unsure, &read(0.0), 1e4).is_some_and(|odds| (odds - expected).abs() < 1e-6));
        assert_eq!(odds(&found, &unsure, &Vector3::zeros(), 0.0), None);
    }
}

//! What data that took no part in the fit say of an effect: fixed points that were measured again.
//!
//! An instrument that moved by d f(t) moves a fixed point with it: z = p + d f(t) + noise, its true place p unknown. What the loop found
//! of d is held against that: twice the logarithm of the likelihood ratio of the readings with and without it,
//!
//! Σ |z − z̄|² / σ² − Σ |z − z̄ − d (f − f̄)|² / σ²,
//!
//! decides where the odds are 100 to 1 either way.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::data::Data;
use super::fitted::Fitted;
use crate::measurement::NestReading;
use crate::problem::Effect;

/// Twice the logarithm of the odds at which readings decide: 100 to 1.
const DECIDED: f64 = 9.21;

/// What it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Says {
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
    pub says: Says,
}

/// z and f of a reading.
type Reading = (Vector3<f64>, f64);

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
            _ => None,
        }
    };
    let parameters = fitted.parameters_of(effect);
    let [x, y, z] = parameters.as_slice() else { return None };
    let strength = Vector3::new(fitted.found.x[*x], fitted.found.x[*y], fitted.found.x[*z]);
    // A session has a place of its own for the instrument.
    let mut points: BTreeMap<(&str, &str), Vec<Reading>> = BTreeMap::new();
    for reading in &measurements.nests {
        let own = (reading.position, moves(reading)?);
        points.entry((&reading.session, &reading.name)).or_default().push(own);
    }
    let gain = |readings: &Vec<Reading>| {
        let count = readings.len() as f64;
        let (place, moved) =
            readings.iter().fold((Vector3::zeros(), 0.0), |(place, moved), (z, f)| (place + z, moved + f));
        let (place, moved) = (place / count, moved / count);
        let one = |(z, f): &Reading| {
            let left = z - place;
            left.norm_squared() - (left - strength * (f - moved)).norm_squared()
        };
        readings.iter().map(one).sum::<f64>()
    };
    let gain = points.values().map(gain).sum::<f64>() / fitted.sigma.powi(2);
    let says = if gain > DECIDED {
        Says::Corroborated
    } else if gain < -DECIDED {
        Says::Contradicted
    } else {
        return None;
    };
    let mut names: Vec<&str> = points.keys().map(|(_, name)| *name).collect();
    names.dedup();
    Some(Witness { data: format!("{} readings of {}", measurements.nests.len(), names.join(", ")), says })
}

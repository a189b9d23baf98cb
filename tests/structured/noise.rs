//! Statistics that a fit to data of known noise has to obey.

use std::f64::consts::TAU;

use flexcal::fit::Identification;
use flexcal::measurement::{Labels, Measurements};
use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::case::Case;
use super::checks::{Verdict, ensure};
use super::fitted::Fitted;
use super::sight::Sight;
use super::world::World;

/// Probability of a sum of squares beyond its limits by chance alone.
const RARE: f64 = 1e-10;
/// Largest error in units of its standard deviation: beyond 8 once in 10¹⁵ normal numbers, and with
/// room for standard deviations that the fit estimates from few rows.
const MOST_SIGMAS: f64 = 10.0;

/// Checks residuals, predictions of held-out rows, and estimates against the noise that was made.
pub fn noise_is_left(case: &Case, fit: &Fitted) -> Verdict {
    let [sigma, _] = case.noise;
    let found = &fit.found;
    if sigma == 0.0 || case.is_limited || !case.declares_sigma || !found.is_trusted() {
        return Ok(());
    }
    let squares: f64 = fit
        .residuals
        .iter()
        .filter(|row| !row.held_out)
        .map(|row| {
            let turned = row.orientation.map_or(0.0, |turn| turn.norm_squared());
            (row.position.norm_squared() + turned) / (sigma * sigma)
        })
        .sum();
    let limit = |freedom: f64, probability: f64| {
        ChiSquared::new(freedom).map_or(0.0, |law| law.inverse_cdf(probability))
    };
    let coordinates = found.coordinates as f64;
    // Priors that the truth is within add at most their own squares.
    let priors = found.estimates.iter().filter(|estimate| estimate.prior_sigma.is_some()).count();
    let most = limit(coordinates, 1.0 - RARE) + 4.0 * priors as f64;
    ensure!(
        squares <= most,
        "χ² is {squares}, of {coordinates} coordinates at most {most} by chance"
    );
    let freedom =
        coordinates - found.estimates.iter().filter(|estimate| estimate.fitted).count() as f64;
    if freedom > 3.0 {
        let least = limit(freedom, RARE);
        ensure!(
            squares >= least,
            "χ² is {squares}, of {freedom} degrees of freedom at least {least} by chance"
        );
    }
    let mut truth = case.truth.clone();
    for estimate in
        found.estimates.iter().filter(|estimate| !is_of_held_out_rows(fit, &estimate.name))
    {
        let Some((true_value, error)) =
            truth.parameter(&estimate.name).map(|value| *value).zip(estimate.std_error)
        else {
            continue;
        };
        let estimated =
            nearest_turn(found, &mut truth, &estimate.name).unwrap_or(estimate.estimate);
        let off = (estimated - true_value).abs() / error;
        ensure!(off < MOST_SIGMAS, "{} is {off} standard errors off the truth", estimate.name);
    }
    held_out_rows_are_foreseen(case, fit)
}

/// Returns component `name` of an estimated rotation vector, or of the vector of the same rotation
/// that is a whole turn away if that is nearer to the truth. Returns `None` for other parameters.
fn nearest_turn(found: &Identification, truth: &mut World, name: &str) -> Option<f64> {
    let (of, field) = name.rsplit_once('.')?;
    let axis = ["rx", "ry", "rz"].iter().position(|axis| *axis == field)?;
    let mut vectors = [Vector3::zeros(); 2];
    for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate() {
        let name = format!("{of}.{axis}");
        let estimate = found.estimates.iter().find(|estimate| estimate.name == name)?;
        vectors[0][k] = estimate.estimate;
        vectors[1][k] = *truth.parameter(&name)?;
    }
    let [estimated, expected] = vectors;
    let other = estimated * (1.0 - TAU / estimated.norm());
    let is_nearer = (other - expected).norm() < (estimated - expected).norm();
    Some(if is_nearer { other[axis] } else { estimated[axis] })
}

/// Returns true for a base or tool that held-out rows alone use: it is fitted to them with the arm
/// as it is, and so is its standard error.
fn is_of_held_out_rows(fit: &Fitted, name: &str) -> bool {
    let Some((_, word)) = name.split_once('[') else { return false };
    let word = word.split(']').next().unwrap_or_default();
    let rows = &fit.data.measurements;
    let has = |labels: &Labels, row: usize| labels.names[labels.of_row[row]] == word;
    let uses = |row: usize| {
        has(&rows.session, row) || rows.target.as_ref().is_some_and(|target| has(target, row))
    };
    let of_place = name.starts_with("base[") || name.starts_with("tool[");
    of_place && !fit.data.split.identification.iter().any(|&row| uses(row))
}

/// Checks errors of held-out rows against their stated standard deviations.
fn held_out_rows_are_foreseen(case: &Case, fit: &Fitted) -> Verdict {
    let rows = Measurements::read_to_predict(&fit.problem.data.files, &fit.problem);
    let rows = rows.map_err(|error| error.to_string())?.0;
    let (_, poses) = fit.predict(&rows).map_err(|error| error.to_string())?;
    let Some(poses) = poses else { return Ok(()) };
    for residual in fit.residuals.iter().filter(|row| row.held_out) {
        if case.rows[residual.row].sight != Sight::Position {
            continue;
        }
        let stated = poses[residual.row].error_sigma();
        for k in 0..3 {
            let size = stated[k].max(case.noise[0]);
            let off = residual.position[k].abs() / size;
            ensure!(off < MOST_SIGMAS, "row {}: a held-out error of {off} stated σ", residual.row);
        }
    }
    Ok(())
}

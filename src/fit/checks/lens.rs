//! Check of held intrinsics: an error of a lens is no error of the arm.

use nalgebra::{Matrix6, Vector6};
use serde_json::json;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::finding::Finding;
use super::view_order::views;
use crate::fit::{Estimate, FindingCode, Identification, IdentifyError, Placement};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::observation::Scene;
use crate::problem::{Fixture, Freedom, ParameterRule, Problem, Quantities};

/// Largest probability of the F test by chance at which freeing the intrinsics improves the fit.
const MAX_CHANCE_PROBABILITY: f64 = 1e-4;
/// Smallest probability that is stated as a number; smaller ones are rounding errors.
const LEAST_STATED_CHANCE: f64 = 1e-16;
/// Smallest deviation of a coefficient from its declared value at which it is named \[σ\].
const MIN_NAMED_SIGMAS: f64 = 3.0;
/// Smallest ratio of the gain to the misfit that remains beyond noise at which the intrinsics are
/// the cause: they remove three quarters of the misfit.
const MIN_GAIN_RATIO: f64 = 3.0;
/// Multiple of the standard deviation of the remaining misfit by chance that is subtracted from it.
const REMAINING_SIGMAS: f64 = 2.0;
/// Smallest number of degrees of freedom within views that determines the noise of pixels: its
/// relative standard error is then √(2/200) = 10 %.
const MIN_NOISE_FREEDOM: f64 = 200.0;

/// Compares the fit with one whose intrinsics are free: focal lengths, image centres and
/// distortion. Returns a finding if these are a cause of the misfit.
///
/// Two conditions hold then. An F test shows that the gain in χ² for each freed parameter is not
/// noise of the fit with a free lens. The gain is also several times the misfit that remains beyond
/// the noise of pixels; otherwise the arm or a marker may be the cause, of which a free lens takes
/// up a part. The noise of pixels is that within views ([`noise_within_views`]), or the declared one.
///
/// `fit` repeats the fit with another problem. There is nothing to compare without pixels, or if
/// all intrinsics are free.
pub(in crate::fit) fn lens_finding(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    fit: impl FnOnce(&Problem) -> Result<Identification, IdentifyError>,
) -> Option<Finding> {
    let rows = &data.measurements;
    let is_used = |fixture: usize| {
        let mut used = data.split.identification.iter();
        used.any(|&row| rows.observation(row).fixtures()[0] == Some(fixture))
    };
    let of_fixture = |(index, fixture): (usize, &Fixture)| {
        let is_camera = fixture.kind.word() == "camera" && is_used(index);
        let fields = fixture.kind.fields().iter().skip(6).filter(move |_| is_camera);
        let name = fixture.name.clone();
        fields.map(move |field| format!("camera[{name}].{field}")).collect::<Vec<_>>()
    };
    let held: Vec<String> = problem
        .fixtures
        .iter()
        .enumerate()
        .flat_map(of_fixture)
        .filter(|name| !found.unknowns.contains(name))
        .collect();
    let before = found.reduced_chi2?;
    if held.is_empty() {
        return None;
    }
    let mut freed = problem.clone();
    freed.parameters.extend(held.iter().map(|name| ParameterRule {
        pattern: name.clone(),
        freedom: Freedom::Free {
            sigma: Quantities::default(),
            min: Quantities::default(),
            max: Quantities::default(),
        },
        location: problem.data.location.clone(),
    }));
    let other = fit(&freed).ok().filter(|other| other.termination.converged())?;
    let after = other.reduced_chi2?;
    let count = other.unknowns.len().saturating_sub(found.unknowns.len()) as f64;
    let freedom = other.coordinates.saturating_sub(other.unknowns.len()) as f64;
    let gain = before * (freedom + count) - after * freedom;
    let chance = FisherSnedecor::new(count, freedom).ok()?.sf(gain.max(0.0) / (count * after));
    if chance > MAX_CHANCE_PROBABILITY {
        return None;
    }
    let (noise, within) = noise_within_views(&freed, data, &other).unwrap_or((1.0, 0.0));
    let by_chance = REMAINING_SIGMAS * noise * (2.0 * (freedom - within).max(0.0)).sqrt();
    let remaining = (after - noise) * freedom - by_chance;
    if gain <= MIN_GAIN_RATIO * remaining {
        return None;
    }
    let sigmas = |estimate: &Estimate| {
        let deviation = (estimate.estimate - estimate.nominal).abs();
        estimate.std_error.filter(|_| held.contains(&estimate.name)).map(|error| deviation / error)
    };
    let largest = other.estimates.iter().filter_map(sigmas).fold(0.0, f64::max);
    let limit = MIN_NAMED_SIGMAS.min(largest);
    let is_off = |estimate: &&Estimate| sigmas(estimate).is_some_and(|sigmas| sigmas >= limit);
    let off: Vec<&Estimate> = other.estimates.iter().filter(is_off).collect();
    let words = off.iter().map(|estimate| {
        let error = estimate.std_error.unwrap_or_default();
        format!("{} = {:.6} ± {error:.6}", estimate.name, estimate.estimate)
    });
    let chance = if chance < LEAST_STATED_CHANCE {
        format!("below {LEAST_STATED_CHANCE:e}")
    } else {
        format!("{chance:.0e}")
    };
    let names: Vec<&str> = off.iter().map(|estimate| estimate.name.as_str()).collect();
    let text = format!(
        "the intrinsics are not as declared: with {} the reduced χ² falls from {before:.3} to {after:.3}, \
         by chance with probability {chance}",
        words.collect::<Vec<_>>().join(", ")
    );
    let numbers = [json!(names), json!(before), json!(after)];
    Some(Finding::new(FindingCode::LensContradicted, numbers, text))
}

/// Returns the variance of pixels within views, relative to the declared one, and its degrees of
/// freedom; `None` if the views have too few points.
///
/// The arm only moves the camera relative to the marker. In each view, the residuals are therefore
/// projected onto the complement of the six motions of the camera: what remains is noise, if lens
/// and marker are right. With the derivatives M of a view, χ² = r·r − (Mᵀr)ᵀ (MᵀM)⁺ Mᵀr.
fn noise_within_views(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
) -> Option<(f64, f64)> {
    let Dataset { measurements, split } = data;
    let placement = Placement::of(measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets).ok()?;
    let poses = placement.poses(measurements, &split.identification, found.sigma);
    let fixtures = model.fixtures(found.x.as_slice());
    let carriers = model.carrier_frames(&poses, found.x.as_slice());
    let (mut chi2, mut freedom) = (0.0, 0.0);
    for view in views(measurements, &split.identification) {
        let (mut normal, mut right, mut square) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        let mut numbers = 0;
        for (pose, carriers) in view.into_iter().map(|place| (&poses[place], carriers[place])) {
            let ([Some(camera), Some(marker)], Some(carriers)) =
                (pose.observation.fixtures(), carriers)
            else {
                continue;
            };
            let scene = Scene {
                fixtures: [fixtures[camera], fixtures[marker]],
                carriers,
                point: model.fixture_point(pose.observation),
                ..Scene::default()
            };
            let slopes = pose.observation.slopes(&scene);
            for axis in 0..2 {
                let motion =
                    slopes.by_fixtures[0].fixed_view::<1, 6>(axis, 0).transpose() / pose.sigma;
                let residual = (pose.measured[axis] - slopes.value[axis]) / pose.sigma;
                normal += motion * motion.transpose();
                right += motion * residual;
                square += residual * residual;
                numbers += 1;
            }
        }
        if numbers > 6
            && let Some(factor) = normal.cholesky()
        {
            chi2 += square - right.dot(&factor.solve(&right));
            freedom += f64::from(numbers - 6);
        }
    }
    (freedom >= MIN_NOISE_FREEDOM && chi2.is_finite()).then(|| (chi2 / freedom, freedom))
}

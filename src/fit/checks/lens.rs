//! Check of intrinsics of cameras that the fit does not vary: their errors would be attributed to
//! the arm.

use std::collections::BTreeMap;

use nalgebra::{DVector, Matrix6, Vector6};
use serde_json::json;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor};

use super::finding::Finding;
use super::freed::{Freed, MAX_CHANCE_PROBABILITY};
use super::view_order::views;
use crate::fit::{Estimate, FindingCode, Identification, IdentifyError, Placement};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::observation::Scene;
use crate::problem::pattern::matches;
use crate::problem::{CENTRE_X, FIRST_COEFFICIENT, Fixture, Freedom, Problem};

/// Smallest p-value that is stated as a number; smaller ones are below the rounding errors.
const LEAST_STATED_CHANCE: f64 = 1e-16;
/// Largest probability that chance makes the parameters of one kind, such as the radial distortion,
/// deviate together as far as they do, at which the finding names them.
const MAX_NAMED_CHANCE: f64 = 1e-3;
/// Smallest ratio of the decrease of χ² by free intrinsics to the χ² that remains beyond noise, at
/// which the intrinsics are the cause. They then remove three quarters of the misfit.
const MIN_GAIN_RATIO: f64 = 3.0;
/// Number of standard deviations of χ² of noise that are subtracted from the remaining misfit.
const REMAINING_SIGMAS: f64 = 2.0;
/// Largest share of what exceeds the noise in χ² that another reading of the intrinsics leaves.
const MAX_LEFT_BY_READING: f64 = 0.05;
/// Reduced χ² below which the residual is far below the declared noise: an error of the lens that
/// hardly decreases it is small.
const FAR_BELOW_DECLARED: f64 = 0.5;
/// Smallest ratio by which free intrinsics decrease the reduced χ² below [`FAR_BELOW_DECLARED`], or
/// that within views of a bent marker: a smaller decrease may come from its shape.
const MIN_DECREASE: f64 = 1.1;
/// Smallest [`Within::shape`] of a marker that is bent. That of a flat one exceeds it by chance only
/// with very few points.
const MIN_SHAPE_RATIO: f64 = 4.0;
/// Smallest number of degrees of freedom within views that determines the noise of pixels: its
/// relative standard error is then √(2/200) = 10 %.
const MIN_NOISE_FREEDOM: f64 = 200.0;

/// Compares the fit `found` with one whose intrinsics are free: focal lengths, image centres and
/// distortion. Returns a finding if errors of the intrinsics cause most of the misfit.
///
/// Within the views, no error of the arm acts: there, free intrinsics show their errors whatever else
/// is wrong ([`is_shown_within_views`]). Otherwise this requires two conditions. By an F test, the
/// decrease of χ² by the freed parameters is larger than noise explains. The decrease is also several
/// times the misfit that remains beyond the noise of pixels. Otherwise the arm or a marker may be the
/// cause, and free intrinsics only absorb a part of their error. The noise of pixels is that within
/// views ([`noise_within_views`]), or else the declared one.
///
/// `fit` repeats the fit with another problem. Returns `None` without a comparison if no row
/// measures pixels, or if all intrinsics are free.
pub(in crate::fit) fn lens_finding(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    fit: impl Fn(&Problem) -> Result<Identification, IdentifyError>,
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
    let fixed: Vec<String> = problem
        .fixtures
        .iter()
        .enumerate()
        .flat_map(of_fixture)
        .filter(|name| !found.unknowns.contains(name))
        .collect();
    let before = found.reduced_chi2?;
    if fixed.is_empty() {
        return None;
    }
    let Freed { problem: freed, fitted: other, reduced_chi2: after, freedom, gain, chance } =
        Freed::new((problem, found), &fixed, &fit)?;
    let of_views = noise_within_views(&freed, data, &other);
    let Within { noise, freedom: within, shape } = of_views.unwrap_or_default();
    let by_chance = REMAINING_SIGMAS * noise * (2.0 * (freedom - within).max(0.0)).sqrt();
    let remaining = (after - noise) * freedom - by_chance;
    let before_within = noise_within_views(problem, data, found).map(|within| within.noise);
    let is_bent = shape > MIN_SHAPE_RATIO
        && before_within.is_some_and(|before| before < MIN_DECREASE * noise);
    let is_notable = before > FAR_BELOW_DECLARED || before > MIN_DECREASE * after;
    let explains = chance <= MAX_CHANCE_PROBABILITY
        && gain > MIN_GAIN_RATIO * remaining
        && is_notable
        && !is_bent;
    let shown = before_within.zip(of_views).filter(|&(before, of)| {
        is_notable && is_shown_within_views((before, of.noise), of.freedom, fixed.len() as f64)
    });
    if !explains && shown.is_none() {
        return None;
    }
    let off = deviating(&other, &fixed, after);
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
    let words = words.collect::<Vec<_>>().join(", ");
    let text = match shown.filter(|_| !explains) {
        Some((before, Within { noise: after, .. })) => format!(
            "the intrinsics are not as declared: with {words} the reduced χ² within the views, \
             where no error of the arm acts, falls from {before:.3} to {after:.3}; something beyond \
             the views errs as well"
        ),
        None => format!(
            "the intrinsics are not as declared: with {words} the reduced χ² falls from {before:.3} to \
             {after:.3}, by chance with probability {chance}"
        ),
    };
    if let Some((words, after)) = other_lens(problem, (before, noise), &fit) {
        let text = format!(
            "the intrinsics are not as declared: with {words} the reduced χ² falls from \
             {before:.3} to {after:.3}"
        );
        let numbers = [json!(names), json!(before), json!(after)];
        let finding = Finding::new(FindingCode::LensContradicted, numbers, text);
        return Some(finding.with_remedy("correct the camera"));
    }
    let numbers = [json!(names), json!(before), json!(after)];
    let remedy = format!("{}, or declare better ones", freeing(problem, &fixed));
    Some(Finding::new(FindingCode::LensContradicted, numbers, text).with_remedy(remedy))
}

/// Returns the freed parameters of each kind that deviates from the declared values beyond chance, or
/// of the one kind that deviates most.
///
/// Parameters of one kind are judged together, by the χ² of their deviations with their covariance:
/// they make up for each other, so that each alone may have a large standard error. A
/// `reduced_chi2` above 1, which errors of the arm cause, widens the covariance.
fn deviating<'a>(
    found: &'a Identification,
    freed: &[String],
    reduced_chi2: f64,
) -> Vec<&'a Estimate> {
    let mut kinds: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (place, &of) in found.covariance.parameters.iter().enumerate() {
        let name = &found.estimates[of].name;
        if freed.contains(name) {
            // "camera[hand].k2" is of the kind "camera[hand].k".
            let kind =
                name.rfind('.').map_or(name.as_str(), |dot| &name[..(dot + 2).min(name.len())]);
            kinds.entry(kind).or_default().push(place);
        }
    }
    let chance = |places: &Vec<usize>| {
        let of = |place: usize| &found.estimates[found.covariance.parameters[place]];
        let covariance = found.covariance.matrix.select_rows(places).select_columns(places);
        let deviations = places.iter().map(|&place| of(place).estimate - of(place).nominal);
        let deviations = DVector::from_iterator(places.len(), deviations);
        let chi2 = deviations.dot(&covariance.cholesky()?.solve(&deviations));
        let chi2 = chi2 / reduced_chi2.max(1.0);
        Some((ChiSquared::new(places.len() as f64).ok()?.sf(chi2), chi2))
    };
    let mut judged: Vec<(f64, f64, Vec<usize>)> = kinds
        .into_values()
        .filter_map(|places| chance(&places).map(|(chance, chi2)| (chance, chi2, places)))
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let beyond = judged.iter().filter(|(chance, ..)| *chance <= MAX_NAMED_CHANCE).count();
    let mut named: Vec<usize> =
        judged.into_iter().take(beyond.max(1)).flat_map(|(.., places)| places).collect();
    named.sort_unstable();
    named.into_iter().map(|place| &found.estimates[found.covariance.parameters[place]]).collect()
}

/// States what frees the intrinsics `names` in `[parameters]`: lines that hold them and have to free
/// them, and lines to add for those that no line names.
fn freeing(problem: &Problem, names: &[String]) -> String {
    let rule =
        |name: &String| problem.parameters.iter().rev().find(|rule| matches(&rule.pattern, name));
    let (held, others): (Vec<&String>, Vec<&String>) = names
        .iter()
        .partition(|name| rule(name).is_some_and(|rule| matches!(rule.freedom, Freedom::Fixed)));
    let mut lines: Vec<String> = Vec::new();
    for rule in held.into_iter().filter_map(rule) {
        let place = rule.location.of_line();
        let line = format!("\"{}\" ({place})", rule.pattern);
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    let change =
        (!lines.is_empty()).then(|| format!("write free = true for {}", lines.join(" and ")));
    let others: Vec<String> = others.into_iter().cloned().collect();
    let free = (!others.is_empty())
        .then(|| format!("free them in [parameters] ({})", rules_in_words(&others)));
    change.into_iter().chain(free).collect::<Vec<_>>().join("; ")
}

/// Returns the words of the other reading of the intrinsics of a camera with which the images fit
/// best, and the reduced χ² with it; `None` if none explains what exceeds `noise` in `before`, the
/// reduced χ² as declared.
fn other_lens(
    problem: &Problem,
    (before, noise): (f64, f64),
    fit: impl Fn(&Problem) -> Result<Identification, IdentifyError>,
) -> Option<(String, f64)> {
    let cameras = problem.fixtures.iter().enumerate();
    let read = cameras.flat_map(|(index, fixture)| {
        let of_camera = lens_readings(fixture).into_iter();
        of_camera.map(move |(words, known)| (index, words, known))
    });
    let explained = read.filter_map(|(index, words, known)| {
        let mut other = problem.clone();
        other.fixtures.get_mut(index)?.known = known;
        let found = fit(&other).ok().filter(|found| found.termination.converged())?;
        Some((words, found.reduced_chi2?))
    });
    let (words, after) = explained.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let is_explained =
        before > MIN_DECREASE * after && after - noise < MAX_LEFT_BY_READING * (before - noise);
    is_explained.then_some((words, after))
}

/// Returns the other readings of the declared centre and distortion of a pinhole camera: their words
/// and the numbers of the camera.
fn lens_readings(fixture: &Fixture) -> Vec<(String, Vec<Option<f64>>)> {
    let (known, name) = (&fixture.known, &fixture.name);
    if fixture.kind.word() != "camera" || known.len() != FIRST_COEFFICIENT + 5 {
        return Vec::new();
    }
    let with = |places: [usize; 7], factor: f64| {
        let mut other = known.clone();
        for (place, &from) in places.iter().enumerate() {
            let sign = if place < 2 { 1.0 } else { factor };
            other[CENTRE_X + place] = known[CENTRE_X + from].map(|value| sign * value);
        }
        other
    };
    let in_order = [0, 1, 2, 3, 4, 5, 6];
    let readings = [
        (in_order, 0.0, "distortion = [0, 0, 0, 0, 0] (pixels that are undistorted already)"),
        (in_order, -1.0, "the distortion of the other sign"),
        (
            [0, 1, 2, 3, 5, 6, 4],
            1.0,
            "the distortion in the order k1, k2, p1, p2, k3 (written in the order k1, k2, k3, p1, \
             p2)",
        ),
        ([1, 0, 2, 3, 4, 5, 6], 1.0, "the two numbers of centre_px exchanged"),
    ];
    let readings = readings.map(|(places, factor, words)| (words, with(places, factor)));
    let changed = readings.into_iter().filter(|(_, other)| other != known);
    changed.map(|(words, other)| (format!("{words} of camera \"{name}\""), other)).collect()
}

/// Returns the lines of `[parameters]` that free the intrinsics `names`, one for each kind of
/// number: focal lengths, centre, radial and tangential distortion.
fn rules_in_words(names: &[String]) -> String {
    let kind = |name: &String| name.rsplit('.').next().and_then(|field| field.chars().next());
    let mut kinds: Vec<char> = names.iter().filter_map(kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let rules = kinds.iter().map(|kind| format!("\"camera*.{kind}*\" = {{ free = true }}"));
    rules.collect::<Vec<_>>().join(", ")
}

/// Returns true if `count` freed intrinsics cause the fall of the reduced χ² within views, which has
/// `freedom` degrees of freedom: chance does not, and no more than a third of it is left beyond the
/// declared noise, as an error of the marker would leave.
fn is_shown_within_views((before, after): (f64, f64), freedom: f64, count: f64) -> bool {
    let gain = (before - after) * freedom;
    let left = (after - 1.0) * freedom - REMAINING_SIGMAS * (2.0 * freedom).sqrt();
    let left_freedom = (freedom - count).max(1.0);
    let ratio = gain.max(0.0) / count / (after * freedom / left_freedom);
    let test = FisherSnedecor::new(count, left_freedom);
    let chance = test.map_or(1.0, |test| test.sf(ratio));
    chance <= MAX_CHANCE_PROBABILITY && gain > MIN_GAIN_RATIO * left
}

/// Residual of pixels within views, in which no error of the arm acts.
#[derive(Debug, Clone, Copy)]
struct Within {
    /// Variance, relative to the declared noise.
    noise: f64,
    /// Degrees of freedom from which it is estimated.
    freedom: f64,
    /// Mean decrease of χ² by a shift of each point along the normal of its marker, the same in all
    /// views, relative to `noise`: 1 for a flat marker, more for a bent one.
    shape: f64,
}

/// Values without an estimate: those of the declared noise.
impl Default for Within {
    fn default() -> Self {
        Self { noise: 1.0, freedom: 0.0, shape: 1.0 }
    }
}

/// Returns the residual of pixels within views; `None` if it has too few degrees of freedom.
///
/// Errors of the arm only move the camera relative to the marker. In each view, the residuals are
/// therefore projected onto the complement of the six motions of the camera. What remains is noise
/// if lens and marker are as modelled. With the derivatives M of the pixels of a view with respect
/// to these motions, χ² = r·r − (Mᵀr)ᵀ (MᵀM)⁻¹ Mᵀr.
fn noise_within_views(problem: &Problem, data: &Dataset, found: &Identification) -> Option<Within> {
    let Dataset { measurements, split } = data;
    let placement = Placement::of(measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets).ok()?;
    let model = found.strategy.model(model);
    let poses = placement.poses(measurements, &split.identification, found.sigma);
    let fixtures = model.fixtures(found.x.as_slice());
    let carriers = model.carrier_frames(&poses, found.x.as_slice());
    let (mut chi2, mut freedom) = (0.0, 0.0);
    // For each marker and point, Σ s·r and Σ s² of the slopes s along the normal.
    let mut shapes: BTreeMap<(usize, [u64; 3]), [f64; 2]> = BTreeMap::new();
    for view in views(measurements, &split.identification) {
        let (mut normal, mut right, mut square) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        let (mut numbers, mut rows) = (0, Vec::new());
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
                let normal_axis = fixtures[marker].frame().axes[2];
                let along = slopes.by_fixtures[1].fixed_view::<1, 3>(axis, 0) * normal_axis;
                let point = scene.point.map(f64::to_bits);
                rows.push((motion, residual, along[0] / pose.sigma, (marker, point.into())));
                normal += motion * motion.transpose();
                right += motion * residual;
                square += residual * residual;
                numbers += 1;
            }
        }
        if numbers > 6
            && let Some(factor) = normal.cholesky()
        {
            let moved = factor.solve(&right);
            chi2 += square - right.dot(&moved);
            freedom += f64::from(numbers - 6);
            for (motion, residual, along, point) in rows {
                let [product, squares] = shapes.entry(point).or_default();
                *product += along * (residual - motion.dot(&moved));
                *squares += along * along;
            }
        }
    }
    let gains = shapes.values().filter(|[_, squares]| *squares > 0.0);
    let gains: Vec<f64> = gains.map(|[product, squares]| product * product / squares).collect();
    let noise = chi2 / freedom;
    let shape = gains.iter().sum::<f64>() / gains.len().max(1) as f64 / noise;
    (freedom >= MIN_NOISE_FREEDOM && chi2.is_finite()).then_some(Within { noise, freedom, shape })
}

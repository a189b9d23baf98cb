//! Measurements simulated by the model.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use flexcal::fit::{Identification, Options, Placement, identify};
use flexcal::measurement::{Dataset, Labels, Measurements, Split};
use flexcal::model::Model;
use flexcal::problem::{JointKind, Problem};
use flexcal::quantity::Unit;
use nalgebra::{DVector, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Returns `count` configurations with angles within ±`reach` [rad] and offsets within ±0.3 m,
/// without positions.
pub fn at_random(
    problem: &Problem,
    count: usize,
    reach: f64,
    rng: &mut ChaCha8Rng,
) -> Measurements {
    let kinds: Vec<JointKind> = problem.joints.iter().map(|joint| joint.kind).collect();
    let drawn = |rng: &mut ChaCha8Rng, kind: &JointKind| match kind {
        JointKind::Revolute => rng.random_range(-reach..reach),
        JointKind::Prismatic => rng.random_range(-0.3..0.3),
        JointKind::Fixed => 0.0,
    };
    let configurations =
        (0..count).map(|_| kinds.iter().map(|kind| drawn(rng, kind)).collect::<Vec<f64>>());
    Dataset::builder(configurations, vec![Vector3::zeros(); count]).measurements().unwrap()
}

/// Assigns the targets of the problem to the rows in turn.
pub fn of_targets(problem: &Problem, rows: Measurements) -> Measurements {
    let words = problem.target_words();
    let target = (!problem.targets.is_empty())
        .then(|| labels(words.iter().cycle().map(String::as_str).take(rows.len())));
    Measurements { target, ..rows }
}

/// Returns labels of the rows, in order of appearance.
pub fn labels<'a>(words: impl Iterator<Item = &'a str>) -> Labels {
    words.collect()
}

/// Returns the given rows, with only the sessions and targets that occur in them.
pub fn part(measurements: &Measurements, rows: impl IntoIterator<Item = usize>) -> Measurements {
    let mut part = measurements.select(&rows.into_iter().collect::<Vec<usize>>());
    let relabelled = |all: &Labels| labels(all.of_row.iter().map(|&word| all.names[word].as_str()));
    (part.session, part.target) = (relabelled(&part.session), part.target.as_ref().map(relabelled));
    part
}

/// Returns the model of a problem with the bases and targets of its measurements.
pub fn model_of(problem: &Problem, measurements: &Measurements) -> Model {
    let placement = Placement::of(measurements);
    Model::new(problem, &placement.bases, &placement.targets).unwrap()
}

/// Returns the positions of every row at the full parameter vector `x` [m].
pub fn predicted(
    problem: &Problem,
    measurements: &Measurements,
    x: &DVector<f64>,
) -> Vec<Vector3<f64>> {
    let model = model_of(problem, measurements);
    let rows: Vec<usize> = (0..measurements.len()).collect();
    let poses = Placement::of(measurements).poses(measurements, &rows, 1.0);
    model.predict(poses, x)
}

/// Simulates measurements of every row at `x`, with noise of 1 σ = `sigma` [m] on each coordinate.
pub fn measure(
    problem: &Problem,
    rows: &mut Measurements,
    x: &DVector<f64>,
    sigma: f64,
    rng: &mut ChaCha8Rng,
) {
    rows.positions = predicted(problem, rows, x);
    for position in &mut rows.positions {
        *position += Vector3::from_fn(|_, _| sigma * normal(rng));
    }
}

/// Draws deviations from the priors; parameters without a prior have the standard deviation `size`.
pub fn draw(model: &Model, size: impl Fn(Unit) -> f64, rng: &mut ChaCha8Rng) -> DVector<f64> {
    let drawn = model.parameters.iter().map(|parameter| {
        let sigma = parameter.sigma.unwrap_or_else(|| size(parameter.unit()));
        sigma * normal(rng)
    });
    DVector::from_iterator(model.parameters.len(), drawn)
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Splits the rows: the first `count` for identification, the others held out.
pub fn split_at(count: usize, measurements: &Measurements) -> Split {
    Split { identification: (0..count).collect(), held_out: (count..measurements.len()).collect() }
}

/// Returns the rows as a table: joints, positions, split, and sessions and targets if there are
/// any.
pub fn csv(problem: &Problem, Dataset { measurements: rows, split }: &Dataset) -> String {
    let unit = |kind: JointKind| if kind == JointKind::Prismatic { "m" } else { "rad" };
    let mut header: Vec<String> = problem
        .joints
        .iter()
        .enumerate()
        .map(|(k, joint)| format!("q{}_{}", k + 1, unit(joint.kind)))
        .collect();
    header.extend(["x_m", "y_m", "z_m", "split"].map(str::to_owned));
    let sessions =
        Some(&rows.session).filter(|labels| labels.names.iter().any(|name| !name.is_empty()));
    let labels = [("session", sessions), ("target", rows.target.as_ref())];
    let labels: Vec<(&str, &Labels)> =
        labels.into_iter().filter_map(|(name, words)| Some((name, words?))).collect();
    header.extend(labels.iter().map(|(name, _)| (*name).to_owned()));
    let mut text = header.join(",") + "\n";
    for (row, position) in rows.positions.iter().enumerate() {
        let numbers = rows.configuration(row).iter().chain(position);
        let mut cells: Vec<String> = numbers.map(f64::to_string).collect();
        let held_out = split.held_out.contains(&row);
        cells.push(if held_out { "validation" } else { "identification" }.to_owned());
        cells.extend(labels.iter().map(|(_, words)| words.names[words.of_row[row]].clone()));
        text += &(cells.join(",") + "\n");
    }
    text
}

/// Returns the rows with the split of [`split_at`].
pub fn divided(count: usize, measurements: &Measurements) -> Dataset {
    Dataset::new(measurements.clone(), split_at(count, measurements))
}

/// Identifies with the default options.
#[track_caller]
pub fn fit(problem: &Problem, data: &Dataset) -> Identification {
    identify(problem, data, &Options::default()).unwrap()
}

/// Fits the data as the command does, with further fits that search for the cause of a misfit.
pub fn fit_as_command(problem: &Problem, data: &Dataset) -> Identification {
    identify(problem, data, &Options::default().with_influential_rows()).unwrap()
}

//! Errors of the instrument that commands do not correct, because targets are true positions.

use nalgebra::{DVector, Vector3};

use crate::fit::{Placement, PredictError, Prediction, SavedEstimate};
use crate::measurement::Measurements;
use crate::model::Model;
use crate::model::parameter::ParameterSite;
use crate::problem::{Effect, Problem};

/// Largest distance between the reading of a row's position and the predicted reading, at which the
/// position is that of a target of the same model \[m\]. Tables round positions to 0.1 µm.
const MAX_ROUNDING: f64 = 1e-6;

/// Declared effect of the instrument, by which commands are not corrected.
#[derive(Debug, Clone)]
pub struct Uncorrected {
    /// Effect as declared.
    pub effect: Effect,
    /// For each target, how far the arm would stay from it \[m\] if the arm or its base moved by the
    /// effect, and not the readings.
    pub differences: Vec<Vector3<f64>>,
    /// True if a motion of the base reads exactly alike, and bounds include the differences. Effects
    /// that change lengths are told from lengths of the arm by priors and other rows.
    pub is_bounded: bool,
}

impl Uncorrected {
    /// Returns root mean square and largest length of the differences \[m\].
    pub fn sizes(&self) -> (f64, f64) {
        sizes(&self.differences)
    }
}

/// Returns true if an effect changes lengths: its rivals are lengths of the arm, not motions of the
/// base.
fn changes_lengths(effect: &Effect, problem: &Problem) -> bool {
    let is_length = |site| matches!(site, ParameterSite::Scale | ParameterSite::Strain { .. });
    effect.terms(problem).iter().any(|term| is_length(term.site))
}

/// Returns root mean square and largest length of some vectors; 0 without any.
fn sizes(vectors: &[Vector3<f64>]) -> (f64, f64) {
    let squares: f64 = vectors.iter().map(Vector3::norm_squared).sum();
    let largest = vectors.iter().map(Vector3::norm).fold(0.0, f64::max);
    ((squares / vectors.len().max(1) as f64).sqrt(), largest)
}

/// Returns the effects of the instrument that `problem` declares, with the errors of the readings at
/// the true positions of `targets` by each of them at the full parameter vector `x` of `model`.
///
/// If `is_seen`, the positions are in the measuring frame. Otherwise they are relative to the base,
/// and only effects that change lengths count: the others move arm and targets alike.
pub(super) fn uncorrected(
    (problem, model): (&Problem, &Model),
    (estimate, x): (&SavedEstimate, &DVector<f64>),
    (targets, is_seen): (&Measurements, bool),
) -> Vec<Uncorrected> {
    let placement = Placement::of(targets);
    let every_row: Vec<usize> = (0..targets.len()).collect();
    let mut poses = placement.poses(targets, &every_row, 1.0);
    estimate.count_time_in(&placement, &mut poses);
    let of_effect = |effect: &Effect| {
        let parameters = effect.parameters(problem);
        let is_of_effect = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
        let parameters = model.parameters.iter().zip(x);
        let alone: Vec<f64> = parameters
            .map(|(parameter, x)| if is_of_effect(&parameter.name) { *x } else { 0.0 })
            .collect();
        let differences = model.reading_errors(&alone, &poses, &targets.positions);
        let acts = differences.iter().any(|difference| difference.norm() > 0.0);
        let is_bounded = !changes_lengths(effect, problem);
        acts.then(|| Uncorrected { effect: effect.clone(), differences, is_bounded })
    };
    let effects = problem.effects.iter().map(|declared| &declared.effect);
    let counted = effects.filter(|effect| is_seen || changes_lengths(effect, problem));
    counted.filter_map(of_effect).collect()
}

/// Returns the root mean square difference \[m\] between readings and true positions if the
/// positions of all `rows` are true positions that the model of `estimate` reaches, such as targets
/// of its own commands, and its instrument errs; `None` for other rows.
///
/// # Errors
/// Returns an error if the estimate is not of the problem.
pub fn true_positions(
    problem: &Problem,
    estimate: &SavedEstimate,
    rows: &Measurements,
    prediction: &Prediction,
) -> Result<Option<f64>, PredictError> {
    let placement = Placement::of(rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let every_row: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &every_row, 1.0);
    estimate.count_time_in(&placement, &mut poses);
    let errors = model.reading_errors(prediction.x.as_slice(), &poses, &rows.positions);
    let Some(residuals) = prediction.residuals.as_ref().filter(|_| !rows.is_empty()) else {
        return Ok(None);
    };
    let is_target = |row: &usize| {
        rows.observation(*row).is_position()
            && (residuals[*row].position + errors[*row]).norm() <= MAX_ROUNDING
    };
    let (rms, largest) = sizes(&errors);
    Ok((largest > MAX_ROUNDING && every_row.iter().all(is_target)).then_some(rms))
}

//! Errors of the instrument that commands do not correct, because targets are true positions.

use nalgebra::{DVector, Vector3};

use super::correction::CorrectedPose;
use crate::fit::{Placement, PredictError, Prediction, SavedEstimate};
use crate::measurement::Measurements;
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose};
use crate::problem::{Effect, PoseView, Problem};

/// Largest distance between the reading of a row's position and the predicted reading, at which the
/// position is that of a target of the same model \[m\]. Tables round positions to 0.1 µm.
const MAX_ROUNDING: f64 = 1e-6;

/// Declared effect by which commands are not corrected: one of the instrument, or one whose sign is
/// that of an unknown direction of approach.
#[derive(Debug, Clone)]
pub struct Uncorrected {
    /// Effect as declared.
    pub effect: Effect,
    /// For each target, how far the arm would stay from it \[m\] if the arm or its base moved by the
    /// effect, and not the readings.
    pub differences: Vec<Vector3<f64>>,
    /// Joint whose direction of approach, which decides on the sign of the differences, is not known;
    /// `None` for an effect of the instrument.
    pub side: Option<usize>,
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
        acts.then(|| Uncorrected { effect: effect.clone(), differences, side: None, is_bounded })
    };
    let effects = problem.effects.iter().map(|declared| &declared.effect);
    let counted = effects.filter(|effect| is_seen || changes_lengths(effect, problem));
    counted.filter_map(of_effect).collect()
}

/// Returns the effects of `problem` that depend on directions of approach which `poses` do not state,
/// each with half of what the direction changes, at the full parameter vector `x` of `model`.
///
/// A pose with earlier poses states the way that friction depends on. Without a column of
/// directions, the moment of the loads stands for the direction at the play of a joint.
pub(super) fn unknown_sides(
    (problem, model): (&Problem, &Model),
    x: &[f64],
    poses: &[Pose],
) -> Vec<Uncorrected> {
    let sided = || problem.effects.iter().map(|of| &of.effect).filter(|of| of.has_sides());
    let names = |of: &Effect| of.parameters(problem).into_iter().map(|parameter| parameter.name);
    let of_joint = |effect: &Effect, joint: usize| {
        let reads = |pose: &Pose| match pose.setup.approach.and_then(|sides| sides.get(joint)) {
            _ if effect.is_friction_alone() => pose.setup.past.read().times.is_empty(),
            side => side.is_some() || !effect.is_play(),
        };
        let is_unknown = |pose: &Pose| {
            let side = pose.setup.approach.and_then(|sides| sides.get(joint));
            side.is_none_or(|side| side.total_cmp(&0.0).is_eq()) && reads(pose)
        };
        let mut chosen: Vec<usize> = (0..poses.len()).collect();
        chosen.retain(|&row| poses.get(row).is_some_and(is_unknown));
        let others: Vec<String> =
            sided().filter(|other| !other.is_same_as(effect)).flat_map(names).collect();
        let parameters = model.parameters.iter().zip(x);
        let alone = parameters
            .map(|(parameter, x)| if others.contains(&parameter.name) { 0.0 } else { *x });
        let alone: Vec<f64> = alone.collect();
        let at = |side: f64| {
            let sides: Vec<f64> =
                (0..model.joints()).map(|other| if other == joint { side } else { 0.0 }).collect();
            let of_rows = chosen.iter().filter_map(|&row| poses.get(row)).map(|pose| Pose {
                setup: PoseView { approach: Some(&sides), ..pose.setup },
                ..*pose
            });
            model.predicted_targets(&of_rows.collect::<Vec<Pose>>(), &alone)
        };
        let mut differences = vec![Vector3::zeros(); poses.len()];
        for (&row, (more, less)) in chosen.iter().zip(at(1.0).into_iter().zip(at(-1.0))) {
            let half = (more - less) * 0.5;
            if let Some(difference) = differences.get_mut(row)
                && half.iter().all(|x| x.is_finite())
            {
                *difference = half;
            }
        }
        let acts = differences.iter().any(|half| half.norm() > MAX_ROUNDING);
        let effect = effect.clone();
        acts.then_some(Uncorrected { effect, differences, side: Some(joint), is_bounded: true })
    };
    let each = |effect| (0..model.joints()).map(move |joint| (effect, joint));
    sided().flat_map(each).filter_map(|(effect, joint)| of_joint(effect, joint)).collect()
}

/// Adds the effects of unknown directions of approach to the uncertainty of each pose.
pub(super) fn widen(poses: &mut [CorrectedPose], sides: &[Uncorrected]) {
    for of in sides {
        for (pose, half) in poses.iter_mut().zip(&of.differences) {
            pose.aside += half.norm();
        }
    }
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
    let rows = &*rows.with_sides(estimate.has_approach);
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

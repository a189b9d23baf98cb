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
pub(crate) fn unknown_sides(
    (problem, model): (&Problem, &Model),
    x: &[f64],
    poses: &[Pose],
) -> Vec<Uncorrected> {
    let positions = |poses: &[Pose], x: &[f64]| {
        let positions = model.predicted_targets(poses, x);
        positions.iter().flat_map(|position| position.iter().copied()).collect()
    };
    let found = side_changes((problem, model), x, poses, positions);
    let shown = found.into_iter().map(|SideChange { effect, joint, changes }| {
        let differences = changes.chunks_exact(3).map(Vector3::from_column_slice).collect();
        Uncorrected { effect: effect.clone(), differences, side: Some(joint), is_bounded: true }
    });
    shown.filter(|of| of.sizes().1 > MAX_ROUNDING).collect()
}

/// Change of numbers by an effect from an unknown direction of approach to a known one.
pub(crate) struct SideChange<'a> {
    effect: &'a Effect,
    joint: usize,
    /// Change of each number; 0 in poses whose direction is known.
    pub changes: Vec<f64>,
}

/// Returns, for each effect of `problem` and each joint on whose direction of approach it depends,
/// what that direction changes in the numbers of `poses` that `evaluate` returns, as many for each
/// pose, at the full parameter vector `x` of `model`. Only poses that do not state it are changed.
pub(crate) fn side_changes<'a>(
    (problem, model): (&'a Problem, &Model),
    x: &[f64],
    poses: &[Pose],
    evaluate: impl Fn(&[Pose], &[f64]) -> Vec<f64>,
) -> Vec<SideChange<'a>> {
    let effects = problem.effects.iter().map(|of| &of.effect);
    let each = |effect: &'a Effect| effect.sided_joints().into_iter().map(move |at| (effect, at));
    let sided: Vec<(&Effect, usize)> = effects.flat_map(each).collect();
    if sided.is_empty() {
        return Vec::new();
    }
    let joints = model.joints();
    let stated = |pose: &Pose| pose.setup.approach.map_or(vec![0.0; joints], <[f64]>::to_vec);
    let stated: Vec<Vec<f64>> = poses.iter().map(stated).collect();
    let with = |sides: &[Vec<f64>], x: &[f64]| {
        let poses = poses.iter().zip(sides).map(|(pose, sides)| Pose {
            setup: PoseView { approach: Some(sides), ..pose.setup },
            ..*pose
        });
        evaluate(&poses.collect::<Vec<Pose>>(), x)
    };
    let mut middle: Option<Vec<f64>> = None;
    let mut found = Vec::new();
    for &(effect, joint) in &sided {
        let reads = |pose: &Pose| match pose.setup.approach {
            _ if effect.is_friction_alone() => pose.setup.past.read().times.is_empty(),
            sides => sides.is_some() || !effect.is_play(),
        };
        let (mut sides, mut is_any) = (stated.clone(), false);
        for (pose, sides) in poses.iter().zip(&mut sides) {
            if let Some(side) = sides.get_mut(joint).filter(|side| **side == 0.0 && reads(pose)) {
                (*side, is_any) = (1.0, true);
            }
        }
        if !is_any {
            continue;
        }
        // Effects of the same joint are told apart by one evaluation more for each of them.
        let others = || sided.iter().filter(|of| of.1 == joint && !of.0.is_same_as(effect));
        let names = others().flat_map(|of| of.0.parameters(problem)).map(|of| of.name);
        let names: Vec<String> = names.collect();
        let alone: Vec<f64> = (model.parameters.iter().zip(x))
            .map(|(parameter, x)| if names.contains(&parameter.name) { 0.0 } else { *x })
            .collect();
        let before = match others().next() {
            Some(_) => &with(&stated, &alone),
            None => &*middle.get_or_insert_with(|| with(&stated, x)),
        };
        let change = |(after, before): (f64, &f64)| Some(after - before).filter(|x| x.is_finite());
        let changes = with(&sides, &alone).into_iter().zip(before).map(change);
        let changes = changes.map(Option::unwrap_or_default).collect();
        found.push(SideChange { effect, joint, changes });
    }
    found
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

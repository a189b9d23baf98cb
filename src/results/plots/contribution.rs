//! Contribution of each parameter and effect to the predicted positions of the measured poses.

use super::arm::{Arm, Poses};
use super::pose::sample;
use crate::fit::Identification;
use crate::model::parameter::ParameterSite;
use crate::problem::Problem;

/// Maximum number of poses over which contributions are averaged.
const MAX_AVERAGED_POSES: usize = 200;

/// Influence of a parameter, or of an effect with all its parameters, on predicted positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// Name of the parameter or effect.
    pub name: String,
    /// True if the contribution is that of an effect, false if it is that of a parameter.
    pub is_effect: bool,
    /// Root mean square displacement of predicted positions \[m\] if the parameter, or all
    /// parameters of the effect, return to their values in the registered nominal arm. All others
    /// stay.
    pub moved: f64,
}

/// Computes the contribution of every effect of `problem`, and of every free parameter outside
/// effects. Each is averaged over at most [`MAX_AVERAGED_POSES`] of the `rows`; the largest comes
/// first.
pub fn of(
    problem: &Problem,
    poses: &Poses,
    arm: &Arm,
    (identification, rows): (&Identification, &[usize]),
) -> Vec<Contribution> {
    let rows = sample(rows, MAX_AVERAGED_POSES, |_| 0.0);
    let errors = poses.errors(arm, &rows);
    let parameters = &arm.model.parameters;
    let setups = poses.placement.poses(poses.measurements, &rows, 1.0);
    let moved = |indices: &[usize]| {
        let mut without = arm.clone();
        for &k in indices {
            without.x[k] = identification.registered_x[k];
        }
        // A base or a target moves the positions of its rows alone.
        let is_moved = |place: usize| match indices.iter().map(|&k| parameters[k].site).next() {
            Some(ParameterSite::Base { base, .. }) => setups[place].base == base,
            Some(ParameterSite::Target { target, .. }) => setups[place].target == target,
            _ => true,
        };
        let places: Vec<usize> = (0..rows.len()).filter(|&place| is_moved(place)).collect();
        let moved_rows: Vec<usize> = places.iter().map(|&place| rows[place]).collect();
        let mut changes: Vec<_> = errors.iter().map(|error| error * 0.0).collect();
        for (place, without) in places.into_iter().zip(poses.errors(&without, &moved_rows)) {
            changes[place] = without - errors[place];
        }
        let squares: Vec<f64> = changes
            .iter()
            .map(nalgebra::Matrix::norm_squared)
            .filter(|square| square.is_finite())
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let mut remaining: Vec<usize> = (0..parameters.len()).collect();
    let mut contributions = Vec::new();
    for effect in problem.effects.iter().map(|declared| &declared.effect) {
        let of_effect = effect.parameters(problem);
        let is_of_effect =
            |k: &usize| of_effect.iter().any(|parameter| parameter.name == parameters[*k].name);
        let (indices, others): (Vec<usize>, Vec<usize>) =
            remaining.iter().partition(|k| is_of_effect(k));
        remaining = others;
        let name = format!("{} {}", effect.name(), effect.place()).trim_end().to_owned();
        contributions.extend((!indices.is_empty()).then(|| Contribution {
            name,
            is_effect: true,
            moved: moved(&indices),
        }));
    }
    contributions.extend(remaining.into_iter().map(|k| Contribution {
        name: parameters[k].name.clone(),
        is_effect: false,
        moved: moved(&[k]),
    }));
    contributions.sort_by(|a, b| b.moved.total_cmp(&a.moved));
    contributions
}

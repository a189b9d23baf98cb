//! Contribution of each parameter and effect to the predicted positions of the measured poses.

use super::arm::{Arm, Poses};
use super::pose::sample;
use super::prelude::*;
use crate::fit::Identification;
use crate::problem::Problem;

/// Number of poses over which contributions are averaged.
const MAX_POSES: usize = 200;
/// Maximum number of bars.
const MAX_BARS: usize = 20;
/// Height of a bar with its gap in pixels.
const ROW: i32 = 19;
/// Width for names in pixels.
const NAMES: i32 = 220;
/// Width for numbers in pixels.
const NUMBERS: i32 = 74;
/// Maximum number of decades that the bars span.
const MAX_DECADES: f64 = 4.0;

/// Contribution of a parameter, or of an effect with all its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// Name of the parameter or effect.
    pub name: String,
    /// True for an effect.
    pub is_effect: bool,
    /// Root mean square displacement of predicted positions if it returns to its nominal value and
    /// everything else stays unchanged \[m\].
    pub moved: f64,
}

/// Computes the contribution of every free parameter and effect of `problem` over some of the rows.
pub fn of(
    problem: &Problem,
    poses: &Poses,
    arm: &Arm,
    (identification, rows): (&Identification, &[usize]),
) -> Vec<Contribution> {
    let rows = sample(rows, MAX_POSES, |_| 0.0);
    let errors = poses.errors(arm, &rows);
    let moved = |indices: &[usize]| {
        let mut without = arm.clone();
        for &k in indices {
            without.x[k] = identification.registered_x[k];
        }
        let changes = poses
            .errors(&without, &rows)
            .into_iter()
            .zip(&errors)
            .map(|(without, errors)| without - errors);
        let squares: Vec<f64> = changes
            .map(|change| change.norm_squared())
            .filter(|square| square.is_finite())
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let parameters = &arm.model.parameters;
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

/// Draws the largest contributions as bars on a logarithmic scale; half of the bars are reserved
/// for effects.
pub fn contributions(contributions: &[Contribution]) -> Option<Drawing> {
    let (mut effects, parameters): (Vec<&Contribution>, Vec<&Contribution>) = contributions
        .iter()
        .filter(|contribution| contribution.moved > 0.0)
        .partition(|contribution| contribution.is_effect);
    effects.truncate(MAX_BARS / 2);
    let room = MAX_BARS - effects.len();
    let mut shown: Vec<&Contribution> =
        effects.into_iter().chain(parameters.into_iter().take(room)).collect();
    shown.sort_by(|a, b| b.moved.total_cmp(&a.moved));
    let log_mm = |contribution: &Contribution| (contribution.moved * 1e3).log10();
    let most = log_mm(shown.first()?);
    let least = shown.last().map_or(most, |last| log_mm(last)).max(most - MAX_DECADES) - 0.25;
    let count = i32::try_from(shown.len()).unwrap_or_default();
    let bottom = 26 + ROW * count;
    let room = f64::from(WIDTH - NAMES - NUMBERS);
    let position =
        |value: f64| px(NAMES) + pixels((value.max(least) - least) / (most - least) * room);
    let svg = figure(
        (WIDTH, bottom + BELOW - 16),
        "What each parameter and effect contributes",
        |area| {
            let entries = [("parameter", FAINT, Mark::Bar), ("effect", ACCENT, Mark::Bar)];
            let has_effects = shown.iter().any(|contribution| contribution.is_effect);
            legend(area, 22, if has_effects { &entries } else { &entries[..1] })?;
            for (k, contribution) in (0..).zip(&shown) {
                let y = 24 + ROW * k + ROW / 2;
                let value = contribution.moved * 1e3;
                let colour = if contribution.is_effect { ACCENT } else { FAINT };
                write(
                    area,
                    &contribution.name,
                    (NAMES - 8, y),
                    if contribution.is_effect { INK } else { MUTED },
                    HPos::Right,
                )?;
                let end = position(value.log10()).max(px(NAMES) + px(1));
                area.draw(&Rectangle::new(
                    [(px(NAMES), px(y - 5)), (end, px(y + 5))],
                    colour.filled(),
                ))?;
                if value.log10() < least {
                    area.draw(&Circle::new((px(NAMES), px(y)), px(2), WARM.filled()))?;
                }
                let words = format!("{} mm", two_digits(value, 4));
                write(area, &words, (end / px(1) + 6, y), MUTED, HPos::Left)?;
            }
            let label = "rms displacement of the predicted position [mm], logarithmic";
            write(
                area,
                label,
                (NAMES + (WIDTH - NAMES - NUMBERS) / 2, bottom + 12),
                INK,
                HPos::Center,
            )
        },
    );
    let note = if contributions.len() > shown.len() {
        format!(" The largest {} of {} are drawn.", shown.len(), contributions.len())
    } else {
        String::new()
    };
    let caption = format!(
        "Root mean square displacement of the predicted positions of the measured poses if one parameter returns to its \
         nominal value (base and tool: to their values for the nominal arm), or one effect is removed, and everything else \
         stays unchanged. Parameters that compensate each other both have long bars.{note}"
    );
    let rows = contributions.iter().map(|contribution| {
        let moved = fixed(contribution.moved * 1e3, 6);
        vec![contribution.name.clone(), contribution.is_effect.to_string(), moved]
    });
    let sheet = Sheet::new(&["name", "is_effect", "rms_move_mm"], rows.collect());
    Some(
        Drawing::new("contributions", "What each parameter and effect contributes", caption, svg)
            .with(sheet),
    )
}

//! What the change of each parameter, and each effect, is worth over the measured poses.

use super::arm::{Arm, Poses};
use super::pose::thin;
use super::prelude::*;
use crate::fit::Identification;
use crate::problem::Problem;

/// Poses over which it is taken.
const POSES: usize = 200;
/// Rows that are drawn.
const MOST: usize = 20;
const ROW: i32 = 19;
/// Room for names and for numbers.
const NAMES: i32 = 220;
const NUMBERS: i32 = 74;
/// Decades that bars span at most.
const DECADES: f64 = 4.0;

/// A parameter, or an effect with all of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// Its name.
    pub name: String,
    /// Whether it is an effect.
    pub is_effect: bool,
    /// Root mean square of how far predicted positions move where it is taken back to nominal and
    /// all else stays \[m\].
    pub moved: f64,
}

/// Of every free parameter and effect of `problem`, over some of the rows.
pub fn of(
    problem: &Problem,
    poses: &Poses,
    arm: &Arm,
    (found, rows): (&Identification, &[usize]),
) -> Vec<Contribution> {
    let rows = thin(rows, POSES, |_| 0.0);
    let with = poses.errors(arm, &rows);
    let moved = |places: &[usize]| {
        let mut without = arm.clone();
        for &k in places {
            without.x[k] = found.registered_x[k];
        }
        let changes = poses
            .errors(&without, &rows)
            .into_iter()
            .zip(&with)
            .map(|(without, with)| without - with);
        let squares: Vec<f64> =
            changes.map(|change| change.norm_squared()).filter(|own| own.is_finite()).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let parameters = &arm.model.parameters;
    let mut rest: Vec<usize> = (0..parameters.len()).collect();
    let mut all = Vec::new();
    for effect in problem.effects.iter().map(|own| &own.effect) {
        let own = effect.parameters(problem);
        let is_own = |k: &usize| own.iter().any(|parameter| parameter.name == parameters[*k].name);
        let (places, others): (Vec<usize>, Vec<usize>) = rest.iter().partition(|k| is_own(k));
        rest = others;
        let name = format!("{} {}", effect.name(), effect.place()).trim_end().to_owned();
        all.extend((!places.is_empty()).then(|| Contribution {
            name,
            is_effect: true,
            moved: moved(&places),
        }));
    }
    all.extend(rest.into_iter().map(|k| Contribution {
        name: parameters[k].name.clone(),
        is_effect: false,
        moved: moved(&[k]),
    }));
    all.sort_by(|a, b| b.moved.total_cmp(&a.moved));
    all
}

/// The largest as bars on a logarithmic scale, effects among them in any case.
pub fn contributions(all: &[Contribution]) -> Option<Drawing> {
    let (mut effects, parameters): (Vec<&Contribution>, Vec<&Contribution>) =
        all.iter().filter(|own| own.moved > 0.0).partition(|own| own.is_effect);
    effects.truncate(MOST / 2);
    let room = MOST - effects.len();
    let mut shown: Vec<&Contribution> =
        effects.into_iter().chain(parameters.into_iter().take(room)).collect();
    shown.sort_by(|a, b| b.moved.total_cmp(&a.moved));
    let most = (shown.first()?.moved * 1e3).log10();
    let least =
        shown.last().map_or(most, |own| (own.moved * 1e3).log10()).max(most - DECADES) - 0.25;
    let count = i32::try_from(shown.len()).unwrap_or_default();
    let bottom = 26 + ROW * count;
    let room = f64::from(WIDTH - NAMES - NUMBERS);
    let place = |value: f64| px(NAMES) + pixels((value.max(least) - least) / (most - least) * room);
    let svg = figure(
        (WIDTH, bottom + BELOW - 16),
        "What each parameter and effect contributes",
        |area| {
            let entries = [("parameter", FAINT, Mark::Bar), ("effect", ACCENT, Mark::Bar)];
            let has_effects = shown.iter().any(|own| own.is_effect);
            legend(area, 22, if has_effects { &entries } else { &entries[..1] })?;
            for (k, own) in (0..).zip(&shown) {
                let y = 24 + ROW * k + ROW / 2;
                let value = own.moved * 1e3;
                let colour = if own.is_effect { ACCENT } else { FAINT };
                write(
                    area,
                    &own.name,
                    (NAMES - 8, y),
                    if own.is_effect { INK } else { MUTED },
                    HPos::Right,
                )?;
                let end = place(value.log10()).max(px(NAMES) + px(1));
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
            let label = "rms move of the predicted position [mm], logarithmic";
            write(
                area,
                label,
                (NAMES + (WIDTH - NAMES - NUMBERS) / 2, bottom + 12),
                INK,
                HPos::Center,
            )
        },
    );
    let part = if all.len() > shown.len() {
        format!(" {} of {} are drawn, the largest.", shown.len(), all.len())
    } else {
        String::new()
    };
    let caption = format!(
        "How far the predicted positions of the measured poses move, root mean square, where one parameter goes back to its \
         nominal value (base and tool: to where the nominal arm has them), or one effect goes, and all else stays. Parameters \
         that make up for each other are long together.{part}"
    );
    let rows = all
        .iter()
        .map(|own| vec![own.name.clone(), own.is_effect.to_string(), fixed(own.moved * 1e3, 6)]);
    let sheet = Sheet::new(&["name", "is_effect", "rms_move_mm"], rows.collect());
    Some(
        Drawing::new("contributions", "What each parameter and effect contributes", caption, svg)
            .with(sheet),
    )
}

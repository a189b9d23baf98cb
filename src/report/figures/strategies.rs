//! Errors of strategies, of parts of the elasticity, and of rounds of a loop.

use super::prelude::*;
use crate::fit::{Comparison, Errors};
use crate::problem::Effect;
use crate::select::{ClosedLoop, Round};

/// Height of a row in pixels.
const ROW: i32 = 22;
/// Width for names in pixels.
const NAMES: i32 = 236;
/// Width for numbers in pixels.
const NUMBERS: i32 = 66;
/// Height above the rows in pixels.
const TOP: i32 = 26;
/// Number of decades below which 2 and 5 are labelled, too.
const MAX_LABELLED_DECADES: f64 = 2.2;

/// Row of the figure.
struct Entry {
    strategy: String,
    name: String,
    /// Number of solvers that share the row.
    solvers: usize,
    errors: Errors,
}

/// Draws held-out and identification error of every strategy with every solver, and of the
/// procedure of [Chen2021].
pub fn strategies(comparison: &Comparison) -> Drawing {
    let mut entries: Vec<Entry> = Vec::new();
    for outcome in &comparison.strategies {
        // Solvers with the same result share a row.
        let (strategy, errors) = (outcome.strategy.as_str(), outcome.fitted);
        let is_same = |entry: &&mut Entry| {
            let ratio = entry.errors.held_out.mean.norm / errors.held_out.mean.norm;
            entry.strategy == strategy && (ratio - 1.0).abs() < 1e-3
        };
        if let Some(entry) = entries.iter_mut().find(is_same) {
            entry.solvers += 1;
            entry.name = format!("{strategy}, {} solvers", entry.solvers);
        } else {
            let name = format!("{strategy} {}", outcome.solver.as_str());
            entries.push(Entry { name, ..entry(strategy.to_owned(), errors) });
        }
    }
    let paper = comparison.paper.iter();
    entries.extend(paper.map(|procedure| entry(procedure.name(), procedure.errors)));
    let caption = "Mean position error of each strategy at the fitted and at the held-out poses, on a logarithmic scale. A \
                   wide gap between the two marks of a row means that the strategy fits noise. Solvers with the same result \
                   share a row.";
    let titles = ("Errors of the strategies", "Error of every strategy");
    draw_entries("strategies", titles, caption, &entries)
}

fn entry(strategy: String, errors: Errors) -> Entry {
    Entry { name: strategy.clone(), strategy, solvers: 1, errors }
}

/// Draws the errors with every part of the elasticity; `None` for an arm without elasticity.
pub fn ablations(comparison: &Comparison) -> Option<Drawing> {
    let entries: Vec<Entry> = comparison
        .ablations
        .iter()
        .map(|(part, outcome)| entry(part.as_str().to_owned(), outcome.fitted))
        .collect();
    let caption = "Mean position error with only this part of the elasticity in the model and everything else fitted, \
                   from rigid to complete, on a logarithmic scale.";
    let titles =
        ("Contribution of each part of the elasticity", "Error with parts of the elasticity");
    (entries.len() > 1).then(|| draw_entries("ablations", titles, caption, &entries))
}

/// Draws the errors after each round of a loop, with the effects it added.
pub fn rounds(closure: &ClosedLoop) -> Option<Drawing> {
    let after = |(k, round): (usize, &Round)| {
        let errors = Errors { identification: round.identification, held_out: round.held_out };
        entry(round_name(closure, k), errors)
    };
    let mut entries = vec![entry("as declared".to_owned(), closure.before.fit.fitted)];
    entries.extend(closure.rounds.iter().enumerate().map(after));
    let caption = "Mean position error after each round of the loop, at the fitted poses and at the held-out ones, which do not \
                   influence any choice, on a logarithmic scale. If the two diverge, a round has fitted noise.";
    let titles = ("Errors after each round", "Error after every round");
    (entries.len() > 1).then(|| draw_entries("rounds", titles, caption, &entries))
}

/// Draws entries with a title, and a label for screen readers.
fn draw_entries(
    name: &str,
    (title, label): (&str, &str),
    caption: &str,
    entries: &[Entry],
) -> Drawing {
    Drawing::new(name, title, caption, rows(entries, label)).with(sheet(entries))
}

/// Returns the change by a round, counted from 0.
fn round_name(closure: &ClosedLoop, k: usize) -> String {
    let before = k.checked_sub(1).map_or(&[][..], |last| closure.rounds[last].effects.as_slice());
    let effects = &closure.rounds[k].effects;
    let named =
        |effect: &Effect| format!("{} {}", effect.name(), effect.place()).trim_end().to_owned();
    let added: Vec<&Effect> = effects.iter().filter(|effect| !before.contains(effect)).collect();
    let change = match added.as_slice() {
        [] if effects.len() < before.len() => {
            format!("− {} of {}", before.len() - effects.len(), before.len())
        }
        [] => "no change".to_owned(),
        [single] => format!("+ {}", named(single)),
        [first, others @ ..] => format!("+ {} and {} more", named(first), others.len()),
    };
    format!("{} {change}", k + 1)
}

fn sheet(entries: &[Entry]) -> Sheet {
    let row = |entry: &Entry| {
        let errors = [entry.errors.identification.mean.norm, entry.errors.held_out.mean.norm];
        let errors = errors.map(|error| fixed(error * 1e3, 6));
        std::iter::once(entry.name.clone()).chain(errors).collect()
    };
    Sheet::new(&["name", "fitted_mean_mm", "held_out_mean_mm"], entries.iter().map(row).collect())
}

fn rows(entries: &[Entry], label: &str) -> String {
    let log_means = |entry: &Entry| {
        [entry.errors.identification.mean.norm, entry.errors.held_out.mean.norm]
            .map(|e| (e * 1e3).max(1e-9).log10())
    };
    let (low, high) = range(entries.iter().flat_map(log_means));
    let (low, high) = if low < high { ((low - 0.1), (high + 0.1)) } else { (low - 0.5, low + 0.5) };
    let bottom = TOP + ROW * i32::try_from(entries.len()).unwrap_or_default();
    let room = f64::from(WIDTH - NAMES - NUMBERS);
    let position = |value: f64| px(NAMES) + pixels((value - low) / (high - low) * room);
    let best = entries.iter().map(|entry| log_means(entry)[1]).fold(f64::INFINITY, f64::min);
    figure((WIDTH, bottom + BELOW), label, |area| {
        let marks = [("fitted poses", FAINT), ("held-out poses", INK), ("best", ACCENT)];
        legend(area, TOP, &marks.map(|(name, colour)| (name, colour, Mark::Dot)))?;
        for decade in -6..=6 {
            for step in [1.0_f64, 2.0, 5.0] {
                let value = f64::from(decade) + step.log10();
                if (low..=high).contains(&value) {
                    let at = position(value);
                    vertical_line(area, at, (TOP, bottom), GRID)?;
                    if step < 1.5 || high - low < MAX_LABELLED_DECADES {
                        let digits = usize::try_from(-decade).unwrap_or_default();
                        let number = number(10.0_f64.powf(value), digits);
                        write(area, &number, (at / px(1), bottom + 10), MUTED, HPos::Center)?;
                    }
                }
            }
        }
        for (k, entry) in (0..).zip(entries) {
            let y = TOP + ROW * k + ROW / 2;
            let [fitted, held_out] = log_means(entry);
            let colour = if held_out <= best + 1e-4 { ACCENT } else { INK };
            write(area, &entry.name, (NAMES - 10, y), INK, HPos::Right)?;
            if !(fitted.is_finite() && held_out.is_finite()) {
                write(area, "no result", (NAMES + 8, y), MUTED, HPos::Left)?;
                continue;
            }
            let ends = vec![(position(fitted), px(y)), (position(held_out), px(y))];
            area.draw(&PathElement::new(ends, line(FAINT, 1.4)))?;
            area.draw(&Circle::new((position(fitted), px(y)), pixels(3.4), FAINT.filled()))?;
            area.draw(&Circle::new((position(held_out), px(y)), pixels(3.4), colour.filled()))?;
            let value = entry.errors.held_out.mean.norm * 1e3;
            write(
                area,
                &number(value, decimals(value, 4) + 1),
                (WIDTH - 6, y),
                colour,
                HPos::Right,
            )?;
        }
        write(
            area,
            "mean position error [mm]",
            (NAMES + (WIDTH - NAMES - NUMBERS) / 2, bottom + 28),
            INK,
            HPos::Center,
        )
    })
}

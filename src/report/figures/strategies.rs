//! Strategies and parts of the elasticity side by side.

use super::prelude::*;
use crate::fit::{Comparison, Errors};
use crate::problem::Effect;
use crate::select::{ClosedLoop, Round};

const ROW: i32 = 22;
/// Room for names.
const NAMES: i32 = 236;
/// Room for numbers.
const NUMBERS: i32 = 66;
const TOP: i32 = 26;
/// Decades in which 2 and 5 have room for their numbers, too.
const CLOSE: f64 = 2.2;

struct Entry {
    strategy: String,
    name: String,
    /// How many solvers it stands for.
    solvers: usize,
    errors: Errors,
}

/// Held-out and identification error of every strategy with every solver, and of the paper's own
/// procedure.
pub fn strategies(comparison: &Comparison) -> Drawing {
    let mut entries: Vec<Entry> = Vec::new();
    for found in &comparison.strategies {
        // Solvers that end in the same place stand in one row.
        let (strategy, errors) = (found.strategy.as_str(), found.fitted);
        let same = |entry: &&mut Entry| {
            let ratio = entry.errors.held_out.mean.norm / errors.held_out.mean.norm;
            entry.strategy == strategy && (ratio - 1.0).abs() < 1e-3
        };
        if let Some(entry) = entries.iter_mut().find(same) {
            entry.solvers += 1;
            entry.name = format!("{strategy}, {} solvers", entry.solvers);
        } else {
            let name = format!("{strategy} {}", found.solver.as_str());
            entries.push(Entry { name, ..entry(strategy.to_owned(), errors) });
        }
    }
    entries.extend(comparison.paper.iter().map(|own| entry(own.name(), own.errors)));
    let caption = "Mean position error after each strategy, on the fitted poses and on those held out, on a logarithmic scale. A \
                   wide gap between the two marks of a row: the strategy has learned noise. Solvers that end in the same place \
                   share a row.";
    drawn("strategies", ("Strategies side by side", "Error of every strategy"), caption, &entries)
}

fn entry(strategy: String, errors: Errors) -> Entry {
    Entry { name: strategy.clone(), strategy, solvers: 1, errors }
}

/// The same for every part of the elasticity that is kept; nothing for an arm without any.
pub fn ablations(comparison: &Comparison) -> Option<Drawing> {
    let entries: Vec<Entry> = comparison
        .ablations
        .iter()
        .map(|(part, found)| entry(part.as_str().to_owned(), found.fitted))
        .collect();
    let caption = "Mean position error with only this part of the elasticity in the model, everything else fitted at once: from \
                   rigid to complete, on a logarithmic scale.";
    let titles =
        ("What each part of the elasticity is worth", "Error with parts of the elasticity");
    (entries.len() > 1).then(|| drawn("ablations", titles, caption, &entries))
}

/// The same after each round of a loop, with what it added.
pub fn rounds(closure: &ClosedLoop) -> Option<Drawing> {
    let after = |(k, round): (usize, &Round)| {
        let errors = Errors { identification: round.identification, held_out: round.held_out };
        entry(round_name(closure, k), errors)
    };
    let mut entries = vec![entry("as declared".to_owned(), closure.before.fit.fitted)];
    entries.extend(closure.rounds.iter().enumerate().map(after));
    let caption = "Mean position error after each round of the loop, on the fitted poses and on those held out, which took part in \
                   no choice, on a logarithmic scale. Where the two part, a round has learned noise.";
    (entries.len() > 1)
        .then(|| drawn("rounds", ("Round by round", "Error after every round"), caption, &entries))
}

/// Entries with a title, and a label for who cannot see them.
fn drawn(name: &str, (title, label): (&str, &str), caption: &str, entries: &[Entry]) -> Drawing {
    Drawing::new(name, title, caption, rows(entries, label)).with(sheet(entries))
}

/// What a round changed, counted from 0.
fn round_name(closure: &ClosedLoop, k: usize) -> String {
    let before = k.checked_sub(1).map_or(&[][..], |last| closure.rounds[last].effects.as_slice());
    let own = &closure.rounds[k].effects;
    let named =
        |effect: &Effect| format!("{} {}", effect.name(), effect.place()).trim_end().to_owned();
    let added: Vec<&Effect> = own.iter().filter(|effect| !before.contains(effect)).collect();
    let change = match added.as_slice() {
        [] if own.len() < before.len() => {
            format!("− {} of {}", before.len() - own.len(), before.len())
        }
        [] => "nothing more".to_owned(),
        [one] => format!("+ {}", named(one)),
        [one, rest @ ..] => format!("+ {} and {} more", named(one), rest.len()),
    };
    format!("{} {change}", k + 1)
}

fn sheet(entries: &[Entry]) -> Sheet {
    let row = |own: &Entry| {
        let errors = [own.errors.identification.mean.norm, own.errors.held_out.mean.norm];
        std::iter::once(own.name.clone()).chain(errors.map(|error| fixed(error * 1e3, 6))).collect()
    };
    Sheet::new(&["name", "fitted_mean_mm", "held_out_mean_mm"], entries.iter().map(row).collect())
}

fn rows(entries: &[Entry], label: &str) -> String {
    let of = |entry: &Entry| {
        [entry.errors.identification.mean.norm, entry.errors.held_out.mean.norm]
            .map(|e| (e * 1e3).max(1e-9).log10())
    };
    let (low, high) = range(entries.iter().flat_map(of));
    let (low, high) = if low < high { ((low - 0.1), (high + 0.1)) } else { (low - 0.5, low + 0.5) };
    let bottom = TOP + ROW * i32::try_from(entries.len()).unwrap_or_default();
    let room = f64::from(WIDTH - NAMES - NUMBERS);
    let place = |value: f64| px(NAMES) + pixels((value - low) / (high - low) * room);
    let best = entries.iter().map(|entry| of(entry)[1]).fold(f64::INFINITY, f64::min);
    figure((WIDTH, bottom + BELOW), label, |area| {
        let marks = [("fitted poses", FAINT), ("held-out poses", INK), ("best", ACCENT)];
        legend(area, TOP, &marks.map(|(name, colour)| (name, colour, Mark::Dot)))?;
        for decade in -6..=6 {
            for part in [1.0_f64, 2.0, 5.0] {
                let value = f64::from(decade) + part.log10();
                if (low..=high).contains(&value) {
                    let at = place(value);
                    upright(area, at, (TOP, bottom), GRID)?;
                    if part < 1.5 || high - low < CLOSE {
                        let digits = usize::try_from(-decade).unwrap_or_default();
                        let number = number(10.0_f64.powf(value), digits);
                        write(area, &number, (at / px(1), bottom + 10), MUTED, HPos::Center)?;
                    }
                }
            }
        }
        for (k, entry) in (0..).zip(entries) {
            let y = TOP + ROW * k + ROW / 2;
            let [fitted, held_out] = of(entry);
            let colour = if held_out <= best + 1e-4 { ACCENT } else { INK };
            write(area, &entry.name, (NAMES - 10, y), INK, HPos::Right)?;
            if !(fitted.is_finite() && held_out.is_finite()) {
                write(area, "no result", (NAMES + 8, y), MUTED, HPos::Left)?;
                continue;
            }
            let ends = vec![(place(fitted), px(y)), (place(held_out), px(y))];
            area.draw(&PathElement::new(ends, line(FAINT, 1.4)))?;
            area.draw(&Circle::new((place(fitted), px(y)), pixels(3.4), FAINT.filled()))?;
            area.draw(&Circle::new((place(held_out), px(y)), pixels(3.4), colour.filled()))?;
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

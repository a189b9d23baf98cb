//! Figures of the errors of strategies, of parts of the elasticity, and of rounds of a loop.

use super::prelude::*;
use crate::fit::{Comparison, Errors};
use crate::problem::Effect;
use crate::quantity::format::counted;
use crate::select::{ClosedLoop, Round};

/// Largest difference of the common logarithms of two errors at which both are marked as best.
const MAX_TIE_DIFFERENCE: f64 = 1e-4;

/// Number of characters of the name of an effect above which a figure shows the kind of the effect
/// alone.
const MAX_EFFECT_NAME: usize = 26;

/// Row of a figure: name and errors of one fit, or of several fits with equal errors.
struct Entry {
    strategy: String,
    name: String,
    /// Number of solvers that share the row.
    solvers: usize,
    errors: Errors,
}

/// Draws the mean held-out and identification errors of every strategy with every solver, and of
/// the procedures of \[Chen2021\].
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
            entries.push(Entry { name, ..entry(strategy.to_owned(), &errors) });
        }
    }
    let paper = comparison.paper.iter();
    entries.extend(paper.map(|procedure| entry(procedure.name(), &procedure.errors)));
    let caption = "Mean position error of each strategy at the fitted and at the held-out poses, on a logarithmic scale. A \
                   wide gap between the two marks of a row suggests that the strategy fits noise. \
                   Solvers with the same result share a row.";
    let titles = ("Errors of the strategies", "Error of every strategy");
    draw_entries("strategies", titles, caption, &entries, ("best", &best(&entries)))
}

/// Creates the row of one fit, whose name is that of its strategy, ablation or round.
fn entry(strategy: String, errors: &Errors) -> Entry {
    Entry { name: strategy.clone(), strategy, solvers: 1, errors: *errors }
}

/// Draws the mean errors of fits with only a part of the elasticity; `None` for an arm without
/// elasticity.
pub fn ablations(comparison: &Comparison) -> Option<Drawing> {
    let entries: Vec<Entry> = comparison
        .ablations
        .iter()
        .map(|(part, outcome)| entry(part.as_str().to_owned(), &outcome.fitted))
        .collect();
    let caption = "Mean position error with only this part of the elasticity in the model and everything else fitted, \
                   from rigid to complete, on a logarithmic scale.";
    let titles =
        ("Contribution of each part of the elasticity", "Error with parts of the elasticity");
    (entries.len() > 1)
        .then(|| draw_entries("ablations", titles, caption, &entries, ("best", &best(&entries))))
}

/// Draws the mean errors after each round of a loop, with the effects that the round added. `None`
/// without rounds.
pub fn draw_rounds(closure: &ClosedLoop) -> Option<Drawing> {
    let after = |(k, round): (usize, &Round)| {
        let errors = Errors {
            identification: round.identification,
            held_out: round.held_out,
            is_left_out: false,
        };
        entry(round_name(closure, k), &errors)
    };
    let mut entries = vec![entry("as declared".to_owned(), &closure.before.fit.fitted)];
    entries.extend(closure.rounds.iter().enumerate().map(after));
    let caption = "Mean position error after each round of the loop, at the fitted poses and at the held-out ones, which do not \
                   influence any choice, on a logarithmic scale. If the two diverge, a round may \
                   have fitted noise.";
    let titles = ("Errors after each round", "Error after every round");
    // A search that was interrupted, or that removed effects at its end, keeps another model than
    // that of its last round.
    let kept = closure.after.fitted.held_out;
    if entries.last().is_some_and(|last| last.errors.held_out != kept) {
        entries.push(entry("final fit".to_owned(), &closure.after.fitted));
    }
    let kept = [entries.len() - 1];
    (!closure.rounds.is_empty())
        .then(|| draw_entries("rounds", titles, caption, &entries, ("kept", &kept)))
}

/// Returns the indices of the fits with the smallest held-out error.
fn best(entries: &[Entry]) -> Vec<usize> {
    let errors = || entries.iter().map(|entry| entry.errors.held_out.mean.norm.max(1e-12).log10());
    let least = errors().fold(f64::INFINITY, f64::min);
    let ties = errors().enumerate().filter(|(_, error)| *error <= least + MAX_TIE_DIFFERENCE);
    ties.map(|(k, _)| k).collect()
}

/// Draws the mean errors of some fits as the figure `name` with a title; `label` describes the
/// figure for screen readers. The fits with the indices `accented` are emphasised, and `word` is
/// their name in the legend.
fn draw_entries(
    name: &str,
    (title, label): (&str, &str),
    caption: &str,
    entries: &[Entry],
    (word, accented): (&str, &[usize]),
) -> Drawing {
    let means = |entry: &Entry| {
        [entry.errors.identification.mean.norm, entry.errors.held_out.mean.norm].map(|e| e * 1e3)
    };
    let log_means = |entry: &Entry| means(entry).map(|mean| mean.max(1e-9).log10());
    let (low, high) = range(entries.iter().flat_map(log_means));
    let ends = if low < high { (low - 0.1, high + 0.1) } else { (low - 0.5, low + 0.5) };
    let marks = entries.iter().enumerate().flat_map(|(k, entry)| {
        let (row, [fitted, held_out]) = (k as f64, log_means(entry));
        if !(fitted.is_finite() && held_out.is_finite()) {
            return vec![Shape::text((ends.0, row), 8.0, "no result", MUTED)];
        }
        let colour = if accented.contains(&k) { ACCENT } else { INK };
        let value = means(entry)[1];
        let value = number(value, decimals(value, 4) + 1);
        vec![
            Shape::line([(fitted, row), (held_out, row)], Paint::line(FAINT, 1.4)),
            Shape::dot((fitted, row), 3.4, Paint::fill(FAINT), None),
            Shape::dot((held_out, row), 3.4, Paint::fill(colour), None),
            Shape::text((ends.1, row), 8.0, value, colour),
        ]
    });
    let names = entries.iter().map(|entry| (entry.name.clone(), INK));
    let x = Axis::logarithmic(ends, "mean position error [mm]", 5);
    let panel = Panel::of_rows(22.0, (250.0, 66.0), x, names).with(marks);
    let legend = [("fitted poses", FAINT), ("held-out poses", INK), (word, ACCENT)];
    let legend = legend.map(|(name, colour)| (name, colour, Mark::Dot));
    let rows = entries.iter().map(|entry| {
        let means = means(entry).map(|mean| fixed(mean, 6));
        std::iter::once(entry.name.clone()).chain(means).collect()
    });
    let data = sheet(["name", "fitted_mean_mm", "held_out_mean_mm"], rows);
    Drawing::new((name, title), caption, chart(label, &legend, &[panel]), data)
}

/// Returns the label of round `k` (from 0): its number from 1, and the effects that it added, or
/// the number that it removed.
fn round_name(closure: &ClosedLoop, k: usize) -> String {
    let named = |effect: &Effect| {
        let name = format!("{} {}", effect.name(), effect.place());
        match effect {
            _ if name.chars().count() <= MAX_EFFECT_NAME => name.trim_end().to_owned(),
            Effect::Law(law) => format!("a law of {}", law.site()),
            _ => effect.name().to_owned(),
        }
    };
    let (added, removed) = closure.changes_of_round(k);
    let change = match (added.as_slice(), removed.as_slice()) {
        ([], []) => "no change".to_owned(),
        ([], removed) => format!("{} removed", counted(removed.len(), "effect")),
        ([single], _) => format!("+ {}", named(single)),
        ([first, others @ ..], _) => format!("+ {} and {} more", named(first), others.len()),
    };
    format!("round {}: {change}", k + 1)
}

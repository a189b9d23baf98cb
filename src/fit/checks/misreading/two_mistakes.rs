//! Search for two mistakes at once: two misreadings, or one misreading and some wrong rows.

use super::explanation::Explanation;
use super::search::{MAX_EXPLAINED_RATIO, TRIAL_TOLERANCE, Trial, near_errors};
use super::{Kind, Misreading};
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::row_kind::listed_up_to;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::Split;
use crate::numeric::{median, parallel, root_mean, whole};
use crate::problem::Problem;

/// Maximum number of rows, evenly spaced, by which pairs of misreadings are ranked.
const MAX_RANKED_ROWS: usize = 24;
/// Maximum number of pairs that are fitted in full.
const MAX_FITTED_PAIRS: usize = 6;
/// Maximum number of misreadings that are tried without the rows that they leave farthest off.
const MAX_TRIMMED: usize = 40;
/// Share of the rows that a registration without wrong rows keeps.
const KEPT_SHARE: f64 = 0.85;
/// Number of registrations to the rows that fit the one before.
const PASSES: usize = 4;
/// Smallest ratio of the error of a wrong row to the median error with a misreading corrected.
const MIN_WRONG_RATIO: f64 = 8.0;
/// Maximum number of rows that the words list.
const MAX_LISTED: usize = 4;

/// Rows that are wrong with a misreading corrected, by their places among the chosen ones, with the
/// rms error of the registered nominal arm at the others \[m\].
struct Trimmed<'m> {
    misreading: &'m Misreading,
    wrong: Vec<usize>,
    error: f64,
}

impl Misreading {
    /// Returns true for a misreading that often comes with another one.
    fn is_usual(&self) -> bool {
        match self.kind {
            Kind::Reversed(joints) => joints.is_power_of_two(),
            Kind::Zero(_, degrees) => degrees % 90 == 0,
            Kind::Mirrored | Kind::Usual | Kind::UsualUnit(_) => true,
            _ => false,
        }
    }
}

impl Trial<'_> {
    /// Returns what explains a fit that no single misreading explains, with `error` \[m\]: one of the
    /// `tested` misreadings where some rows are wrong too, or two of them. `errors` are those of each by
    /// itself, in ascending order.
    pub(super) fn of_two_mistakes(
        &self,
        fit: &CheckedFit,
        (tested, errors): (&[Misreading], &[(Misreading, f64)]),
        error: f64,
    ) -> Vec<Explanation> {
        // The equilibrium of beams takes a time that forbids so many trials.
        let is_slow = fit.problem.joints.iter().any(|joint| joint.beam.is_some());
        match self.explained_without_rows(errors) {
            Some(explanation) => vec![explanation],
            None if is_slow => Vec::new(),
            None => {
                let few = Trial::with_rows(fit, MAX_RANKED_ROWS);
                self.explained_by_two(&few, tested, MAX_EXPLAINED_RATIO * error)
            }
        }
    }

    /// Returns the pairs of usual misreadings among those `tested` that leave less than `limit` \[m\]
    /// after a full fit, best first. `few` is the same trial with fewer rows, which ranks them.
    fn explained_by_two<'m>(
        &self,
        few: &Trial,
        tested: &'m [Misreading],
        limit: f64,
    ) -> Vec<Explanation> {
        let usual: Vec<&Misreading> = tested.iter().filter(|of| of.is_usual()).collect();
        let places: Vec<usize> = (0..usual.len()).collect();
        let of_first = |&place: &usize| {
            few.with_corrected(usual[place], false, |fitting, problem| {
                let inner = Trial::of_rows(fitting, problem, fitting.split.identification.clone());
                let error = |&second: &&'m Misreading| {
                    let is_other = second.key() != usual[place].key();
                    let error = inner.registered_error(second).filter(|_| is_other)?;
                    Some(([usual[place], second], error))
                };
                Some(usual[place + 1..].iter().filter_map(error).collect::<Vec<_>>())
            })
        };
        let pairs = parallel::map_items(&places, of_first);
        let mut pairs: Vec<([&Misreading; 2], f64)> =
            pairs.into_iter().flatten().flatten().collect();
        pairs.sort_by(|a, b| a.1.total_cmp(&b.1));
        pairs.truncate(MAX_FITTED_PAIRS);
        let explained = |([first, second], _): &([&Misreading; 2], f64)| {
            let explained = self.with_corrected(first, false, |fitting, problem| {
                let inner = Trial::of_rows(fitting, problem, fitting.split.identification.clone());
                inner.explained(std::slice::from_ref(*second), limit).into_iter().next()
            })?;
            let first = first.described(None);
            Some(Explanation { words: format!("{first}, and {}", explained.words), ..explained })
        };
        let mut explained: Vec<Explanation> = pairs.iter().filter_map(explained).collect();
        explained.sort_by(|a, b| a.rms.total_cmp(&b.rms));
        explained.truncate(1);
        explained
    }

    /// Returns the misreading among the first of `errors` that explains most rows where the others
    /// are wrong, after a full fit without these.
    fn explained_without_rows(&self, errors: &[(Misreading, f64)]) -> Option<Explanation> {
        let declared = Misreading::none();
        let as_read = self.trimmed(&declared)?.error;
        let leaves_rows_out =
            |of: &Misreading| matches!(of.kind, Kind::Shifted(..) | Kind::TextOrder);
        let tried = errors.iter().map(|(misreading, _)| misreading);
        let tried = tried.filter(|misreading| !leaves_rows_out(misreading)).take(MAX_TRIMMED);
        let trimmed = parallel::map_items(&tried.collect::<Vec<_>>(), |&of| self.trimmed(of));
        let mut trimmed: Vec<Trimmed> = trimmed.into_iter().flatten().collect();
        trimmed.sort_by(|a, b| a.error.total_cmp(&b.error));
        let errors: Vec<f64> = trimmed.iter().map(|of| of.error).collect();
        let near = &trimmed[..near_errors(&errors, as_read)];
        let best = near.first()?;
        let near: Vec<Misreading> = near.iter().map(|of| of.misreading.clone()).collect();
        let wrong = best.wrong.clone();
        if wrong.is_empty() {
            return None;
        }
        let kept = (0..self.chosen.len()).filter(|place| !wrong.contains(place));
        let kept = kept.map(|place| self.chosen[place]).collect();
        let without = Trial::of_rows(self.fitting, self.problem, kept);
        let explained = without.explained(&near, MAX_EXPLAINED_RATIO * as_read);
        let best = explained.into_iter().next()?;
        let table = self.fitting.measurements;
        let places: Vec<String> =
            wrong.iter().map(|&place| table.location(self.chosen[place]).to_string()).collect();
        let (noun, verb) = if wrong.len() == 1 { ("row", "is") } else { ("rows", "are") };
        let words = format!(
            "{}, and without the {noun} {}, which {verb} wrong besides",
            best.words,
            listed_up_to(&places, MAX_LISTED)
        );
        Some(Explanation { words, ..best })
    }

    /// Registers the nominal arm with a misreading corrected to most rows, those that it leaves
    /// nearest, again and again.
    fn trimmed<'m>(&self, misreading: &'m Misreading) -> Option<Trimmed<'m>> {
        self.with_corrected(misreading, false, |fitting, _: &Problem| {
            let Fitting { placement, model, measurements, .. } = *fitting;
            let rows = fitting.leading_rows();
            let mut kept = rows.clone();
            let mut lengths = Vec::new();
            for _ in 0..PASSES {
                let split = &Split { identification: kept, held_out: Vec::new() };
                let held_out_only = placement.held_out_only(model, measurements, split);
                let declared = fitting.with_declared_noise();
                let x = Fitting { split, held_out_only, ..declared }
                    .registered_to(TRIAL_TOLERANCE)
                    .ok()?;
                let errors = fitting.position_errors(&rows, &x);
                lengths =
                    rows.iter().zip(errors).map(|(&row, error)| (row, error.norm())).collect();
                lengths.sort_by(|a: &(usize, f64), b| a.1.total_cmp(&b.1));
                let count = whole((KEPT_SHARE * rows.len() as f64).ceil());
                kept = lengths.iter().take(count).map(|(row, _)| *row).collect();
                kept.sort_unstable();
            }
            let limit = MIN_WRONG_RATIO * median(lengths.iter().map(|(_, length)| *length))?;
            let first_wrong = lengths.partition_point(|(_, length)| *length <= limit);
            let (kept, wrong) = lengths.split_at(first_wrong);
            let error = root_mean(kept.iter().map(|(_, length)| length.powi(2)));
            let mut wrong: Vec<usize> = wrong.iter().map(|(row, _)| *row).collect();
            wrong.sort_unstable();
            Some(Trimmed { misreading, wrong, error })
        })
    }
}

//! Search for wrong masses, places of masses and suspension forces of an arm that gives way.

use super::Misreading;
use super::candidates::of_shifted_payloads;
use super::explanation::Explanations;
use super::loads::{
    MassScale, NEWTONS, POUNDS, TENFOLD, TENTH, of_gravity, of_hoists, of_masses, of_places,
};
use super::payload_rows::of_payload_rows;
use super::search::Trial;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::stages::fitting::Fitting;
use crate::numeric::parallel;

/// Scales of masses that an arm with compliances nearly makes up for.
const MASS_SCALES: [MassScale; 4] = [TENTH, TENFOLD, POUNDS, NEWTONS];
/// Maximum number of rows, evenly spaced, by which the misreadings are ranked.
const MAX_RANKED_ROWS: usize = 40;
/// Rounds of the ranking: solver steps of each fit, and the number of misreadings that remain. Those
/// of the last round are fitted in full. A fit to wrong loads is many steps from that to the right
/// ones.
const ROUNDS: [(u64, usize); 2] = [(2, 16), (10, 4)];

impl CheckedFit<'_> {
    /// Returns the masses in another unit or at another place that leave at most `limit` \[m\]. For a
    /// fit near the noise, they replace the other misreadings.
    pub fn misread_masses(&self, limit: f64) -> &Explanations {
        self.explanations.get_or_init(|| misread_masses(self, limit, true))
    }
}

/// Returns the rms error of the fit as declared with the deviations from priors included \[m\].
pub(in crate::fit) fn error_with_priors(fit: &CheckedFit) -> f64 {
    Trial::new(fit).error_as_read(fit)
}

/// Finds the masses in another unit or at another place that leave at most `limit` \[m\] after a full
/// fit, where the fit as declared leaves more than noise. An arm that gives way hides such a mistake
/// in other parameters, so that the nominal arm does not show it.
///
/// The misreadings are ranked by steps from the end of the fit, or from the registered nominal arm
/// if the fit is not `within_priors`: a fit to the wrong loads may end far from the arm.
pub(in crate::fit) fn misread_masses(
    fit: &CheckedFit,
    limit: f64,
    within_priors: bool,
) -> Explanations {
    let gives_way = fit.model().parameters.iter().any(|parameter| parameter.site.is_elastic());
    if !gives_way && !fit.problem.is_elastic() {
        return Explanations::default();
    }
    let measurements = fit.table();
    let mut tested = of_masses(fit.problem, measurements, &MASS_SCALES);
    tested.extend(of_places(fit.problem, measurements));
    tested.extend(of_hoists(fit.problem));
    tested.extend(of_gravity());
    tested.extend(of_shifted_payloads(measurements));
    let (few, end) = (Trial::with_rows(fit, MAX_RANKED_ROWS), &fit.end.x);
    let error = |misreading: &Misreading, steps: u64| {
        let error = few.with_corrected(misreading, false, |fitting, _| {
            let fitting = Fitting { max_steps: Some(steps), ..fitting.with_declared_noise() };
            if fitting.model.parameters.len() != end.len() {
                return None;
            }
            let end = if within_priors { fitting.run(end).ok()? } else { fitting.refitted()? };
            Some(few.penalised(&fitting, &fitting.split.identification, &end.x))
        })?;
        error.is_finite().then(|| (misreading.clone(), error))
    };
    for (steps, left) in ROUNDS {
        let ranked = parallel::map_items(&tested, |misreading| error(misreading, steps));
        let mut ranked: Vec<(Misreading, f64)> = ranked.into_iter().flatten().collect();
        ranked.sort_by(|a, b| a.1.total_cmp(&b.1));
        tested = ranked.into_iter().map(|(misreading, _)| misreading).take(left).collect();
    }
    let trial = Trial::new(fit);
    let as_read = trial.error_as_read(fit);
    let limit = limit.min(as_read).min(trial.refitted_error(fit));
    let mut fitted = trial.explained(&tested, limit);
    if fitted.is_empty() {
        fitted.extend(of_payload_rows(&trial, fit, limit));
    }
    Explanations { fitted, as_read, ..Explanations::default() }
}

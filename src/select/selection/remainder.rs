//! Remainder in addition to the effects that the loop found.

use crate::fit::{Finding, FindingCode, IdentifyError};
use crate::measurement::Dataset;
use crate::problem::Problem;
use crate::remainder::{self, Fitted};
use crate::select::evidence::Hypothesis;
use crate::select::harmonic_prior::is_periodic_of_many_orders;
use crate::select::unexplained::{self, Unexplained};

use super::close::{ClosedLoop, FoundAlone};
use super::found::Found;
use super::status::{Status, Verdict};

/// Largest probability of noise alone beside a law that is probable.
const MAX_NOISE_PROBABILITY: f64 = 0.5;

impl ClosedLoop {
    /// Fits a remainder in addition to the effects, which may replace uncertain ones. No remainder
    /// is fitted if the loop was interrupted or the table was misread.
    ///
    /// Effects without the status [`Status::Found`] are one of several explanations of an error,
    /// chosen because they fit it best. If there are such effects and a remainder is kept beside
    /// them, a remainder is also fitted beside the found effects alone. It describes the error by a
    /// smooth function, whatever its law, and therefore often predicts better. The uncertain
    /// effects then stay only if left-out configurations are predicted better with them by more
    /// than chance. Otherwise they become structure without a law. They always stay if the verdict
    /// is [`Verdict::Explained`], if measured orientations are fitted, if data contradict an effect,
    /// if the fit without them is not trusted, or if the fit with them does not describe the arm,
    /// which makes all of its effects uncertain.
    ///
    /// # Errors
    /// Returns an error if `data` are not those of the loop.
    #[doc(hidden)]
    pub fn corrected(self, data: &Dataset) -> Result<(Self, Option<Fitted>), IdentifyError> {
        let (mut closed, fitted) = self.with_remainder(data)?;
        if let Some(fitted) = &fitted {
            fitted.judge_held_out(&mut closed.after);
        }
        Ok((closed, fitted))
    }

    /// Fits the remainder of [`corrected`](Self::corrected).
    fn with_remainder(mut self, data: &Dataset) -> Result<(Self, Option<Fitted>), IdentifyError> {
        let found_alone = self.found_alone.take();
        if self.interrupted || self.after.has(FindingCode::Misread) {
            return Ok((self, None));
        }
        let with_all = remainder::fit(&self.after, &self.closed, data)?;
        let is_kept = |fitted: &&Fitted| fitted.remainder.is_some();
        let found_alone = found_alone.filter(|_| self.verdict != Verdict::Explained);
        let (Some(kept), Some(alone)) = (with_all.as_ref().filter(is_kept), found_alone) else {
            return Ok((self, with_all));
        };
        let instead = remainder::fit(&alone.found, &alone.problem, data)?;
        match instead.filter(|instead| is_kept(&instead) && !kept.is_better_than(instead)) {
            Some(instead) => Ok((self.with_found_alone(*alone), Some(instead))),
            None => Ok((self, with_all)),
        }
    }

    /// Returns the result with the found effects alone; the other ones become structure without a
    /// law.
    fn with_found_alone(self, alone: FoundAlone) -> Self {
        let FoundAlone { mut found, problem, residual_tests, gain } = alone;
        let (mut effects, others): (Vec<Found>, Vec<Found>) =
            self.effects.into_iter().partition(|found| {
                problem.effects.iter().any(|declared| declared.effect.covers(&found.effect))
            });
        for effect in &mut effects {
            for estimate in &mut effect.estimates {
                let refitted = found.estimates.iter().find(|other| other.name == estimate.name);
                *estimate = refitted.cloned().unwrap_or_else(|| estimate.clone());
            }
            effect.held_out_after = found.fitted.held_out;
        }
        let mut unexplained = self.unexplained;
        unexplained.retain(|left| left.site.is_some());
        unexplained.extend(others.into_iter().filter_map(|found| structure(found, &self.closed)));
        let place = |left: &Unexplained| left.claims.as_ref().map_or(0.0, |of| of.place.1);
        unexplained.sort_by(|a, b| place(b).total_cmp(&place(a)));
        if unexplained.is_empty() {
            unexplained.extend(unexplained::unlocated(&residual_tests));
        }
        found.findings.iter_mut().for_each(Finding::set_remedy_after_loop);
        let has_gear = effects.iter().any(|found| is_periodic_of_many_orders(&found.effect));
        Self {
            verdict: Verdict::Unexplained,
            after: found,
            closed: problem,
            effects,
            unexplained,
            residual_tests,
            gain,
            harmonic_prior: self.harmonic_prior.filter(|_| has_gear),
            ..self
        }
    }
}

/// Returns the structure that an effect of `problem` leaves if it is not used; `None` if neither
/// claims nor its p-value say that there is any.
fn structure(found: Found, problem: &Problem) -> Option<Unexplained> {
    let hypothesis = Hypothesis::of_effect(&found.effect, problem, (false, false));
    // A probable law is more probable than noise.
    let limit = if found.status == Status::Probable { MAX_NOISE_PROBABILITY } else { 1.0 };
    let p_value = found.p_value.min(limit);
    let is_seen = found.claims.is_some() || p_value <= MAX_NOISE_PROBABILITY;
    let (site, depends_on) = match &found.claims {
        Some(claims) => (claims.place.0, claims.depends_on.0.clone()),
        None => (hypothesis.site, hypothesis.depends_on),
    };
    is_seen.then_some(Unexplained {
        site: Some(site),
        depends_on,
        p_value,
        claims: found.claims,
        correction: None,
    })
}

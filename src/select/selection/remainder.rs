//! Remainder in addition to the effects that the loop found.

use crate::fit::{Finding, FindingCode, Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::numeric::Interval;
use crate::problem::Problem;
use crate::remainder::{self, Fitted};
use crate::residual_tests::ResidualTests;
use crate::select::harmonic_prior::is_periodic_of_many_orders;
use crate::select::unexplained::{self, Unexplained};

use super::close::ClosedLoop;
use super::found::Found;
use super::status::{Status, Verdict};

/// Fit of the declared problem with the effects of status [`Status::Found`] alone, and its tests.
#[derive(Debug, Clone)]
pub(super) struct FoundAlone {
    pub found: Identification,
    pub problem: Problem,
    pub residual_tests: ResidualTests,
    /// Reduction of the error on held-out rows, as [`ClosedLoop::gain`] is.
    pub gain: Interval,
}

impl ClosedLoop {
    /// Fits a remainder in addition to the effects, which may replace uncertain ones. No remainder
    /// is fitted if the loop was interrupted or the table was misread.
    ///
    /// Effects without the status [`Status::Found`] are one of several explanations of an error,
    /// chosen because they fit it best. If there are such effects and a remainder is kept beside
    /// them, a remainder is also fitted beside the found effects alone. It describes the error by a
    /// smooth function, whatever its law, and therefore often predicts better. The uncertain
    /// effects then stay only if left-out configurations are predicted better with them by more
    /// than chance. Otherwise they become structure without a law.
    ///
    /// # Errors
    /// Returns an error if `data` are not those of the loop.
    pub fn corrected(mut self, data: &Dataset) -> Result<(Self, Option<Fitted>), IdentifyError> {
        let found_alone = self.found_alone.take();
        if self.interrupted || self.after.has(FindingCode::Misread) {
            return Ok((self, None));
        }
        let with_all = remainder::fit(&self.after, &self.closed, data)?;
        let is_kept = |fitted: &&Fitted| fitted.remainder.is_some();
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
    fn with_found_alone(mut self, alone: FoundAlone) -> Self {
        let FoundAlone { mut found, problem, residual_tests, gain } = alone;
        let (effects, others): (Vec<Found>, Vec<Found>) =
            self.effects.into_iter().partition(|found| found.status == Status::Found);
        self.unexplained.extend(others.into_iter().filter_map(structure));
        if self.unexplained.is_empty() {
            self.unexplained.extend(unexplained::unlocated(&residual_tests));
        }
        found.findings.iter_mut().for_each(Finding::set_remedy_after_loop);
        let has_gear = effects.iter().any(|found| is_periodic_of_many_orders(&found.effect));
        Self {
            verdict: Verdict::Unexplained,
            after: found,
            closed: problem,
            effects,
            residual_tests,
            gain,
            harmonic_prior: self.harmonic_prior.filter(|_| has_gear),
            ..self
        }
    }
}

/// Returns the structure that an effect without a sure law leaves if it is not used; `None` without
/// claims about it.
fn structure(found: Found) -> Option<Unexplained> {
    let claims = found.claims?;
    Some(Unexplained {
        site: Some(claims.place.0),
        depends_on: claims.depends_on.0.clone(),
        p_value: found.p_value,
        claims: Some(claims),
        correction: None,
    })
}

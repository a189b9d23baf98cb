//! Status of each effect, which says what may be claimed of it, and the verdict that follows.

use schemars::JsonSchema;
use serde::Serialize;

use crate::select::SelectionRules;
use crate::select::reference_check::ReferenceVerdict;

/// Smallest probability at which a law is more probable than all others together.
const MIN_PROBABLE: f64 = 0.5;
/// Largest corrected p-value of an effect whose law may be stated. Beyond it, noise alone improves the
/// fit as much as the effect does, whatever the linearised evidence says.
const MAX_P_VALUE: f64 = 0.9;

/// Strongest claim about an effect of the extended problem, the strongest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// An effect with this law acts: the probability of the law is at least
    /// [`stated`](crate::select::SelectionRules::stated).
    Found,
    /// The probability of the effect's law is above one half, but below that of `found`.
    Probable,
    /// At most the place of the cause is established: the law is one of several candidates.
    Located,
    /// Measurements that are independent of the fit contradict the effect.
    Contradicted,
}

impl Status {
    /// Returns the word for the status in result files.
    #[doc(hidden)]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Probable => "probable",
            Self::Located => "located",
            Self::Contradicted => "contradicted",
        }
    }

    /// Returns the status of an effect. `law` is the probability of its law, `None` if no evidence
    /// was evaluated; the effect is then found if its F test, with the p-value `p_value`, is
    /// significant. `witness` is the verdict of measurements that were not fitted.
    pub(super) fn of(
        law: Option<f64>,
        rules: &SelectionRules,
        (p_value, witness): (f64, Option<ReferenceVerdict>),
    ) -> Self {
        match law {
            _ if witness == Some(ReferenceVerdict::Contradicted) => Self::Contradicted,
            _ if p_value > MAX_P_VALUE => Self::Located,
            None if p_value < rules.leaving_level => Self::Found,
            Some(law) if law >= rules.stated => Self::Found,
            Some(law) if law >= MIN_PROBABLE => Self::Probable,
            _ => Self::Located,
        }
    }
}

/// Outcome of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No effect was found and the residual shows no structure.
    NothingFound,
    /// The effects with status `found` alone leave a residual that passes the tests.
    Explained,
    /// Structure remains in the residual, or no effect has the status `found`.
    Unexplained,
}

impl Verdict {
    /// Returns the word for the verdict in result files.
    #[doc(hidden)]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::NothingFound => "nothing-found",
            Self::Explained => "explained",
            Self::Unexplained => "unexplained",
        }
    }

    /// Returns the verdict on effects with these statuses. `is_noise` is true if the fit with all
    /// effects leaves only noise, `is_noise_with_found` if the fit with the effects of status
    /// `found` alone does.
    pub(super) fn of(statuses: &[Status], is_noise: bool, is_noise_with_found: bool) -> Self {
        match statuses {
            [] if is_noise => Self::NothingFound,
            _ if !is_noise || statuses.contains(&Status::Contradicted) => Self::Unexplained,
            _ if is_noise_with_found && statuses.contains(&Status::Found) => Self::Explained,
            _ => Self::Unexplained,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_claims_no_more_than_the_probability_of_the_law() {
        let rules = SelectionRules::default();
        let status = |law, p_value| Status::of(law, &rules, (p_value, None));
        assert_eq!(status(None, 1e-3), Status::Found);
        assert_eq!(status(None, 0.3), Status::Located);
        assert_eq!(status(Some(0.95), 0.3), Status::Found);
        assert_eq!(status(Some(0.95), 1.0), Status::Located);
        assert_eq!(status(Some(0.7), 1e-3), Status::Probable);
        assert_eq!(status(Some(0.3), 1e-3), Status::Located);
        let against = (1e-3, Some(ReferenceVerdict::Contradicted));
        assert_eq!(Status::of(Some(0.99), &rules, against), Status::Contradicted);
    }

    #[test]
    fn explained_means_that_what_is_sure_leaves_noise() {
        let verdict = |statuses: &[Status], with_found| Verdict::of(statuses, true, with_found);
        assert_eq!(verdict(&[], true), Verdict::NothingFound);
        assert_eq!(verdict(&[Status::Found], true), Verdict::Explained);
        assert_eq!(verdict(&[Status::Probable], false), Verdict::Unexplained);
        assert_eq!(verdict(&[Status::Probable], true), Verdict::Unexplained);
        assert_eq!(verdict(&[Status::Found, Status::Located], false), Verdict::Unexplained);
        assert_eq!(verdict(&[Status::Found, Status::Located], true), Verdict::Explained);
        assert_eq!(verdict(&[Status::Found, Status::Contradicted], true), Verdict::Unexplained);
        assert_eq!(Verdict::of(&[], false, false), Verdict::Unexplained);
    }
}

//! Contradiction of new rows with an earlier estimate, and its most probable cause.

use std::path::Path;

use nalgebra::DVector;
use serde_json::json;

use super::assessment::Assessment;
use super::causes::{Cause, CauseKind, Extended};
use super::relocation::Placed;
use super::rows::SensitiveRows;
use crate::fit::{Finding, FindingCode};

/// Cause for which new rows contradict the earlier estimate.
pub(super) struct Contradiction {
    /// Name of the cause for people.
    pub label: String,
    /// Probability of the cause, given that something changed.
    pub probability: f64,
    /// Independent changes by which the prior is widened. Each lists the indices of the model's
    /// parameters that change together, with the size of their change.
    pub widened: Vec<Vec<(usize, f64)>>,
    /// Placement whose pose is fitted without its prior, with the full parameter vector at its new
    /// pose.
    pub relocated: Option<(Placed, DVector<f64>)>,
    /// True if the cause moves parameters, all of which the problem holds.
    pub is_held: bool,
    /// True if the cause is two changes together, and the problem holds some of their parameters.
    pub is_part_held: bool,
    /// Name of the free parameters that are widened instead of held ones, because they move the
    /// rows in the same way.
    pub instead: Option<String>,
    /// Ratio of the noise to the assumed one, if the cause is larger noise.
    pub noise_ratio: Option<f64>,
}

impl Contradiction {
    /// Returns the contradiction of a placement that was moved, with the full parameter vector at
    /// its new pose.
    pub fn of_place(place: (Placed, DVector<f64>), probability: f64) -> Self {
        Self {
            label: place.0.label.clone(),
            probability,
            widened: Vec::new(),
            relocated: Some(place),
            is_held: false,
            is_part_held: false,
            instead: None,
            noise_ratio: None,
        }
    }

    /// Returns the contradiction with a new pose of the placement that it names, if that is one of
    /// `moved`. A camera or marker that was moved says nothing of where it stands now.
    pub fn with_place(self, moved: &[(Placed, DVector<f64>)]) -> Self {
        let is_it = |(placed, _): &&(Placed, DVector<f64>)| {
            let moved = self.widened.iter().flatten().map(|(k, _)| k);
            !placed.is_base && moved.eq(&placed.parameters)
        };
        match moved.iter().find(is_it) {
            Some(found) => Self { widened: Vec::new(), relocated: Some(found.clone()), ..self },
            None => self,
        }
    }

    /// Returns the finding that the new rows contradict the prior in `file`, which is that of a
    /// fleet if `is_of_fleet`. `index` is the number of causes that were found before this one.
    fn finding(&self, index: usize, (file, is_of_fleet): (&Path, bool)) -> Finding {
        let is_refitted = self.relocated.is_some() || !self.widened.is_empty();
        let treatment = match (self.widened.is_empty(), self.noise_ratio) {
            _ if self.relocated.is_some() => {
                "; its place is fitted anew, without the earlier one".to_owned()
            }
            _ if self.instead.is_some() => format!(
                "; the problem holds its parameters, so the prior of {}, which moves these rows in \
                                the same way, was widened",
                self.instead.as_deref().unwrap_or_default()
            ),
            _ if self.is_held => {
                "; the problem holds its parameters, so that the change goes into \
                                  others: free them in [parameters]"
                    .to_owned()
            }
            (false, _) if self.is_part_held => {
                "; the prior of those of its parameters that the problem frees was widened"
                    .to_owned()
            }
            (false, _) => "; the prior of its parameters was widened".to_owned(),
            (true, Some(ratio)) => {
                format!("; the fit assumes {ratio:.1} times the σ that the earlier fit assumed")
            }
            (true, None) => String::new(),
        };
        let cause = if self.noise_ratio.is_some() {
            let what = if index == 0 { "them" } else { "the rest" };
            format!("no change that was tried explains {what} as well as {}", self.label)
        } else {
            let probability = 100.0 * self.probability;
            format!("most probable of the changes tried: {} ({probability:.0} %)", self.label)
        };
        let more = match index {
            0 => " (a false alarm in at most one of 100 fits)",
            _ => " in more than was named before",
        };
        let text = format!("the new rows contradict {}{more}; {cause}{treatment}", file.display());
        let numbers = [json!(self.label), self.probability.into(), json!(is_refitted)];
        let remedy = if is_of_fleet {
            "find how this arm differs from those of the fleet"
        } else {
            "find what happened to the arm since that estimate (flexcal watch looks for it)"
        };
        Finding::new(FindingCode::EarlierEstimateContradicted, numbers, text)
            .with_remedy(remedy.to_owned())
    }
}

/// Returns the findings that new rows contradict the prior in a file, one for each of the `causes`.
/// `prior` is the file, and whether it is of a fleet.
pub(super) fn findings(causes: &[Contradiction], prior: (&Path, bool)) -> Vec<Finding> {
    causes.iter().enumerate().map(|(k, cause)| cause.finding(k, prior)).collect()
}

/// Rewrites findings on a fit that a contradicted prior in `file` forces: they say nothing of table,
/// σ or model. `chi2` is χ² of the new rows under the prior and its degrees of freedom.
pub(super) fn attribute_to_prior(findings: &mut [Finding], file: &Path, chi2: Option<(f64, f64)>) {
    let chi2 = chi2.map_or_else(String::new, |(chi2, coordinates)| {
        format!(" (χ² {chi2:.0} of {coordinates:.0} coordinates)")
    });
    for finding in findings {
        match finding.code {
            FindingCode::BeyondPrior => {
                finding.text = format!(
                    "the new rows contradict the prior {}{chi2}: {}",
                    file.display(),
                    finding.text
                );
                "these rows are of another arm, or it has changed; fit without --prior"
                    .clone_into(&mut finding.remedy);
            }
            FindingCode::HeldOutWorse
            | FindingCode::HeldOutBeyondPrediction
            | FindingCode::HeldOutNotBetter
            | FindingCode::HeldOutOutliers
            | FindingCode::NoiseBeyondDeclared
            | FindingCode::ResidualBeyondDeclared => {
                "the contradicted prior may cause that: fit without --prior"
                    .clone_into(&mut finding.remedy);
            }
            _ => {}
        }
    }
}

/// Returns the most probable cause; `None` if there are no causes. `extended` is the model to whose
/// columns the causes belong, and `rows` are the tested rows.
pub(super) fn most_probable(
    assessed: &Assessment,
    (causes, location): (&[Cause], impl Fn(usize) -> String),
    (extended, rows): (&Extended, &SensitiveRows),
) -> Option<Contradiction> {
    let first = assessed.causes.first()?;
    let cause = &causes[first.cause];
    let size = |i: usize| first.sizes[i].max(first.mean[i].abs());
    let is_held = extended.is_held(cause);
    let is_part_held = cause.kind == CauseKind::Two
        && cause.terms.iter().flatten().any(|&(k, _)| k >= extended.declared);
    let sizes: Vec<f64> = (0..first.sizes.len()).map(size).collect();
    let instead = is_held.then(|| extended.free_instead(cause, &sizes, rows)).flatten();
    let (instead, widened) = if let Some((label, widened)) = instead {
        (Some(label), widened.into_iter().map(|moved| vec![moved]).collect())
    } else {
        let is_free = |(k, _): &(usize, f64)| *k < extended.declared;
        let moved = cause.terms.iter().zip(sizes).map(|(terms, size)| -> Vec<(usize, f64)> {
            terms.iter().map(|&(k, factor)| (k, factor * size)).filter(is_free).collect()
        });
        (None, moved.filter(|moved| !moved.is_empty()).collect())
    };
    // A misfit that no cause explains looks like noise.
    let label = match cause.kind {
        CauseKind::Noise => "larger noise or something that the model lacks".to_owned(),
        _ => first.label(causes, location),
    };
    Some(Contradiction {
        label,
        probability: first.probability,
        widened,
        relocated: None,
        is_held,
        is_part_held,
        instead,
        noise_ratio: (cause.kind == CauseKind::Noise).then(|| first.mean[0]),
    })
}

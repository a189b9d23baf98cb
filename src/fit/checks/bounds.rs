//! Check of the bounds and constraints on which a fit rests.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::row_kind::listed_up_to;
use crate::fit::uncertainty::hidden_by_limit::{HiddenByLimit, Limit};
use crate::least_squares::solver::AtBound;

/// Maximum number of parameters, of those whose uncertainty a bound hides, that the text of the
/// finding names.
const MAX_NAMED_PARTNERS: usize = 5;

/// Checks that no bound and no constraint on which the fit rests hides the uncertainty of
/// parameters.
pub(super) fn bounds_are_seen(fit: &CheckedFit) -> Vec<Finding> {
    let parameters: Vec<_> = fit.whole.parameters().collect();
    let finding = |valley: &HiddenByLimit| {
        let HiddenByLimit { limit, side, deviation, direction, partners } = valley;
        let mut names: Vec<&str> = Vec::new();
        let mut order = partners.clone();
        order.sort_by(|&a, &b| direction[b].abs().total_cmp(&direction[a].abs()));
        names.extend(order.iter().map(|&k| parameters[k].name.as_str()));
        let first = listed_up_to(&names, MAX_NAMED_PARTNERS);
        let (side, place) = match side {
            AtBound::Lower => ("lower", 0),
            AtBound::Upper => ("upper", 1),
        };
        let (name, text) = match *limit {
            Limit::Bound(unknown) => {
                let name = &parameters[unknown].name;
                let text = format!(
                    "{name} rests on its {side} bound; the data hardly determine more than one \
                     combination of it with {first}, and standard errors allow for all values of \
                     {name} within its bounds"
                );
                (name.clone(), text)
            }
            Limit::Constraint(index) => {
                let constraint = &fit.whole.model.constraints[index];
                let limit = constraint.limits[place].as_deref().unwrap_or_default();
                let name = format!("{} {limit}", constraint.sum);
                let text = format!(
                    "the fit rests on the limit of the constraint {name}; the data hardly \
                     determine {first} otherwise, and standard errors allow for all values that \
                     the constraint permits"
                );
                (name, text)
            }
        };
        let numbers = [json!(name), side.into(), (*deviation).into(), json!(names)];
        Finding::new(FindingCode::BoundInUnidentifiedDirection, numbers, text)
    };
    fit.statistics.hidden.iter().map(finding).collect()
}

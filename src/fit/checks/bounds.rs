//! Check of the bounds at which fitted parameters are.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::row_kind::listed_up_to;
use crate::fit::uncertainty::hidden_by_bound::HiddenByBound;
use crate::least_squares::solver::AtBound;

/// Maximum number of parameters, of those whose uncertainty a bound hides, that the text of the
/// finding names.
const MAX_NAMED_PARTNERS: usize = 5;

/// Checks that no parameter is at a bound that hides the uncertainty of other parameters.
pub(super) fn bounds_are_seen(fit: &CheckedFit) -> Vec<Finding> {
    let parameters: Vec<_> = fit.whole.parameters().collect();
    let finding = |valley: &HiddenByBound| {
        let HiddenByBound { unknown, side, deviation, direction, partners } = valley;
        let (parameter, side) = (
            parameters[*unknown],
            match side {
                AtBound::Lower => "lower",
                AtBound::Upper => "upper",
            },
        );
        let name = &parameter.name;
        let mut names: Vec<&str> = Vec::new();
        let mut order = partners.clone();
        order.sort_by(|&a, &b| direction[b].abs().total_cmp(&direction[a].abs()));
        names.extend(order.iter().map(|&k| parameters[k].name.as_str()));
        let first = listed_up_to(&names, MAX_NAMED_PARTNERS);
        let text = format!(
            "{name} rests on its {side} bound; the data hardly determine more than one \
             combination of it with {first}, and standard errors allow for all values of \
             {name} within its bounds"
        );
        let numbers = [json!(name), side.into(), (*deviation).into(), json!(names)];
        Finding::new(FindingCode::BoundInUnidentifiedDirection, numbers, text)
    };
    fit.hidden.iter().map(finding).collect()
}

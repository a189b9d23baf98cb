//! Sentence that says whether a fit is to be trusted.

use super::errors::{judging, with_unit};
use crate::fit::Identification;
use crate::quantity::format::number;
use crate::results::ResidualSize;

/// States whether the fit is to be trusted, the held-out error before and after it, and how much
/// its residual exceeds the declared noise. `has_bound` is true if the text states an error bound.
pub(super) fn outcome(found: &Identification, has_bound: bool) -> String {
    if let Some(reason) = found.first_error() {
        return format!("Not to be trusted: {reason}.");
    }
    let [before, after] = [&found.registered, &found.fitted].map(|errors| &errors.held_out);
    let falls = if after.mean.norm < before.mean.norm { "falls" } else { "does not fall: it goes" };
    let is_larger = match ResidualSize::of(found) {
        ResidualSize::Contradicted(chi2) | ResidualSize::Unclear(chi2) => chi2 > 1.0,
        _ => false,
    };
    if !(before.mean.norm.is_finite() && after.mean.norm.is_finite()) {
        return "The fit is to be trusted.".to_owned();
    }
    let scope = if is_larger && has_bound { " within the error bound below" } else { "" };
    let size = if found.noise_factor > 1.0 {
        format!("{} × the declared σ", number(found.noise_factor.sqrt(), 1))
    } else {
        "larger than the declared σ explains".to_owned()
    };
    format!(
        "Trusted{scope}: the mean {} error {falls} from {} to {}.{}",
        judging(&found.fitted).replace(' ', "-"),
        with_unit(before, before.mean.norm),
        with_unit(after, after.mean.norm),
        if is_larger {
            format!(" Not fully explained: the residual is {size}.")
        } else {
            String::new()
        }
    )
}

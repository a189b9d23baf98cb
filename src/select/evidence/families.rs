//! Prior probabilities of hypotheses. The prior odds of each additional hypothesis are 1 to 2. This
//! probability is divided between families by their weights, and within a family by the shares of
//! its members.

use crate::problem::Effect;
use crate::select::settings::{PRIOR_OF_FUNCTIONS, PRIOR_OF_RIGID_LINKS};

/// Families of the hypotheses about a residual. A family holds the effects of one name, or the
/// functions without a law of one type.
#[derive(Default)]
pub(super) struct Families(Vec<Family>);

struct Family {
    name: String,
    weight: f64,
    /// Sum of the shares of the prior probability that the members of the family have.
    shares: f64,
    is_of_functions: bool,
}

/// Summary of the hypotheses about a residual, from which the prior probability of an effect among
/// them follows without their columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OtherHypotheses {
    /// Sum of the weights of the families of functions without a law.
    pub weight_of_functions: f64,
    /// Effects that displace no pose and are therefore no hypotheses.
    pub unseen: Vec<Effect>,
}

impl Families {
    /// Adds a hypothesis to its family; `effect` is `None` for a function without a law.
    pub fn add(&mut self, name: &str, share: f64, effect: Option<&Effect>) {
        if let Some(family) = self.0.iter_mut().find(|family| family.name == name) {
            family.shares += share;
            return;
        }
        let weight = match effect {
            Some(Effect::LinkBending { .. }) => PRIOR_OF_RIGID_LINKS,
            Some(_) => 1.0,
            None => PRIOR_OF_FUNCTIONS,
        };
        let is_of_functions = effect.is_none();
        self.0.push(Family { name: name.to_owned(), weight, shares: share, is_of_functions });
    }

    /// Returns the sum of the weights of all families, or of those of functions without a law if
    /// `of_functions_only` is true.
    pub fn weight(&self, of_functions_only: bool) -> f64 {
        let is_included = |family: &&Family| family.is_of_functions || !of_functions_only;
        self.0.iter().filter(is_included).map(|family| family.weight).sum()
    }

    /// Returns ln of the prior probability of a hypothesis with this `share` of the family `name`,
    /// given the summed weight of all families.
    pub fn ln_prior(&self, name: &str, share: f64, total_weight: f64) -> f64 {
        let family = self.0.iter().find(|family| family.name == name);
        let (weight, shares) = family.map_or((1.0, 1.0), |family| (family.weight, family.shares));
        (share / shares * weight / total_weight / 2.0).ln()
    }
}

/// Returns ln of the prior probability of a family of effects, given the summed weight of all
/// families.
pub(super) fn ln_family(total_weight: f64) -> f64 {
    -(2.0 * total_weight.max(1.0)).ln()
}

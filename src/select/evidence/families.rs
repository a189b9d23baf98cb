//! Prior probabilities of hypotheses. The prior odds of each additional hypothesis are 1 to 2. This
//! probability is divided between families by their weights, and within a family by the shares of
//! its members.

use crate::problem::{Effect, Joint, JointKind, Problem};
use crate::select::settings::{
    PRIOR_OF_FUNCTIONS, PRIOR_OF_INSTRUMENT_SCALE, PRIOR_OF_RIGID_LINKS,
};

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

/// Summary of the hypotheses about a residual, from which the prior probability of one among them
/// follows without the columns of the others.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OtherHypotheses {
    /// Families of functions without a law, each with the sum of the shares of its members.
    pub functions: Vec<(String, f64)>,
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
            Some(Effect::TrackerScale | Effect::FrameStrain) => PRIOR_OF_INSTRUMENT_SCALE,
            Some(_) => 1.0,
            None => PRIOR_OF_FUNCTIONS,
        };
        let is_of_functions = effect.is_none();
        self.0.push(Family { name: name.to_owned(), weight, shares: share, is_of_functions });
    }

    /// Returns the sum of the weights of all families.
    pub fn weight(&self) -> f64 {
        self.0.iter().map(|family| family.weight).sum()
    }

    /// Returns the families of functions without a law, each with the sum of the shares of its
    /// members.
    pub fn functions(&self) -> Vec<(String, f64)> {
        let functions = self.0.iter().filter(|family| family.is_of_functions);
        functions.map(|family| (family.name.clone(), family.shares)).collect()
    }

    /// Returns ln of the prior probability of a hypothesis with this `share` of the family `name`,
    /// given the summed weight of all families.
    pub fn ln_prior(&self, name: &str, share: f64, total_weight: f64) -> f64 {
        let family = self.0.iter().find(|family| family.name == name);
        let (weight, shares) = family.map_or((1.0, 1.0), |family| (family.weight, family.shares));
        (share / shares * weight / total_weight / 2.0).ln()
    }
}

/// Returns the share of an effect in the prior probability of its family. `tries` is the number of
/// values that are tried of its searched argument.
///
/// Wrong transmission ratios of all sliding joints together are as probable as those of all
/// revolute joints: a gear has whole numbers of teeth, while racks, belts and screws have errors
/// of pitch.
pub(super) fn share(effect: &Effect, tries: f64, problem: &Problem) -> f64 {
    let slides = problem.slides();
    let sliding = slides.iter().filter(|slides| **slides).count();
    let is_turning = |joint: &&Joint| joint.command_kind() == JointKind::Revolute;
    let turning = problem.joints.iter().filter(is_turning).count();
    let weight = match *effect {
        Effect::GearRatio { joint } if slides.get(joint.wrapping_sub(1)) == Some(&true) => {
            (turning as f64 / sliding as f64).max(1.0)
        }
        _ => 1.0,
    };
    weight / tries
}

/// Returns ln of the prior probability of a family of effects, given the summed weight of all
/// families.
pub(super) fn ln_family(total_weight: f64) -> f64 {
    -(2.0 * total_weight.max(1.0)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rail_is_suspected_before_the_scale_of_a_calibrated_instrument() {
        let joint = |kind: &str| format!("{{ kind = \"{kind}\", d_mm = 300, a_mm = 200 }}");
        let joints: Vec<String> =
            ["prismatic"].into_iter().chain(["revolute"; 6]).map(joint).collect();
        let text = format!(
            "name = \"rail\"\ndh = \"standard\"\njoint = [{}]\n[data]\nfiles = \
             [\"m.csv\"]\nposition_sigma_mm = 0.1\n",
            joints.join(", ")
        );
        let problem = Problem::parse(&text, std::path::Path::new("problem.toml")).unwrap();
        let mut families = Families::default();
        let ratios = (1..=7).map(|joint| Effect::GearRatio { joint });
        for effect in ratios.chain([Effect::TrackerScale]) {
            families.add(effect.name(), share(&effect, 1.0, &problem), Some(&effect));
        }
        let ln = |effect: Effect| {
            families.ln_prior(effect.name(), share(&effect, 1.0, &problem), families.weight())
        };
        let over = |other: Effect| (ln(Effect::GearRatio { joint: 1 }) - ln(other)).exp();
        assert!((over(Effect::TrackerScale) - 5.0).abs() < 1e-9);
        assert!((over(Effect::GearRatio { joint: 2 }) - 6.0).abs() < 1e-9);
    }
}

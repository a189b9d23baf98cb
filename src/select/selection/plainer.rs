//! Plainer causes that together displace the target as an effect does, compared with the effect by
//! predictions.
//!
//! The evidence prefers one effect to two that explain the residual as well, even where the two are
//! more common in arms. Predictions of left-out poses show whether the data distinguish them.

use super::state::SearchState;
use crate::problem::Effect;
use crate::select::candidates::Candidates;
use crate::select::fitted::Fitted;
use crate::select::left_out_gain::LeftOutGain;

/// Effect of a fit, and plainer effects that may act in its place.
#[derive(Debug, Clone)]
pub(super) struct Plainer {
    /// Effect of the fit.
    pub effect: Effect,
    /// Effects that may act together in its place.
    pub instead: Vec<Effect>,
    /// Probability of the effect if either the effect or all of `instead` act; both have the same
    /// prior probability.
    pub share: f64,
}

/// Returns the plainer causes that together displace the target almost as an effect does: bending
/// of a link rotates and shifts its end, as compliance of the joints at both ends does.
fn plainer_causes(effect: &Effect) -> Vec<Effect> {
    match *effect {
        Effect::LinkBending { joint } if joint > 1 => {
            [joint - 1, joint].map(|joint| Effect::JointCompliance { joint }).into()
        }
        _ => Vec::new(),
    }
}

/// Fits the plainer causes of each added effect in its place, and compares the predictions of
/// left-out poses. Effects without plainer causes are left out.
pub(super) fn compare_with_plainer(state: &SearchState, fitted: &Fitted) -> Vec<Plainer> {
    let added = state.added(fitted);
    let compared = |effect: &Effect| {
        let others: Vec<Effect> = added.iter().filter(|other| *other != effect).cloned().collect();
        let without = state.problem(fitted, &others);
        let candidates = Candidates::new(&without, state.data);
        let is_tested = |cause: &Effect| candidates.testable.contains(cause);
        let instead: Vec<Effect> = plainer_causes(effect).into_iter().filter(is_tested).collect();
        if instead.is_empty() {
            return None;
        }
        let effects = [others.as_slice(), instead.as_slice()].concat();
        let rival = state.fit(fitted, &effects).ok()?;
        // The σ of the noise is that of the better fit.
        let sigma = fitted.sigma.min(rival.sigma);
        let gain = LeftOutGain::new(fitted, &rival, state.data)?;
        let share = (1.0 + (-gain.ln_odds(sigma)).exp()).recip();
        Some(Plainer { effect: effect.clone(), instead, share })
    };
    added.iter().filter_map(compared).collect()
}

//! Effects that were added, tested again once others are in the model.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::super::fitted::Fitted;
use super::super::neighbourhood::{Library, Linear};
use super::super::smooth_term::SmoothTerm;
use crate::problem::Effect;

/// An effect of a fit, and the probability that it is none.
#[derive(Debug, Clone)]
pub(super) struct Retested {
    pub effect: Effect,
    pub p: f64,
}

/// Effects of a fit with their p: what it would lose without each.
pub(super) fn retest(
    fitted: &Fitted,
    library: &Library,
    smooth_terms: &[SmoothTerm],
    own: Vec<Effect>,
) -> Vec<Retested> {
    let (linear, normal) = (fitted.linear(library, &[], smooth_terms), fitted.normal(library, smooth_terms));
    let test = |effect: Effect| {
        let parameters = fitted.parameters_of(&effect);
        let loss = fitted.loss_without(&normal, &parameters);
        let p = loss.map_or(1.0, |loss| chance(&linear, loss, parameters.len()));
        Retested { effect, p }
    };
    own.into_iter().map(test).collect()
}

/// Probability that k directions without an effect take off so much of the sum of squares.
fn chance(linear: &Linear, loss: f64, k: usize) -> f64 {
    let freedom = linear.sums().freedom();
    let f = loss / k as f64 / (linear.sums().squares / freedom);
    FisherSnedecor::new(k as f64, freedom).map_or(1.0, |chance| chance.sf(f)).max(f64::MIN_POSITIVE)
}

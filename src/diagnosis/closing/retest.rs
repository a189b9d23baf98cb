//! Effects that were added, tested again once others are in the model.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::super::candidates::parts;
use super::super::fitted::Fitted;
use super::super::trace::{Library, Linear};
use crate::problem::Effect;

/// An effect, or one order of a harmonic, and the probability that it is none.
#[derive(Debug, Clone)]
pub(super) struct Retested {
    pub effect: Effect,
    pub p: f64,
}

/// p of each added effect as a whole, in order.
pub(super) fn p_values(fitted: &Fitted, library: &Library, added: &[Effect]) -> Vec<f64> {
    tested(fitted, library, added.iter().cloned()).into_iter().map(|tested| tested.p).collect()
}

/// Every added effect with its p, harmonics order by order.
pub(super) fn retest(fitted: &Fitted, library: &Library, added: &[Effect]) -> Vec<Retested> {
    tested(fitted, library, added.iter().flat_map(parts))
}

fn tested(fitted: &Fitted, library: &Library, effects: impl Iterator<Item = Effect>) -> Vec<Retested> {
    let (linear, normal) = (fitted.linear(library, &[]), fitted.normal(library));
    let test = |effect: Effect| {
        let parameters = fitted.parameters_of(&effect);
        let loss = fitted.loss_without(&normal, &parameters);
        let p = loss.map_or(1.0, |loss| chance(&linear, loss, parameters.len()));
        Retested { effect, p }
    };
    effects.map(test).collect()
}

/// Probability that k directions without an effect take off so much of the sum of squares.
fn chance(linear: &Linear, loss: f64, k: usize) -> f64 {
    let freedom = linear.freedom();
    let f = loss / k as f64 / (linear.squares() / freedom);
    FisherSnedecor::new(k as f64, freedom).map_or(1.0, |chance| chance.sf(f)).max(f64::MIN_POSITIVE)
}

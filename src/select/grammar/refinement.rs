//! Refinement of the parameters inside formulas, such as time constants and positions of kinks.

use nalgebra::DVector;

use super::quantities::Quantities;
use super::site::{Noise, Span, Weighted, WhitenedSite};
use super::terms::{Sum, Terms, ln_prior, product};

/// Number of trial values of an inner parameter on either side of its value, within one step.
const TRIAL_VALUES: i32 = 8;
/// Maximum number of passes over the inner parameters of a sum in the beam search.
const MAX_PASSES: usize = 2;
/// If ln evidence is lower by more than this at both trial values next to the best one, values
/// between them are tried.
const MAX_LN_LOSS: f64 = 0.5;

/// Sum with refined values of its inner parameters.
pub(super) struct Refined {
    pub sum: Sum,
    /// Values of the inner parameters: one list for each term, with one value for each factor.
    pub inner: Vec<Vec<f64>>,
    /// ln of the evidence, averaged over the grid cells of the inner parameters, plus `ln_prior`.
    pub ln_posterior: f64,
    /// ln of the evidence of the sum of terms at the values `inner` of the inner parameters.
    pub ln_evidence: f64,
    pub ln_prior: f64,
    /// Fitted sum of terms as a function of the pose, with its product with the weight matrix W.
    pub prediction: Weighted,
}

/// Search for the values of the inner parameters of sums.
pub(super) struct Refiner<'a> {
    pub terms: &'a Terms,
    pub quantities: &'a Quantities,
    pub site: &'a WhitenedSite,
    pub noise: &'a Noise,
}

impl Refiner<'_> {
    /// Returns a sum with the best values of its inner parameters, and its posterior averaged over
    /// the grid cell of each of them. If `is_refined` is false, the sum keeps the values that the
    /// dictionary lists.
    pub fn refined(&self, sum: Sum, is_refined: bool) -> Refined {
        let mut inner = self.starts(&sum);
        let averaged = if is_refined { self.refine(&sum, &mut inner) } else { 0.0 };
        let ln_prior = ln_prior(self.terms, &sum);
        let span = self.span_of(&sum, &inner);
        let ln_evidence = self.noise.evidence(span.explained_squares(), span.along.len());
        Refined {
            ln_posterior: ln_evidence + averaged + ln_prior,
            prediction: span.prediction(),
            ln_evidence,
            ln_prior,
            inner,
            sum,
        }
    }

    /// Returns the best values of the inner parameters (such as time constants) of a sum of terms;
    /// `None` if the sum has no inner parameter.
    pub fn best_values(&self, sum: &Sum) -> Option<Vec<Vec<f64>>> {
        let has_inner = |&k: &u16| self.terms.factors[usize::from(k)].inner.is_some();
        if !sum.iter().flatten().any(has_inner) {
            return None;
        }
        let mut inner = self.starts(sum);
        let count = sum.iter().flatten().filter(|k| has_inner(k)).count();
        // The best value of one parameter depends on those of the others.
        for _ in 0..count.min(MAX_PASSES) {
            self.refine(sum, &mut inner);
        }
        Some(inner)
    }

    /// Returns the values of the inner parameters of a sum that its factors list; 0 for factors
    /// without an inner parameter.
    pub fn starts(&self, sum: &Sum) -> Vec<Vec<f64>> {
        let start = |&k: &u16| self.terms.factors[usize::from(k)].inner.map_or(0.0, |at| at.0);
        sum.iter().map(|term| term.iter().map(start).collect()).collect()
    }

    /// Sets each inner parameter in turn to its best value, with the others fixed. Returns ln of
    /// the mean likelihood over the parameters' grid cells, relative to that at the best values.
    fn refine(&self, sum: &Sum, inner: &mut [Vec<f64>]) -> f64 {
        let mut averaged = 0.0;
        for (t, term) in sum.iter().enumerate() {
            for (f, &factor) in term.iter().enumerate() {
                let Some((_, step)) = self.terms.factors[usize::from(factor)].inner else {
                    continue;
                };
                // The span of the other terms does not change while this term is refined.
                let mut others = self.site.empty_span();
                for (other, (term, inner)) in sum.iter().zip(inner.iter()).enumerate() {
                    if other != t {
                        others.extend(&self.columns(term, inner), &self.site.product);
                    }
                }
                let start = inner[t][f];
                // The other factors of the term do not change either while one factor is refined.
                let mut fixed = self.factors(term, &inner[t]);
                fixed.remove(f);
                let fixed = product(fixed.iter().map(Vec::as_slice));
                let form = self.terms.factors[usize::from(factor)].form;
                let mut evidence = |value: f64| {
                    let moved = form.columns(self.quantities, value).into_iter();
                    let moved: Vec<DVector<f64>> = moved.map(DVector::from_vec).collect();
                    let both = fixed.iter().map(Vec::as_slice).chain([moved.as_slice()]);
                    let mut span = others.clone();
                    let columns = self.site.weighted(product(both).unwrap_or_default());
                    span.extend(&columns, &self.site.product);
                    self.noise.evidence(span.explained_squares(), span.along.len())
                };
                let (best, mean) = best_in_cell(start, step, &mut evidence);
                inner[t][f] = best;
                averaged += mean;
            }
        }
        averaged
    }

    /// Returns the span of a sum's columns with these values of its inner parameters.
    fn span_of(&self, sum: &Sum, inner: &[Vec<f64>]) -> Span {
        let mut span = self.site.empty_span();
        for (term, inner) in sum.iter().zip(inner) {
            span.extend(&self.columns(term, inner), &self.site.product);
        }
        span
    }

    /// Returns the columns of a term with values of its inner parameters, and W times them.
    fn columns(&self, term: &[u16], inner: &[f64]) -> Vec<Weighted> {
        let factors = self.factors(term, inner);
        self.site.weighted(product(factors.iter().map(Vec::as_slice)).unwrap_or_default())
    }

    /// Returns the columns of each factor of a term with values of its inner parameters.
    fn factors(&self, term: &[u16], inner: &[f64]) -> Vec<Vec<DVector<f64>>> {
        let of_factor = |(&k, &x): (&u16, &f64)| {
            let form = self.terms.factors[usize::from(k)].form;
            form.columns(self.quantities, x).into_iter().map(DVector::from_vec).collect()
        };
        term.iter().zip(inner).map(of_factor).collect()
    }
}

/// Returns the value within one step of `start` with the largest ln evidence. Also returns ln of
/// the mean likelihood over the cell of one step about it, relative to that value. Where the
/// evidence has a narrow peak, values between the first trial values are tried.
fn best_in_cell(start: f64, step: f64, evidence: &mut impl FnMut(f64) -> f64) -> (f64, f64) {
    let mut trials = |centre: f64, width: f64| {
        let at = |k: i32| centre + width * f64::from(k) / f64::from(TRIAL_VALUES);
        let trials: Vec<(i32, f64)> =
            (-TRIAL_VALUES..=TRIAL_VALUES).map(|k| (k, evidence(at(k)))).collect();
        let order = |a: &&(i32, f64), b: &&(i32, f64)| {
            a.1.total_cmp(&b.1).then_with(|| b.0.abs().cmp(&a.0.abs()))
        };
        let best = trials.iter().max_by(order).copied().unwrap_or((0, 0.0));
        (at(best.0), best, trials)
    };
    let (mut value, (k, mut most), coarse) = trials(start, step);
    let is_near = |(other, _): &&(i32, f64)| (other - k).abs() <= TRIAL_VALUES / 2;
    let next_to = coarse.iter().filter(|(other, _)| (other - k).abs() == 1);
    let is_narrow =
        next_to.fold(f64::INFINITY, |least, (_, ln)| least.min(most - ln)) > MAX_LN_LOSS;
    let count = f64::from(TRIAL_VALUES + 1);
    if !is_narrow {
        let cell: f64 = coarse.iter().filter(is_near).map(|(_, ln)| (ln - most).exp()).sum();
        return (value, (cell / count).ln());
    }
    let coarse_most = most;
    let (finer, (_, finer_most), fine) = trials(value, step / f64::from(TRIAL_VALUES));
    if finer_most > most {
        (value, most) = (finer, finer_most);
    }
    let beyond = coarse.iter().filter(is_near).filter(|(other, _)| *other != k);
    let beyond: f64 = beyond.map(|(_, ln)| (ln - most).exp()).sum();
    let within: f64 = fine.iter().map(|(_, ln)| (ln - most).exp()).sum();
    // The finer trials reach from one neighbour of the best coarse trial to the other.
    let within = within / f64::from(TRIAL_VALUES);
    let cell = (beyond + within).max((coarse_most - most).exp() / f64::from(TRIAL_VALUES));
    (value, (cell / count).ln())
}

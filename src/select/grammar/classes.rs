//! Classes of sums whose predictions noise does not tell apart.

use nalgebra::DVector;

use super::beam::{Beam, Sum, ln_prior};
use super::dictionary::factors;
use super::quantities::Quantities;
use super::site::{Noise, Span, Weighted, WhitenedSite};
use super::terms::{Terms, product};
use super::written::{Written, written};

/// Log odds to the best sum beyond which sums are dropped.
const MAX_LN_ODDS: f64 = 12.0;
/// Maximum number of sums that are grouped into classes.
const MAX_SUMS: usize = 400;
/// Maximum number of sums whose inner parameters are refined.
const MAX_REFINED: usize = 40;
/// Maximum number of classes that are proposed as laws.
const MAX_CLASSES: usize = 8;
/// Largest difference between the predictions of two sums of one class, in units of the noise.
const MAX_CLASS_DIFFERENCE: f64 = 2.0;
/// Number of trial values of an inner parameter on either side of its listed value, within one grid
/// step.
const TRIAL_VALUES: i32 = 8;

/// Formula proposed for a class of sums with nearly equal predictions.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// Formulas and parameters of the simplest sum of the class.
    pub law: Written,
    /// ln of the prior probability of the class if its likelihood is that of the proposed formula.
    pub ln_prior: f64,
    /// True if a law that the fit contains belongs to the class.
    pub is_present: bool,
}

/// Sum with refined values of its inner parameters.
struct Refined {
    sum: Sum,
    /// Values of the inner parameters: one list for each term, with one value for each factor.
    inner: Vec<Vec<f64>>,
    ln_posterior: f64,
    ln_evidence: f64,
    ln_prior: f64,
    prediction: Weighted,
}

struct Class {
    first: Refined,
    /// ln of the summed posteriors of the class.
    ln_posterior: f64,
}

/// Returns the most probable formulas of the error at a joint, counted from 0. `present` holds the
/// columns of laws that the fit contains.
pub fn proposals(
    known: &Quantities,
    joint: usize,
    (site, noise): (&WhitenedSite, &Noise),
    present: &[Vec<DVector<f64>>],
) -> Vec<Proposal> {
    let terms = Terms::new(factors(known, joint), known, site);
    let beam = Beam::new(&terms, site, noise);
    let mut sums: Vec<(Sum, f64)> =
        beam.search().into_iter().map(|(sum, scored)| (sum, scored.ln_posterior)).collect();
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some(best) = sums.first().map(|sum| sum.1) else { return Vec::new() };
    sums.retain(|(_, ln)| *ln > best - MAX_LN_ODDS);
    sums.truncate(MAX_SUMS);
    let refiner = Refiner { terms: &terms, known, site, noise };
    let mut all: Vec<Refined> = sums
        .into_iter()
        .enumerate()
        .map(|(place, (sum, _))| refiner.refined(sum, place < MAX_REFINED))
        .collect();
    all.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
    let mut classes: Vec<Class> = Vec::new();
    for refined in all {
        let is_same = |class: &&mut Class| {
            class.first.prediction.squared_distance(&refined.prediction)
                < MAX_CLASS_DIFFERENCE.powi(2) * noise.factor
        };
        if let Some(class) = classes.iter_mut().find(is_same) {
            class.ln_posterior = ln_add(class.ln_posterior, refined.ln_posterior);
            // The simplest sum that is hardly less probable represents the class.
            let is_simpler = refined.ln_prior > class.first.ln_prior + 1e-9
                && refined.ln_posterior > class.first.ln_posterior - 0.5;
            if is_simpler {
                class.first = refined;
            }
        } else {
            let ln_posterior = refined.ln_posterior;
            classes.push(Class { first: refined, ln_posterior });
        }
    }
    classes.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
    let predictions: Vec<Weighted> =
        present.iter().map(|columns| site.span(columns.clone()).prediction()).collect();
    let proposal = |class: Class| {
        let first = &class.first;
        let is_catalogued = first.sum.iter().all(|term| {
            matches!(term.as_slice(), [k] if terms.factors[usize::from(*k)].form.is_catalogued(joint))
        });
        if is_catalogued {
            return None;
        }
        let is_near = |other: &Weighted| {
            other.squared_distance(&first.prediction) < MAX_CLASS_DIFFERENCE.powi(2) * noise.factor
        };
        let is_present = predictions.iter().any(is_near);
        let law = written((&terms, known), joint, &first.sum, &first.inner);
        let ln_prior = class.ln_posterior - first.ln_evidence;
        Some(Proposal { law, ln_prior, is_present })
    };
    classes.into_iter().filter_map(proposal).take(MAX_CLASSES).collect()
}

/// Refinement of the inner parameters of sums, such as time constants and kink positions.
struct Refiner<'a> {
    terms: &'a Terms,
    known: &'a Quantities,
    site: &'a WhitenedSite,
    noise: &'a Noise,
}

impl Refiner<'_> {
    /// Returns a sum with the best values of its inner parameters. Its evidence is averaged over
    /// the grid cell of each parameter.
    fn refined(&self, sum: Sum, is_refined: bool) -> Refined {
        let starts = |term: &Vec<u16>| {
            term.iter()
                .map(|&k| self.terms.factors[usize::from(k)].inner.map_or(0.0, |inner| inner.0))
                .collect::<Vec<f64>>()
        };
        let mut inner: Vec<Vec<f64>> = sum.iter().map(starts).collect();
        let ln_prior = ln_prior(self.terms, &sum);
        let mut averaged = 0.0;
        let mut columns: Vec<Vec<Weighted>> =
            sum.iter().zip(&inner).map(|(term, inner)| self.columns(term, inner)).collect();
        // Functions of earlier terms do not change any more.
        let mut earlier = self.site.empty_span();
        for (t, term) in sum.iter().enumerate() {
            for (f, &factor) in term.iter().enumerate().filter(|_| is_refined) {
                let Some((start, step)) = self.terms.factors[usize::from(factor)].inner else {
                    continue;
                };
                let at = |k: i32| start + step * f64::from(k) / f64::from(TRIAL_VALUES);
                let mut evidences = Vec::new();
                for k in -TRIAL_VALUES..=TRIAL_VALUES {
                    inner[t][f] = at(k);
                    columns[t] = self.columns(term, &inner[t]);
                    let span = self.span(earlier.clone(), &columns[t..]);
                    let evidence = self.noise.evidence(span.explained_squares(), span.along.len());
                    evidences.push((k, evidence));
                }
                let best = evidences
                    .iter()
                    .copied()
                    .max_by(|a, b| a.1.total_cmp(&b.1).then_with(|| b.0.abs().cmp(&a.0.abs())));
                let (k, most) = best.unwrap_or((0, 0.0));
                inner[t][f] = at(k);
                columns[t] = self.columns(term, &inner[t]);
                // Over the cell about the best value.
                let cell: Vec<f64> = evidences
                    .iter()
                    .filter(|(other, _)| (other - k).abs() <= TRIAL_VALUES / 2)
                    .map(|(_, ln)| (ln - most).exp())
                    .collect();
                averaged += (cell.iter().sum::<f64>() / f64::from(TRIAL_VALUES + 1)).ln();
            }
            earlier.extend(&columns[t], &self.site.product);
        }
        let ln_evidence = self.noise.evidence(earlier.explained_squares(), earlier.along.len());
        Refined {
            ln_posterior: ln_evidence + averaged + ln_prior,
            prediction: earlier.prediction(),
            ln_evidence,
            ln_prior,
            inner,
            sum,
        }
    }

    /// Returns a span extended by the columns of further terms.
    fn span(&self, mut span: Span, terms: &[Vec<Weighted>]) -> Span {
        for columns in terms {
            span.extend(columns, &self.site.product);
        }
        span
    }

    /// Returns the columns of a term with values of its inner parameters, and W times them.
    fn columns(&self, term: &[u16], inner: &[f64]) -> Vec<Weighted> {
        let of_factor = |(&k, &x): (&u16, &f64)| {
            let form = self.terms.factors[usize::from(k)].form;
            form.columns(self.known, x).into_iter().map(DVector::from_vec).collect::<Vec<_>>()
        };
        let factors: Vec<Vec<DVector<f64>>> = term.iter().zip(inner).map(of_factor).collect();
        self.site.weighted(product(factors.iter().map(Vec::as_slice)).unwrap_or_default())
    }
}

fn ln_add(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Returns numbers without pattern, of mean 0 and root mean square 1 about.
    fn scattered(count: usize, seed: f64) -> Vec<f64> {
        let value = |k: usize| ((12.9898 * k as f64 + 78.233 * seed).sin() * 43_758.545_3).fract();
        (0..count).map(|k| 2.0 * 3.0_f64.sqrt() * (value(k).abs() - 0.5)).collect()
    }

    /// Returns the laws of a residual of 60 poses of three joints that one function makes beside
    /// noise.
    fn found(function: impl Fn(&[f64; 3]) -> f64) -> Vec<Proposal> {
        let commands: Vec<(usize, Vec<f64>)> =
            (0..3).map(|joint| (joint, scattered(60, 1.0 + joint as f64))).collect();
        let known = Quantities {
            commands: commands.clone(),
            turns: vec![true; 3],
            sides: Vec::new(),
            moments: Vec::new(),
            warming: Some(scattered(60, 9.0)),
            lag: None,
            elapsed: None,
            payload: None,
            covariates: Vec::new(),
            names: Vec::new(),
        };
        let noise = scattered(60, 20.0);
        let at = |pose: usize| std::array::from_fn(|joint| commands[joint].1[pose]);
        let product = DVector::from_fn(60, |pose, _| function(&at(pose)) + noise[pose]);
        let squares = product.norm_squared();
        let site = WhitenedSite {
            diagonal: DVector::repeat(60, 1.0),
            less: DMatrix::zeros(0, 60),
            product,
        };
        let noise = Noise::new(squares, 60.0, |squares| -0.5 * squares);
        proposals(&known, 0, (&site, &noise), &[])
    }

    #[test]
    fn a_product_of_two_joints_is_written_down() {
        let laws = found(|q| 12.0 * q[0].sin() * q[1].cos());
        assert_eq!(laws[0].law.formulas, ["sin(q1)*cos(q2)"]);
        assert_eq!(laws[0].law.name, "joint1-sin-q1-cos-q2");
        let second = laws.get(1).map_or(f64::NEG_INFINITY, |law| law.ln_prior);
        assert!(laws[0].ln_prior.is_finite() && second < 0.0);
    }

    #[test]
    fn a_kink_has_its_place_as_a_parameter() {
        let laws = found(|q| 9.0 * (q[2] - 0.35).abs());
        assert_eq!(laws[0].law.formulas, ["abs(q3 - c)"]);
        let place = &laws[0].law.parameters[0];
        assert!((place.start - 0.35).abs() < 0.15, "{place:?}");
    }

    #[test]
    fn a_law_of_the_catalogue_is_left_to_it() {
        let laws = found(|q| 8.0 * q[0]);
        assert!(laws.iter().all(|law| law.law.formulas != ["q1"]), "{laws:?}");
    }
}

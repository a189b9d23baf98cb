//! Classes of sums whose predictions differ by less than the noise allows to distinguish, and the
//! prior probability of laws among all hypotheses.

use nalgebra::DVector;

use super::beam::Beam;
use super::dictionary::{factors, factors_at_other_sites};
use super::factor::{Form, FormulaSite};
use super::quantities::Quantities;
use super::refinement::{Refined, Refiner};
use super::site::{Noise, Weighted, WhitenedSite};
use super::terms::{Sum, Terms, is_separated};
use super::written::{Written, write_law};
use crate::laws::{At, Law};
use crate::problem::{Effect, Joint, Problem};

/// Largest ln odds of the best sum over another sum that is kept.
const MAX_LN_ODDS: f64 = 12.0;
/// Maximum number of candidate laws (sums of terms) that are grouped into classes of nearly equal
/// predictions.
const MAX_SUMS: usize = 400;
/// Maximum number of sums whose inner parameters are refined.
const MAX_REFINED: usize = 40;
/// Maximum number of classes that are proposed as laws.
const MAX_CLASSES: usize = 8;
/// Largest difference between the values of each inner parameter, in grid cells, at which two sums
/// of the same factors are one.
const MAX_CELL_DIFFERENCE: f64 = 0.5;
/// Largest difference between the predictions of two sums of one class: root of the sum of squares
/// over all measurements, in units of the noise.
const MAX_CLASS_DIFFERENCE: f64 = 2.0;
/// Largest difference between the predictions of two sums of one form, as for
/// [`MAX_CLASS_DIFFERENCE`].
const MAX_FORM_DIFFERENCE: f64 = 1.0;
/// Smallest fraction of the probability of a class at which another form is listed.
const MIN_FORM_PROBABILITY: f64 = 0.02;
/// Maximum number of other forms of a class that are listed.
const MAX_RIVAL_FORMS: usize = 4;

/// Formula proposed for a class of sums with nearly equal predictions.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// Formulas and parameters of the simplest sum of the class.
    pub law: Written,
    /// Sums of the class that are of another form than `law`, each with its fraction of the
    /// probability of the class, the most probable first.
    pub rivals: Vec<(Written, f64)>,
    /// ln of the prior probability that gives the class its posterior if its likelihood is that of
    /// `law`.
    pub ln_prior: f64,
    /// ln of the posterior probability of the class, up to a constant that depends on the residual
    /// alone.
    pub ln_posterior: f64,
    /// True if the fit already contains a law whose prediction belongs to the class.
    pub is_present: bool,
}

struct Class {
    /// Candidate law (sum of terms) that represents the class.
    first: Refined,
    /// Other candidate laws of the class, which predict nearly the same as `first`.
    others: Vec<Refined>,
    /// ln of the sum of the posteriors of all candidate laws of the class.
    ln_posterior: f64,
}

impl Class {
    /// Returns the sums of the class that are of another form than the first one, each with its
    /// fraction of the probability of the class, the most probable first.
    ///
    /// Two sums are of one form if the squared distance of their predictions is less than
    /// `max_squared_distance`, or if the second one has all terms of the first.
    fn rivals(&self, terms: &Terms, max_squared_distance: f64) -> Vec<(&Refined, f64)> {
        let forms = |sum: &Sum| forms(terms, sum);
        let is_one_form = |one: &Refined, other: &Refined| {
            let of_other = forms(&other.sum);
            one.prediction.squared_distance(&other.prediction) < max_squared_distance
                || forms(&one.sum).iter().all(|term| of_other.contains(term))
        };
        let mut others: Vec<&Refined> = self.others.iter().collect();
        others.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
        let mut rivals: Vec<(&Refined, f64)> = Vec::new();
        for other in others.into_iter().filter(|other| !is_one_form(&self.first, other)) {
            let share = (other.ln_posterior - self.ln_posterior).exp();
            match rivals.iter_mut().find(|(rival, _)| is_one_form(rival, other)) {
                Some((_, sum)) => *sum += share,
                None => rivals.push((other, share)),
            }
        }
        rivals.retain(|(_, share)| *share >= MIN_FORM_PROBABILITY);
        rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
        rivals.truncate(MAX_RIVAL_FORMS);
        rivals
    }
}

/// Returns the most probable formulas of the error at a site, the most probable first, without
/// those that the catalogue contains. `at` is the site in the words of files, `place` the part of
/// the arm to which it belongs. `present` holds the columns of each law that the fit contains.
pub fn proposals(
    quantities: &Quantities,
    (at, place): (&str, FormulaSite),
    (site, noise): (&WhitenedSite, &Noise),
    present: &[Vec<DVector<f64>>],
) -> Vec<Proposal> {
    let factors = match place {
        FormulaSite::Joint(joint) => factors(quantities, joint),
        FormulaSite::Elsewhere => factors_at_other_sites(quantities),
        // The catalogue searches the time constant of a link that follows a lagged temperature.
        // Products with a lag of one time constant would imitate another one.
        FormulaSite::Link => {
            let mut factors = factors_at_other_sites(quantities);
            factors.retain(|factor| factor.form != Form::Lag);
            factors
        }
    };
    let beam = Beam::new(Terms::new(factors, quantities, site), quantities, (site, noise));
    let (terms, sums) = beam.search();
    let mut sums: Vec<(Sum, f64)> =
        sums.into_iter().map(|(sum, scored)| (sum, scored.ln_posterior)).collect();
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some(best) = sums.first().map(|sum| sum.1) else { return Vec::new() };
    sums.retain(|(_, ln)| *ln > best - MAX_LN_ODDS);
    sums.truncate(MAX_SUMS);
    let refiner = Refiner { terms: &terms, quantities, site, noise };
    let mut refined_sums: Vec<Refined> = sums
        .into_iter()
        .enumerate()
        .map(|(rank, (sum, _))| refiner.refined(sum, rank < MAX_REFINED))
        .collect();
    refined_sums.retain(|refined| is_separated(&terms, &refined.sum, &refined.inner));
    refined_sums.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
    let distinct_sums = distinct(refined_sums, &terms);
    // The noise factor assumes that the residual of the best sum is only noise.
    let factor =
        distinct_sums.first().map_or(0.0, |best| noise.factor(best.prediction.squared_length()));
    let largest = MAX_CLASS_DIFFERENCE.powi(2) * factor;
    let mut classes: Vec<Class> = Vec::new();
    for refined in distinct_sums {
        // Sums that differ only in the values of inner parameters are one law, whose parameters are
        // uncertain.
        let is_same = |class: &&mut Class| {
            class.first.prediction.squared_distance(&refined.prediction) < largest
                || is_one_law(&terms, &class.first.sum, &refined.sum)
        };
        if let Some(class) = classes.iter_mut().find(is_same) {
            class.ln_posterior = ln_add(class.ln_posterior, refined.ln_posterior);
            // The simplest sum represents the class if it is hardly less probable.
            let is_simpler = refined.ln_prior > class.first.ln_prior + 1e-9
                && refined.ln_posterior > class.first.ln_posterior - 0.5;
            if is_simpler {
                class.others.push(std::mem::replace(&mut class.first, refined));
            } else {
                class.others.push(refined);
            }
        } else {
            let ln_posterior = refined.ln_posterior;
            classes.push(Class { first: refined, others: Vec::new(), ln_posterior });
        }
    }
    classes.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
    let predictions: Vec<Weighted> =
        present.iter().map(|columns| site.span(columns.clone()).prediction()).collect();
    let proposal = |class: Class| {
        let first = &class.first;
        let is_catalogued = first.sum.iter().all(|term| {
            matches!(term.as_slice(), &[k] if terms.factors[usize::from(k)].form.is_catalogued(place))
        });
        if is_catalogued {
            return None;
        }
        let is_near = |other: &Weighted| other.squared_distance(&first.prediction) < largest;
        let is_present = predictions.iter().any(is_near);
        let as_written = |sum: &Refined| write_law((&terms, quantities), at, &sum.sum, &sum.inner);
        let rivals = class.rivals(&terms, MAX_FORM_DIFFERENCE.powi(2) * factor);
        Some(Proposal {
            law: as_written(first),
            rivals: rivals.into_iter().map(|(rival, share)| (as_written(rival), share)).collect(),
            ln_prior: class.ln_posterior - first.ln_evidence,
            ln_posterior: class.ln_posterior,
            is_present,
        })
    };
    classes.into_iter().filter_map(proposal).take(MAX_CLASSES).collect()
}

/// Returns the forms of the factors of each term, gas springs without their ratio.
fn forms(terms: &Terms, sum: &Sum) -> Vec<Vec<Form>> {
    let of_term = |term: &Vec<u16>| {
        term.iter().map(|&k| terms.factors[usize::from(k)].form.with_first_ratio()).collect()
    };
    sum.iter().map(of_term).collect()
}

/// Returns true if two sums have the same terms, apart from the order of terms and factors and from
/// the values of inner parameters.
fn is_one_law(terms: &Terms, one: &Sum, other: &Sum) -> bool {
    let sorted = |sum: &Sum| {
        let word = |forms: Vec<Form>| {
            let mut words: Vec<String> = forms.iter().map(|form| format!("{form:?}")).collect();
            words.sort();
            words.join(" ")
        };
        let mut words: Vec<String> = forms(terms, sum).into_iter().map(word).collect();
        words.sort();
        words
    };
    one.len() == other.len() && sorted(one) == sorted(other)
}

/// Returns the sums without those that differ from an earlier one only by a fraction of a grid cell
/// in the values of inner parameters.
fn distinct(refined_sums: Vec<Refined>, terms: &Terms) -> Vec<Refined> {
    let parts = |refined: &Refined| {
        let part = |(term, inner): (&Vec<u16>, &Vec<f64>)| {
            let factor = |(&k, &value): (&u16, &f64)| {
                let factor = &terms.factors[usize::from(k)];
                let step = factor.inner.map_or(1.0, |inner| inner.1);
                (format!("{:?}", factor.form), value / step)
            };
            let mut part: Vec<(String, f64)> = term.iter().zip(inner).map(factor).collect();
            part.sort_by(|a, b| a.0.cmp(&b.0));
            part
        };
        let mut parts: Vec<_> = refined.sum.iter().zip(&refined.inner).map(part).collect();
        let forms = |part: &[(String, f64)]| {
            part.iter().map(|(form, _)| form.clone()).collect::<Vec<String>>()
        };
        parts.sort_by_key(|part| forms(part));
        parts.concat()
    };
    let mut listed: Vec<Vec<(String, f64)>> = Vec::new();
    let mut is_new = |refined: &Refined| {
        let parts = parts(refined);
        let is_same = |other: &Vec<(String, f64)>| {
            other.len() == parts.len()
                && other
                    .iter()
                    .zip(&parts)
                    .all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < MAX_CELL_DIFFERENCE)
        };
        let is_new = !listed.iter().any(is_same);
        if is_new {
            listed.push(parts);
        }
        is_new
    };
    refined_sums.into_iter().filter(|refined| is_new(refined)).collect()
}

/// Returns ln(eᵃ + eᵇ).
fn ln_add(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}

/// Prior weight of all laws of the grammar at the coordinates of all joints, relative to one family
/// of effects. There are about twenty families of formulas, each less common than a family of the
/// catalogue.
const PRIOR_OF_GRAMMAR: f64 = 8.0;
/// Prior weight of all laws of the grammar at each of the other sites: tool, measurement, base,
/// small motions of all joints, and links. Fewer formulas are searched there.
const PRIOR_ELSEWHERE: f64 = 2.0;
/// Number of sites of laws (axes or components) at each of tool, measurement, base and link.
const AXES: f64 = 3.0;
/// Number of small motions of a joint at which laws are searched: along x and z, about x and y, and
/// behind the joint along and about y.
const MOTIONS: f64 = 6.0;

/// Returns ln of the prior probability of a formula from the search, relative to a family of
/// effects; `None` for other effects.
pub fn ln_prior(effect: &Effect, problem: &Problem) -> Option<f64> {
    let Effect::Law(law) = effect else { return None };
    Some(ln_weight(law, problem) + law.composed_ln_prior()?)
}

/// Returns ln of the prior weight of all laws at the site of a law, relative to a family of
/// effects.
fn ln_weight(law: &Law, problem: &Problem) -> f64 {
    let takes_command = |joint: &&Joint| joint.takes_command();
    let joints = problem.joints.iter().filter(takes_command).count().max(1) as f64;
    match law.at() {
        At::Coordinate => (PRIOR_OF_GRAMMAR / joints).ln(),
        At::Before(_) | At::After(_) => (PRIOR_ELSEWHERE / MOTIONS / joints).ln(),
        At::Beam(_) => {
            let links = problem.joints.iter().filter(|joint| joint.beam.is_some()).count().max(1);
            (PRIOR_ELSEWHERE / AXES / links as f64).ln()
        }
        _ => (PRIOR_ELSEWHERE / AXES).ln(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Returns numbers without pattern, with mean about 0 and root mean square about 1.
    fn scattered(count: usize, seed: f64) -> Vec<f64> {
        let value = |k: usize| ((12.9898 * k as f64 + 78.233 * seed).sin() * 43_758.545_3).fract();
        (0..count).map(|k| 2.0 * 3.0_f64.sqrt() * (value(k).abs() - 0.5)).collect()
    }

    /// Returns the laws found for a residual of 60 poses of three joints that contains this
    /// function and noise.
    fn found(function: impl Fn(&[f64; 3]) -> f64) -> Vec<Proposal> {
        let commands: Vec<(usize, Vec<f64>)> =
            (0..3).map(|joint| (joint, scattered(60, 1.0 + joint as f64))).collect();
        let quantities = Quantities {
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
        let site = WhitenedSite::new(DVector::repeat(60, 1.0), &DMatrix::zeros(0, 60), product);
        let noise = Noise::new(squares, 60.0, |squares| -0.5 * squares);
        proposals(&quantities, ("joint1", FormulaSite::Joint(0)), (&site, &noise), &[])
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

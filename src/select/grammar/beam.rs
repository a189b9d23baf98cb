//! Beam search over sums of terms.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::quantities::Quantities;
use super::refinement::Refiner;
use super::site::{BEAM_VARIANCE, Noise, Span, Weighted, WhitenedSite};
use super::terms::{Chunk, Product, Sum, Terms, is_separated, ln_prior};
use crate::numeric::kernel::few_transposed_times;
use crate::numeric::parallel;

/// Maximum number of terms of a candidate law, each a coefficient times a product of factors.
const MAX_TERMS: usize = 3;
/// Number of best sums of each length that are extended by one more term.
const EXTENDED_SUMS: usize = 8;
/// Number of best sums of each length in which each term is exchanged in turn, and multiplied by
/// each factor.
const EXCHANGED_SUMS: usize = 4;
/// Number of best sums of each length to which every product of two factors is tried as the next
/// term, not only those that are best alone.
const SCREENED_SUMS: usize = 4;
/// Number of terms, the best ones alone, that are tried as the first of two terms.
const FIRST_TERMS: usize = 400;
/// Number of sums above which only the best are kept: a bound of memory.
const MAX_UNSORTED_SUMS: usize = 4_000;
/// Number of best sums of each length whose inner parameters are refined before terms are added.
/// Otherwise additional terms would compensate a wrong value.
const REFINED_SUMS: usize = 24;
/// Maximum numbers of extensions of a sum that are kept: the best by posterior, and the best of the
/// others by [`Scored::guide`].
const KEPT_EXTENSIONS: [usize; 2] = [120, 60];
/// Loss of ln posterior from the best sum to the best one with one more term, above which the
/// search ends.
const MAX_LN_LOSS_OF_TERM: f64 = 1.0;
/// Smallest difference between the predictions of two sums that are both extended: root of the sum
/// of squares over all measurements, in units of the noise.
const MIN_BEAM_DIFFERENCE: f64 = 0.7;

/// Scores of a sum.
#[derive(Debug, Clone, Copy)]
pub struct Scored {
    /// ln of the posterior of the sum of terms, evidence times prior probability.
    pub ln_posterior: f64,
    /// ln of the posterior, computed as if the part of the explainable residual that the sum leaves
    /// were noise of unknown scale. By this score, simple terms are added first.
    guide: f64,
}

/// Candidate law (sum of terms) that the beam search extends, with an orthonormal basis of its
/// columns.
struct SpannedSum {
    sum: Sum,
    ln_prior: f64,
    span: Span,
    /// Weight matrix W times the orthonormal functions of the span, shape = (poses, k).
    weighted: DMatrix<f32>,
}

/// Term that extends a sum, with its scores.
struct Extension {
    /// Indices of the extended sum, of the chunk of the term, and of the term in its chunk.
    indices: (usize, usize, usize),
    scored: Scored,
}

/// Beam search for the formula of an error at one site.
pub struct Beam<'a> {
    /// Terms (products of functions of the pose) from which candidate laws are built.
    terms: Terms,
    quantities: &'a Quantities,
    /// Products of columns at the site's coordinate, with the fit projected out.
    site: &'a WhitenedSite,
    /// Table of ln p(residual) by its sum of squares, integrated over the noise scale.
    noise: &'a Noise,
    /// Sum of squares that one free value per pose would explain.
    explainable: f64,
}

impl<'a> Beam<'a> {
    /// Creates the search at one site.
    pub fn new(
        terms: Terms,
        quantities: &'a Quantities,
        (site, noise): (&'a WhitenedSite, &'a Noise),
    ) -> Self {
        Self { terms, quantities, site, noise, explainable: site.explainable() }
    }

    /// Returns all sums that were evaluated, with their scores, and the terms with the factors that
    /// the refinement added.
    pub fn search(mut self) -> (Terms, BTreeMap<Sum, Scored>) {
        let mut evaluated: BTreeMap<Sum, Scored> = BTreeMap::new();
        let mut extended: BTreeSet<Sum> = BTreeSet::new();
        let mut front: Vec<Sum> = vec![Vec::new()];
        let mut most = f64::NEG_INFINITY;
        for depth in 1..=MAX_TERMS {
            let mut next: BTreeMap<Sum, Scored> = BTreeMap::new();
            self.extend(&front, &mut extended, &mut next);
            let changed = self.best(&next, EXCHANGED_SUMS);
            if depth > 1 {
                let exchanged: BTreeSet<Sum> = changed
                    .iter()
                    .flat_map(without_one)
                    .filter(|sum| !extended.contains(sum))
                    .collect();
                let exchanged: Vec<Sum> = exchanged.into_iter().collect();
                self.extend(&exchanged, &mut extended, &mut next);
                self.extend_by_pairs(&front, &mut next);
            }
            if depth == 2 {
                self.add_two_terms(&mut next);
            }
            self.multiply(&changed, &mut next);
            self.refine(&mut next);
            front = self.best(&next, EXTENDED_SUMS);
            let of_length = next.values().map(|scored| scored.ln_posterior);
            let of_length = of_length.fold(f64::NEG_INFINITY, f64::max);
            evaluated.extend(next);
            // If the best sum with one more term is less probable, longer sums are not tried.
            if of_length < most - MAX_LN_LOSS_OF_TERM {
                break;
            }
            most = of_length;
        }
        // No sum is claimed before it was compared with the sums that lack one of its terms.
        for shorter in self.best(&evaluated, REFINED_SUMS).iter().flat_map(without_one) {
            if !shorter.is_empty() && !evaluated.contains_key(&shorter) {
                let scored = self.scored_sum(&shorter);
                evaluated.insert(shorter, scored);
            }
        }
        (self.terms, evaluated)
    }

    /// Extends each of `sums` by every term, and adds the new sums to `next` with their scores.
    /// `extended` holds all sums that have been extended; `sums` are added to it.
    fn extend(&self, sums: &[Sum], extended: &mut BTreeSet<Sum>, next: &mut BTreeMap<Sum, Scored>) {
        for sum in sums {
            extended.insert(sum.clone());
            self.extend_by(&self.terms.chunks, sum, next);
        }
    }

    /// Extends each of the first [`SCREENED_SUMS`] of `sums` by the products of two and three
    /// factors that explain most in addition to it. Adds the new sums to `next` with their scores.
    fn extend_by_pairs(&self, sums: &[Sum], next: &mut BTreeMap<Sum, Scored>) {
        let sums = &sums[..sums.len().min(SCREENED_SUMS)];
        let spans: Vec<Span> = sums.iter().map(|sum| self.spanned(sum).span).collect();
        for (sum, terms) in sums.iter().zip(self.terms.beside(&spans, self.site)) {
            self.extend_by(&self.terms.chunks_of(&terms, self.site), sum, next);
        }
    }

    /// Adds the best sums of two terms with one column each to `next`. The first is one of the
    /// [`FIRST_TERMS`] best terms alone, many more than [`EXTENDED_SUMS`].
    fn add_two_terms(&self, next: &mut BTreeMap<Sum, Scored>) {
        let chunks: Vec<&Chunk> =
            self.terms.chunks.iter().filter(|chunk| chunk.width == 1).collect();
        let alone = |(number, chunk): (usize, &&Chunk)| {
            let gains = chunk.single_term_gains().zip(&chunk.ln_prior).enumerate();
            let extension = |(term, (gain, ln_prior)): (usize, (f64, &f64))| {
                let scored = self.scored(gain, 1, *ln_prior);
                (gain > 0.0).then_some(Extension { indices: (0, number, term), scored })
            };
            gains.filter_map(extension).collect::<Vec<Extension>>()
        };
        let mut first: Vec<Extension> = chunks.iter().enumerate().flat_map(alone).collect();
        split_best(&mut first, FIRST_TERMS, |scored| scored.guide);
        let n = self.site.diagonal.len();
        let mut weighted = DMatrix::<f32>::zeros(first.len(), n);
        let mut along = Vec::with_capacity(first.len());
        for (mut row, Extension { indices: (_, chunk, term), .. }) in
            weighted.row_iter_mut().zip(&first)
        {
            let chunk = chunks[*chunk];
            let scale = chunk.squares[*term].sqrt().recip();
            let column = chunk.columns.column(*term).map(|value| f64::from(value) * scale);
            let unit = self.site.times(&column);
            #[expect(clippy::cast_possible_truncation, reason = "half the width is twice as fast")]
            row.iter_mut().zip(unit.iter()).for_each(|(to, value)| *to = *value as f32);
            along.push(chunk.along[*term] * scale);
        }
        // A sum that does not explain more than the best term alone is not worth its second term.
        let least = along.iter().fold(0.0_f64, |most, along| most.max(along * along));
        let of_chunk = |number: usize| {
            let chunk = chunks[number];
            let products = &weighted * &chunk.columns;
            let mut sums: Vec<Extension> = Vec::new();
            for term in 0..chunk.terms.len() {
                let products = products.column(term);
                for (k, (product, along)) in products.iter().zip(&along).enumerate() {
                    let product = f64::from(*product);
                    let (gain, new) =
                        chunk.gain(term, |_, _| product * product, |_| product * along);
                    let explained = along * along + gain;
                    if new == 0 || explained <= least {
                        continue;
                    }
                    let (_, first_chunk, first_term) = first[k].indices;
                    // A second term halves the prior, and two terms have two orders.
                    let ln_prior = chunks[first_chunk].ln_prior[first_term] + chunk.ln_prior[term];
                    let scored = self.scored(explained, 2, ln_prior);
                    sums.push(Extension { indices: (k, number, term), scored });
                }
                if sums.len() > MAX_UNSORTED_SUMS {
                    sums = best_of(sums);
                }
            }
            best_of(sums)
        };
        let sums = parallel::joined(parallel::map(chunks.len(), of_chunk));
        for Extension { indices: (k, chunk, term), scored } in best_of(sums) {
            let (_, first_chunk, first_term) = first[k].indices;
            let mut sum = vec![
                chunks[first_chunk].terms[first_term].clone(),
                chunks[chunk].terms[term].clone(),
            ];
            sum.sort();
            if self.is_separated(&sum) {
                next.entry(sum).or_insert(scored);
            }
        }
    }

    /// Extends a sum by each term of `chunks`, and adds the new sums to `next` with their scores.
    fn extend_by(&self, chunks: &[Chunk], sum: &Sum, next: &mut BTreeMap<Sum, Scored>) {
        let spanned = self.spanned(sum);
        for Extension { indices: (_, chunk, term), scored } in self.extensions(&spanned, chunks) {
            let term = &chunks[chunk].terms[term];
            if spanned.sum.contains(term) {
                continue;
            }
            let mut longer = [spanned.sum.as_slice(), std::slice::from_ref(term)].concat();
            longer.sort();
            if !self.is_separated(&longer) {
                continue;
            }
            let entry = next.entry(longer).or_insert(scored);
            if scored.ln_posterior > entry.ln_posterior {
                *entry = scored;
            }
        }
    }

    /// Returns true if no two terms of a sum are nearly the same function.
    fn is_separated(&self, sum: &Sum) -> bool {
        let Self { terms, quantities, site, noise, .. } = self;
        sum.len() < 2
            || is_separated(terms, sum, &Refiner { terms, quantities, site, noise }.starts(sum))
    }

    /// Replaces each term of `sums` by its products with every factor, and adds the new sums to
    /// `next` with their scores. A term may explain little alone, but much in a sum with the other
    /// terms.
    fn multiply(&self, sums: &[Sum], next: &mut BTreeMap<Sum, Scored>) {
        for sum in sums {
            for k in 0..sum.len() {
                let others = [&sum[..k], &sum[k + 1..]].concat();
                let chunks = self.terms.multiples(&sum[k], self.site);
                self.extend_by(&chunks, &others, next);
            }
        }
    }

    /// Adds the best sums of `next` to it once more, with refined values of their inner parameters.
    fn refine(&mut self, next: &mut BTreeMap<Sum, Scored>) {
        for sum in self.best(next, REFINED_SUMS) {
            let Self { terms, quantities, site, noise, .. } = &*self;
            let refiner = Refiner { terms, quantities, site, noise };
            let Some(values) = refiner.best_values(&sum) else { continue };
            let with_values = |(term, values): (&Product, Vec<f64>)| {
                let pairs = term.iter().zip(values);
                let mut term: Product = pairs
                    .map(|(&k, value)| self.terms.with_inner(k, value, self.quantities))
                    .collect();
                term.sort_unstable();
                term
            };
            let mut refined: Sum = sum.iter().zip(values).map(with_values).collect();
            refined.sort();
            if !self.is_separated(&refined) {
                continue;
            }
            let scored = self.scored_sum(&refined);
            next.entry(refined).or_insert(scored);
        }
    }

    /// Returns the scores of a sum.
    fn scored_sum(&self, sum: &Sum) -> Scored {
        let SpannedSum { span, ln_prior, .. } = self.spanned(sum);
        self.scored(span.explained_squares(), span.along.len(), ln_prior)
    }

    /// Returns the columns of a term, scaled to length 1, and W times each of them.
    fn weighted(&self, term: &Product) -> Vec<Weighted> {
        self.site
            .weighted(self.terms.columns(term).into_iter().map(scaled_to_unit_length).collect())
    }

    fn spanned(&self, sum: &Sum) -> SpannedSum {
        let mut span = self.site.empty_span();
        for term in sum {
            span.extend(&self.weighted(term), &self.site.product);
        }
        #[expect(clippy::cast_possible_truncation, reason = "half the width is twice as fast")]
        let weighted = span.weighted.map(|value| value as f32);
        let ln_prior = if sum.is_empty() { 0.0 } else { ln_prior(&self.terms, sum) };
        SpannedSum { sum: sum.clone(), ln_prior, span, weighted }
    }

    /// Returns the extensions of a sum by terms of `chunks` with the best scores.
    fn extensions(&self, spanned: &SpannedSum, chunks: &[Chunk]) -> Vec<Extension> {
        let count = spanned.sum.len() as f64;
        let ln_prior_of_count =
            if spanned.sum.is_empty() { 0.0 } else { 0.5_f64.ln() + (count + 1.0).ln() };
        let (before, rank) = (spanned.span.explained_squares(), spanned.span.along.len());
        let of_chunk = |number: usize| {
            let chunk = &chunks[number];
            let along = few_transposed_times(&spanned.weighted, &chunk.columns);
            let product = |a: usize, b: usize| {
                let pairs = along.column(a).into_iter().zip(along.column(b));
                pairs.map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>()
            };
            let explained = |a: usize| {
                let pairs = along.column(a).into_iter().zip(spanned.span.along.iter());
                pairs.map(|(x, y)| f64::from(*x) * y).sum::<f64>()
            };
            let mut extensions: Vec<Extension> = Vec::new();
            for term in 0..chunk.terms.len() {
                let (gain, new) = chunk.gain(term, product, explained);
                if new == 0 {
                    continue;
                }
                let prior = spanned.ln_prior + chunk.ln_prior[term] + ln_prior_of_count;
                let scored = self.scored(before + gain, rank + new, prior);
                extensions.push(Extension { indices: (0, number, term), scored });
            }
            best_of(extensions)
        };
        best_of(parallel::joined(parallel::map(chunks.len(), of_chunk)))
    }

    /// Returns the scores of a sum that explains the sum of squares `explained` with `rank`
    /// independent columns.
    fn scored(&self, explained: f64, rank: usize, ln_prior: f64) -> Scored {
        let shrunk = explained * BEAM_VARIANCE / (1.0 + BEAM_VARIANCE);
        let occam = 0.5 * rank as f64 * (1.0 + BEAM_VARIANCE).ln();
        let poses = self.site.diagonal.len() as f64;
        let unexplained_share = (1.0 - shrunk / self.explainable.max(f64::MIN_POSITIVE)).max(1e-12);
        Scored {
            ln_posterior: self.noise.gain(shrunk) - occam + ln_prior,
            guide: -0.5 * poses * unexplained_share.ln() - occam + ln_prior,
        }
    }

    /// Returns at most `most` of the best sums, alternately by posterior and by guide, whose
    /// predictions differ by at least [`MIN_BEAM_DIFFERENCE`].
    fn best(&self, sums: &BTreeMap<Sum, Scored>, most: usize) -> Vec<Sum> {
        const MAX_COMPARED_SUMS: usize = 200;
        let by = |of: fn(&Scored) -> f64| {
            let mut sorted: Vec<(&Sum, f64)> = sums.iter().map(|(sum, s)| (sum, of(s))).collect();
            sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
            sorted.truncate(MAX_COMPARED_SUMS);
            sorted
        };
        let (by_evidence, by_guide) = (by(|s| s.ln_posterior), by(|s| s.guide));
        let in_turn = by_evidence.iter().zip(&by_guide).flat_map(|(a, b)| [a.0, b.0]);
        let mut found: Vec<(Sum, Weighted)> = Vec::new();
        // The noise factor assumes that the residual of the best sum is only noise.
        let mut factor = f64::NAN;
        let mut of_terms: BTreeMap<&Product, Vec<Weighted>> = BTreeMap::new();
        for sum in in_turn {
            if found.len() >= most {
                break;
            }
            if found.iter().any(|(other, _)| other == sum) {
                continue;
            }
            let mut span = self.site.empty_span();
            for term in sum {
                let columns = of_terms.entry(term).or_insert_with(|| self.weighted(term));
                span.extend(columns, &self.site.product);
            }
            let prediction = span.prediction();
            if factor.is_nan() {
                factor = self.noise.factor(span.explained_squares());
            }
            let is_near = |(_, other): &(Sum, Weighted)| {
                other.squared_distance(&prediction) < MIN_BEAM_DIFFERENCE.powi(2) * factor
            };
            if !found.iter().any(is_near) {
                found.push((sum.clone(), prediction));
            }
        }
        found.into_iter().map(|(sum, _)| sum).collect()
    }
}

/// Returns the sums that lack one term of a sum.
fn without_one(sum: &Sum) -> Vec<Sum> {
    (0..sum.len()).map(|k| [&sum[..k], &sum[k + 1..]].concat()).collect()
}

/// Returns the column scaled to length 1.
fn scaled_to_unit_length(column: DVector<f64>) -> DVector<f64> {
    let norm = column.norm();
    if norm > 0.0 { column / norm } else { column }
}

/// Returns the best extensions by posterior and by guide, at most [`KEPT_EXTENSIONS`] of each.
fn best_of(mut extensions: Vec<Extension>) -> Vec<Extension> {
    if extensions.len() <= KEPT_EXTENSIONS[0] {
        return extensions;
    }
    let mut others = split_best(&mut extensions, KEPT_EXTENSIONS[0], |scored| scored.ln_posterior);
    split_best(&mut others, KEPT_EXTENSIONS[1], |scored| scored.guide);
    extensions.extend(others);
    extensions
}

/// Keeps the `most` extensions with the highest value of `of`, sorted, and returns the others. Of
/// equal values the one with smaller indices comes first.
fn split_best(
    extensions: &mut Vec<Extension>,
    most: usize,
    of: impl Fn(&Scored) -> f64,
) -> Vec<Extension> {
    let order = |a: &Extension, b: &Extension| {
        of(&b.scored).total_cmp(&of(&a.scored)).then_with(|| a.indices.cmp(&b.indices))
    };
    if extensions.len() > most {
        extensions.select_nth_unstable_by(most, order);
    }
    let others = extensions.split_off(extensions.len().min(most));
    extensions.sort_unstable_by(order);
    others
}

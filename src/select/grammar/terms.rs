//! Terms: products of up to three factors, with their columns and inner products.

use nalgebra::{DMatrix, DVector};

use super::factor::{Factor, Form};
use super::quantities::Quantities;
use super::site::{Span, WhitenedSite};
use crate::numeric::kernel::{dot, few_transposed_times, sum_of_squares};
use crate::numeric::parallel;

/// Prior probability that a term has one, two or three factors.
const FACTOR_COUNT_PROBABILITIES: [f64; 3] = [0.6, 0.3, 0.1];
/// Prior probability of a sine or a cosine that is multiplied by none of another joint, relative to
/// one that is. An error by one joint's command has any phase, which their pair fits; in products
/// of several joints, as rotations give them, the zero positions of the arm determine the phases.
pub const LONE_WAVE: f64 = 1.0 / 3.0;
/// Smallest fraction of a column's length that the fitted parameters must leave unexplained.
const MIN_LEFT: f64 = 2e-3;
/// Smallest difference between the inner parameters of two terms of a sum with the same factors, in
/// grid steps.
const MIN_STEPS_APART: f64 = 1.9;
/// Number of terms whose columns are multiplied together in one matrix product.
const TERMS_PER_PRODUCT: usize = 1024;
/// Number of chunks of terms that are formed at a time: a bound of memory.
const CHUNKS_AT_ONCE: usize = 8;
/// Maximum number of terms with two factors that are kept, the best ones.
const MAX_PAIRS: usize = 8_000;
/// Maximum number of terms with two factors to which a third factor is added.
const MAX_EXTENDED: usize = 40;
/// Maximum number of terms with two factors tried in a sum because they explain most besides it.
const MAX_PAIRS_BESIDE: usize = 300;

/// Product of factors, given by their indices in [`Terms::factors`], ascending.
pub type Product = Vec<u16>;

/// Sum of products of factors: the terms of a formula.
pub type Sum = Vec<Product>;

/// Returns ln of the prior probability of a sum. Each term after the first halves it; the orders of
/// the terms add up.
pub fn ln_prior(terms: &Terms, sum: &Sum) -> f64 {
    let count = sum.len().max(1);
    let orderings: f64 = (1..=count).map(|k| k as f64).product();
    let of_terms: f64 = sum.iter().map(|term| terms.ln_prior(term)).sum();
    of_terms + (count - 1) as f64 * 0.5_f64.ln() + orderings.ln()
}

/// Returns false if two terms of a sum differ only in the position of a kink, or only in inner
/// parameters with nearly the same values `inner`. Such a sum approximates another function, such
/// as a ramp or a pulse, and is no law.
pub fn is_separated(terms: &Terms, sum: &Sum, inner: &[Vec<f64>]) -> bool {
    let is_apart = |a: usize, b: usize| {
        let factors = |k: usize| sum[k].iter().map(|&k| &terms.factors[usize::from(k)]);
        let is_other = sum[a].len() != sum[b].len()
            || factors(a).zip(factors(b)).any(|(one, other)| one.form != other.form);
        let mut pairs = factors(a).zip(inner[a].iter().zip(&inner[b]));
        is_other
            || pairs.any(|(factor, (one, other))| {
                let is_far = |step: f64| (one - other).abs() >= MIN_STEPS_APART * step;
                !matches!(factor.form, Form::Kink(_))
                    && factor.inner.is_some_and(|(_, step)| is_far(step))
            })
    };
    (0..sum.len()).all(|a| (a + 1..sum.len()).all(|b| is_apart(a, b)))
}

/// Group of terms with the same number of columns, and the inner products of these columns in W.
pub struct Chunk {
    /// Number of columns (1, or 2 for a sine with its cosine) of each term of the group.
    pub width: usize,
    /// Factors whose product is the term, for each term of the group.
    pub terms: Vec<Product>,
    /// ln of the prior probability of each term.
    pub ln_prior: Vec<f64>,
    /// Columns, each scaled to length 1, shape = (poses, terms × width).
    pub columns: DMatrix<f32>,
    /// Squared length of each column in W; 0 if the fitted parameters explain the column.
    pub squares: Vec<f64>,
    /// Inner product in W of the two columns of each term; empty if terms have one column.
    pub mixed: Vec<f64>,
    /// Product of each column with the whitened residual, in the order of `columns`.
    pub along: Vec<f64>,
}

/// Terms that the search for formulas at one site combines.
pub struct Terms {
    /// Factors of the dictionary, and after them those with refined inner parameters.
    pub factors: Vec<Factor>,
    /// Values of each factor in all poses: one column, or two for a sine with its cosine.
    values: Vec<Vec<DVector<f64>>>,
    /// Number of leading `factors` that are from the dictionary; the later ones have refined inner
    /// parameters.
    listed: usize,
    /// Terms in groups of equal width.
    pub chunks: Vec<Chunk>,
    /// All terms with two factors, without their columns.
    pairs: Vec<Chunk>,
}

impl Terms {
    /// Creates the terms: all single factors, the best products of two, and products of three that
    /// extend the best pairs.
    pub fn new(factors: Vec<Factor>, quantities: &Quantities, site: &WhitenedSite) -> Self {
        let columns = |factor: &Factor| {
            let columns =
                factor.form.columns(quantities, factor.inner.map_or(0.0, |inner| inner.0));
            columns.into_iter().map(DVector::from_vec).collect()
        };
        let values: Vec<Vec<DVector<f64>>> = factors.iter().map(columns).collect();
        let count = factors.len().min(usize::from(u16::MAX));
        let (chunks, pairs) = (Vec::new(), Vec::new());
        let mut new_terms = Self { factors, values, listed: count, chunks, pairs };
        let number = |k: usize| u16::try_from(k).unwrap_or(u16::MAX);
        let single: Vec<Product> = (0..count).map(|k| vec![number(k)]).collect();
        let pairs: Vec<Product> = (0..count)
            .flat_map(|a| (a..count).map(move |b| vec![number(a), number(b)]))
            .filter(|pair| new_terms.is_allowed(pair))
            .collect();
        let mut chunks = new_terms.chunks_of(&single, site);
        let (best_pairs, all_pairs) = new_terms.best_of(&pairs, MAX_PAIRS, site);
        let extended = new_terms.multiplied(&Self::best_terms(&best_pairs, MAX_EXTENDED));
        chunks.extend(best_pairs);
        chunks.extend(new_terms.chunks_of(&extended, site));
        (new_terms.chunks, new_terms.pairs) = (chunks, all_pairs);
        new_terms
    }

    /// Returns the products of `terms` with every factor of the dictionary.
    fn multiplied(&self, terms: &[Product]) -> Vec<Product> {
        let number = |k: usize| u16::try_from(k).unwrap_or(u16::MAX);
        let multiple = |term: &Product, factor: usize| {
            let mut term = [term.as_slice(), &[number(factor)]].concat();
            term.sort_unstable();
            term
        };
        let multiples = terms
            .iter()
            .filter(|term| term.len() < FACTOR_COUNT_PROBABILITIES.len())
            .flat_map(|term| (0..self.listed).map(move |factor| multiple(term, factor)));
        let mut multiples: Vec<Product> = multiples.filter(|term| self.is_allowed(term)).collect();
        multiples.sort_unstable();
        multiples.dedup();
        multiples
    }

    /// Returns, for each span, the terms with two factors that explain most of the residual in
    /// addition to it, and products of the best of them with every factor of the dictionary.
    ///
    /// A term that alone explains little may explain most of what other terms leave.
    pub fn beside(&self, spans: &[Span], site: &WhitenedSite) -> Vec<Vec<Product>> {
        let n = site.diagonal.len();
        let gains = |number: usize| {
            let chunk = &self.pairs[number];
            let terms: Vec<&Product> = chunk.terms.iter().collect();
            let columns = self.unit_columns(chunk.width, &terms, n);
            let of_span = |Span { weighted, along, .. }: &Span| {
                let products = few_transposed_times(weighted, &columns);
                let gain = |term: usize| chunk.gain_beside(term, (&products, along)).0;
                (0..terms.len()).map(|term| (gain(term), number, term)).collect::<Vec<_>>()
            };
            spans.iter().map(of_span).collect::<Vec<_>>()
        };
        let gains: Vec<Vec<Vec<(f64, usize, usize)>>> = parallel::map(self.pairs.len(), gains);
        let of_span =
            |span: usize| self.best_beside(gains.iter().flat_map(|of| &of[span]).copied());
        (0..spans.len()).map(of_span).collect()
    }

    /// Returns the terms with the largest gains, and products of the best of them with every factor
    /// of the dictionary. `gains` holds each gain with the indices of the chunk and of the term in
    /// it.
    fn best_beside(&self, gains: impl Iterator<Item = (f64, usize, usize)>) -> Vec<Product> {
        let order = |a: &(f64, usize, usize), b: &(f64, usize, usize)| {
            b.0.total_cmp(&a.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2)))
        };
        let mut gains: Vec<(f64, usize, usize)> = gains.collect();
        if gains.len() > MAX_PAIRS_BESIDE {
            gains.select_nth_unstable_by(MAX_PAIRS_BESIDE, order);
            gains.truncate(MAX_PAIRS_BESIDE);
        }
        gains.sort_unstable_by(order);
        let term = |(_, chunk, term): (f64, usize, usize)| self.pairs[chunk].terms[term].clone();
        let mut terms: Vec<Product> = gains.into_iter().map(term).collect();
        terms.extend(self.multiplied(&terms[..terms.len().min(MAX_EXTENDED)]));
        terms
    }

    /// Returns the products of a term with every factor of the dictionary, in chunks; none for a
    /// term of three factors.
    pub fn multiples(&self, term: &Product, site: &WhitenedSite) -> Vec<Chunk> {
        self.chunks_of(&self.multiplied(std::slice::from_ref(term)), site)
    }

    /// Returns the index of a factor with another value of its inner parameter. Adds the factor if
    /// it is not in the list.
    pub fn with_inner(&mut self, factor: u16, value: f64, quantities: &Quantities) -> u16 {
        let Factor { form, inner, ln_prior } = self.factors[usize::from(factor)].clone();
        let Some((old, step)) = inner else { return factor };
        #[expect(clippy::float_cmp, reason = "the same value is the same factor")]
        let is_same = |listed: &Factor| {
            listed.form == form && listed.inner.is_some_and(|(at, _)| at == value)
        };
        if old.to_bits() == value.to_bits() {
            return factor;
        }
        let index = self.factors.iter().position(is_same).unwrap_or_else(|| {
            self.factors.push(Factor { form, inner: Some((value, step)), ln_prior });
            let columns = form.columns(quantities, value);
            self.values.push(columns.into_iter().map(DVector::from_vec).collect());
            self.factors.len() - 1
        });
        u16::try_from(index).unwrap_or(factor)
    }

    /// Returns true if a product of factors may be a term: no product of fewer factors is the same
    /// function, and it has at most one harmonic.
    fn is_allowed(&self, term: &Product) -> bool {
        let of = |k: u16| &self.factors[usize::from(k)];
        let wide = term.iter().filter(|k| of(**k).form.width() > 1).count();
        // A gas spring is multiplied by no other factor.
        let is_lone = term.iter().any(|&k| matches!(of(k).form, Form::Strut { .. }));
        wide <= 1
            && (term.len() == 1 || !is_lone)
            && term.iter().enumerate().all(|(k, &one)| {
                term[k + 1..].iter().all(|&other| {
                    let (a, b) = (of(one), of(other));
                    let is_same = one == other;
                    // A product contains at most one kink, step or settling of the same quantity.
                    let is_shifted = a.form == b.form && a.inner.is_some();
                    !(is_same && (a.form.is_idempotent() || a.form.width() > 1)) && !is_shifted
                })
            })
    }

    /// Returns ln of the prior probability of a term.
    pub fn ln_prior(&self, term: &Product) -> f64 {
        let distinct = {
            let mut term = term.clone();
            term.dedup();
            term.len()
        };
        let orderings: f64 = match (term.len(), distinct) {
            (2, 2) => 2.0,
            (3, 3) => 6.0,
            (3, 2) => 3.0,
            _ => 1.0,
        };
        let factors = term.iter().map(|&k| self.factors[usize::from(k)].ln_prior);
        let forms = || term.iter().map(|&k| self.factors[usize::from(k)].form);
        let is_wave_elsewhere = |of: usize| {
            forms().any(|form| match form {
                Form::Wave { joint, .. } => joint != of,
                form => matches!(form, Form::OfSum { .. }),
            })
        };
        let phase = |form: Form| match form {
            Form::Wave { joint, .. } if !is_wave_elsewhere(joint) => LONE_WAVE.ln(),
            _ => 0.0,
        };
        let of_phases: f64 = forms().map(phase).sum();
        FACTOR_COUNT_PROBABILITIES[term.len().clamp(1, 3) - 1].ln()
            + factors.sum::<f64>()
            + orderings.ln()
            + of_phases
    }

    /// Returns the columns of a term, one value per pose.
    pub fn columns(&self, term: &[u16]) -> Vec<DVector<f64>> {
        let factor_columns = term.iter().map(|&k| &self.values[usize::from(k)]);
        product(factor_columns.map(Vec::as_slice)).unwrap_or_default()
    }

    fn width(&self, term: &[u16]) -> usize {
        term.iter().map(|&k| self.factors[usize::from(k)].form.width()).product()
    }

    /// Returns all of `terms` with their columns, in chunks of equal width.
    pub fn chunks_of(&self, terms: &[Product], site: &WhitenedSite) -> Vec<Chunk> {
        let chunk = |(width, terms): &(usize, Vec<&Product>)| self.chunk(*width, terms, site);
        parallel::map_items(&self.groups(terms), chunk)
    }

    /// Returns the `most` of `terms` that alone explain most of the residual, and all terms without
    /// their columns, both in chunks. Few chunks are formed at a time to save memory.
    fn best_of(
        &self,
        terms: &[Product],
        most: usize,
        site: &WhitenedSite,
    ) -> (Vec<Chunk>, Vec<Chunk>) {
        let chunk = |(width, terms): &(usize, Vec<&Product>)| self.chunk(*width, terms, site);
        let (mut best_chunks, mut all_chunks) = (Vec::<Chunk>::new(), Vec::new());
        for some in self.groups(terms).chunks(CHUNKS_AT_ONCE) {
            let new = parallel::map_items(some, chunk);
            all_chunks.extend(new.iter().map(Chunk::without_columns));
            best_chunks.extend(new);
            best_chunks = Self::best(best_chunks, most);
        }
        (best_chunks, all_chunks)
    }

    /// Returns the terms in groups for chunks, each with its number of columns a term (1 or 2).
    fn groups<'t>(&self, terms: &'t [Product]) -> Vec<(usize, Vec<&'t Product>)> {
        let (narrow, wide): (Vec<&Product>, Vec<&Product>) =
            terms.iter().partition(|term| self.width(term) == 1);
        let groups = |width: usize, terms: Vec<&'t Product>| -> Vec<(usize, Vec<&'t Product>)> {
            terms.chunks(TERMS_PER_PRODUCT).map(|some| (width, some.to_vec())).collect()
        };
        [groups(1, narrow), groups(2, wide)].concat()
    }

    /// Returns the columns of terms, each scaled to length 1, because powers of large numbers would
    /// exceed the range of single precision.
    fn unit_columns(&self, width: usize, terms: &[&Product], n: usize) -> DMatrix<f64> {
        let mut columns = DMatrix::<f64>::zeros(n, terms.len() * width);
        for (k, target) in columns.as_mut_slice().chunks_exact_mut(n.max(1)).enumerate() {
            target.fill(1.0);
            for &factor in terms[k / width] {
                let values = &self.values[usize::from(factor)];
                // At most one factor of a term has two columns.
                let values = values[(k % width).min(values.len() - 1)].as_slice();
                target.iter_mut().zip(values).for_each(|(value, factor)| *value *= factor);
            }
            let norm = sum_of_squares(target).sqrt();
            let scale = if norm > 0.0 { norm } else { 1.0 };
            for value in target {
                *value /= scale;
            }
        }
        columns
    }

    fn chunk(&self, width: usize, terms: &[&Product], site: &WhitenedSite) -> Chunk {
        let n = site.diagonal.len();
        let columns = self.unit_columns(width, terms, n);
        let less = site.within(&columns);
        let mut weighted = vec![0.0; n];
        let mut inner = |a: usize, b: usize| {
            let pairs = column(&columns, a).iter().zip(site.diagonal.as_slice());
            weighted.iter_mut().zip(pairs).for_each(|(value, (x, d))| *value = x * d);
            let whole = dot(&weighted, column(&columns, b));
            (whole, whole - dot(column(&less, a), column(&less, b)))
        };
        let mut squares = Vec::with_capacity(columns.ncols());
        for k in 0..columns.ncols() {
            let (whole, left) = inner(k, k);
            let is_seen = left.is_finite() && left > MIN_LEFT * MIN_LEFT * whole;
            squares.push(if is_seen { left } else { 0.0 });
        }
        let mixed = if width == 2 {
            (0..terms.len()).map(|k| inner(2 * k, 2 * k + 1).1).collect()
        } else {
            Vec::new()
        };
        let along = (0..columns.ncols())
            .map(|k| dot(column(&columns, k), site.product.as_slice()))
            .collect();
        Chunk {
            width,
            terms: terms.iter().map(|&term| term.clone()).collect(),
            ln_prior: terms.iter().map(|term| self.ln_prior(term)).collect(),
            squares,
            mixed,
            along,
            #[expect(clippy::cast_possible_truncation, reason = "half the width is twice as fast")]
            columns: columns.map(|value| value as f32),
        }
    }

    /// Keeps the `most` terms that alone explain most of the residual.
    fn best(chunks: Vec<Chunk>, most: usize) -> Vec<Chunk> {
        let mut gains: Vec<f64> = chunks.iter().flat_map(Chunk::single_term_gains).collect();
        if gains.len() <= most {
            return chunks;
        }
        let (_, &mut least, _) = gains.select_nth_unstable_by(most, |a, b| b.total_cmp(a));
        chunks.into_iter().map(|chunk| chunk.explaining_more_than(least)).collect()
    }

    /// Returns the `most` terms that alone explain most of the residual, the best one first.
    fn best_terms(chunks: &[Chunk], most: usize) -> Vec<Product> {
        let mut gains_and_terms: Vec<(f64, &Product)> =
            chunks.iter().flat_map(|chunk| chunk.single_term_gains().zip(&chunk.terms)).collect();
        let order = |a: &(f64, &Product), b: &(f64, &Product)| {
            b.0.total_cmp(&a.0).then_with(|| a.1.cmp(b.1))
        };
        if gains_and_terms.len() > most {
            gains_and_terms.select_nth_unstable_by(most, order);
            gains_and_terms.truncate(most);
        }
        gains_and_terms.sort_unstable_by(order);
        gains_and_terms.into_iter().map(|(_, term)| term.clone()).collect()
    }
}

impl Chunk {
    /// Returns the sum of squares that each term alone explains.
    pub fn single_term_gains(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.terms.len()).map(|term| self.gain(term, |_, _| 0.0, |_| 0.0).0)
    }

    /// Returns the sum of squares that a term explains in addition to a span, and its number of
    /// columns independent of the span. For column indices, `less` returns the inner product of two
    /// columns' parts within the span, `explained` that of a column's part with the residual.
    pub fn gain(
        &self,
        term: usize,
        less: impl Fn(usize, usize) -> f64,
        explained: impl Fn(usize) -> f64,
    ) -> (f64, usize) {
        const MIN_NEW: f64 = 1e-4;
        let first = term * self.width;
        let gain_and_square = |k: usize| {
            let new_square = self.squares[k] - less(k, k);
            let is_new = new_square > MIN_NEW * self.squares[k] && self.squares[k] > 0.0;
            if is_new {
                ((self.along[k] - explained(k)).powi(2) / new_square, new_square)
            } else {
                (0.0, 0.0)
            }
        };
        if self.width == 1 {
            let (gain, new_square) = gain_and_square(first);
            return (gain, usize::from(new_square > 0.0));
        }
        let (a, b) = (gain_and_square(first), gain_and_square(first + 1));
        let mixed = self.mixed[term] - less(first, first + 1);
        let determinant = a.1 * b.1 - mixed * mixed;
        if a.1 <= 0.0 || b.1 <= 0.0 || determinant <= 1e-6 * a.1 * b.1 {
            let (gain, left) = if a.1 >= b.1 { a } else { b };
            return (gain, usize::from(left > 0.0));
        }
        let [p, q] = [first, first + 1].map(|k| self.along[k] - explained(k));
        ((b.1 * p * p - 2.0 * mixed * p * q + a.1 * q * q) / determinant, 2)
    }

    /// Returns the result of [`Self::gain`]. `products` holds the inner products of the chunk's
    /// columns with the orthonormal functions of the span, `along` those of the functions with the
    /// residual.
    fn gain_beside(
        &self,
        term: usize,
        (products, along): (&DMatrix<f64>, &DVector<f64>),
    ) -> (f64, usize) {
        let column = |k: usize| column(products, k);
        self.gain(term, |a, b| dot(column(a), column(b)), |a| dot(column(a), along.as_slice()))
    }

    /// Returns the chunk without the columns, but with their inner products.
    fn without_columns(&self) -> Self {
        Self {
            width: self.width,
            terms: self.terms.clone(),
            ln_prior: self.ln_prior.clone(),
            columns: DMatrix::zeros(0, 0),
            squares: self.squares.clone(),
            mixed: self.mixed.clone(),
            along: self.along.clone(),
        }
    }

    /// Keeps the terms that alone explain more than the sum of squares `least`.
    fn explaining_more_than(self, least: f64) -> Self {
        let gains: Vec<f64> = self.single_term_gains().collect();
        let kept: Vec<usize> = (0..gains.len()).filter(|&k| gains[k] > least).collect();
        if kept.len() == gains.len() {
            return self;
        }
        let columns: Vec<usize> =
            kept.iter().flat_map(|k| (0..self.width).map(move |j| k * self.width + j)).collect();
        Self {
            width: self.width,
            terms: kept.iter().map(|&k| self.terms[k].clone()).collect(),
            ln_prior: kept.iter().map(|&k| self.ln_prior[k]).collect(),
            columns: self.columns.select_columns(&columns),
            squares: columns.iter().map(|&k| self.squares[k]).collect(),
            mixed: if self.width == 2 {
                kept.iter().map(|&k| self.mixed[k]).collect()
            } else {
                Vec::new()
            },
            along: columns.iter().map(|&k| self.along[k]).collect(),
        }
    }
}

/// Returns a column of a matrix.
fn column(matrix: &DMatrix<f64>, k: usize) -> &[f64] {
    let rows = matrix.nrows();
    &matrix.as_slice()[k * rows..(k + 1) * rows]
}

/// Returns the products of the factors' columns: one column for each choice of one column from
/// every factor; `None` if there are no factors.
pub fn product<'a>(factors: impl Iterator<Item = &'a [DVector<f64>]>) -> Option<Vec<DVector<f64>>> {
    factors.map(<[DVector<f64>]>::to_vec).reduce(|left, right| {
        left.iter()
            .flat_map(|one| right.iter().map(move |other| one.component_mul(other)))
            .collect()
    })
}

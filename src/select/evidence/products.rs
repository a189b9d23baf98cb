//! Products of the columns of hypotheses with one another and with the residual, on which alone
//! the evidence of a set depends. Each product is computed on first use and cached.

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock, PoisonError};

use nalgebra::{DMatrix, DVector};

use super::block::Block;
use super::cache::Cache;
use super::column_products::{
    ColumnProducts, MIN_SIDE, Member, form_products, products_of_stacked,
};
use super::marginal::{Noise, NoiseGrid, Normal};
use crate::fit::Stop;
use crate::numeric::parallel;
use crate::numeric::{inverse_factor, inverse_lower, lower_factor, lower_product};
use crate::select::neighbourhood::LinearNeighbourhood;

/// Number of hypotheses whose gains are computed in one matrix product.
const HYPOTHESES_PER_PRODUCT: usize = 16;

/// Smallest size of a set's member at which its gain is computed from the diagonal block Pₖₖ (see
/// [`ReducedProblem::of_member`]). At smaller sizes Pₖₖ⁻¹ is 1 to rounding, and the other members
/// are factored instead.
const MIN_SIZE_OF_MEMBER: f64 = 1e-3;

/// Linearised fit whose residual the hypotheses are to explain, with the noise model and the
/// request to stop the search.
#[derive(Debug, Clone)]
pub(super) struct ResidualModel {
    pub fit: LinearNeighbourhood,
    pub noise: Noise,
    /// ln of the factor on the prior of a hypothesis if the set already contains one of its family.
    pub alike: f64,
    /// Request to stop the search early.
    pub stop: Stop,
}

/// Columns of hypotheses, the residual, and their products.
pub(super) struct Products<'a> {
    pub blocks: &'a [Block],
    pub residual_model: &'a ResidualModel,
    /// Sum of squares rᵀr, with the fitted parameters projected out.
    pub squares: f64,
    /// Grid over the noise factor f = true σ / assumed σ.
    grid: NoiseGrid,
    cache: CachedProducts,
}

/// Cached results of computations about a list of hypotheses and one residual. They remain valid
/// when hypotheses are appended to the list.
#[derive(Default)]
pub(super) struct CachedProducts {
    /// Columns of each hypothesis that is in a set, with their products with other columns.
    columns: ColumnProducts,
    /// Gains of hypotheses when added to a set, by set.
    gains: Mutex<BTreeMap<SizedSet, Gains>>,
    /// Converged sizes and ln posterior of sets.
    settled: Cache<SizedSet, (Vec<f64>, f64)>,
}

/// Gain in ln p(r) by each hypothesis, and its most probable size, by the index of the hypothesis.
type Gains = BTreeMap<usize, (f64, f64)>;

/// Key of a set: its members with the bit patterns of their sizes, in order.
type SizedSet = Vec<(usize, u64)>;

fn sized_set(members: &[usize], sizes: &[f64]) -> SizedSet {
    members.iter().copied().zip(sizes.iter().map(|size| size.to_bits())).collect()
}

impl<'a> Products<'a> {
    pub fn new(blocks: &'a [Block], residual_model: &'a ResidualModel) -> Self {
        Self::with_cache(CachedProducts::default(), blocks, residual_model)
    }

    /// Creates the products for `blocks`, reusing cached results about the first of them.
    pub fn with_cache(
        mut cache: CachedProducts,
        blocks: &'a [Block],
        residual_model: &'a ResidualModel,
    ) -> Self {
        let squares = residual_model.fit.residual().norm_squared();
        cache.columns.extend_to(blocks.len());
        Self { blocks, residual_model, squares, grid: residual_model.noise.grid(), cache }
    }

    /// Returns the cached results, for reuse with more hypotheses.
    pub fn into_cache(self) -> CachedProducts {
        self.cache
    }

    /// Returns ln of the density of a residual with this sum of squares, integrated over the noise
    /// factor, up to a constant.
    pub fn ln_density(&self, squares: f64) -> f64 {
        self.grid.ln_likelihood(squares)
    }

    /// Returns true if at least one of these hypotheses is a periodic error with many orders.
    pub fn has_gear(&self, members: &[usize]) -> bool {
        members.iter().any(|&member| self.blocks[member].is_periodic_of_many_orders)
    }

    /// Returns ln of the prior probability of a hypothesis in a set that contains the `others`.
    pub fn ln_prior(&self, block: &Block, others: &[usize]) -> f64 {
        if others.iter().any(|&other| block.excludes(&self.blocks[other])) {
            return f64::NEG_INFINITY;
        }
        let is_alike =
            block.is_law() && others.iter().any(|&other| self.blocks[other].family == block.family);
        block.ln_prior + if is_alike { self.residual_model.alike } else { 0.0 }
    }

    fn member(&self, block: usize) -> &Member {
        self.cache.columns.member(block, self.blocks, &self.residual_model.fit)
    }

    /// Returns the product AᵀC of a set member's columns A and another hypothesis' columns C.
    fn product(&self, member: usize, other: usize) -> &DMatrix<f64> {
        self.member(member).product_with(other, self.blocks)
    }

    /// Forms the products of several set members with other hypotheses together, which is faster
    /// than one after the other.
    pub fn form(&self, members: impl IntoIterator<Item = usize>, others: &[usize]) {
        if !self.residual_model.stop.is_requested() {
            let members: Vec<&Member> =
                members.into_iter().map(|member| self.member(member)).collect();
            form_products(&members, others, self.blocks);
        }
    }

    /// Returns, for each tried hypothesis, the gain in ln p(r) in addition to a set with given
    /// sizes, and its most probable size. Empty if the search was stopped or the set is degenerate.
    pub fn gains(&self, members: &[usize], sizes: &[f64], tried: &[usize]) -> Vec<(f64, f64)> {
        let set = sized_set(members, sizes);
        let cached = || self.cache.gains.lock().unwrap_or_else(PoisonError::into_inner);
        let missing: Vec<usize> = match cached().get(&set) {
            Some(gains) => {
                tried.iter().copied().filter(|block| !gains.contains_key(block)).collect()
            }
            None => tried.to_vec(),
        };
        if !missing.is_empty() {
            let Some(left) = self.reduced(members, sizes) else { return Vec::new() };
            let gains = left.gains(&missing);
            if gains.len() < missing.len() {
                return Vec::new();
            }
            cached().entry(set.clone()).or_default().extend(missing.into_iter().zip(gains));
        }
        let cached = cached();
        let entries_of_set = cached.get(&set);
        tried.iter().filter_map(|block| entries_of_set?.get(block).copied()).collect()
    }

    /// Returns the converged sizes of a set and ln of its posterior; calls `settle` if they are not
    /// cached. `settle` also returns true if its sizes are a fixed point; the result for a set that
    /// starts with them is then the same.
    pub fn settled(
        &self,
        (members, sizes): (&[usize], &[f64]),
        settle: impl FnOnce() -> Option<(Vec<f64>, f64, bool)>,
    ) -> Option<(Vec<f64>, f64)> {
        let cache = &self.cache.settled;
        cache.get_or_compute(&sized_set(members, sizes), || {
            let (sizes, ln_posterior, stay) = settle()?;
            let result = (sizes, ln_posterior);
            if stay {
                let converged = sized_set(members, &result.0);
                cache.get_or_compute(&converged, || Some(result.clone()));
            }
            Some(result)
        })
    }

    /// Returns the problem that remains once the hypotheses `members` are fitted with the prior
    /// standard deviations `sizes` of their coefficients; `None` if the Cholesky factorisation
    /// fails.
    pub fn reduced(&self, members: &[usize], sizes: &[f64]) -> Option<ReducedProblem<'_, 'a>> {
        let mut scales = Vec::new();
        let mut begins = Vec::new();
        for (&member, &size) in members.iter().zip(sizes) {
            begins.push(scales.len());
            scales.extend(std::iter::repeat_n(size, self.member(member).columns.ncols()));
        }
        let n = scales.len();
        let (mut inner, mut residual_along) = (DMatrix::identity(n, n), DVector::zeros(n));
        for (i, (&one, &size)) in members.iter().zip(sizes).enumerate() {
            let product = self.blocks[one].product();
            residual_along.rows_mut(begins[i], product.len()).axpy(size, product, 0.0);
            for j in 0..=i {
                // The factorisation reads only the lower half.
                let gram = self.product(one, members[j]);
                inner.view_mut((begins[i], begins[j]), gram.shape()).zip_apply(
                    gram,
                    |entry, value| {
                        *entry += size * sizes[j] * value;
                    },
                );
            }
        }
        let mut within = inverse_factor(&inner)?;
        let ln_determinant = -within.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let residual_along = &within * residual_along;
        within.column_iter_mut().zip(scales).for_each(|(mut column, scale)| column *= scale);
        let squares = self.squares - residual_along.norm_squared();
        let without = self.ln_density(squares);
        Some(ReducedProblem {
            products: self,
            members: members.to_vec(),
            within,
            residual_along,
            squares,
            without,
            ln_determinant,
            sizes: sizes.to_vec(),
            begins,
            reach: OnceLock::new(),
        })
    }
}

/// Residual problem that a set leaves. With A the columns of its members, D their sizes, 1 + D AᵀA
/// D = L Lᵀ and Z = L⁻¹D Aᵀ, it leaves CᵀC − (Z C)ᵀ(Z C) and Cᵀr − (Z C)ᵀ(Z r) of other columns C.
pub(super) struct ReducedProblem<'p, 'a> {
    products: &'p Products<'a>,
    members: Vec<usize>,
    sizes: Vec<f64>,
    /// Index of the first column of each member among the columns of all members of the set.
    begins: Vec<usize>,
    /// Matrix L⁻¹D: the sizes D of the members, divided by the Cholesky factor L of 1 + D AᵀA D.
    within: DMatrix<f64>,
    /// Vector Z r = L⁻¹D Aᵀr: the residual r along the whitened columns of the set.
    residual_along: DVector<f64>,
    pub squares: f64,
    /// ln of the density of the residual that remains after the set is fitted, without the term in
    /// det L.
    without: f64,
    /// ln det L of the Cholesky factor L of 1 + D AᵀA D, with the columns A and the sizes D of the
    /// members.
    ln_determinant: f64,
    /// Matrix Z, computed when columns of other hypotheses are first needed.
    reach: OnceLock<DMatrix<f64>>,
}

impl ReducedProblem<'_, '_> {
    /// Returns ln p(r | set) for the sizes of the set's members.
    pub fn ln_likelihood(&self) -> f64 {
        self.without - self.ln_determinant
    }

    /// Returns ln p(r | set) averaged over the size of the k-th member, and its most probable size
    /// given the others; `None` if a factorisation fails.
    ///
    /// Let P = (1 + D AᵀA D)⁻¹, t = P D Aᵀr and c the size of member k. Given the others, its
    /// columns have G = (Pₖₖ⁻¹ − 1)/c² and b = Pₖₖ⁻¹tₖ/c. Without it, the set leaves tₖᵀPₖₖ⁻¹tₖ
    /// more squares, and its determinant is det(1 + D AᵀA D) det Pₖₖ.
    pub fn of_member(&self, k: usize) -> Option<(f64, f64)> {
        let Products { blocks, residual_model, grid, .. } = self.products;
        let (block, size) = (&blocks[self.members[k]], self.sizes[k]);
        if size < MIN_SIZE_OF_MEMBER {
            let others = [&self.members[..k], &self.members[k + 1..]].concat();
            let others = self
                .products
                .reduced(&others, &[&self.sizes[..k], &self.sizes[k + 1..]].concat())?;
            let (gain, size) = others.gain(self.members[k]);
            return Some((others.ln_likelihood() + gain, size));
        }
        // L⁻¹D is lower triangular, so the columns of member k are zero above row `first`.
        let (first, count) = (self.begins[k], block.product().len());
        let rows = self.within.view((first, first), (self.within.nrows() - first, count)) / size;
        let lower = lower_factor(rows.transpose() * &rows)?;
        let ln_determinant = lower.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let inverse = inverse_lower(&lower);
        let along = rows.tr_mul(&self.residual_along.rows_range(first..));
        let product = inverse.tr_mul(&(&inverse * &along));
        let squares = self.squares + along.dot(&product);
        let mut gram = inverse.transpose() * inverse;
        (0..count).for_each(|j| gram[(j, j)] -= 1.0);
        let normal = Normal::Dense { gram: gram / (size * size), product: product / size };
        let (ln_summed, size) =
            block.ln_likelihood_over_sizes(&normal, (squares, residual_model.noise.freedom), grid);
        Some((ln_summed - self.ln_determinant - ln_determinant, size))
    }

    /// Returns the residual that the set leaves, with the fitted parameters projected out.
    pub fn residual(&self) -> DVector<f64> {
        let mut residual = self.products.residual_model.fit.residual().clone();
        let along = self.within.tr_mul(&self.residual_along);
        let mut first = 0;
        for &member in &self.members {
            let columns = &self.products.member(member).columns;
            residual.gemv(-1.0, columns, &along.rows(first, columns.ncols()), 1.0);
            first += columns.ncols();
        }
        residual
    }

    /// Returns the matrix Z, which reduces columns and residuals by the set.
    pub fn reach(&self) -> &DMatrix<f64> {
        self.reach.get_or_init(|| {
            let mut reach = DMatrix::zeros(
                self.residual_along.len(),
                self.products.residual_model.fit.residual().len(),
            );
            let mut first = 0;
            for &member in &self.members {
                let transposed = &self.products.member(member).transposed;
                // The factor is lower triangular, so that only its rows below `first` contribute.
                let below = self.within.nrows() - first;
                let block_of_within = self.within.view((first, first), (below, transposed.nrows()));
                reach.rows_range_mut(first..).gemm(1.0, &block_of_within, transposed, 1.0);
                first += transposed.nrows();
            }
            reach
        })
    }

    /// Returns ln p(r | set and hypothesis) − ln p(r | set), without the prior, and the most
    /// probable size of the hypothesis.
    pub fn gain(&self, block: usize) -> (f64, f64) {
        self.gains_together(&[block])[0]
    }

    /// Returns the gains of several hypotheses; empty if the search was stopped.
    pub fn gains(&self, tried: &[usize]) -> Vec<(f64, f64)> {
        self.products.form(self.members.iter().copied(), tried);
        let stop = &self.products.residual_model.stop;
        let of = |some: &[usize]| {
            if stop.is_requested() { Vec::new() } else { self.gains_together(some) }
        };
        let gains = parallel::map_chunks(tried, HYPOTHESES_PER_PRODUCT, of);
        if gains.len() == tried.len() { gains } else { Vec::new() }
    }

    fn gains_together(&self, tried: &[usize]) -> Vec<(f64, f64)> {
        let Products { blocks, .. } = *self.products;
        let counts = || tried.iter().map(|&block| blocks[block].product().len());
        // A gain does not depend on the hypotheses that are tried with it.
        let width = counts().sum::<usize>().max(MIN_SIDE);
        let mut stacked = DMatrix::zeros(self.residual_along.len(), width);
        for (&member, &first) in self.members.iter().zip(&self.begins) {
            let count = self.products.member(member).columns.ncols();
            let mut targets = stacked.as_mut_slice().chunks_exact_mut(self.within.nrows().max(1));
            for &block in tried {
                let with = self.products.product(member, block).as_slice();
                for (column, target) in with.chunks_exact(count.max(1)).zip(&mut targets) {
                    target[first..first + count].copy_from_slice(column);
                }
            }
        }
        self.gains_along(
            tried.iter().map(|&block| &blocks[block]),
            &lower_product(&self.within, &stacked),
        )
    }

    /// Returns ln of the odds of the set with each of `blocks` over the set alone, priors included.
    /// These blocks need not be in the list of blocks of the products.
    pub fn ln_odds_of(&self, blocks: &[Block]) -> Vec<f64> {
        let padded = |block: &Block| {
            let rows = self.products.residual_model.fit.residual().len();
            block.unprojected().into_owned().resize_vertically(rows, 0.0)
        };
        let columns: Vec<DMatrix<f64>> = blocks.iter().map(padded).collect();
        let along = products_of_stacked(self.reach(), &columns.iter().collect::<Vec<_>>());
        let gains = self.gains_along(blocks.iter(), &along);
        gains
            .into_iter()
            .zip(blocks)
            .map(|((gain, _), block)| gain + self.products.ln_prior(block, &self.members))
            .collect()
    }

    /// Returns the gains of hypotheses with columns C (side by side), which the set reduces by Z C
    /// = `along`.
    fn gains_along<'b>(
        &self,
        blocks: impl Iterator<Item = &'b Block>,
        along: &DMatrix<f64>,
    ) -> Vec<(f64, f64)> {
        let Products { residual_model, grid, .. } = self.products;
        let squares_and_freedom = ((self.squares, residual_model.noise.freedom), self.without);
        let mut rest = along.as_slice();
        let gain = |block: &Block| {
            let (along_block, others) = rest.split_at(along.nrows() * block.product().len());
            rest = others;
            block.gain(
                (!self.members.is_empty()).then_some((along_block, &self.residual_along)),
                squares_and_freedom,
                grid,
            )
        };
        blocks.map(gain).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::select::evidence::block::Design;
    use crate::select::evidence::marginal::Coefficients;
    use crate::select::neighbourhood::Unknowns;

    /// Returns a matrix of pseudo-random numbers.
    fn matrix(rows: usize, columns: usize, seed: f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            (12.9898 * i as f64 + 78.233 * j as f64 + seed).sin() * 43.7 % 1.0
        })
    }

    #[test]
    fn products_tell_what_a_dense_solve_does() {
        let (jacobian, residual) = (matrix(120, 4, 0.5), matrix(120, 1, 9.0).column(0) * 4.0);
        let unknowns =
            Unknowns { x: vec![0.0; 4], priors: vec![None; 4], active: DMatrix::zeros(0, 4) };
        let fit = LinearNeighbourhood::new(&jacobian, &residual, &unknowns, 0);
        let lever = matrix(120, 1, 3.0).column(0).into_owned();
        let designs = [
            Design::Dense(matrix(120, 2, 1.0)),
            Design::per_pose(&lever),
            Design::Dense(matrix(120, 30, 2.0)),
        ];
        let designs =
            designs.map(|effect| (effect.scaled(40).unwrap(), 0.0, Coefficients::default()));
        let blocks = Block::all(designs.to_vec(), &fit);
        let noise = Noise { freedom: 116.0, ln_half_width: 0.1, min_ln_factor: 0.0 };
        let residual_model = ResidualModel { fit, noise, alike: 0.0, stop: Stop::default() };
        let products = Products::new(&blocks, &residual_model);
        let (members, sizes) = ([0, 1, 2], [3.0, 0.3, 1.0]);
        let reduced = products.reduced(&members, &sizes).unwrap();
        let r = residual_model.fit.residual();
        let mut covariance = DMatrix::identity(r.len(), r.len());
        for (&member, size) in members.iter().zip(sizes) {
            let columns = blocks[member].columns(&residual_model.fit);
            covariance += &columns * columns.transpose() * (size * size);
        }
        let factor = covariance.cholesky().unwrap();
        let solved = factor.solve(r);
        assert!((reduced.residual() - &solved).amax() < 1e-9);
        assert!((reduced.squares / r.dot(&solved) - 1.0).abs() < 1e-9);
        let ln_determinant: f64 = factor.l().diagonal().iter().map(|value| value.ln()).sum();
        assert!((reduced.ln_determinant - ln_determinant).abs() < 1e-9);
        // The result for one member of a set equals the gain of adding it to the other members,
        // even for a size near zero.
        for (k, least) in [(0, 1.0), (1, 1.0), (2, 1.0), (1, 1e-6)] {
            let mut sizes = sizes;
            sizes[k] *= least;
            let others: Vec<usize> = (0..3).filter(|&other| other != k).collect();
            let beside = products
                .reduced(&others, &others.iter().map(|&other| sizes[other]).collect::<Vec<_>>())
                .unwrap();
            let (gain, size) = beside.gain(k);
            let summed = products.reduced(&members, &sizes).unwrap().of_member(k).unwrap();
            let expected = beside.ln_likelihood() + gain;
            assert!(
                (summed.0 / expected - 1.0).abs() < 1e-9 && (summed.1 - size).abs() < 1e-12,
                "{summed:?} {expected} {size}"
            );
        }
        // The gain of a hypothesis does not depend on whether it is in the list of blocks.
        let two = products.reduced(&members[..2], &sizes[..2]).unwrap();
        for (block, (gain, size)) in
            two.gains(&[2, 0, 1]).into_iter().zip([2, 0, 1]).map(|(summed, block)| (block, summed))
        {
            let alone = two.gain(block);
            assert!((gain - alone.0).abs() < 1e-9 && (size - alone.1).abs() < 1e-12);
        }
        assert!((two.gain(2).0 - two.ln_odds_of(&blocks[2..])[0]).abs() < 1e-9);
    }

    #[test]
    fn a_further_effect_of_a_family_that_is_there_is_likelier() {
        let (jacobian, residual) = (matrix(30, 1, 0.5), matrix(30, 1, 9.0).column(0).into_owned());
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let fit = LinearNeighbourhood::new(&jacobian, &residual, &unknowns, 0);
        let families =
            [Some("joint-compliance"), Some("joint-compliance"), Some("link-bending"), None, None];
        let block = |family: Option<&str>| {
            let mut block =
                Block::new(Design::Dense(matrix(30, 1, 1.0)), &fit, -3.0, Coefficients::default());
            block.family = family.map(str::to_owned);
            block
        };
        let blocks: Vec<Block> = families.map(block).to_vec();
        let noise = Noise { freedom: 29.0, ln_half_width: 0.1, min_ln_factor: 0.0 };
        let model = ResidualModel { fit: fit.clone(), noise, alike: 1.5, stop: Stop::default() };
        let products = Products::new(&blocks, &model);
        let of = |block: usize, others: &[usize]| products.ln_prior(&blocks[block], others);
        let is = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-12, "{value}");
        is(of(1, &[]), -3.0);
        is(of(1, &[2, 3]), -3.0);
        is(of(1, &[2, 0]), -1.5);
        // Functions without a law do not belong to a family of effects.
        is(of(4, &[3, 0]), -3.0);
    }
}

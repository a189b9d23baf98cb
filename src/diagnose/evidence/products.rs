//! Products of the columns of hypotheses with one another and with the residual: what a set leaves, and what a further hypothesis gains
//! beside it, is told by these alone. Each is made once, when the first set asks for it.

use std::borrow::Cow;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::block::Block;
use super::marginal::{Noise, over_noise};
use crate::diagnose::neighbourhood::LinearNeighbourhood;
use crate::diagnose::rules::SelectionRules;
use crate::identify::Stop;

/// What is explained: what a fit leaves, with its degrees of freedom, and how far its σ is trusted.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub fit: LinearNeighbourhood,
    pub noise: Noise,
    /// The wish that the search end early.
    pub stop: Stop,
}

/// Columns of hypotheses, the residual they are to explain, and their products.
pub(super) struct Products<'a> {
    pub blocks: &'a [Block],
    pub target: &'a Target,
    pub rules: &'a SelectionRules,
    /// rᵀr, everything fitted projected out.
    pub squares: f64,
    /// Of the noise.
    grid: Vec<(f64, f64)>,
    members: Vec<OnceLock<Member<'a>>>,
}

/// A hypothesis of some set.
struct Member<'a> {
    /// A, everything fitted projected out.
    columns: Cow<'a, DMatrix<f64>>,
    /// Aᵀ.
    transposed: DMatrix<f64>,
    /// AᵀC of every other one.
    products: Vec<OnceLock<DMatrix<f64>>>,
}

impl<'a> Products<'a> {
    pub fn new((blocks, target): (&'a [Block], &'a Target), rules: &'a SelectionRules) -> Self {
        let squares = target.fit.residual().norm_squared();
        let members = std::iter::repeat_with(OnceLock::new).take(blocks.len()).collect();
        Self { blocks, target, rules, squares, grid: target.noise.grid(), members }
    }

    /// ln of the density of a residual of such squares, up to a constant.
    pub fn over_noise(&self, squares: f64) -> f64 {
        over_noise(squares, &self.grid)
    }

    fn member(&self, block: usize) -> &Member<'a> {
        self.members[block].get_or_init(|| {
            let columns = self.blocks[block].columns(&self.target.fit);
            let products = std::iter::repeat_with(OnceLock::new).take(self.blocks.len()).collect();
            Member { transposed: columns.transpose(), columns, products }
        })
    }

    /// AᵀC of a member of a set and another hypothesis.
    fn product(&self, member: usize, other: usize) -> &DMatrix<f64> {
        let member = self.member(member);
        member.products[other].get_or_init(|| self.blocks[other].times((&member.columns, &member.transposed)))
    }

    /// What a set leaves at some sizes.
    pub fn left(&self, members: &[usize], sizes: &[f64]) -> Option<Left<'_, 'a>> {
        let mut scales = Vec::new();
        let mut begins = Vec::new();
        for (&member, &size) in members.iter().zip(sizes) {
            begins.push(scales.len());
            scales.extend(std::iter::repeat_n(size, self.member(member).columns.ncols()));
        }
        let n = scales.len();
        let (mut inner, mut taken) = (DMatrix::identity(n, n), DVector::zeros(n));
        for (i, (&one, &size)) in members.iter().zip(sizes).enumerate() {
            let product = self.blocks[one].product();
            taken.rows_mut(begins[i], product.len()).axpy(size, product, 0.0);
            for j in 0..=i {
                // The lower half alone is read.
                let gram = self.product(one, members[j]);
                inner.view_mut((begins[i], begins[j]), gram.shape()).zip_apply(gram, |own, value| {
                    *own += size * sizes[j] * value;
                });
            }
        }
        let lower = inner.cholesky()?.l();
        let within = lower.solve_lower_triangular(&DMatrix::from_diagonal(&DVector::from_row_slice(&scales)))?;
        if !lower.solve_lower_triangular_mut(&mut taken) {
            return None;
        }
        let squares = self.squares - taken.norm_squared();
        let without = self.over_noise(squares);
        let ln_determinant = lower.diagonal().iter().map(|value| value.ln()).sum();
        Some(Left { products: self, members: members.to_vec(), within, taken, squares, without, ln_determinant })
    }
}

/// What a set leaves of the residual: with A of its members, D of their sizes, 1 + D AᵀA D = L Lᵀ and Z = L⁻¹D Aᵀ it leaves CᵀC − (Z C)ᵀ(Z C)
/// and Cᵀr − (Z C)ᵀ(Z r) of further columns C.
pub(super) struct Left<'p, 'a> {
    products: &'p Products<'a>,
    members: Vec<usize>,
    /// L⁻¹D.
    within: DMatrix<f64>,
    /// Z r.
    taken: DVector<f64>,
    squares: f64,
    /// ln of the density of what is left.
    without: f64,
    /// ln det L.
    ln_determinant: f64,
}

impl Left<'_, '_> {
    /// ln p(r | set) at its sizes.
    pub fn ln_likelihood(&self) -> f64 {
        self.without - self.ln_determinant
    }

    /// What is left of the residual, everything fitted projected out.
    pub fn residual(&self) -> DVector<f64> {
        let mut left = self.products.target.fit.residual().clone();
        let along = self.within.tr_mul(&self.taken);
        let mut first = 0;
        for &member in &self.members {
            let columns = &self.products.member(member).columns;
            left.gemv(-1.0, columns.as_ref(), &along.rows(first, columns.ncols()), 1.0);
            first += columns.ncols();
        }
        left
    }

    /// ln p(r | set and a hypothesis) − ln p(r | set), and its most probable size.
    pub fn gain(&self, block: usize) -> (f64, f64) {
        let products = self.members.iter().map(|&member| Cow::Borrowed(self.products.product(member, block)));
        self.gain_with(&self.products.blocks[block], products)
    }

    /// The gain of a hypothesis that is none of the others, with its prior.
    pub fn odds_of(&self, block: &Block) -> f64 {
        let with = |&member: &usize| {
            let Member { columns, transposed, .. } = self.products.member(member);
            Cow::Owned(block.times((columns, transposed)))
        };
        self.gain_with(block, self.members.iter().map(with)).0 + block.ln_prior
    }

    /// The same with AᵀC of every member.
    fn gain_with<'m>(&self, block: &Block, with: impl Iterator<Item = Cow<'m, DMatrix<f64>>>) -> (f64, f64) {
        let Products { target, grid, rules, .. } = self.products;
        let left = ((self.squares, target.noise.freedom), self.without);
        if self.members.is_empty() {
            return block.gain(None, left, grid, rules);
        }
        let (mut all, mut first) = (DMatrix::zeros(self.taken.len(), block.product().len()), 0);
        for with in with {
            all.rows_mut(first, with.nrows()).copy_from(&with);
            first += with.nrows();
        }
        let along = &self.within * all;
        block.gain(Some((&along, &self.taken)), left, grid, rules)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::evidence::block::Design;
    use crate::diagnose::evidence::marginal::Coefficients;
    use crate::diagnose::neighbourhood::Unknowns;

    /// Numbers without pattern.
    fn matrix(rows: usize, columns: usize, seed: f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| (12.9898 * i as f64 + 78.233 * j as f64 + seed).sin() * 43.7 % 1.0)
    }

    #[test]
    fn products_tell_what_a_dense_solve_does() {
        let rules = &SelectionRules::DEFAULT;
        let (jacobian, residual) = (matrix(120, 4, 0.5), matrix(120, 1, 9.0).column(0) * 4.0);
        let unknowns = Unknowns { x: vec![0.0; 4], priors: vec![None; 4], active: DMatrix::zeros(0, 4) };
        let fit = LinearNeighbourhood::new(&jacobian, &residual, &unknowns, 0);
        let lever = matrix(120, 1, 3.0).column(0).into_owned();
        let designs =
            [Design::Dense(matrix(120, 2, 1.0)), Design::per_pose(&lever), Design::Dense(matrix(120, 30, 2.0))];
        let designs = designs.map(|own| (own.scaled(40).unwrap(), 0.0, Coefficients::default()));
        let blocks = Block::all(designs.to_vec(), &fit);
        let noise = Noise { freedom: 116.0, trust: 0.1, least: 0.0 };
        let target = Target { fit, noise, stop: Stop::default() };
        let products = Products::new((&blocks, &target), rules);
        let (members, sizes) = ([0, 1, 2], [3.0, 0.3, 1.0]);
        let left = products.left(&members, &sizes).unwrap();
        let r = target.fit.residual();
        let mut covariance = DMatrix::identity(r.len(), r.len());
        for (&member, size) in members.iter().zip(sizes) {
            let columns = blocks[member].columns(&target.fit).into_owned();
            covariance += &columns * columns.transpose() * (size * size);
        }
        let factor = covariance.cholesky().unwrap();
        let solved = factor.solve(r);
        assert!((left.residual() - &solved).amax() < 1e-9);
        assert!((left.squares / r.dot(&solved) - 1.0).abs() < 1e-9);
        let ln_determinant: f64 = factor.l().diagonal().iter().map(|value| value.ln()).sum();
        assert!((left.ln_determinant - ln_determinant).abs() < 1e-9);
        // One more gains as much whether it is among the blocks or not.
        let two = products.left(&members[..2], &sizes[..2]).unwrap();
        assert!((two.gain(2).0 - two.odds_of(&blocks[2])).abs() < 1e-9);
    }
}

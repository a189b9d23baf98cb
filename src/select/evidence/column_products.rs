//! Products AᵀC of the columns of set members with those of other hypotheses, each formed once.
//!
//! The products of many pairs are one matrix product, since each pair alone would read its columns
//! from memory again. An entry does not depend on the pairs that are formed with it.

use std::sync::OnceLock;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::block::Block;
use crate::select::neighbourhood::LinearNeighbourhood;

/// Number of hypotheses whose products are formed together. Their columns fit into the processor
/// cache.
const HYPOTHESES_PER_PRODUCT: usize = 32;
/// Smallest number of rows and of columns of a product. With fewer, nalgebra sums in another order,
/// and a product would depend on those formed with it.
pub(super) const MIN_SIDE: usize = 6;

/// Members of sets with their products, by the index of the hypothesis.
#[derive(Default)]
pub(super) struct ColumnProducts(Vec<OnceLock<Member>>);

/// Hypothesis that is a member of at least one set, with its cached products.
pub(super) struct Member {
    /// Whitened columns A of the hypothesis with the fitted parameters projected out, shape = (3 N,
    /// k).
    pub columns: DMatrix<f64>,
    /// Transpose of `columns`, shape = (k, 3 N).
    pub transposed: DMatrix<f64>,
    /// Products AᵀC of `columns` with the columns C of every hypothesis, each computed on first
    /// use.
    products: Vec<OnceLock<DMatrix<f64>>>,
}

impl ColumnProducts {
    /// Adds empty entries for the products of `count` hypotheses in all.
    pub fn extend_to(&mut self, count: usize) {
        for member in self.0.iter_mut().filter_map(OnceLock::get_mut) {
            member.products.resize_with(count, OnceLock::new);
        }
        self.0.resize_with(count, OnceLock::new);
    }

    /// Returns the hypothesis with this index as a set member, with its columns.
    pub fn member(&self, index: usize, blocks: &[Block], fit: &LinearNeighbourhood) -> &Member {
        if let Some(member) = self.0[index].get() {
            return member;
        }
        // The columns are computed before the cell is locked: a thread that helps with this
        // product may need the same member.
        let columns = blocks[index].columns(fit);
        let products = std::iter::repeat_with(OnceLock::new).take(blocks.len()).collect();
        let new = Member { transposed: columns.transpose(), columns, products };
        self.0[index].get_or_init(|| new)
    }
}

impl Member {
    /// Returns the product AᵀC with the columns C of another hypothesis.
    pub fn product_with(&self, other: usize, blocks: &[Block]) -> &DMatrix<f64> {
        self.products[other].get_or_init(|| match blocks[other].dense() {
            Some(columns) => products_of_stacked(&stacked(&[self]), &[columns])
                .resize_vertically(self.transposed.nrows(), 0.0),
            None => blocks[other].times_grouped(&self.transposed),
        })
    }

    fn lacks(&self, other: usize) -> bool {
        self.products[other].get().is_none()
    }
}

/// Forms the products of some members with the hypotheses `others`, as far as they are missing.
pub(super) fn form_products(members: &[&Member], others: &[usize], blocks: &[Block]) {
    let of_all = OnceLock::new();
    let form_block = |others: &[usize]| {
        let is_missing = |other: usize| members.iter().any(|member| member.lacks(other));
        let missing: Vec<(usize, &DMatrix<f64>)> = others
            .iter()
            .filter(|&&other| is_missing(other))
            .filter_map(|&other| Some((other, blocks[other].dense()?)))
            .collect();
        let lacking: Vec<&Member> = members
            .iter()
            .copied()
            .filter(|member| missing.iter().any(|&(other, _)| member.lacks(other)))
            .collect();
        if lacking.is_empty() {
            return;
        }
        let columns: Vec<&DMatrix<f64>> = missing.iter().map(|(_, columns)| *columns).collect();
        let product_of_lacking = if lacking.len() == members.len() {
            products_of_stacked(of_all.get_or_init(|| stacked(members)), &columns)
        } else {
            products_of_stacked(&stacked(&lacking), &columns)
        };
        let mut row = 0;
        for member in lacking {
            let (count, mut column) = (member.columns.ncols(), 0);
            for (other, columns) in &missing {
                let cell = &member.products[*other];
                if cell.get().is_none() {
                    let product = product_of_lacking.view((row, column), (count, columns.ncols()));
                    // Another thread may have formed the same numbers meanwhile.
                    let _ = cell.set(product.into_owned());
                }
                column += columns.ncols();
            }
            row += count;
        }
    };
    others.par_chunks(HYPOTHESES_PER_PRODUCT).for_each(form_block);
}

/// Returns the transposed columns of some members, one below the other. Rows of zeros are added up
/// to [`MIN_SIDE`].
fn stacked(members: &[&Member]) -> DMatrix<f64> {
    let height: usize = members.iter().map(|member| member.transposed.nrows()).sum();
    let rows = members.first().map_or(0, |member| member.transposed.ncols());
    let mut stacked = DMatrix::zeros(height.max(MIN_SIDE), rows);
    let mut first = 0;
    for Member { transposed, .. } in members {
        stacked.rows_mut(first, transposed.nrows()).copy_from(transposed);
        first += transposed.nrows();
    }
    stacked
}

/// Returns the products AᵀC of `stacked` members with `columns` side by side. Columns of zeros are
/// added up to [`MIN_SIDE`] for several pairs only.
pub(super) fn products_of_stacked(
    stacked: &DMatrix<f64>,
    columns: &[&DMatrix<f64>],
) -> DMatrix<f64> {
    let width: usize = columns.iter().map(|columns| columns.ncols()).sum();
    let mut right = Vec::with_capacity(stacked.ncols() * width.max(MIN_SIDE));
    for columns in columns {
        right.extend_from_slice(columns.as_slice());
    }
    right.resize(stacked.ncols() * width.max(MIN_SIDE), 0.0);
    let product = stacked * DMatrix::from_vec(stacked.ncols(), width.max(MIN_SIDE), right);
    product.resize_horizontally(width, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::select::evidence::block::Design;
    use crate::select::evidence::marginal::Coefficients;
    use crate::select::neighbourhood::Unknowns;
    use nalgebra::DVector;

    #[test]
    fn a_product_is_the_same_to_the_bit_alone_and_together_with_others() {
        let matrix = |columns: usize, seed: f64| {
            DMatrix::from_fn(930, columns, |i, j| {
                (12.9898 * i as f64 + 78.233 * j as f64 + seed).sin() * 43.7 % 1.0
            })
        };
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let residual = DVector::from_element(930, 1.0);
        let fit = LinearNeighbourhood::new(&matrix(1, 0.5), &residual, &unknowns, 0);
        let design = |k: u8| {
            let columns = matrix(usize::from(1 + 4 * k % 11), f64::from(k));
            (Design::Dense(columns).scaled(310).unwrap(), 0.0, Coefficients::default())
        };
        let blocks = Block::all((0..40).map(design).collect(), &fit);
        let all: Vec<usize> = (0..blocks.len()).collect();
        let (mut alone, mut many) = (ColumnProducts::default(), ColumnProducts::default());
        alone.extend_to(blocks.len());
        many.extend_to(blocks.len());
        let members: Vec<&Member> =
            (0..12).map(|member| many.member(member, &blocks, &fit)).collect();
        form_products(&members, &all, &blocks);
        for (k, member) in members.iter().enumerate() {
            for &other in &all {
                let single = alone.member(k, &blocks, &fit).product_with(other, &blocks);
                assert_eq!(member.product_with(other, &blocks), single, "{k} {other}");
                let exact = member.columns.tr_mul(&blocks[other].columns(&fit));
                assert!((single - exact).amax() < 1e-9);
            }
        }
    }
}

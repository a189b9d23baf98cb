//! Set of hypotheses that act together, with its posterior.

use std::cmp::Ordering;

use super::block::Block;
use super::products::Products;
use super::settling::converged_sizes;

/// Largest difference of ln posteriors that rounding alone causes between sets of the same members
/// in another order. The order found first is kept, so that effects are listed alike everywhere.
const MAX_ROUNDING_OF_LN_POSTERIOR: f64 = 1e-6;

/// Set with the sizes of its members and ln of its posterior, up to a constant.
#[derive(Debug, Clone)]
pub(super) struct Set {
    pub members: Vec<usize>,
    pub sizes: Vec<f64>,
    /// ln of likelihood times prior, relative to the likelihood of noise alone.
    pub ln_posterior: f64,
}

impl Set {
    /// Returns the members in ascending order, which identify the set.
    pub fn key(&self) -> Vec<usize> {
        sorted(&self.members)
    }

    /// Returns the set with one more hypothesis, given its gain and most probable size.
    fn with(&self, block: usize, (gain, size): (f64, f64), products: &Products) -> Self {
        Self {
            members: [self.members.as_slice(), &[block]].concat(),
            sizes: [self.sizes.as_slice(), &[size]].concat(),
            ln_posterior: self.ln_posterior
                + gain
                + products.ln_prior(&products.blocks[block], &self.members),
        }
    }

    /// Returns true if the set is more probable than another one by more than rounding.
    pub fn exceeds(&self, other: &Self) -> bool {
        self.ln_posterior > other.ln_posterior + MAX_ROUNDING_OF_LN_POSTERIOR
    }

    /// Returns true if the set is not extended because of a member for which [`Block::is_wide`] is
    /// true.
    pub fn has_wide(&self, blocks: &[Block]) -> bool {
        self.members.iter().any(|&member| blocks[member].is_wide())
    }

    /// Returns the set with the converged size of each member, given all others, and its posterior
    /// at these sizes.
    ///
    /// Sizes are relative to the noise, which includes effects that are not explained yet. Without
    /// this step, members that were added first would have too small a size. ln p(r | set) = l + Σ
    /// (ln p(r | the others, k) − l), with l at the sizes of all members, and ln p(r | the others,
    /// k) averaged over the size of member k.
    pub fn settled(self, products: &Products) -> Self {
        if self.has_wide(products.blocks) { self } else { self.with_converged_sizes(products) }
    }

    /// Returns the set with converged sizes, regardless of how many columns its members have.
    pub fn with_converged_sizes(mut self, products: &Products) -> Self {
        if self.members.len() < 2 {
            return self;
        }
        let settled = products.settled((&self.members, &self.sizes), || {
            converged_sizes(products, &self.members, &self.sizes)
        });
        if let Some((sizes, ln_posterior)) = settled {
            (self.sizes, self.ln_posterior) = (sizes, ln_posterior);
        }
        self
    }
}

/// Compares sets by their posteriors; the more probable one is the lesser.
pub(super) fn best_first(a: &Set, b: &Set) -> Ordering {
    b.ln_posterior.total_cmp(&a.ln_posterior)
}

/// Returns, for each of the `tried` hypotheses, the set extended by it.
pub(super) fn extended(set: &Set, tried: &[usize], products: &Products) -> Vec<Set> {
    let new: Vec<usize> =
        tried.iter().copied().filter(|block| !set.members.contains(block)).collect();
    let gains = products.gains(&set.members, &set.sizes, &new);
    new.into_iter().zip(gains).map(|(block, gain)| set.with(block, gain, products)).collect()
}

/// Creates a set from the hypotheses `members`. The size of each is the most probable one when it
/// is added to the earlier members. `None` if a Cholesky factorisation fails.
pub(super) fn assembled(members: &[usize], products: &Products) -> Option<Set> {
    let mut set = Set { members: Vec::new(), sizes: Vec::new(), ln_posterior: 0.0 };
    for &member in members {
        let gain = products.reduced(&set.members, &set.sizes)?.gain(member);
        set = set.with(member, gain, products);
    }
    Some(set.settled(products))
}

pub(super) fn sorted(members: &[usize]) -> Vec<usize> {
    let mut members = members.to_vec();
    members.sort_unstable();
    members
}

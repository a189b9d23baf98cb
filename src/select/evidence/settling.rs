//! Sizes of the members of a set of hypotheses (1 σ of their coefficients), each at its most
//! probable value.

use super::products::Products;

/// Maximum number of coordinate-ascent passes over the sizes of the members of a set.
const MAX_SETTLING_PASSES: usize = 4;

/// Returns the converged sizes (prior σ of the coefficients) of a set, from the starting values
/// `sizes`, and ln of the posterior at the converged sizes. The bool is true if these are a fixed
/// point: a start from them has the same result. Returns `None` if a Cholesky factorisation fails.
pub(super) fn converged_sizes(
    products: &Products,
    members: &[usize],
    sizes: &[f64],
) -> Option<(Vec<f64>, f64, bool)> {
    let mut sizes = sizes.to_vec();
    let mut reduced = products.reduced(members, &sizes)?;
    let mut summed = vec![0.0; members.len()];
    // A size stays converged while the sizes of the other members do not change.
    let mut stale = vec![true; members.len()];
    let mut last_changed = None;
    for _ in 0..MAX_SETTLING_PASSES {
        for k in 0..members.len() {
            if !std::mem::take(&mut stale[k]) {
                continue;
            }
            let (ln_summed, size) = reduced.of_member(k)?;
            summed[k] = ln_summed;
            if size.to_bits() != sizes[k].to_bits() {
                stale.fill(true);
                stale[k] = false;
                last_changed = Some(k);
                sizes[k] = size;
                reduced = products.reduced(members, &sizes)?;
            }
        }
    }
    let mut is_fixed_point = !stale.contains(&true);
    // A start from these sizes evaluates the last changed member at them, too. Both starts then
    // have the same result to the last bit.
    if let Some(k) = last_changed {
        let (ln_summed, size) = reduced.of_member(k)?;
        summed[k] = ln_summed;
        is_fixed_point &= size.to_bits() == sizes[k].to_bits();
    }
    let ln_prior_of = |(k, &member)| products.ln_prior(&products.blocks[member], &members[..k]);
    let prior: f64 = members.iter().enumerate().map(ln_prior_of).sum();
    let gains: f64 = summed.iter().map(|with| with - reduced.ln_likelihood()).sum();
    let ln_posterior =
        reduced.ln_likelihood() + gains - products.ln_density(products.squares) + prior;
    Some((sizes, ln_posterior, is_fixed_point))
}

//! Sizes of the members of a set of hypotheses, each at its most probable value.

use super::products::Products;

/// Maximum number of coordinate-ascent passes over the sizes of the members of a set.
const MAX_SETTLING_PASSES: usize = 4;

/// Returns the converged sizes (prior σ of the coefficients) of a set that begins with `sizes`, ln of
/// the posterior at them, and whether a set that begins with them has the same result; `None` if a Cholesky factorisation fails.
pub(super) fn converged_sizes(
    products: &Products,
    members: &[usize],
    sizes: &[f64],
) -> Option<(Vec<f64>, f64, bool)> {
    let mut sizes = sizes.to_vec();
    let mut all = products.reduced(members, &sizes)?;
    let mut summed = vec![0.0; members.len()];
    // A size stays converged while the sizes of the other members do not change.
    let mut stale = vec![true; members.len()];
    let mut last_changed = None;
    for _ in 0..MAX_SETTLING_PASSES {
        for k in 0..members.len() {
            if !std::mem::take(&mut stale[k]) {
                continue;
            }
            let (ln_summed, size) = all.of_member(k)?;
            summed[k] = ln_summed;
            if size.to_bits() != sizes[k].to_bits() {
                stale.fill(true);
                stale[k] = false;
                last_changed = Some(k);
                sizes[k] = size;
                all = products.reduced(members, &sizes)?;
            }
        }
    }
    let mut stay = !stale.contains(&true);
    // A set that begins with these sizes sums the last changed member with them too. Both have
    // the same result to the last bit.
    if let Some(k) = last_changed {
        let (ln_summed, size) = all.of_member(k)?;
        summed[k] = ln_summed;
        stay &= size.to_bits() == sizes[k].to_bits();
    }
    let further = |(k, &member)| products.ln_prior(&products.blocks[member], &members[..k]);
    let prior: f64 = members.iter().enumerate().map(further).sum();
    let gains: f64 = summed.iter().map(|with| with - all.ln_likelihood()).sum();
    let ln_posterior = all.ln_likelihood() + gains - products.over_noise(products.squares) + prior;
    Some((sizes, ln_posterior, stay))
}

//! Check of the bases and tools that only held-out rows use.

use super::checked_fit::{Check, CheckedFit};
use super::finding::Finding;

/// Checks that held-out rows determine the bases and tools that only they use.
pub(super) struct HeldOutPlaced;

impl Check for HeldOutPlaced {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        fit.poses.held_out.clone().into_iter().collect()
    }
}

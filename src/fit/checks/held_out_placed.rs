//! Check of the bases and tools of held-out sessions.

use super::checked_fit::{Check, CheckedFit};
use super::finding::Finding;

/// Checks that held-out sessions determine their bases and tools.
pub(super) struct HeldOutPlaced;

impl Check for HeldOutPlaced {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        fit.poses.held_out.clone().into_iter().collect()
    }
}

//! Search for several joints that count the other way.

use super::search::{MAX_RATIO_TO_BEST, Trial};
use super::{Kind, Misreading};

/// Maximum number of moving joints of which every subset is tried as reversed.
pub(super) const MAX_REVERSED: usize = 7;

impl Misreading {
    /// Returns the set of joints that count the other way, as in [`Kind::Reversed`]; 0 for other
    /// misreadings.
    pub(super) fn reversed_joints(&self) -> u64 {
        match self.kind {
            Kind::Reversed(joints) => joints,
            _ => 0,
        }
    }
}

/// Returns the misreadings that two or more of the joints are reversed of which each alone is among
/// the `singles`.
pub(super) fn several_reversed(singles: &[Misreading]) -> Vec<Misreading> {
    let joints = singles.iter().map(Misreading::reversed_joints).filter(|joints| *joints > 0);
    let joints: Vec<u64> = joints.take(MAX_REVERSED).collect();
    let set = |bits: u64| -> u64 {
        joints.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1).map(|(_, joint)| joint).sum()
    };
    let sets = (1..1_u64 << joints.len()).filter(|bits| bits.count_ones() > 1).map(set);
    sets.map(Misreading::reversed).collect()
}

impl Trial<'_> {
    /// Returns the misreading that two or more joints are reversed with the smallest error of the
    /// registered nominal arm, and that error \[m\]. Of sets of joints with about the same error,
    /// it is the smallest set. `singles` contains the reversals of single joints that are possible;
    /// `None` if there are fewer than two.
    pub(super) fn several_reversed(&self, singles: &[Misreading]) -> Option<(Misreading, f64)> {
        let errors = self.registered_errors(&several_reversed(singles));
        let best = errors.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
        let size = |found: &(Misreading, f64)| found.0.reversed_joints().count_ones();
        errors.into_iter().filter(|(_, error)| *error <= MAX_RATIO_TO_BEST * best).min_by_key(size)
    }

    /// Returns the difference between the largest and the smallest command of the joint at index
    /// `joint` \[rad\] or \[m\].
    pub(super) fn commanded_range(&self, joint: usize) -> f64 {
        let commands = || {
            let measurements = self.fitting.measurements;
            let rows = self.fitting.split.identification.iter();
            rows.filter_map(move |&row| measurements.configuration(row).get(joint).copied())
        };
        commands().fold(f64::NEG_INFINITY, f64::max) - commands().fold(f64::INFINITY, f64::min)
    }
}

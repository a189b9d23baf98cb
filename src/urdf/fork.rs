//! Place where the chain to a further tip leaves the joints of the chains before it.

use super::chain::{Chain, Stage};
use super::row::Row;
use crate::spatial::Frame;

/// Place from which the rows of a chain begin: the base, or a joint that an earlier chain moves too.
#[derive(Default)]
pub(super) struct Fork {
    /// Number of leading moving joints of the chain that have a row already.
    pub shared: usize,
    /// Number of the row of the last of them, from 1; 0 for the base. `None` for the first chain.
    pub parent: Option<usize>,
    /// Frame of that row with all joints at zero, in the frame of the base.
    pub frame: Frame<f64>,
    /// Frame of that row in the axis frame of the last shared joint.
    pub gauge: Frame<f64>,
    /// Indices of the moving joints of the other chains, which carry their own links.
    pub beside: Vec<usize>,
}

impl Fork {
    /// Finds where the chain at index `of` leaves the chains before it, whose rows are `rows`.
    pub fn new(chains: &[&Chain], of: usize, rows: &[Row]) -> Self {
        let Some((chain, earlier)) = chains.get(of).zip(chains.get(..of)) else {
            return Self::default();
        };
        let is_in = |stages: &[Stage], joint: usize| stages.iter().any(|of| of.joint == joint);
        let moving = chains.iter().flat_map(|other| &other.stages).map(|stage| stage.joint);
        let beside = moving.filter(|&joint| !is_in(&chain.stages, joint)).collect();
        if earlier.is_empty() {
            return Self { beside, ..Self::default() };
        }
        let alike = |other: &Chain| {
            let pairs = chain.stages.iter().zip(&other.stages);
            pairs.take_while(|(one, other)| one.joint == other.joint).count()
        };
        let shared = earlier.iter().map(|other| alike(other)).max().unwrap_or(0);
        let (trunk, _) = chain.stages.split_at(shared);
        let row =
            trunk.last().and_then(|last| rows.iter().position(|row| row.joint == Some(last.joint)));
        let frame = row.and_then(|row| rows.get(row)).map_or_else(Frame::identity, |row| row.frame);
        let axis = trunk.iter().fold(Frame::identity(), |at, stage| at.compose(&stage.step));
        Self {
            shared,
            parent: Some(row.map_or(0, |row| row + 1)),
            frame,
            gauge: axis.inverse().compose(&frame),
            beside,
        }
    }

    /// Returns a frame that is given in the last shared axis frame, in the frame of its row.
    pub fn in_row(&self, frame: &Frame<f64>) -> Frame<f64> {
        self.gauge.inverse().compose(frame)
    }
}

/// Returns the indices of the leading moving joints that all chains share.
pub(super) fn trunk(chains: &[&Chain]) -> Vec<usize> {
    let joints = |chain: &&Chain| chain.stages.iter().map(|stage| stage.joint).collect();
    let shared = |one: Vec<usize>, other: Vec<usize>| {
        let pairs = one.into_iter().zip(other);
        pairs.take_while(|(one, other)| one == other).map(|(joint, _)| joint).collect()
    };
    chains.iter().map(joints).reduce(shared).unwrap_or_default()
}

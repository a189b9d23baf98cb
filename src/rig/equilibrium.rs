//! Static equilibrium of a chain: every hinge has given way to exactly the load that it carries.

use nalgebra::Vector3;

use super::chain::{Chain, Load, Motion, Place};
use crate::spatial::Frame;

/// Hinges have settled when one more pass would move all of them together by less [rad, m].
const SETTLED: f64 = 1e-12;
/// Passes after which an arm is given up as too soft for its loads.
const MAX_PASSES: usize = 2000;
/// Smallest part of a pass that is followed.
const LEAST_STEP: f64 = 1.0 / 64.0;

/// A chain at rest in the base frame.
pub(super) struct AtRest {
    /// Frames in the middle of every hinge's motion, in whose axes it feels its load.
    hinges: Vec<Frame<f64>>,
    /// Frames of the pieces.
    pieces: Vec<Frame<f64>>,
    motions: Vec<Motion>,
    /// Force \[N\] of all that each piece carries, and its moment about the origin of the base
    /// frame [N·m].
    carried: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl AtRest {
    /// Lets the chain come to rest; `None` if it never does.
    ///
    /// Each pass loads the chain as it stands and lets every hinge follow. A pass that overshoots,
    /// as in an arm that hangs from soft joints, is taken back and followed in part.
    pub fn find(chain: &Chain) -> Option<Self> {
        let count = chain.pieces.len();
        let mut rest = Self {
            hinges: Vec::with_capacity(count),
            pieces: Vec::with_capacity(count),
            motions: vec![Motion::default(); count],
            carried: Vec::with_capacity(count),
        };
        // Those of a piece may lie apart where others have come to sit on it.
        let mut loads = chain.loads.clone();
        loads.sort_by_key(|load| load.piece);
        let mut from = rest.motions.clone();
        let mut missing = rest.motions.clone();
        let mut next_missing = rest.motions.clone();
        let (mut step, mut least) = (1.0, f64::INFINITY);
        for _ in 0..MAX_PASSES {
            rest.place(chain);
            let change = rest.load(chain, &loads, &mut next_missing);
            if change <= SETTLED {
                return Some(rest);
            }
            if step > LEAST_STEP && (change > least || !change.is_finite()) {
                step /= 2.0;
            } else if change.is_finite() {
                least = change;
                from.copy_from_slice(&rest.motions);
                missing.copy_from_slice(&next_missing);
            } else {
                return None;
            }
            for ((motion, from), missing) in rest.motions.iter_mut().zip(&from).zip(&missing) {
                motion.rotation = from.rotation + missing.rotation * step;
                motion.stretch = from.stretch + missing.stretch * step;
            }
        }
        None
    }

    /// Places every piece, given how far the hinges have moved.
    fn place(&mut self, chain: &Chain) {
        self.hinges.clear();
        self.pieces.clear();
        for (piece, motion) in chain.pieces.iter().zip(&self.motions) {
            let mut frame = self.frame(&piece.root);
            let half = motion.rotation * 0.5;
            frame.rotate(&half);
            self.hinges.push(frame);
            frame.translate_x(motion.stretch);
            frame.rotate(&half);
            self.pieces.push(frame);
        }
    }

    /// Where a place on a piece that has been placed is, base frame.
    pub fn frame(&self, place: &Place) -> Frame<f64> {
        let Place { piece, frame: seen } = place;
        let frame = piece.map_or(Frame::identity(), |piece| self.pieces[piece]);
        Frame { axes: seen.axes.map(|axis| frame.vector(&axis)), origin: frame.point(&seen.origin) }
    }

    /// Sums `loads`, in the order of their pieces, from the tips inwards: how far each hinge is
    /// from what it does under its load, and their sum.
    fn load(&mut self, chain: &Chain, loads: &[Load], missing: &mut [Motion]) -> f64 {
        let mut sum = 0.0;
        let mut loads = loads.iter().rev().peekable();
        self.carried.clear();
        self.carried.resize(chain.pieces.len(), (Vector3::zeros(), Vector3::zeros()));
        for (k, piece) in chain.pieces.iter().enumerate().rev() {
            let (mut force, mut moment) = self.carried[k];
            while let Some(load) = loads.next_if(|load| load.piece == k) {
                let at = self.pieces[k].point(&load.at);
                let pull = load.force.at(&at);
                force += pull;
                moment += at.cross(&pull);
            }
            if let Some(below) = piece.root.piece {
                self.carried[below].0 += force;
                self.carried[below].1 += moment;
            }
            let hinge = &self.hinges[k];
            let about_hinge = moment - hinge.origin.cross(&force);
            let motion = &self.motions[k];
            let mut felt = hinge.resolve(&about_hinge);
            let springs = chain.springs.iter().filter(|spring| spring.piece == k);
            felt.z += springs.map(|spring| spring.moment(motion.rotation.z)).sum::<f64>();
            let wanted = piece.hinge.give(&hinge.resolve(&force), &felt);
            missing[k] = Motion {
                rotation: wanted.rotation - motion.rotation,
                stretch: wanted.stretch - motion.stretch,
            };
            sum += missing[k].rotation.norm() + missing[k].stretch.abs();
        }
        sum
    }
}

//! Static equilibrium of a chain: the deformation of every hinge matches the force and the moment
//! that act on it.

use nalgebra::Vector3;

use super::chain::{Chain, Load, Motion, PieceFrame};
use crate::spatial::Frame;

/// Largest sum of the changes of all hinges in one pass at which the equilibrium is reached,
/// rotations in rad and elongations in m.
const EQUILIBRIUM_TOLERANCE: f64 = 1e-12;
/// Maximum number of passes over all hinges. If they do not suffice, the arm counts as too flexible
/// for its loads.
const MAX_PASSES: usize = 2000;
/// Smallest fraction of the changes of a pass that is applied after overshoots.
const MIN_STEP: f64 = 1.0 / 64.0;

/// Chain in static equilibrium, base frame.
pub(super) struct Equilibrium {
    /// Frames at half the deformation of every hinge, in which its load is resolved.
    hinges: Vec<Frame<f64>>,
    /// Frames of the pieces, base frame.
    pieces: Vec<Frame<f64>>,
    /// Deformation of the hinge before each piece.
    motions: Vec<Motion>,
    /// Force \[N\] that all pieces beyond a piece exert on it, and the moment of that force about
    /// the origin of the base frame [N·m].
    carried: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Equilibrium {
    /// Finds the equilibrium of a chain; returns `None` if the iteration does not converge.
    ///
    /// Each pass computes the loads on the deformed chain and deforms every hinge accordingly. If a
    /// pass overshoots, as with an arm that hangs from flexible joints, it is undone and applied in
    /// part.
    pub fn find(chain: &Chain) -> Option<Self> {
        let count = chain.pieces.len();
        let mut equilibrium = Self {
            hinges: Vec::with_capacity(count),
            pieces: Vec::with_capacity(count),
            motions: vec![Motion::default(); count],
            carried: Vec::with_capacity(count),
        };
        // Loads of one piece need not be adjacent.
        let mut loads = chain.loads.clone();
        loads.sort_by_key(|load| load.piece);
        let mut from = equilibrium.motions.clone();
        let mut missing = equilibrium.motions.clone();
        let mut next_missing = equilibrium.motions.clone();
        let (mut step, mut least) = (1.0, f64::INFINITY);
        for _ in 0..MAX_PASSES {
            equilibrium.place(chain);
            let change = equilibrium.sum_loads(chain, &loads, &mut next_missing);
            if change <= EQUILIBRIUM_TOLERANCE {
                return Some(equilibrium);
            }
            if step > MIN_STEP && (change > least || !change.is_finite()) {
                step /= 2.0;
            } else if change.is_finite() {
                least = change;
                from.copy_from_slice(&equilibrium.motions);
                missing.copy_from_slice(&next_missing);
            } else {
                return None;
            }
            for ((motion, from), missing) in equilibrium.motions.iter_mut().zip(&from).zip(&missing)
            {
                motion.rotation = from.rotation + missing.rotation * step;
                motion.stretch = from.stretch + missing.stretch * step;
            }
        }
        None
    }

    /// Computes the frame of every piece from the deformations of the hinges.
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

    /// Returns a frame on a piece, in the base frame.
    pub fn frame(&self, on_piece: &PieceFrame) -> Frame<f64> {
        let PieceFrame { piece, frame: local } = on_piece;
        let frame = piece.map_or(Frame::identity(), |piece| self.pieces[piece]);
        Frame {
            axes: local.axes.map(|axis| frame.vector(&axis)),
            origin: frame.point(&local.origin),
        }
    }

    /// Sums the loads from the tips inwards. Writes into `missing` the change of deformation that
    /// each hinge needs to match its load, and returns the sum of the changes. `loads` must be in
    /// the order of the pieces.
    fn sum_loads(&mut self, chain: &Chain, loads: &[Load], missing: &mut [Motion]) -> f64 {
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
            let mut resolved = hinge.resolve(&about_hinge);
            let springs = chain.springs.iter().filter(|spring| spring.piece == k);
            resolved.z += springs.map(|spring| spring.moment(motion.rotation.z)).sum::<f64>();
            let wanted = piece.hinge.deformation(&hinge.resolve(&force), &resolved);
            missing[k] = Motion {
                rotation: wanted.rotation - motion.rotation,
                stretch: wanted.stretch - motion.stretch,
            };
            sum += missing[k].rotation.norm() + missing[k].stretch.abs();
        }
        sum
    }
}

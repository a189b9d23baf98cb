//! Segments of the arm: each is differentiated alone, by the few numbers that act on it.
//!
//! A segment is the base that tilts, a joint, or a beam element; between segments only a frame is
//! handed on. Segments do not feel each other, so that numbers of different segments share one
//! direction of a forward pass in dual numbers. The adjoint sweep (`adjoint.rs`) chains them.

use super::arm::Arm;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Where a slide tilts, as parts of its length: the points of Gauss and Legendre, (1 ∓ 1/√3)/2.
pub(super) const SLIDE_TILTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// A segment of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Segment {
    /// The base, where it tilts.
    Mounting,
    /// A joint with its α, and its a where no beam lies along it.
    Joint(usize),
    /// The beam along a joint's a; a segment for every element, with the same parameters.
    Beam(usize),
}

impl Segment {
    /// The first direction that is left for parameters: a beam's root turns in three, an element
    /// bends by three moments, a joint tilts by two and turns by one.
    pub fn first_lane(self) -> usize {
        if self.is_beam() { 6 } else { 3 }
    }

    /// Direction of the first of the `count` moments that bend the segment at once.
    pub(super) fn moment_lane(self, count: usize) -> usize {
        match (self, count) {
            (Self::Beam(_), _) => 3,
            (_, 2) => 0,
            _ => 2,
        }
    }

    pub(super) fn is_beam(self) -> bool {
        matches!(self, Self::Beam(_))
    }

    /// Place in a list of all segments.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Mounting => 0,
            Self::Joint(joint) => 1 + 2 * joint,
            Self::Beam(joint) => 2 + 2 * joint,
        }
    }
}

/// The end of a segment.
#[derive(Debug, Clone)]
pub(super) struct Cut<S> {
    /// The frame there.
    pub frame: Frame<S>,
    pub segment: Segment,
    /// Index of the first moment that bends the segment, and how many there are.
    pub unknowns: (usize, usize),
}

/// Directions of all moments of an arm, in their order.
pub(super) fn moment_lanes<S: Scalar>(arm: &Arm<S>) -> Vec<usize> {
    let mut lanes = Vec::new();
    let mut add = |segment: Segment, count: usize| {
        lanes.extend((0..count).map(|k| segment.moment_lane(count) + k))
    };
    if arm.mounting.is_some() {
        add(Segment::Mounting, 2);
    }
    for (i, joint) in arm.joints.iter().enumerate() {
        if joint.beam.is_some() {
            (0..arm.beam_elements).for_each(|_| add(Segment::Beam(i), 3));
        }
        if joint.lateral.is_some() {
            add(Segment::Joint(i), 2);
        }
        if joint.turns() {
            add(Segment::Joint(i), 1);
        }
        if joint.slide.is_some() {
            for _ in SLIDE_TILTS {
                add(Segment::Joint(i), 2);
            }
        }
    }
    lanes
}

impl<S: Scalar> Cut<S> {
    pub(super) fn real(&self) -> Frame<f64> {
        Frame {
            axes: self.frame.axes.map(|axis| axis.map(|c| c.re())),
            origin: self.frame.origin.map(|c| c.re()),
        }
    }
}

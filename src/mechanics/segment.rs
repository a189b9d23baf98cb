//! Segments of the arm, each differentiated with respect to the few parameters that act on it.
//!
//! A segment is the mounting, a joint, or a beam element. Segments pass on only a frame, so
//! parameters of different segments share one direction of a forward pass in dual numbers. The
//! adjoint sweep (`adjoint.rs`) chains the segments.

use super::arm::Arm;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Positions along a slide at which its bending is concentrated, relative to its length:
/// Gauss–Legendre points (1 ∓ 1/√3)/2.
pub(super) const SLIDE_TILT_POSITIONS: [f64; 2] =
    [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Part of the arm between two frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Segment {
    /// Mounting of the base, which tilts.
    Mounting,
    /// Joint with its twist α, and with its length a if it has no beam.
    Joint(usize),
    /// Beam along a joint's a: one segment for every element, all with the same parameters.
    Beam(usize),
}

impl Segment {
    /// Returns the index of the first direction that belongs to a parameter. Before it are three
    /// rotations of a beam's root and three moments of an element, or two tilts and one rotation of
    /// a joint.
    pub fn first_parameter_direction(self) -> usize {
        if self.is_beam() { 6 } else { 3 }
    }

    /// Returns the direction of the first of the `count` moments that deflect the segment at one
    /// place.
    pub(super) fn moment_direction(self, count: usize) -> usize {
        match (self, count) {
            (Self::Beam(_), _) => 3,
            (_, 2) => 0,
            _ => 2,
        }
    }

    pub(super) fn is_beam(self) -> bool {
        matches!(self, Self::Beam(_))
    }

    /// Returns the index of the segment in the list of all segments of the arm.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Mounting => 0,
            Self::Joint(joint) => 1 + 2 * joint,
            Self::Beam(joint) => 2 + 2 * joint,
        }
    }
}

/// End of a segment in a forward pass made segment by segment.
#[derive(Debug, Clone)]
pub(super) struct Cut<S> {
    /// Frame at the end of the segment, arm base frame.
    pub frame: Frame<S>,
    pub segment: Segment,
    /// Index of the first moment that deflects the segment, and number of these moments.
    pub unknowns: (usize, usize),
}

/// Returns the direction (index within its segment) of every unknown moment of an arm.
pub(super) fn moment_directions<S: Scalar>(arm: &Arm<S>) -> Vec<usize> {
    let mut directions = Vec::new();
    let mut add = |segment: Segment, count: usize| {
        directions.extend((0..count).map(|k| segment.moment_direction(count) + k));
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
        if joint.has_twist() {
            add(Segment::Joint(i), 1);
        }
        if joint.slide.is_some() {
            for _ in SLIDE_TILT_POSITIONS {
                add(Segment::Joint(i), 2);
            }
        }
    }
    directions
}

impl<S: Scalar> Cut<S> {
    pub(super) fn real_frame(&self) -> Frame<f64> {
        Frame {
            axes: self.frame.axes.map(|axis| axis.map(|c| c.re())),
            origin: self.frame.origin.map(|c| c.re()),
        }
    }
}
